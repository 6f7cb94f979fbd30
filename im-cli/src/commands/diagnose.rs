//! `im diagnose`: the whole loop on files.

use std::io::Write;
use std::path::{Path, PathBuf};

use im_diagnose::diagnosis::{Diagnosis, diagnose};
use im_diagnose::intake::Finding;
use im_diagnose::report::{self, Meta, NextTest, Story};
use im_diagnose::search::{Learning, Options};
use im_diagnose::sources::by_fit;

use super::inputs::{Data, quality, refused, write_quality};
use crate::failure::Failure;
use crate::interrupt::together;
use crate::spinner::spinning;
use crate::terminal::{STORY_WIDTH, stdout};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im diagnose --motor motor.toml --train a.csv --train b.csv --holdout c.csv --out out

Writes out/report.html (open it in a browser), out/motor.refined.toml (every command takes it as \
--motor), out/diagnosis.json, and out/data_quality.json: what was noticed about the recordings.")]
pub struct Args {
    #[command(flatten)]
    data: Data,
    /// Folder for report.html, motor.refined.toml and diagnosis.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Chance of a false alarm over the whole library
    #[arg(long, default_value_t = 0.01, value_name = "P")]
    significance: f64,
    /// Learn as a curve what the library leaves unexplained
    #[arg(long)]
    learn: bool,
    /// Write measured, modelled and residual of every sample into this file: .csv, or .parquet
    #[arg(long, value_name = "FILE")]
    signals: Option<PathBuf>,
    /// Print diagnosis.json instead of the story
    #[arg(long)]
    json: bool,
}

/// What is written.
pub const FILES: [&str; 4] = ["report.html", "motor.refined.toml", "diagnosis.json", "data_quality.json"];

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if !(args.significance > 0.0 && args.significance < 0.5) {
        return Err(Failure::Input(format!("--significance {} must lie between 0 and 0.5", args.significance)));
    }
    let mut outputs = args.data.outputs();
    if let Some(dir) = &args.out {
        outputs.folder(dir, &FILES)?;
    }
    if let Some(file) = &args.signals {
        outputs.file(file)?;
    }
    let (case, mut noticed, options) = args.data.case()?;
    let learning = if args.learn { Learning::Unexplained } else { Learning::Never };
    let options = Options { significance: args.significance, learning, ..options };
    let found = spinning("fitting and scoring", || diagnose(case, options)).map_err(|e| refused(&args.data.motor, &e))?;
    let meta = noticed_by(&found, &mut noticed);
    finish(&found, &meta, &noticed, args.out.as_deref(), args.signals.as_deref(), args.json)
}

/// Drops from what was noticed at intake what the answer refutes, and adds what it shows: what the report says of how it came about.
pub fn noticed_by(found: &Diagnosis, noticed: &mut Vec<Finding>) -> Meta {
    noticed.retain(|f| !found.refutes(f));
    noticed.extend(by_fit(noticed, &found.case.motor, &found.refined.machine));
    Meta { quality: quality(noticed), ..meta(found) }
}

/// Writes the files and prints the story.
pub fn finish(
    found: &Diagnosis,
    meta: &Meta,
    noticed: &[Finding],
    out: Option<&Path>,
    signals: Option<&Path>,
    json: bool,
) -> Result<(), Failure> {
    let story = Story::new(found, meta);
    if let Some(file) = signals {
        story.signals().write(file)?;
    }
    let write = |dir| {
        together(|| {
            write_quality(dir, noticed)?;
            Ok::<_, Failure>(report::write(dir, &story)?)
        })
    };
    let written = out.map(write).transpose()?;
    let mut stdout = stdout();
    if json {
        writeln!(stdout, "{}", found.to_json())?;
        return Ok(());
    }
    write!(stdout, "{}", report::terminal(&story, STORY_WIDTH))?;
    if let Some(files) = written {
        writeln!(stdout, "\n{}", files.report.display())?;
        writeln!(stdout, "{}", files.motor.display())?;
        writeln!(stdout, "{}", files.diagnosis.display())?;
    }
    Ok(())
}

/// What the report says of how it came about: the program, and the test that would settle what is open.
pub fn meta(found: &Diagnosis) -> Meta {
    let program = concat!("im ", env!("CARGO_PKG_VERSION")).to_string();
    Meta { program, next_test: NextTest::after(found), ..Meta::default() }
}
