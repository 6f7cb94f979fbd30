//! `im compare`: where a model and recordings disagree, without changing anything.

use std::io::Write;
use std::path::PathBuf;

use im_diagnose::report::{Comparison, Meta, compare_html, compare_terminal};
use im_model::{MotorFile, write_atomically};
use serde_json::json;

use super::inputs::recordings_or_drafts;
use crate::failure::Failure;
use crate::output::Outputs;
use crate::provenance::of_this_run;
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
    let label = args.motor.display().to_string();
    let (comparison, noticed) =
        spinning("looking where the model fails", || Comparison::of_intake(&motor, &label, data, args.anyway))?;
    let meta = of_this_run(Meta { quality: Some(noticed), ..Meta::default() }, &outputs);
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
        report["data_quality"] = json!(meta.quality);
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
    let page = if written.is_none() { "--out DIR writes this as a page with pictures; " } else { "" };
    write!(out, "\n{}", wrapped("", &format!("{page}im diagnose fits the motor and names what is missing.")))?;
    Ok(())
}
