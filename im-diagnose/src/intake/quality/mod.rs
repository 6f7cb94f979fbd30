//! What is wrong with a recording, reported before anything is fitted to it, and corrected where that is safe.

mod balance;
mod channels;
pub mod clip;
mod conduction;
pub mod convention;
mod currents;
mod frozen;
mod leaps;
mod machine;
pub mod offset;
mod smooth_mains;
pub mod steady;
pub mod supply;
pub mod switched;
mod time;
pub mod voltage_noise;

use im_model::{Complex, MotorFile, space_vector::from_phases};
use rayon::prelude::*;

use super::finding::{Finding, FindingKind, Severity};
use super::mapping::{CurrentForm, Instant};
use super::resampled::{Samples, samples};
use super::signals::{Signals, SpeedTrace};
use super::trace::Trace;
use crate::localise::Quantity;

/// What the checks leave of the currents.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checked {
    /// Rows that may be used, per column of the current; empty: all.
    pub valid: Vec<Vec<bool>>,
    /// The samples of each column of the current, and of the speed after them, where these are fewer than rows.
    pub samples: Vec<Option<Samples>>,
    /// Whether the second sensor of a column takes its place.
    pub second: Vec<bool>,
    /// What was found.
    pub findings: Vec<Finding>,
    /// Whether there are stretches of steady operation.
    pub steady: bool,
    /// Whether the load between the samples of its sensor is a guess that the speed contradicts.
    pub load_is_guessed: bool,
}

impl Checked {
    /// The sensor that is used for a column of the current.
    pub fn current<'a>(&self, s: &'a Signals, column: usize) -> &'a Trace {
        let c = &s.current[column];
        c.alternate.as_ref().filter(|_| self.second[column]).unwrap_or(&c.main)
    }

    /// The current of row `k`.
    pub fn i(&self, s: &Signals, k: usize) -> Complex<f64> {
        let at = |column: usize| self.current(s, column).values[k];
        match &s.current_form {
            CurrentForm::AlphaBeta(_) | CurrentForm::Dq(_) => Complex::new(at(0), at(1)),
            CurrentForm::Phases(_) => from_phases([at(0), at(1), at(2)]),
            CurrentForm::TwoPhases(which, _) => {
                let mut i = [-at(0) - at(1); 3];
                i[which[0]] = at(0);
                i[which[1]] = at(1);
                from_phases(i)
            }
        }
    }

    /// Whether row `k` is whole.
    pub fn whole(&self, k: usize) -> bool {
        self.valid.iter().all(|v| v[k])
    }
}

/// What a phase is called: its column, where it has one.
fn phase_name(s: &Signals, checked: &Checked, phase: usize) -> String {
    let column = match &s.current_form {
        CurrentForm::Phases(_) => Some(phase),
        CurrentForm::TwoPhases(which, _) => which.iter().position(|w| *w == phase),
        CurrentForm::AlphaBeta(_) | CurrentForm::Dq(_) => None,
    };
    column.map_or_else(|| format!("phase {}", ["a", "b", "c"][phase]), |x| checked.current(s, x).column.clone())
}

/// The rows at which a channel was measured; `slow`: its samples, where these are fewer than the rows.
fn measured_rows(slow: Option<&Samples>, s: &Signals) -> Vec<usize> {
    (0..s.len()).filter(|&k| slow.is_none_or(|s| s.measured[k]) && s.filled.get(k) != Some(&true)).collect()
}

/// Checks a recording against itself and against the motor.
pub fn check(s: &Signals, motor: &MotorFile) -> Checked {
    let mut checked = currents::check(s);
    let mut measured: Vec<&Trace> = (0..s.current.len()).map(|x| checked.current(s, x)).collect();
    if let SpeedTrace::Measured(w) = &s.speed {
        measured.push(w);
    }
    let slower = measured.par_iter().map(|t| samples(&t.values)).collect::<Vec<_>>();
    let columns = measured.iter().map(|t| t.column.as_str());
    let slower_channels = time::slower(s, columns.zip(&slower));
    checked.samples = slower;
    let n = s.len();
    let dt = s.sample_time_s;
    let u: Vec<Complex<f64>> = (0..n).map(|k| s.u(k)).collect();
    let i: Vec<Complex<f64>> = (0..n).map(|k| checked.i(s, k)).collect();
    let speed = if let SpeedTrace::Measured(w) = &s.speed { Some(&w.values[..]) } else { None };
    let held = matches!(s.speed, SpeedTrace::Locked).then(|| vec![0.0; n]);
    let mut steady = steady::stretches(&u, &i, speed.or(held.as_deref()), dt);
    steady.retain(|s| s.rows.clone().all(|k| checked.whole(k)));
    // A voltage held over a sample belongs to its middle.
    let half = match s.instant {
        Instant::HeldFromRow => -0.5 * dt,
        Instant::Sample => 0.0,
        Instant::HeldUntilRow => 0.5 * dt,
    };
    steady.iter_mut().for_each(|s| s.u *= Complex::from_polar(1.0, half * s.omega));
    checked.steady = !steady.is_empty();
    let columns: Vec<&str> = (0..s.current.len()).map(|x| checked.current(s, x).column.as_str()).collect();
    let slow_speed = checked.samples.get(s.current.len()).and_then(Option::as_ref);
    let guessed_load = time::guessed_load(s, slow_speed, motor.machine.parameters().inertia_kg_m2);
    checked.load_is_guessed = guessed_load.is_some();
    let measured_speed = if let SpeedTrace::Measured(w) = &s.speed { Some(w) } else { None };
    let of_current = |x: usize| {
        let mut rows = measured_rows(checked.samples[x].as_ref(), s);
        rows.retain(|&k| checked.valid.get(x).is_none_or(|v| v[k]));
        frozen::check(checked.current(s, x), Quantity::Current, &rows, s)
    };
    // A speed that has stopped leaps when it comes back.
    let of_speed = |w: &Trace| {
        let rows = measured_rows(slow_speed, s);
        frozen::check(w, Quantity::Speed, &rows, s).or_else(|| leaps::check(w, &rows, s, motor))
    };
    let found = [
        measured_speed.and_then(of_speed).into_iter().chain((0..s.current.len()).filter_map(of_current)).collect(),
        guessed_load.into_iter().collect(),
        time::clock(s, &u, motor).into_iter().collect(),
        slower_channels,
        convention::check(&steady, &s.voltage_form, motor),
        time::check(s, &steady, motor),
        channels::check(s, &steady, motor),
        conduction::check(&u, &i, |phase| phase_name(s, &checked, phase), |k| s.end_before(k)),
        machine::check(&steady, motor, &columns.join(", "), held.is_some()),
    ];
    checked.findings.extend(found.into_iter().flatten());
    // What upsets voltage, current or speed upsets the balance of torques as well.
    let doubtful = |f: &Finding| f.severity == Severity::Serious || f.kind == FindingKind::Convention;
    if let (Some(speed), Some(load), false) = (speed, &s.tau_load, checked.findings.iter().any(doubtful)) {
        let measured = balance::Measured { u: &u, i: &i, speed, load: &load.values, sample_time_s: dt, voltage_shift_s: half };
        checked.findings.extend(balance::check(&measured, &load.column, motor));
    }
    for f in &mut checked.findings {
        f.recording.clone_from(&s.name);
        if let (None, Some(first), Some(last)) = (f.span_s, f.rows.first(), f.rows.last()) {
            f.span_s = Some([s.time_s(first.start), s.time_s(last.end)]);
        }
    }
    // The worst first.
    checked.findings.sort_by_key(|f| std::cmp::Reverse(f.severity));
    checked
}
