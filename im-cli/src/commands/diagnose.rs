//! `im diagnose`: the whole loop on files.

use std::io::Write;
use std::path::{Path, PathBuf};

use im_diagnose::diagnosis::{Diagnosis, Verdict, diagnose};
use im_diagnose::intake::Finding;
use im_diagnose::next_test::{Limits, propose};
use im_diagnose::report::{self, Meta, NextTest, Story};
use im_diagnose::search::Options;
use im_diagnose::worst_case::machines_after;

use super::inputs::{Data, by_fit, quality, refused, write_quality};
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
    let (case, mut noticed) = args.data.case()?;
    let options = Options { significance: args.significance, ..args.data.options() };
    let found = spinning("fitting and scoring", || diagnose(case, options)).map_err(|e| refused(&args.data.motor, &e))?;
    noticed.retain(|f| !found.refutes(f));
    noticed.extend(by_fit(&noticed, &found.case.motor, &found.refined.machine));
    let meta = Meta { quality: quality(&noticed), ..meta(&found) };
    finish(&found, &meta, &noticed, args.out.as_deref(), args.signals.as_deref(), args.json)
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
    Meta { program, next_test: next_test(found), ..Meta::default() }
}

fn next_test(found: &Diagnosis) -> Option<NextTest> {
    let mut open: Vec<_> = found
        .effects
        .iter()
        .zip(&found.alternatives)
        .filter(|(_, a)| !a.is_empty())
        .flat_map(|(e, a)| a.iter().chain([e]))
        .copied()
        .collect();
    if open.is_empty() && found.verdict == Verdict::Inconclusive {
        open.extend(found.ranking.iter().filter(|c| !c.excited).map(|c| c.effect));
    }
    if open.is_empty() {
        return None;
    }
    let noise = |k: &str, otherwise: f64| found.noise.get(k).copied().unwrap_or(otherwise);
    let noise = (noise("i_alpha_A", 0.05), noise("omega_m_rad_s", 0.1));
    let safe_for = machines_after(&found.refined, Some(&found.to_json()), &open);
    let best = propose(&found.refined, &open, noise, &Limits::default(), &safe_for).ok()?.into_iter().next()?;
    let settles = best
        .detectable
        .iter()
        .map(|(e, x)| {
            let seen = if *x < 1.0 { "shows it" } else { "still does not show it" };
            format!("{}: {seen} (smallest size found is {:.2} of the largest usual one)", e.card().title, x)
        })
        .collect();
    Some(NextTest { text: format!("{} im next-test writes it as a scenario.", best.what), settles, profile: best.profile })
}
