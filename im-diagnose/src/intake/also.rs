//! Files of one run by several instruments, each with its own clock and rate: `[[also]]` in a mapping.
//!
//! The columns that the mapping asks for and the recording does not have are taken from the other files, on the recording's time axis, over the
//! stretch that all of them cover. A shift between the clocks is given, or found from a signal that both instruments have.

use std::path::{Path, PathBuf};

use im_model::{FileError, Problem, TextFormat};

use super::columns::Columns;
use super::finding::{Finding, FindingKind, Severity};
use super::lag::{Lag, lag};
use super::mapping::{Also, Clock, Column, Mapping, Signal, TextSaid};
use super::raw::{RawTable, find, open};
use super::signals::{seconds, time_of};
use super::sniff::sniff;

/// The other files of a recording.
pub fn files<'a>(path: &'a Path, mapping: &'a Mapping) -> impl Iterator<Item = PathBuf> + 'a {
    mapping.also.iter().map(|a| path.with_file_name(&a.file))
}

/// All columns that a mapping asks for, of the recording `path` and of the files beside it.
///
/// # Errors
/// A file cannot be read or lacks a column; clocks that have no time in common; signals that are not alike, or alike at several shifts.
pub fn join(path: &Path, mapping: &Mapping) -> Result<Columns, FileError> {
    let label = path.display().to_string();
    let asked: Vec<&Signal> = mapping.signals().into_iter().map(|(s, _)| s).collect();
    let with = mapping.also.iter().filter_map(|a| match &a.clock {
        Clock::Alike { with, .. } => Some(&**with),
        Clock::Unsaid | Clock::Shift(_) => None,
    });
    let own_signals: Vec<_> = asked.iter().copied().chain(with).collect();
    let mut own = taken(path, &label, mapping.format, &own_signals, mapping.time.signal.as_ref())?;
    let time = time_of(&own, mapping)?;
    let (mut from, mut to) = ends(&time);
    let mut others = Vec::new();
    for also in &mapping.also {
        let path = path.with_file_name(&also.file);
        let label = path.display().to_string();
        let mut wanted: Vec<&Signal> = asked.iter().copied().filter(|s| !has(&own, s)).collect();
        wanted.push(&also.time);
        if let Clock::Alike { column, .. } = &also.clock {
            wanted.push(column);
        }
        let table = taken(&path, &label, sniff(&path, &label, TextSaid::default())?.format, &wanted, Some(&also.time))?;
        let mut clock = seconds(&table, &also.time, mapping)?;
        let shift = match &also.clock {
            Clock::Unsaid => 0.0,
            Clock::Shift(s) => *s,
            Clock::Alike { column, with } => {
                let a = &own.columns[find(&own.names, with, &mapping.label)?];
                let b = &table.columns[find(&table.names, column, &mapping.label)?];
                shift(&time, a, &clock, b).map_err(|found| refused(mapping, also, "align", found, ALIKE))?
            }
        };
        clock.iter_mut().for_each(|t| *t += shift);
        let (first, last) = ends(&clock);
        (from, to) = (from.max(first), to.min(last));
        others.push((table, clock));
    }
    // A row at the very end of another clock belongs to it, whatever the last digit says.
    let slack = 1e-6 * (ends(&time).1 - ends(&time).0) / time.len() as f64;
    let rows: Vec<usize> = (0..time.len()).filter(|&k| (from - slack..=to + slack).contains(&time[k])).collect();
    if rows.len() < 2 {
        let found = format!("files that have only {} rows of the recording in common", rows.len());
        let expected = "clocks that run together: give shift_s, or align";
        return Err(refused(mapping, &mapping.also[0], "also", found, expected));
    }
    let axis: Vec<f64> = rows.iter().map(|&k| time[k]).collect();
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    for (name, values) in own.names.iter().zip(&mut own.columns) {
        let values = std::mem::take(values);
        let kept = if values.is_empty() { vec![f64::NAN; rows.len()] } else { rows.iter().map(|&k| values[k]).collect() };
        columns.push((name.clone(), kept));
    }
    for (table, clock) in &others {
        for (name, values) in table.names.iter().zip(&table.columns).filter(|(_, v)| !v.is_empty()) {
            // A name of the recording's own, of the time for example, stays the recording's.
            if columns.iter().all(|(n, _)| n != name) {
                columns.push((name.clone(), im_formats::drawn(clock, values, &axis)));
            }
        }
    }
    Columns::try_new(&label, columns, Some(Mapping { also: Vec::new(), ..mapping.clone() }))
}

/// That nobody said by how much the clocks differ.
pub(super) fn clocks_taken_as_one(mapping: &Mapping, recording: &str) -> Option<Finding> {
    let unsaid = |a: &&Also| a.clock == Clock::Unsaid;
    let files: Vec<&str> = mapping.also.iter().filter(unsaid).map(|a| a.file.as_str()).collect();
    let said = format!("The clock of {} is taken as the recording's: neither shift_s nor align is given", files.join(", "));
    let advice = "Say one of them in [[also]]: some milliseconds between instruments look like a sensor's lag.";
    let finding = Finding::new(FindingKind::ClocksTakenAsOne, Severity::Note, said, advice);
    (!files.is_empty()).then(|| Finding { recording: recording.to_owned(), ..finding })
}

const ALIKE: &str = "a signal of both instruments that changes once in the run (a speed, the current of a start), or shift_s";

fn refused(mapping: &Mapping, also: &Also, key: &str, found: String, expected: &str) -> FileError {
    FileError::new(&mapping.label, Some(also.line), Some(key), Problem::Unexpected { found, expected: expected.to_owned() })
}

fn has(table: &RawTable, signal: &Signal) -> bool {
    match &signal.column {
        Column::Name(name) => table.names.contains(name),
        Column::Number(_) => true,
    }
}

/// The columns of `signals` that a file has, one of them that of time.
fn taken(
    path: &Path,
    label: &str,
    format: TextFormat,
    signals: &[&Signal],
    time: Option<&Signal>,
) -> Result<RawTable, FileError> {
    let mut rows = open(path, label, format)?;
    let mut asked = Vec::new();
    for s in signals {
        if let Ok(k) = find(rows.names(), s, label) {
            asked.push(k);
        }
    }
    asked.sort_unstable();
    asked.dedup();
    asked.iter().for_each(|&k| rows.require(k));
    if let Some(k) = time.and_then(|t| find(rows.names(), t, label).ok()) {
        rows.time_in(k);
    }
    RawTable::from_rows(rows, label, &asked, usize::MAX)
}

fn ends(time: &[f64]) -> (f64, f64) {
    (time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(0.0))
}

/// Points of an even axis at most.
const POINTS: f64 = 1e6;

/// What has to be added to the second time axis, s.
fn shift(a_time: &[f64], a: &[f64], b_time: &[f64], b: &[f64]) -> Result<f64, String> {
    let ((a_from, a_to), (b_from, b_to)) = (ends(a_time), ends(b_time));
    let step = |t: &[f64]| (ends(t).1 - ends(t).0) / (t.len().max(2) - 1) as f64;
    let t = step(a_time).min(step(b_time)).max((a_to - a_from).max(b_to - b_from) / POINTS);
    let even = |from: f64, to: f64| -> Vec<f64> { (0..=((to - from) / t) as usize).map(|k| from + k as f64 * t).collect() };
    let (x, y) = (im_formats::drawn(a_time, a, &even(a_from, a_to)), im_formats::drawn(b_time, b, &even(b_from, b_to)));
    match lag(&x, &y) {
        Lag::Of(l) => Ok(a_from - b_from + l * t),
        Lag::Unlike(best) => Err(format!("columns whose correlation is {best:.2} at best: they are not the same signal")),
        Lag::Several(a, b) => {
            let between = (a - b).abs() * t;
            Err(format!("columns that are alike at several shifts, {between:.4} s apart"))
        }
    }
}
