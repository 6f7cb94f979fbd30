//! `im diagnose`: the whole loop on files.

use std::io::{self, Write};
use std::path::PathBuf;

use im_diagnose::diagnosis::{Diagnosis, diagnose};
use im_diagnose::refine::Options;

use super::inputs::{Data, refused};
use crate::failure::Failure;
use crate::story::story;
use crate::terminal::Progress;

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im diagnose --motor motor.toml --train a.csv --train b.csv --holdout c.csv --out out

Writes out/report.html (open it in a browser), out/motor.refined.toml (every command takes it as
--motor) and out/diagnosis.json.")]
pub struct Args {
    #[command(flatten)]
    data: Data,
    /// Folder for report.html, motor.refined.toml and diagnosis.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Chance of a false alarm over the whole library
    #[arg(long, default_value_t = 0.01, value_name = "P")]
    significance: f64,
    /// Print diagnosis.json instead of the story
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if !(args.significance > 0.0 && args.significance < 0.5) {
        return Err(Failure::Input(format!("--significance {} must lie between 0 and 0.5", args.significance)));
    }
    let case = args.data.case()?;
    let progress = Progress::new("diagnosing");
    progress.then("fitting and scoring");
    let options = Options { significance: args.significance, ..Options::default() };
    let found = diagnose(case, options).map_err(|e| refused(&args.data.motor, &e));
    progress.finish();
    let found = found?;
    finish(&found, args.out.as_deref(), args.json)
}

/// Writes the files and tells the story.
pub fn finish(found: &Diagnosis, out: Option<&std::path::Path>, json: bool) -> Result<(), Failure> {
    if let Some(dir) = out {
        std::fs::create_dir_all(dir)?;
        found.refined.write(&dir.join("motor.refined.toml"))?;
        im_model::write_atomically(&dir.join("diagnosis.json"), |w| writeln!(w, "{:#}", found.to_json()))?;
    }
    let mut stdout = io::stdout().lock();
    if json {
        writeln!(stdout, "{}", found.to_json())?;
    } else {
        write!(stdout, "{}", story(found))?;
        if let Some(dir) = out {
            writeln!(stdout, "\n{}: motor.refined.toml, diagnosis.json", dir.display())?;
        }
    }
    Ok(())
}
