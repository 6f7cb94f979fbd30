//! `im fleet`: many motors, one table of verdicts.

use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use im_diagnose::report::Meta;
use im_diagnose::search::Significance;
use im_fleet::job::{jobs, passed_over};
use im_fleet::row::{JobStatus, Row};
use im_fleet::settings::Settings;
use im_fleet::summary::Summary;
use im_fleet::work::{Done, run as work};
use im_fleet::write_all;
use im_model::Shard;
use serde_json::json;

use crate::failure::Failure;
use crate::interrupt::together;
use crate::output::Outputs;
use crate::provenance::of_this_run;
use crate::terminal::{Progress, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  im fleet plant --out plant-out
  im fleet plant.csv --out plant-out --shard 1/4      # one of four machines that share plant-out

A folder holds a folder for each motor, with motor.toml and its recordings (holdout.csv is held out), or folders of \
recordings by date. A table (CSV) has a line for each recording: unit, motor, recording, and where wanted type, date, role \
(train or holdout) and mapping.

Writes verdicts.csv, parameters.csv, fleet.json, fleet.html, and a report for each motor that was diagnosed. Rows that are \
there are not made again: a run that was ended goes on, and shards that share the folder meet in one table.")]
pub struct Args {
    /// A folder of motors, or a table
    #[arg(value_name = "FOLDER|TABLE")]
    fleet: PathBuf,
    /// Folder for the table, the rows and the reports
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Do this part of the jobs alone
    #[arg(long, value_name = "K/N", default_value_t = Shard::WHOLE)]
    shard: Shard,
    /// Diagnose all, also those that the screening sees nothing in
    #[arg(long)]
    all: bool,
    /// Chance of a false alarm over the whole library, of a diagnosis
    #[arg(long, default_value_t, value_name = "P")]
    significance: Significance,
    /// Go on where what was noticed about the data makes the answer meaningless
    #[arg(long)]
    anyway: bool,
    /// Write no report for the motors that are diagnosed
    #[arg(long)]
    no_reports: bool,
    /// Print fleet.json instead of the summary
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let jobs = jobs(&args.fleet)?;
    Outputs::default().folder(&args.out, &im_fleet::FILES)?;
    let settings = Settings { significance: args.significance, all: args.all, anyway: args.anyway, reports: !args.no_reports };
    let progress = Mutex::new(Progress::new("judging"));
    let shown = |done, all| progress.lock().unwrap_or_else(PoisonError::into_inner).show(done, all);
    let (rows, done) = work(&jobs, &args.out, &settings, args.shard, &shown)?;
    progress.lock().unwrap_or_else(PoisonError::into_inner).finish();
    let title = args.fleet.file_stem().map_or_else(|| "fleet".into(), |n| n.to_string_lossy().into_owned());
    let how = of_this_run(Meta::default(), &Outputs::beside([&args.fleet]));
    let summary = together(|| write_all(&args.out, &title, &rows, &how))?;
    if args.json {
        writeln!(stdout(), "{}", with_work(summary.to_json(&rows), done))?;
        return Ok(());
    }
    tell(args, &rows, &summary, done)?;
    // What the run writes may lie in the fleet's own folder.
    let own = fs::canonicalize(&args.out).ok();
    for passed in passed_over(&args.fleet, &jobs)?.into_iter().filter(|(folder, _)| fs::canonicalize(folder).ok() != own) {
        write!(stdout(), "{}", wrapped("! ", &format!("{}: passed over, as there is {} in it.", passed.0.display(), passed.1)))?;
    }
    Ok(())
}

fn with_work(mut summary: serde_json::Value, done: Done) -> serde_json::Value {
    summary["work"] = json!({"found": done.found, "made": done.made, "open": done.open});
    summary
}

fn tell(args: &Args, rows: &[Row], summary: &Summary, done: Done) -> std::io::Result<()> {
    let mut out = stdout();
    let count = |status: JobStatus| rows.iter().filter(|r| r.status == status).count();
    writeln!(out, "{} rows made, {} were there, {} left to other shards", done.made, done.found, done.open)?;
    writeln!(
        out,
        "{} screened and let pass, {} diagnosed, {} could not be judged\n",
        count(JobStatus::Screened),
        count(JobStatus::Diagnosed),
        count(JobStatus::Failed)
    )?;
    for (k, row) in rows.iter().enumerate() {
        let said = summary.of_row(k);
        let name = if row.date.is_empty() { row.unit.clone() } else { format!("{} {}", row.unit, row.date) };
        if row.is_flagged() {
            let text = format!("{}: {}", row.verdict.replace('_', " "), row.effects.join(", "));
            write!(out, "{}", wrapped(&format!("{name}  "), text.trim_end_matches([':', ' '])))?;
        }
        for sentence in said {
            write!(out, "{}", wrapped(&format!("{name}  "), &sentence))?;
        }
    }
    for row in rows.iter().filter(|r| r.status == JobStatus::Failed) {
        write!(out, "{}", wrapped(&format!("{}  ", row.unit), &row.error))?;
    }
    writeln!(out, "\n{}: the page; verdicts.csv, parameters.csv, fleet.json beside it", args.out.join("fleet.html").display())
}
