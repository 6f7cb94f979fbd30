//! Errors over time.

use serde::Serialize;

use super::{Quantity, Run, Signals};

/// Root mean square error over time, one run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TimeTrace {
    /// Which error.
    pub quantity: Quantity,
    /// Name of the run.
    pub run: String,
    /// Time (middle of an interval), s, and root mean square error there, in the quantity's unit.
    pub points: Vec<[f64; 2]>,
    /// The noise level, in the quantity's unit.
    pub noise: f64,
}

/// A stretch of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Window {
    /// Number of the run.
    pub run: usize,
    /// Its name.
    pub name: String,
    /// From, s.
    pub from_s: f64,
    /// To, s.
    pub to_s: f64,
    /// Root mean square error there over the noise.
    pub level: f64,
    /// The same over all runs.
    pub average: f64,
}

/// Intervals per run.
const INTERVALS: usize = 160;

pub(super) fn traces(s: &Signals) -> Vec<TimeTrace> {
    let mut out = Vec::new();
    for run in &s.runs {
        for q in Quantity::ALL {
            let step = run.rows.len().div_ceil(INTERVALS).max(1);
            let points: Vec<[f64; 2]> = run
                .rows
                .chunks(step)
                .enumerate()
                .filter_map(|(k, rows)| {
                    let (n, sum) = rows.iter().filter_map(|r| q.squared(r)).fold((0.0, 0.0), |(n, t), x| (n + 1.0, t + x));
                    let middle = ((k * step) as f64 + 0.5 * rows.len() as f64) * run.sample_time_s;
                    (n > 0.0).then(|| [middle, (sum / n).sqrt()])
                })
                .collect();
            if !points.is_empty() {
                out.push(TimeTrace { quantity: q, run: run.name.clone(), points, noise: q.noise(s) });
            }
        }
    }
    out
}

/// Squared errors over their noise, all quantities together.
fn squared(s: &Signals, run: &Run) -> Vec<f64> {
    let w = Quantity::ALL.map(|q| 1.0 / q.noise(s).max(1e-300).powi(2));
    let weights = [2.0, 1.0];
    run.rows
        .iter()
        .map(|r| {
            let (mut n, mut sum) = (0.0, 0.0);
            for (k, q) in Quantity::ALL.into_iter().enumerate() {
                if let Some(x) = q.squared(r) {
                    n += weights[k];
                    sum += weights[k] * x * w[k];
                }
            }
            if n > 0.0 { sum / n } else { 0.0 }
        })
        .collect()
}

pub(super) fn worst(s: &Signals) -> Option<Window> {
    let mut best: Option<Window> = None;
    let (mut rows, mut total) = (0.0, 0.0);
    for (index, run) in s.runs.iter().enumerate() {
        let e = squared(s, run);
        let n = ((1.0 / run.sample_time_s).round() as usize).clamp(1, e.len().max(1));
        if e.is_empty() {
            continue;
        }
        rows += e.len() as f64;
        total += e.iter().sum::<f64>();
        let mut sum: f64 = e[..n].iter().sum();
        let (mut at, mut most) = (0, sum);
        for k in n..e.len() {
            sum += e[k] - e[k - n];
            if sum > most {
                (at, most) = (k + 1 - n, sum);
            }
        }
        let level = (most / n as f64).max(0.0).sqrt();
        if best.as_ref().is_none_or(|b| level > b.level) {
            let t = |k: usize| k as f64 * run.sample_time_s;
            best = Some(Window { run: index, name: run.name.clone(), from_s: t(at), to_s: t(at + n), level, average: 0.0 });
        }
    }
    best.map(|b| Window { average: (total / f64::max(rows, 1.0)).sqrt(), ..b })
}
