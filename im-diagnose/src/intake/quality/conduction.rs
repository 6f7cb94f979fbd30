//! A phase that does not conduct: an inverter's switch that stays open, a blown fuse, a lost phase of the supply.
//!
//! Over whole periods a healthy phase current is near zero for a few per cent of the time, 2/π·asin(0.1) of a sine. With one switch open it is zero
//! for about half of each period and has one sign for the rest; with both open it is zero throughout. No model of a whole machine follows that. Where
//! no voltage is applied to the phase either, as in a test along one axis, nothing is wrong.

use std::f64::consts::TAU;
use std::ops::Range;

use im_model::Complex;

use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity};

/// Part of the largest current of a period that is near zero: offsets of sensors are less.
const NEAR_ZERO: f64 = 0.1;
/// A phase that is near zero for this part of the time does not conduct: dead time makes half of it, at little current.
const IDLE: f64 = 0.3;
/// Part of what flows before, from which on a current counts as flowing.
const FLOWS: f64 = 0.3;
/// Periods, one after the other, in which a phase does not conduct. A field that turns back shows one.
const PERIODS: usize = 3;
/// Rows that a period has at least: fewer do not show how long a current is near zero.
const LEAST_ROWS: usize = 12;

/// The directions in which a phase does not conduct, and the part of a period for which it is near zero.
#[derive(Clone, Debug)]
struct Period {
    rows: Range<usize>,
    /// Into the machine, and out of it.
    lacks: [bool; 2],
    idle: f64,
}

impl Period {
    /// Of a current as a phase sees it: along its axis, and across.
    fn new(rows: Range<usize>, i: &[Complex<f64>]) -> Self {
        let i = &i[rows.clone()];
        let largest = i.iter().map(|i| i.norm()).fold(0.0, f64::max);
        let flows: Vec<f64> = i.iter().filter(|i| i.norm() > FLOWS * largest).map(|i| i.re / largest).collect();
        let idle = flows.iter().filter(|x| x.abs() < NEAR_ZERO).count() as f64 / flows.len().max(1) as f64;
        let lacks = [1.0, -1.0].map(|sign| !flows.iter().any(|x| sign * x > 2.0 * NEAR_ZERO));
        Self { rows, lacks, idle }
    }

    fn fails(&self) -> bool {
        self.idle > IDLE && self.lacks != [false, false]
    }
}

/// Periods of the current that flows across a phase, which does not need that phase.
fn periods(across: impl Iterator<Item = f64>) -> Vec<Range<usize>> {
    let mut changes = Vec::new();
    let mut largest: f64 = 0.0;
    for (k, x) in across.enumerate() {
        // A sign counts once the current flows the other way.
        if x * largest <= 0.0 && x.abs() > FLOWS * largest.abs() {
            changes.push(k);
            largest = x;
        } else if x * largest > largest * largest {
            largest = x;
        }
    }
    let ends = changes.iter().step_by(2);
    let all = ends.clone().zip(ends.skip(1)).map(|(a, b)| *a..*b);
    all.filter(|p| p.len() >= LEAST_ROWS).collect()
}

/// Phases that do not conduct, `name`d, with the time that ends the recording `before` a row.
pub fn check(
    u: &[Complex<f64>],
    i: &[Complex<f64>],
    name: impl Fn(usize) -> String,
    before: impl Fn(usize) -> String,
) -> Vec<Finding> {
    let of_phase = |phase: usize| -> Option<Finding> {
        let axis = Complex::from_polar(1.0, -TAU * phase as f64 / 3.0);
        let seen: Vec<Complex<f64>> = i.iter().map(|i| i * axis).collect();
        let all: Vec<Period> = periods(seen.iter().map(|i| i.im)).into_iter().map(|p| Period::new(p, &seen)).collect();
        let alike = |w: &[Period]| w.iter().all(|p| p.fails() && p.lacks == w[0].lacks);
        let failing = all.windows(PERIODS).find(|w| alike(w))?;
        let (lacks, first) = (failing[0].lacks, failing[0].rows.start);
        let same: Vec<&Period> = all.iter().filter(|p| p.fails() && p.lacks == lacks && p.rows.start >= first).collect();
        let applied = || same.iter().flat_map(|p| &u[p.rows.clone()]).map(|u| u * axis);
        if applied().map(|u| u.re * u.re).sum::<f64>() < FLOWS * FLOWS * applied().map(|u| u.im * u.im).sum::<f64>() {
            return None;
        }
        let idle = same.iter().map(|p| p.idle).sum::<f64>() / same.len() as f64;
        let (shown, which) = match lacks {
            [true, true] => ("does not flow in between", "the phase is open"),
            [true, false] => ("is never positive", "its upper switch does not close"),
            _ => ("is never negative", "its lower switch does not close"),
        };
        let (name, part, from) = (name(phase), number(100.0 * idle, 2), before(first));
        let text = format!("The current of {name} is near zero for {part} % of the time from {from} s on and {shown}: {which}");
        let advice = if first > i.len() / 10 {
            format!("No whole machine does that: use what comes before, to_s = {from} under [time].")
        } else {
            "No whole machine does that: record again once it is mended.".to_owned()
        };
        let mut found = Finding::new(FindingKind::OpenPhase, Severity::Serious, text, advice).on(&name);
        found.value = Some(idle);
        Some(found.at(same.iter().map(|p| p.rows.clone()).collect()))
    };
    (0..3).filter_map(of_phase).collect()
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
        let u: Vec<_> = (0..i.len()).map(|k| Complex::from_polar(300.0, TAU * 50.0 * DT * k as f64)).collect();
        check(&u, i, |p| format!("phase {}", ["a", "b", "c"][p]), |k| (DT * k as f64).to_string())
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
            // Within a period.
            assert!((2900..3300).contains(&found[0].rows[0].start), "{found:?}");
        }
    }

    #[test]
    fn a_test_along_one_axis_is_no_fault() {
        let sine = |k: u32| Complex::new(0.0, (TAU * 50.0 * DT * f64::from(k)).sin());
        let i: Vec<_> = (0..5000).map(|k| 5.0 * sine(k)).collect();
        let u: Vec<_> = (0..5000).map(|k| 40.0 * sine(k)).collect();
        assert!(check(&u, &i, |_| String::new(), |_| String::new()).is_empty());
    }

    /// A healthy machine: with an offset, with a constant in the beginning, at standstill, where nothing flows, and where the field stands across a
    /// phase for long and turns back.
    #[test]
    fn what_conducts_is_left_alone() {
        let healthy = currents(|_| true);
        let offset: Vec<_> = healthy.iter().map(|i| i + Complex::new(0.8, -0.5)).collect();
        let decaying: Vec<_> = healthy.iter().enumerate().map(|(k, i)| i + 10.0 * (-(k as f64) * 1e-3).exp()).collect();
        let still = vec![Complex::new(0.0, 5.0); 5000];
        let late: Vec<_> = vec![Complex::new(0.0, 0.0); 5000].into_iter().chain(healthy.clone()).collect();
        let angle = |k: i32| (0.01 * (f64::from(k - 5000).abs() - 4000.0).max(0.0)) + 0.25 * TAU;
        let turning_back: Vec<_> = (0..10_000).map(|k| Complex::from_polar(10.0, angle(k))).collect();
        for i in [healthy, offset, decaying, still, late, turning_back, Vec::new()] {
            assert!(found(&i).is_empty(), "{:?}", found(&i));
        }
    }
}
