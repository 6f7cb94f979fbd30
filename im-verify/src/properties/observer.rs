//! Properties of observers. The observer is the caller's: one of `im-observers` or another implementation of [`Observer`].

use im_observers::{Estimate, Input, Observer};

use super::Steady;
use crate::claim::C;
use crate::verdict::Verdict;

/// Runs an observer over a steady state from a start of its own; `see` gets each estimate with its sample's number.
pub fn run<O: Observer<f64>>(
    observer: &O,
    truth: &Steady,
    start: [C; 2],
    omega_m: f64,
    samples: usize,
    mut see: impl FnMut(usize, &Estimate<f64>),
) {
    let mut state = observer.state_at(start[0], start[1], omega_m);
    for k in 1..=samples {
        see(k, &observer.step(&mut state, &truth.input(k)));
    }
}

/// In steady state, from a flux turned by `angle` and a speed off by `speed_error`, the speed is within `tolerance` (rad/s) of the truth over
/// the last tenth of `duration_s`.
pub fn speed_converges<O: Observer<f64>>(
    observer: &O,
    truth: &Steady,
    angle: f64,
    speed_error: f64,
    duration_s: f64,
    tolerance: f64,
) -> Verdict {
    let samples = (duration_s / truth.sample_time_s) as usize;
    let start = [truth.flux(0) * im_model::space_vector::unit(angle), truth.current(0)];
    let mut worst = 0.0f64;
    run(observer, truth, start, truth.omega_m + speed_error, samples, |k, e| {
        if k > samples - samples / 10 {
            worst = worst.max((e.omega_m - truth.omega_m).abs());
        }
    });
    Verdict::at_most("speed error at the end, rad/s", worst, tolerance)
}

/// From a flux error, |λ̂ − λ| falls at least like e^(−rate t), but for `floor` (Vs).
pub fn flux_error_decays<O: Observer<f64>>(
    observer: &O,
    truth: &Steady,
    error: C,
    rate_per_s: f64,
    duration_s: f64,
    floor: f64,
) -> Verdict {
    let samples = (duration_s / truth.sample_time_s) as usize;
    let mut worst = f64::NEG_INFINITY;
    run(observer, truth, [truth.flux(0) + error, truth.current(0)], truth.omega_m, samples, |k, e| {
        let allowed = error.norm() * (-rate_per_s * truth.sample_time_s * k as f64).exp() + floor;
        worst = worst.max((e.rotor_flux_vs - truth.flux(k)).norm() / allowed);
    });
    Verdict::at_most("flux error over what the rate allows", worst, 1.0)
}

/// Whatever samples are lost or absurd, estimates stay numbers, bad ones are flagged, and good samples bring the observer back to within
/// `tolerance` (rad/s) in `recovery_s`.
pub fn survives_bad_samples<O: Observer<f64>>(
    observer: &O,
    truth: &Steady,
    bad: &[Input<f64>],
    recovery_s: f64,
    tolerance: f64,
) -> Verdict {
    let mut state = observer.state_at(truth.flux(0), truth.current(0), truth.omega_m);
    let mut finite = true;
    let mut flagged = true;
    let settle = (0.1 / truth.sample_time_s) as usize;
    for k in 1..=settle {
        observer.step(&mut state, &truth.input(k));
    }
    for input in bad {
        let e = observer.step(&mut state, input);
        finite &= e.rotor_flux_vs.norm().is_finite() && e.omega_m.is_finite() && e.torque_nm.is_finite();
        flagged &= !e.status.is_valid();
    }
    let samples = (recovery_s / truth.sample_time_s) as usize;
    let first = settle + bad.len() + 1;
    let mut last = f64::NAN;
    for k in first..first + samples {
        last = (observer.step(&mut state, &truth.input(k)).omega_m - truth.omega_m).abs();
    }
    let no = |x: bool| f64::from(u8::from(!x));
    Verdict::at_most("estimates that are no numbers", no(finite), 0.5)
        .and(Verdict::at_most("bad samples that were not flagged", no(flagged), 0.5))
        .and(Verdict::at_most("speed error after recovery, rad/s", last, tolerance))
}
