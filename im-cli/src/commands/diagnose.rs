//! `im diagnose`: the whole loop on files.

use std::io::Write;
use std::path::{Path, PathBuf};

use im_diagnose::diagnosis::{Diagnosis, diagnose};
use im_diagnose::report::{FILES, Files, Meta, Story, terminal};
use im_diagnose::search::{Learning, Options, Significance};

use super::inputs::{Data, refused};
use crate::failure::Failure;
use crate::interrupt::together;
use crate::output::Outputs;
use crate::provenance::of_this_run;
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
    asked: Asked,
    /// Learn as a curve what the library leaves unexplained
    #[arg(long)]
    learn: bool,
}

/// What is asked for with and without learning.
#[derive(clap::Args)]
pub struct Asked {
    #[command(flatten)]
    data: Data,
    /// Folder for report.html, motor.refined.toml and diagnosis.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Chance of a false alarm over the whole library
    #[arg(long, default_value_t, value_name = "P")]
    significance: Significance,
    /// Write measured, modelled and residual of every sample into this file: .csv, or .parquet
    #[arg(long, value_name = "FILE")]
    signals: Option<PathBuf>,
    /// Print diagnosis.json instead of the story
    #[arg(long)]
    json: bool,
}

impl Asked {
    /// Where files may be written.
    pub fn outputs(&self) -> Result<Outputs, Failure> {
        let mut outputs = self.data.outputs();
        self.out.as_ref().map_or(Ok(()), |dir| outputs.folder(dir, &FILES))?;
        self.signals.as_ref().map_or(Ok(()), |file| outputs.file(file))?;
        Ok(outputs)
    }

    /// Whether the answer is for a program.
    pub fn as_json(&self) -> bool {
        self.json
    }

    /// Reads, decides, and gives the answer with what is to be said beside it.
    pub fn answer(&self, learning: Learning, outputs: &Outputs) -> Result<(Diagnosis, Meta), Failure> {
        let (case, noticed, options) = self.data.case()?;
        let options = Options { significance: self.significance, learning, ..options };
        let what = if learning == Learning::Always { "fitting, scoring and learning" } else { "fitting and scoring" };
        let found = spinning(what, || diagnose(case, options)).map_err(|e| refused(&self.data.motor, &e))?;
        let meta = of_this_run(spinning("looking at what is left", || Meta::of(&found, noticed)), outputs);
        Ok((found, meta))
    }

    /// Writes the files and prints the story.
    pub fn finish(&self, found: &Diagnosis, meta: &Meta) -> Result<(), Failure> {
        let story = Story::new(found, meta);
        if let Some(file) = &self.signals {
            story.signals().write(file)?;
        }
        finish(&story, self.out.as_deref(), self.json)
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let outputs = args.asked.outputs()?;
    let (found, meta) = args.asked.answer(if args.learn { Learning::Unexplained } else { Learning::Never }, &outputs)?;
    args.asked.finish(&found, &meta)
}

/// Writes the files of a report and prints the story.
pub fn finish(story: &Story, out: Option<&Path>, json: bool) -> Result<(), Failure> {
    let written = out.map(|dir| together(|| Files::of(story).write(dir))).transpose()?;
    let mut stdout = stdout();
    if json {
        writeln!(stdout, "{}", story.to_json())?;
        return Ok(());
    }
    write!(stdout, "{}", terminal(story, STORY_WIDTH))?;
    if let Some(files) = written {
        writeln!(stdout, "\n{}", files.report.display())?;
        writeln!(stdout, "{}", files.motor.display())?;
        writeln!(stdout, "{}", files.diagnosis.display())?;
    }
    Ok(())
}
