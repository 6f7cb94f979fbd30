//! A sensor's offset: a mean over whole periods that stays the same while the machine runs at different points.
//!
//! A transient decays, a mean of the current follows that of the voltage, and one stretch of steady operation cannot tell: only what
//! persists is a sensor's.

use super::steady::Steady;
use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity};
use crate::intake::trace::Trace;
use crate::statistics::median;

/// Means of steady stretches that differ by no more than this part of their median are one offset.
const SAME: f64 = 0.3;
/// Means below this part of the amplitude are not looked at.
const LEAST: f64 = 0.02;
/// Stretches whose amplitudes or frequencies differ by more than this part are different operating points.
const ANOTHER_POINT: f64 = 0.05;

fn mean(t: &Trace, s: &Steady) -> f64 {
    let x = &t.values[s.rows.clone()];
    x.iter().sum::<f64>() / x.len() as f64
}

/// The mean of a trace that most stretches show, at two operating points at least.
fn persistent(t: &Trace, steady: &[Steady], amplitude: impl Fn(&Steady) -> f64) -> Option<f64> {
    let middle = median(&mut steady.iter().map(|s| mean(t, s)).collect::<Vec<_>>());
    let size = median(&mut steady.iter().map(&amplitude).collect::<Vec<_>>());
    // A transient may still decay in some.
    let same: Vec<&Steady> = steady.iter().filter(|s| (mean(t, s) - middle).abs() < SAME * middle.abs()).collect();
    // An offset stays to the end, a transient is gone.
    let to_the_end = same.last().is_some_and(|s| steady.last().is_some_and(|last| s.rows == last.rows));
    if middle.abs() < LEAST * size || 2 * same.len() <= steady.len() || !to_the_end {
        return None;
    }
    let apart = |a: f64, b: f64| (a - b).abs() > ANOTHER_POINT * a.abs().max(b.abs());
    let another =
        |a: &Steady, b: &Steady| apart(a.omega, b.omega) || apart(a.u.norm(), b.u.norm()) || apart(a.i.norm(), b.i.norm());
    same.iter().any(|s| another(s, same[0])).then_some(middle)
}

fn finding(t: &Trace, what: &str, unit: &str, offset: f64, steady: &[Steady]) -> Finding {
    let text = format!("The {what} {} has a mean of {} {unit} at every operating point", t.column, number(offset, 2));
    // The mapping's offset is in the column's own unit, and one may be taken off already.
    let said = t.offset + offset / t.gain;
    let advice =
        format!("If it is the sensor's, say offset = {} for this column in the mapping.", number(said, 3).replace('−', "-"));
    let mut found = Finding::new(FindingKind::Offset, Severity::Note, text, advice).on(&t.column);
    found.value = Some(offset);
    found.at(steady.iter().map(|s| s.rows.clone()).collect())
}

/// Offsets of voltages and currents.
pub fn check(voltage: &[Trace], current: &[&Trace], steady: &[Steady], stator_resistance_ohm: f64) -> Vec<Finding> {
    let mut out = Vec::new();
    let mut driven: f64 = 0.0;
    for t in voltage {
        driven = driven.max(median(&mut steady.iter().map(|s| mean(t, s)).collect::<Vec<_>>()).abs() / stator_resistance_ohm);
        out.extend(persistent(t, steady, |s| s.u.norm()).map(|x| finding(t, "voltage", "V", x, steady)));
    }
    for t in current {
        // A mean voltage drives a mean current: then it is no error of the current sensor.
        let own = persistent(t, steady, |s| s.i.norm()).filter(|x| x.abs() > 2.0 * driven);
        out.extend(own.map(|x| finding(t, "current", "A", x, steady)));
    }
    out
}

/// Takes back offsets that not every recording of the same columns shows.
pub fn keep_common(recordings: &mut [Vec<Finding>], steady: &[bool]) {
    let offsets: Vec<Vec<(Option<String>, f64)>> = recordings
        .iter()
        .map(|r| {
            let own = r.iter().filter(|f| f.kind == FindingKind::Offset);
            own.filter_map(|f| Some((f.channel.clone(), f.value?))).collect()
        })
        .collect();
    let common = |channel: &Option<String>, value: f64| {
        offsets
            .iter()
            .zip(steady)
            .filter(|(_, steady)| **steady)
            .all(|(found, _)| found.iter().any(|(c, x)| c == channel && (x - value).abs() < SAME * value.abs()))
    };
    for findings in recordings {
        findings.retain(|f| f.kind != FindingKind::Offset || f.value.is_some_and(|x| common(&f.channel, x)));
    }
}
