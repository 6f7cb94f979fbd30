//! What the tests in the files of the effects run: one machine with one effect at a middling size.

use core::f64::consts::PI;

use num_complex::Complex;

use super::{EffectId, Effects, Role};
use crate::machines::MOTULATOR_2_2_KW as M;
use crate::{Bench, Machine, Output, PlantInput, State};

/// Sampling time, s.
pub(super) const T: f64 = 1e-4;
/// Rated phase voltage, peak, V, at 50 Hz.
pub(super) const RATED_V: f64 = 326.6;
/// Synchronous speed at 50 Hz, rad/s.
pub(super) const SYNCHRONOUS: f64 = 50.0 * PI;

pub(super) fn machine(set: impl FnOnce(&mut Effects<f64>)) -> Machine<f64> {
    let mut e = Effects::scaled(&M.rating, &M.parameters(), M.pole_pairs);
    set(&mut e);
    Machine::try_new(M.parameters(), M.pole_pairs, e).unwrap()
}

/// The machine with every strength of an effect in the middle of its usual range.
pub(super) fn with(id: EffectId) -> Machine<f64> {
    machine(|e| {
        for (k, info) in id.parameters().iter().enumerate().filter(|(_, p)| p.role == Role::Strength) {
            let size = (info.typical.0 * info.typical.1).sqrt();
            e.set(id, k, size * M.rating.unit_of(info.scale, &M.parameters(), M.pole_pairs));
        }
    })
}

/// What the sensors show in one period of 50 Hz at an imposed speed, after half a second on rated frequency.
pub(super) fn running(m: &Machine<f64>, volts: f64, speed: f64) -> Vec<Output<f64>> {
    running_for(m, volts, speed, 200)
}

/// As [`running`], for so many samples.
pub(super) fn running_for(m: &Machine<f64>, volts: f64, speed: f64, samples: u32) -> Vec<Output<f64>> {
    let mut bench = Bench::new(m, State::turning(speed), T);
    let mut out = Vec::new();
    for k in 0..5000 + samples {
        if k >= 5000 {
            out.push(bench.output());
        }
        let u = Complex::from_polar(volts, 100.0 * PI * T * (f64::from(k) + 0.5));
        bench.advance(&PlantInput { imposed_speed: Some([speed; 2]), ..PlantInput::new(u, 0.0) });
    }
    out
}

/// The current that turns with `hz` (negative: backwards) in what [`running`] gave, A.
pub(super) fn current(out: &[Output<f64>], hz: f64) -> Complex<f64> {
    let turned = |(k, y): (usize, &Output<f64>)| y.i_s * Complex::from_polar(1.0, -2.0 * PI * hz * T * k as f64);
    out.iter().enumerate().map(turned).sum::<Complex<f64>>() / out.len() as f64
}
