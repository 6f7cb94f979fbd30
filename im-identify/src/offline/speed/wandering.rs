//! How the unknown part of a speed and its slope go on from row to row.
//!
//! Where nothing shows the speed, a line whose slope wanders: x_{k+1} = F x_k + w, Var w = Q. Where a sensor shows it, the same line given all
//! that the sensor showed is again such a chain, about its smoothed mean: with Λ the information in the later rows,
//!
//!   F̃ = (I + QΛ)⁻¹F,   Q̃ = (I + QΛ)⁻¹Q,   Λ_k = H Hᵀ/σ² + FᵀΛ_{k+1}F̃,   Var x_0 = Λ_0⁻¹.
//!
//! Source: H. E. Rauch, F. Tung, C. T. Striebel, AIAA J. 3 (1965) 1445; the chain is their smoother read forwards.

use std::sync::Arc;

use nalgebra::{Matrix2, Vector2};

/// One step of (δω, its slope): rad/s and rad/s².
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::offline) struct Onward {
    /// F.
    pub f: Matrix2<f64>,
    /// Q.
    pub q: Matrix2<f64>,
}

impl Onward {
    /// A slope that wanders freely, by `intensity` (rad/s²)²/s, over a sample of `t` seconds.
    pub fn free(intensity: f64, t: f64) -> Self {
        let q = Matrix2::new(t * t * t / 3.0, t * t / 2.0, t * t / 2.0, t) * intensity;
        Self { f: Matrix2::new(1.0, t, 0.0, 1.0), q }
    }

    /// This step and the next as one.
    fn then(&self, next: &Self) -> Self {
        Self { f: next.f * self.f, q: next.f * self.q * next.f.transpose() + next.q }
    }
}

/// A chain of steps.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::offline) struct Wandering {
    /// Covariance at the first row.
    pub first: Matrix2<f64>,
    steps: Arc<[Onward]>,
    /// Where it is the speed that wanders so, and not what it is off by: how much of what its torque does to a rotor of the motor file's inertia
    /// moves it beside.
    pub push: Option<f64>,
}

impl Wandering {
    /// Of a speed that nothing but the machine moves, of which this part is left from row to row.
    pub fn coasting(left: f64, rows: usize) -> Self {
        let step = Onward { f: Matrix2::new(left, 0.0, 0.0, 0.0), q: Matrix2::zeros() };
        Self { first: Matrix2::zeros(), steps: vec![step; rows].into(), push: None }
    }

    /// Of a line that nothing shows, over `rows` rows.
    pub fn free(intensity: f64, t: f64, rows: usize) -> Self {
        Self { first: unknown(), steps: vec![Onward::free(intensity, t); rows].into(), push: Some(0.0) }
    }

    /// Of what a sensor with noise `sigma` leaves of it, which counts at the rows of `valid`.
    pub fn behind(intensity: f64, sigma: f64, t: f64, rows: usize, valid: impl Fn(usize) -> bool) -> Self {
        // In units of σ and σ/t: all numbers of one size.
        let Onward { f, q } = Onward::free(intensity * t.powi(3) / (sigma * sigma), 1.0);
        let unit = Vector2::new(sigma, sigma / t);
        let (there, back) = (Matrix2::from_diagonal(&unit.map(|u| 1.0 / u)), Matrix2::from_diagonal(&unit));
        let shown = |k: usize| Matrix2::new(f64::from(u8::from(valid(k))), 0.0, 0.0, 0.0);
        let mut information = Matrix2::zeros();
        let mut steps = Vec::with_capacity(rows);
        for k in (0..rows).rev() {
            let kept = (Matrix2::identity() + q * information).try_inverse().unwrap_or_else(Matrix2::identity);
            let step = Onward { f: kept * f, q: kept * q };
            information = shown(k) + f.transpose() * information * step.f;
            information = (information + information.transpose()) * 0.5;
            steps.push(Onward { f: back * step.f * there, q: back * step.q * back });
        }
        steps.reverse();
        let first = (information + Matrix2::identity() * 1e-9).try_inverse().unwrap_or_else(Matrix2::identity);
        Self { first: back * first * back, steps: steps.into(), push: None }
    }

    /// The same, its slope wandering so many times as much.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { steps: self.steps.iter().map(|s| Onward { q: s.q * factor, ..*s }).collect(), ..self.clone() }
    }

    /// The step from row `k`.
    pub fn step(&self, k: usize) -> &Onward {
        &self.steps[k]
    }

    /// On every so many rows.
    pub fn every(&self, stride: usize) -> Self {
        let one = |steps: &[Onward]| steps[1..].iter().fold(steps[0], |sum, next| sum.then(next));
        Self { steps: self.steps.chunks(stride).map(one).collect(), ..self.clone() }
    }
}

/// Any speed and any slope.
fn unknown() -> Matrix2<f64> {
    Matrix2::new(1e6, 0.0, 0.0, 1e10)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The covariance at row `k`, carried from the first.
    fn at(w: &Wandering, k: usize) -> Matrix2<f64> {
        (0..k).fold(w.first, |p, k| w.step(k).f * p * w.step(k).f.transpose() + w.step(k).q)
    }

    #[test]
    fn what_a_sensor_leaves_is_the_inverse_of_all_information() {
        // The same without recursions: precision matrix of the whole chain and its sensor, inverted.
        let (intensity, sigma, t, rows) = (3e4, 0.1, 1e-3, 40);
        let valid = |k: usize| k % 7 != 3;
        let w = Wandering::behind(intensity, sigma, t, rows, valid);
        let Onward { f, q } = Onward::free(intensity, t);
        let inverse = q.try_inverse().unwrap();
        let mut precision = nalgebra::DMatrix::<f64>::zeros(2 * rows, 2 * rows);
        for k in 0..rows {
            precision[(2 * k, 2 * k)] += f64::from(u8::from(valid(k))) / (sigma * sigma);
            if k + 1 < rows {
                let step = nalgebra::Matrix2x4::from_fn(|r, c| if c < 2 { -f[(r, c)] } else { f64::from(u8::from(r == c - 2)) });
                let form = step.transpose() * inverse * step;
                let mut block = precision.view_mut((2 * k, 2 * k), (4, 4));
                block += form;
            }
        }
        let covariance = precision.cholesky().unwrap().inverse();
        for k in [0, 1, 10, 25, 39] {
            let (a, b) = (at(&w, k), covariance.view((2 * k, 2 * k), (2, 2)));
            for c in 0..4 {
                assert!((a[c] - b[(c % 2, c / 2)]).abs() < 1e-5 * (b[(c % 2, c % 2)] * b[(c / 2, c / 2)]).sqrt(), "{k}: {a} {b}");
            }
        }
        // Between rows far apart, too.
        let thin = w.every(5);
        let a = at(&thin, 5);
        assert!((a - at(&w, 25)).norm() < 1e-9 * a.norm(), "{a}");
    }
}
