//! A current sensor in whose solid core eddy currents hold a part of the flux back.
//!
//! What the core lets through of a current at frequency s is 1/(1 + √(sτ)): diffusion, which has no single time constant. Its relaxation is
//! spread over time constants τ eˣ with the density 1/(2π cosh(x/2)), here taken at many points.

use std::f64::consts::TAU;

use super::plane::Vector;

/// A core.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlowCore {
    /// The part of the reading that it holds back.
    pub part: f64,
    /// τ, s.
    pub time_s: f64,
}

/// Points of the spread, and how far it reaches, in natural logarithms.
const POINTS: usize = 60;
const REACH: f64 = 12.0;

impl SlowCore {
    /// Without current, for samples of a length, s.
    pub fn at_rest(self, sample_s: f64) -> CoreState {
        let step = 2.0 * REACH / (POINTS - 1) as f64;
        let at = |k: usize| {
            let x = -REACH + step * k as f64;
            let decay = (-sample_s / (self.time_s * x.exp())).exp();
            (step / (TAU * (0.5 * x).cosh()), decay, Vector::ZERO)
        };
        CoreState { part: self.part, last: Vector::ZERO, layers: (0..POINTS).map(at).collect() }
    }
}

/// A core in the course of a run.
pub struct CoreState {
    part: f64,
    last: Vector,
    /// Weight, decay over a sample, and what is let through.
    layers: Vec<(f64, f64, Vector)>,
}

impl CoreState {
    /// What the sensor reads of the current, of which the mean since the last sample acted on the core.
    pub fn reads(&mut self, current: Vector) -> Vector {
        let middle = (current + self.last) * 0.5;
        self.last = current;
        let mut through = Vector::ZERO;
        let mut whole = 0.0;
        for (weight, decay, layer) in &mut self.layers {
            *layer = middle + (*layer - middle) * *decay;
            through = through + *layer * *weight;
            whole += *weight;
        }
        current + (through * (1.0 / whole) - current) * self.part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At ωτ = 1 diffusion lets 1/(1 + √j) through: 0.54 of the current, 22.5° late.
    #[test]
    fn a_core_lets_through_what_diffusion_does() {
        let (time_s, sample_s) = (2e-3, 5e-6);
        let omega = 1.0 / time_s;
        let mut core = SlowCore { part: 1.0, time_s }.at_rest(sample_s);
        let samples = 60_000;
        let read = (0..samples).map(|k| core.reads(Vector::polar(1.0, omega * sample_s * f64::from(k)))).last().unwrap();
        let end = omega * sample_s * f64::from(samples - 1);
        let seen = read.turn_back((end.cos(), end.sin()));
        let root = Vector::polar(1.0, std::f64::consts::FRAC_PI_4);
        let one_plus = Vector::new(1.0 + root.x, root.y);
        let expected = Vector::new(one_plus.x, -one_plus.y) * (1.0 / one_plus.length().powi(2));
        assert!((seen - expected).length() < 0.01, "{seen:?} {expected:?}");
    }
}
