//! A phase that does not conduct: an inverter's switch that stays open, a blown fuse, a lost phase of the supply.
//!
//! Over whole periods a healthy phase current is near zero for a few per cent of the time, 2/π·asin(0.1) of a sine. With one switch open it is zero
//! for about half of each period and has one sign for the rest; with both open it is zero throughout. No model of a whole machine follows that.

use std::f64::consts::TAU;
use std::ops::Range;

use im_model::Complex;

use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity};

/// Part of the largest current of a stretch that is near zero: offsets of sensors are less.
const NEAR_ZERO: f64 = 0.1;
/// A phase that is near zero for this part of the time does not conduct: twice what dead time makes of a current that lingers there.
const IDLE: f64 = 0.3;
/// Current vectors below this part of the largest say nothing.
const FLOWS: f64 = 0.3;
/// Sign changes of the current between the other two phases, a whole number of periods.
const CHANGES: usize = 6;
/// Rows that a period has at least: fewer do not show how long a current is near zero.
const LEAST_ROWS: usize = 12;

/// What a phase does in a stretch.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Conducts {
    Both,
    OnlyNegative,
    OnlyPositive,
    Never,
}

/// The component of a current along a phase's axis, and across it.
fn seen_by(phase: usize, i: Complex<f64>) -> [f64; 2] {
    let turned = i * Complex::from_polar(1.0, -TAU * phase as f64 / 3.0);
    [turned.re, turned.im]
}

/// Stretches of a whole number of periods of the current that flows across a phase, which does not need that phase.
fn stretches(across: &[f64], largest: f64) -> Vec<Range<usize>> {
    let mut out = Vec::new();
    let (mut begin, mut changes, mut sign) = (0, 0, 0.0);
    for (k, &x) in across.iter().enumerate() {
        // A sign counts once the current has gone well beyond zero.
        if x.abs() > FLOWS * largest && x.signum() != sign {
            (changes, sign) = (changes + 1, x.signum());
            if changes == 1 {
                begin = k;
            } else if changes == CHANGES + 1 {
                out.push(begin..k);
                (begin, changes) = (k, 1);
            }
        }
    }
    out
}

fn conducts(along: &[f64], i: &[Complex<f64>]) -> (Conducts, f64) {
    let largest = i.iter().map(|i| i.norm()).fold(0.0, f64::max);
    let flows = along.iter().zip(i).filter(|(_, i)| i.norm() > FLOWS * largest);
    let [mut rows, mut idle, mut positive, mut negative] = [0.0; 4];
    for (x, _) in flows {
        rows += 1.0;
        match x / largest {
            x if x.abs() < NEAR_ZERO => idle += 1.0,
            x if x > 0.0 => positive += 1.0,
            _ => negative += 1.0,
        }
    }
    let idle = idle / f64::max(rows, 1.0);
    let none = |count: f64| count < 0.03 * rows;
    let how = match (idle > IDLE, none(positive), none(negative)) {
        (true, true, true) => Conducts::Never,
        (true, true, false) => Conducts::OnlyNegative,
        (true, false, true) => Conducts::OnlyPositive,
        _ => Conducts::Both,
    };
    (how, idle)
}

/// Phases that do not conduct, `name`d, in a recording that begins at `start_s`.
pub fn check(i: &[Complex<f64>], start_s: f64, sample_time_s: f64, name: impl Fn(usize) -> String) -> Vec<Finding> {
    let largest = i.iter().map(|i| i.norm()).fold(0.0, f64::max);
    (0..3)
        .filter_map(|phase| {
            let (along, across): (Vec<f64>, Vec<f64>) = i.iter().map(|i| seen_by(phase, *i)).map(|[a, b]| (a, b)).unzip();
            let all = stretches(&across, 0.5 * largest).into_iter().filter(|s| s.len() >= CHANGES / 2 * LEAST_ROWS);
            let all: Vec<_> = all.map(|s| (conducts(&along[s.clone()], &i[s.clone()]), s)).collect();
            // The last way in which it fails is the one to name; what came before it may be another.
            let ((how, idle), last) = all.iter().rev().find(|((how, _), _)| *how != Conducts::Both)?;
            let first = all.iter().find(|((h, _), _)| h == how).map_or(last.start, |(_, s)| s.start);
            let from_s = start_s + first as f64 * sample_time_s;
            let (part, which) = match how {
                Conducts::OnlyNegative => ("never positive", "the upper switch of that phase does not close"),
                Conducts::OnlyPositive => ("never negative", "the lower switch of that phase does not close"),
                _ => ("no more than that in between", "the phase is open"),
            };
            let text = format!(
                "The current of {} is near zero for {} % of the time from {} s on, and {part}: {which}",
                name(phase),
                number(100.0 * idle, 2),
                number(from_s, 3)
            );
            let advice = if first > 0 && from_s > start_s + 0.1 * (i.len() as f64 * sample_time_s) {
                format!(
                    "No model of a whole machine follows that: use what comes before, to_s = {} under [time].",
                    number(from_s, 3)
                )
            } else {
                "No model of a whole machine follows that: record again once it is mended.".to_owned()
            };
            let mut found = Finding::new(FindingKind::OpenPhase, Severity::Serious, text, advice).on(&name(phase));
            found.value = Some(*idle);
            Some(found.at(vec![first..last.end]))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1e-4;

    /// Currents of 10 A at 50 Hz through what `phase` a of an inverter lets pass, from row 3000 on.
    fn currents(passes: impl Fn(f64) -> bool) -> Vec<Complex<f64>> {
        (0..10_000)
            .map(|k| {
                let mut p: [f64; 3] = std::array::from_fn(|p| 10.0 * (TAU * (50.0 * DT * f64::from(k) - p as f64 / 3.0)).cos());
                if k > 3000 && !passes(p[0]) {
                    (p[1], p[2]) = (0.5 * (p[1] - p[2]), 0.5 * (p[2] - p[1]));
                    p[0] = 0.0;
                }
                im_model::space_vector::from_phases(p)
            })
            .collect()
    }

    fn found(i: &[Complex<f64>]) -> Vec<Finding> {
        check(i, 0.0, DT, |p| format!("phase {}", ["a", "b", "c"][p]))
    }

    #[test]
    fn an_open_switch_is_found_where_it_opens_and_named() {
        for (passes, said) in [
            (&(|i| i < 0.0) as &dyn Fn(f64) -> bool, "never positive"),
            (&|i| i > 0.0, "never negative"),
            (&|_| false, "the phase is open"),
        ] {
            let found = found(&currents(passes));
            assert!(found.len() == 1 && found[0].sentence.contains(said), "{found:?}");
            assert!(found[0].sentence.contains("phase a") && found[0].advice.contains("to_s"), "{found:?}");
            // Within the three periods of a stretch.
            assert!((2400..3700).contains(&found[0].rows[0].start), "{found:?}");
        }
    }

    /// A healthy machine: with an offset, with a constant in the beginning, at standstill, and where nothing flows.
    #[test]
    fn what_conducts_is_left_alone() {
        let healthy = currents(|_| true);
        let offset: Vec<_> = healthy.iter().map(|i| i + Complex::new(0.8, -0.5)).collect();
        let decaying: Vec<_> = healthy.iter().enumerate().map(|(k, i)| i + 10.0 * (-(k as f64) * 1e-3).exp()).collect();
        let still = vec![Complex::new(0.0, 5.0); 5000];
        let late: Vec<_> = vec![Complex::new(0.0, 0.0); 5000].into_iter().chain(healthy.clone()).collect();
        for i in [healthy, offset, decaying, still, late, Vec::new()] {
            assert!(found(&i).is_empty(), "{:?}", found(&i));
        }
    }
}
