//! Sampling: even, fast enough, and every row a new one.

use im_model::TParameters;

use super::steady::Steady;
use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity, ranges};
use crate::intake::signals::Signals;

/// Looks at the sampling.
pub fn check(s: &Signals, steady: &[Steady], p: &TParameters<f64>) -> Vec<Finding> {
    let mut out = Vec::new();
    let dt = s.sample_time_s;
    let warn = |kind, text: String, advice: &str| Finding::new(kind, Severity::Warning, text, advice);
    if s.jitter > 0.05 {
        let text =
            format!("The times of the rows are off an even grid by up to {} % of the sampling time", number(100.0 * s.jitter, 2));
        out.push(warn(FindingKind::IrregularSampling, text, "Write the time with more digits, or resample evenly."));
    }
    let missing = ranges(&s.filled);
    if !missing.is_empty() {
        let count = s.filled.iter().filter(|f| **f).count();
        let text =
            format!("{count} rows are missing; the voltage is interpolated linearly, the rows are left out of the comparison");
        out.push(Finding::new(FindingKind::Gap, Severity::Warning, text, "").at(missing));
    }
    if let Some(fastest) = steady.iter().map(|s| s.omega.abs()).reduce(f64::max) {
        let per_period = 2.0 * std::f64::consts::PI / (fastest * dt);
        if per_period < 20.0 {
            let text = format!("There are only {} rows per period of the supply", number(per_period, 2));
            out.push(warn(FindingKind::SlowSampling, text, "Sample at twenty times the supply frequency at least."));
        }
    }
    let leakage_s =
        (p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h) / (p.stator_resistance_ohm + p.rotor_resistance_ohm);
    if dt > leakage_s {
        let text = format!(
            "The sampling time of {} ms exceeds the machine's leakage time constant of {} ms: what the currents do in between is not seen",
            number(1e3 * dt, 2),
            number(1e3 * leakage_s, 2)
        );
        out.push(warn(FindingKind::SlowSampling, text, "Sample faster."));
    }
    // A logger that writes faster than it measures repeats itself.
    let same = |k: usize| s.current.iter().all(|c| c.main.values[k] == c.main.values[k - 1]);
    let flows = |k: usize| s.current.iter().any(|c| c.main.values[k] != 0.0);
    let moving = (1..s.len()).filter(|&k| flows(k)).count();
    let repeated = (1..s.len()).filter(|&k| flows(k) && same(k)).count();
    if repeated * 4 > moving && moving > 100 {
        let text =
            format!("{} % of the rows repeat the currents of the row before", number(100.0 * repeated as f64 / moving as f64, 2));
        let advice = "The logger writes more often than it measures: keep every row that brings something new.";
        out.push(warn(FindingKind::RepeatedRows, text, advice));
    }
    out
}
