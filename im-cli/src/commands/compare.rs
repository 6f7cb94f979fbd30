//! `im compare`: where a model and recordings disagree, without changing anything.

use std::io::Write;
use std::path::PathBuf;

use im_diagnose::case::Case;
use im_diagnose::consistency;
use im_diagnose::intake::{Finding, FindingKind};
use im_diagnose::report::{Comparison, Meta, compare_html, compare_terminal};
use im_diagnose::sources::{followed, meaningful};
use im_model::{MotorFile, write_atomically};
use serde_json::json;

use super::inputs::{quality, recordings_or_drafts};
use crate::failure::Failure;
use crate::output::Outputs;
use crate::spinner::spinning;
use crate::terminal::{STORY_WIDTH, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im compare --motor motor.toml --data run.csv --out out

Simulates the motor as it is with the recorded voltages and says where the currents and the speed differ. \
im diagnose goes on from there.")]
pub struct Args {
    /// The motor: a motor.toml
    #[arg(long, value_name = "FILE")]
    motor: PathBuf,
    /// A recording, or its recording.toml; give it several times for several recordings
    #[arg(long, visible_alias = "train", value_name = "FILE", required = true)]
    data: Vec<PathBuf>,
    /// What the columns of the recordings mean, instead of the recording.toml beside them
    #[arg(long, value_name = "FILE")]
    mapping: Option<PathBuf>,
    /// Go on where the times of a recording cannot be those of the motor
    #[arg(long)]
    anyway: bool,
    /// Folder for compare.html
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write measured, modelled and residual of every sample into this file: .csv, or .parquet
    #[arg(long, value_name = "FILE")]
    signals: Option<PathBuf>,
    /// Print the findings as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let read = Outputs::beside([&args.motor].into_iter().chain(&args.mapping));
    let mut outputs = read.and_recordings(&args.data, args.mapping.as_deref());
    if let Some(dir) = &args.out {
        outputs.folder(dir, &["compare.html"])?;
    }
    if let Some(file) = &args.signals {
        outputs.file(file)?;
    }
    let motor = MotorFile::read(&args.motor)?;
    let (data, guessed) = recordings_or_drafts(&args.data, args.mapping.as_deref(), &motor, args.out.as_deref())?;
    let mut noticed = im_diagnose::intake::findings(data.iter());
    // What else is wrong is what a comparison shows; by a wrong clock nothing can be simulated.
    let clock: Vec<_> = noticed.iter().filter(|f| f.kind == FindingKind::TimeUnit).cloned().collect();
    meaningful(&clock, args.anyway)?;
    let label = args.motor.display().to_string();
    for taken in &data {
        followed(&motor, &label, taken)?;
    }
    let case = Case::from_intake(motor.clone(), data, None);
    if !noticed.iter().any(Finding::stops) {
        noticed.extend(spinning("comparing the recordings", || consistency::check(&case)));
    }
    let comparison = spinning("looking where the model fails", || Comparison::new(motor, case.train));
    let program = concat!("im ", env!("CARGO_PKG_VERSION")).into();
    let meta = Meta { program, quality: quality(&noticed), ..Meta::default() };
    let mut written = None;
    if let Some(dir) = &args.out {
        let path = dir.join("compare.html");
        write_atomically(&path, |w| w.write_all(compare_html(&comparison, &meta).as_bytes()))?;
        written = Some(path);
    }
    if let Some(file) = &args.signals {
        comparison.signals().write(file)?;
    }
    let mut out = stdout();
    if args.json {
        let mut report = comparison.to_json();
        report["guessed"] = json!(guessed);
        report["data_quality"] = json!(noticed);
        writeln!(out, "{report}")?;
        return Ok(());
    }
    for guess in &guessed {
        write!(out, "{}", wrapped("? ", guess))?;
    }
    if !guessed.is_empty() {
        writeln!(out)?;
    }
    write!(out, "{}", compare_terminal(&comparison, &meta, STORY_WIDTH))?;
    for path in written.iter().chain(&args.signals) {
        writeln!(out, "\n{}", path.display())?;
    }
    Ok(())
}
