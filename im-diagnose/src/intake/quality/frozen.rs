//! A noisy signal that stays at one value to the last digit: its sensor or its logger has stopped.

use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity, ranges};
use crate::intake::signals::Signals;
use crate::intake::trace::Trace;
use crate::localise::Quantity;

/// Samples of one value that are long enough to matter.
const LEAST: usize = 20;
/// Chance that a working sensor shows as many somewhere in the recording.
const CHANCE: f64 = 1e-6;
/// Part of a noisy signal's samples at which it turns: of white noise two thirds or more, of a ramp or an encoder's steps next to none.
const TURNS: f64 = 1.0 / 3.0;

/// Where a channel stands still at `rows`, those that it was measured at and that are in use.
pub fn check(t: &Trace, quantity: Quantity, rows: &[usize], s: &Signals) -> Option<Finding> {
    let x: Vec<f64> = rows.iter().map(|&k| t.values[k]).collect();
    let runs: Vec<&[f64]> = x.chunk_by(|a, b| a == b).collect();
    let most = x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    // A current at its limit is cut off, which is another matter; drives report zero where they do not look.
    let limit = if quantity == Quantity::Current { most } else { f64::INFINITY };
    let stands = |run: &[f64]| run.len() >= LEAST && run[0] != 0.0 && run[0].abs() < limit;
    let moving: Vec<f64> = runs.iter().filter(|run| !stands(run)).flat_map(|run| run.iter().copied()).collect();
    let pairs = moving.len().max(2) - 1;
    // A current's sine is steeper than its noise; three differences on, it is not.
    let order = if quantity == Quantity::Current { 3 } else { 1 };
    let steps = (0..order).fold(moving.clone(), |x, _| x.windows(2).map(|w| w[1] - w[0]).collect());
    let turns = steps.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
    if (turns as f64) < TURNS * pairs as f64 {
        return None;
    }
    let alike = moving.windows(2).filter(|w| w[0] == w[1]).count() as f64 + 1.0;
    let by_chance = |run: &[f64]| x.len() as f64 * (alike / pairs as f64).powi(run.len() as i32 - 1);
    let mut frozen = vec![false; s.len()];
    let (mut at, mut first) = (0, None);
    for run in runs {
        if stands(run) && by_chance(run) < CHANCE {
            frozen[rows[at]..=rows[at + run.len() - 1]].fill(true);
            first = first.or(Some(at..at + run.len()));
        }
        at += run.len();
    }
    let (first, frozen) = (first?, ranges(&frozen));
    let (value, places) = (number(x[first.start], 4), frozen.len());
    let duration_s = number((rows[first.end - 1] - rows[first.start]) as f64 * s.sample_time_s, 3);
    let at_s = s.end_before(rows[first.start]);
    let more = if places > 1 { format!(", and in {} places more", places - 1) } else { String::new() };
    let text = format!(
        "{} stays at {value} {} for {duration_s} s from {at_s} s on{more}, and is noisy elsewhere: its sensor or the logger has stopped",
        t.column,
        quantity.unit()
    );
    let part = match rows.get(first.end) {
        Some(&after) if first.start == 0 => s.part_after(after),
        _ => s.part_before(rows[first.start]),
    };
    let advice = format!("If it cannot be recorded again, {part}.");
    Some(Finding::new(FindingKind::Glitch, Severity::Serious, text, advice).on(&t.column).at(frozen))
}
