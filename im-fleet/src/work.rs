//! Jobs to rows. A job never stops the others: what goes wrong with it is its row.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};

use im_diagnose::diagnosis::Diagnosis;
use im_diagnose::intake::Finding;
use im_diagnose::report::{Files, Meta, Story};
use im_diagnose::search::Options;
use im_diagnose::sources::{Refused, Source, Sources};
use im_identify::offline::stop::Stopped;
use im_model::{FileError, Shard};
use rayon::prelude::*;

use crate::job::Job;
use crate::key::{key, number};
use crate::row::{JobStatus, Parameter, Row};
use crate::screen::Screening;
use crate::settings::Settings;
use crate::store::Store;

/// What a run did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Done {
    /// Rows that were there already.
    pub found: usize,
    /// Rows made now.
    pub made: usize,
    /// Jobs of other shards that nobody has done yet.
    pub open: usize,
}

/// Does the jobs of a shard that are not done yet, and gathers every row there is, in the order of the jobs. `tell` hears how many of how
/// many are done.
///
/// # Errors
/// A row cannot be kept.
pub fn run(
    jobs: &[Job],
    out: &Path,
    settings: &Settings,
    shard: Shard,
    tell: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Vec<Row>, Done), FileError> {
    let store = Store::open(out)?;
    let keys: Vec<String> = jobs.par_iter().map(|job| key(job, settings)).collect();
    let mut rows: Vec<Option<Row>> = keys.par_iter().map(|key| store.get(key)).collect();
    let mine: Vec<usize> = (0..jobs.len()).filter(|&k| rows[k].is_none() && shard.has(number(&keys[k]))).collect();
    let found = rows.iter().flatten().count();
    let count = std::sync::atomic::AtomicUsize::new(0);
    let make = |&k: &usize| {
        let row = one(&jobs[k], &keys[k], out, settings);
        store.put(&row)?;
        tell(count.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1, mine.len());
        Ok::<_, FileError>((k, row))
    };
    for (k, row) in mine.par_iter().with_max_len(1).map(make).collect::<Result<Vec<_>, _>>()? {
        rows[k] = Some(row);
    }
    let done = Done { found, made: mine.len(), open: rows.iter().filter(|r| r.is_none()).count() };
    Ok((rows.into_iter().flatten().collect(), done))
}

/// Does one job: whatever comes, a row. A report goes into a folder of its own in `out`.
pub fn one(job: &Job, key: &str, out: &Path, settings: &Settings) -> Row {
    match catch_unwind(AssertUnwindSafe(|| judged(job, failed(job, key, ""), out, settings))) {
        Ok(Ok(row)) => row,
        Ok(Err(e)) => failed(job, key, &e.to_string()),
        Err(panic) if panic.is::<Stopped>() => resume_unwind(panic),
        Err(panic) => failed(job, key, &format!("the program itself failed: {}", words(panic.as_ref()))),
    }
}

/// The row of a job that could not be done.
pub fn failed(job: &Job, key: &str, error: &str) -> Row {
    let name = |p: &PathBuf| p.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    Row {
        key: key.to_owned(),
        unit: job.unit.clone(),
        kind: job.kind.clone(),
        date: job.date.clone(),
        recordings: job.train.iter().chain(&job.holdout).map(name).collect(),
        error: one_line(error),
        ..Row::default()
    }
}

/// A message on one line: what stood in a list is parted by semicolons.
fn one_line(message: &str) -> String {
    let mut out = String::new();
    for line in message.lines().map(str::trim).filter(|l| !l.is_empty()) {
        let (gap, text) = match line.strip_prefix("- ") {
            Some(item) if out.ends_with(':') => (" ", item),
            Some(item) => ("; ", item),
            None => (" ", line),
        };
        out += if out.is_empty() { "" } else { gap };
        out += text;
    }
    out
}

fn words(panic: &(dyn Any + Send)) -> &str {
    panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("no reason given")
}

fn judged(job: &Job, blank: Row, out: &Path, settings: &Settings) -> Result<Row, Refused> {
    let source = |path: &PathBuf| Source::File(path.clone(), job.mapping.clone());
    let sources = Sources {
        train: job.train.iter().map(source).collect(),
        holdout: job.holdout.as_ref().map(source),
        anyway: settings.anyway,
        ..Sources::of_motor(&job.motor)?
    };
    let kind = if job.kind.is_empty() { sources.motor.name.clone() } else { job.kind.clone() };
    let blank = Row { kind, ..blank };
    let (case, noticed) = sources.case()?;
    let options = Options { significance: settings.significance, ..sources.options() };
    let fail = |e| Refused::fit(&sources.label, &e);
    let screening = Screening::new(case, options).map_err(fail)?;
    let suspicion = screening.suspicion();
    if suspicion.is_none() && !settings.all {
        return Ok(screened(blank, &screening));
    }
    let found = screening.diagnosed().map_err(fail)?;
    let mut row = of_diagnosis(Row { suspicion: suspicion.unwrap_or_default(), ..blank }, &found);
    if settings.reports {
        row.report = reported(&row, &found, noticed, out)?;
    }
    Ok(row)
}

/// Writes the report of a motor into a folder of its own; the page's place in `out`.
fn reported(row: &Row, found: &Diagnosis, noticed: Vec<Finding>, out: &Path) -> Result<String, FileError> {
    let folder = format!("reports/{}", row.key);
    let title = if row.date.is_empty() { row.unit.clone() } else { format!("{}, {}", row.unit, row.date) };
    let program = concat!("im fleet ", env!("CARGO_PKG_VERSION")).to_owned();
    let meta = Meta { title, program, ..Meta::of(found, noticed) };
    Files::of(&Story::new(found, &meta)).write(out.join(&folder))?;
    Ok(folder + "/report.html")
}

fn rms(chi2: f64) -> Option<f64> {
    chi2.is_finite().then(|| chi2.sqrt())
}

fn screened(blank: Row, s: &Screening) -> Row {
    let f = &s.fitted;
    Row {
        status: JobStatus::Screened,
        verdict: "adequate".into(),
        base_rms_in_sigma: rms(f.train.chi2_per_sample),
        rms_in_sigma: rms(f.train.chi2_per_sample),
        holdout_rms_in_sigma: f.holdout.and_then(rms),
        parameters: f.estimates.list.iter().map(|e| parameter(e.quantity.key(), e.after, Some(e.std))).collect(),
        ..blank
    }
}

fn parameter(key: String, value: f64, std: Option<f64>) -> Parameter {
    Parameter { key, value, std: std.filter(|s| s.is_finite()) }
}

fn of_diagnosis(blank: Row, d: &Diagnosis) -> Row {
    let names = |effects: &[im_model::EffectId]| effects.iter().map(|e| e.name().to_owned()).collect::<Vec<_>>();
    let (first, last) = (&d.steps[0], &d.steps[d.steps.len() - 1]);
    let named = d.named();
    Row {
        status: JobStatus::Diagnosed,
        verdict: d.verdict.name().into(),
        effects: names(named),
        rivals: named.iter().map(|e| names(d.rivals(*e))).collect(),
        base_rms_in_sigma: rms(first.train.chi2_per_sample),
        rms_in_sigma: rms(last.train.chi2_per_sample),
        holdout_rms_in_sigma: last.holdout.as_ref().and_then(|h| rms(h.chi2_per_sample)),
        parameters: d.parameters.iter().map(|p| parameter(p.quantity.key(), p.after, (!p.ratio_held).then_some(p.std))).collect(),
        ..blank
    }
}
