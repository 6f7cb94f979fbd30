//! What small changes of the speed do to fluxes and currents: the T circuit in the stationary frame, ω_e = n_p ω.
//!
//!   dψ_s/dt = u − R_s i_s,   dψ_r/dt = −R_r i_r + jω_e ψ_r,   i_s = (L_r ψ_s − L_m ψ_r)/Δ,   i_r = (L_s ψ_r − L_m ψ_s)/Δ,   Δ = L_s L_r − L_m²
//!
//! and so dδψ/dt = A δψ + (0, jn_p ψ_r δω). The effects of a machine are left out: they make the filter's gains no less right, only less than best.

use im_model::{Complex, Machine};

use super::super::channel::{Channel, ChannelKind};
use super::wandering::{Onward, Wandering};
use super::{Matrix, SLOPE, SPEED, Vector};

/// The linear circuit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Electrical {
    /// −A without the speed: (ss, sr, rs, rr), 1/s.
    decay: [f64; 4],
    /// L_r/Δ and L_m/Δ: what the fluxes are of the stator current, 1/H.
    current: [f64; 2],
    pole_pairs: f64,
}

/// Fluxes of stator and rotor.
pub(super) type Fluxes = [Complex<f64>; 2];

/// One sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    /// e^{AT}.
    phi: [[Complex<f64>; 2]; 2],
    /// What a speed of 1 rad/s, and a slope of 1 rad/s², add to the fluxes.
    speed: Fluxes,
    slope: Fluxes,
    /// How speed and slope go on.
    onward: Onward,
}

impl Electrical {
    pub fn of(machine: &Machine<f64>) -> Self {
        let p = machine.parameters();
        let (l_m, r_s, r_r) = (p.magnetizing_inductance_h, p.stator_resistance_ohm, p.rotor_resistance_ohm);
        let (l_s, l_r) = (l_m + p.stator_leakage_inductance_h, l_m + p.rotor_leakage_inductance_h);
        let delta = l_s * l_r - l_m * l_m;
        Self {
            decay: [r_s * l_r / delta, -r_s * l_m / delta, -r_r * l_m / delta, r_r * l_s / delta],
            current: [l_r / delta, l_m / delta],
            pole_pairs: f64::from(machine.pole_pairs()),
        }
    }

    /// Pole pairs.
    pub fn pole_pairs(&self) -> f64 {
        self.pole_pairs
    }

    /// What a channel shows of the state.
    pub fn shown_by(&self, c: &Channel) -> Vector {
        let ChannelKind::Current { direction_rad } = c.kind else { return Vector::zeros() };
        let (s, cos) = direction_rad.sin_cos();
        let [a, b] = self.current;
        Vector::from([a * cos, a * s, -b * cos, -b * s, 0.0, 0.0])
    }

    /// A at this speed.
    fn rates(&self, omega_m: f64) -> [[Complex<f64>; 2]; 2] {
        let [ss, sr, rs, rr] = self.decay.map(|d| Complex::new(-d, 0.0));
        [[ss, sr], [rs, rr + Complex::new(0.0, self.pole_pairs * omega_m)]]
    }

    /// Over a sample at this speed and rotor flux.
    pub fn step(&self, omega_m: f64, psi_r: Complex<f64>, t: f64, onward: Onward) -> Step {
        let a = self.rates(omega_m);
        // e^{AT} and ∫e^{Aτ}dτ by their series: |A|T is below one half where a sample follows the currents.
        let zero = Complex::new(0.0, 0.0);
        let one = Complex::new(1.0, 0.0);
        let (mut phi, mut integral) = ([[one, zero], [zero, one]], [[one * t, zero], [zero, one * t]]);
        let mut power = phi;
        let mut factor = 1.0;
        for n in 1..9 {
            power = product(&power, &a);
            factor *= t / f64::from(n);
            for (row, (phi, integral)) in phi.iter_mut().zip(&mut integral).enumerate() {
                for c in 0..2 {
                    phi[c] += power[row][c] * factor;
                    integral[c] += power[row][c] * (factor * t / f64::from(n + 1));
                }
            }
        }
        let turned = Complex::new(0.0, self.pole_pairs) * psi_r;
        let speed = [integral[0][1] * turned, integral[1][1] * turned];
        Step { phi, speed, slope: speed.map(|x| x * (0.5 * t)), onward }
    }

    /// Over all samples of a run.
    pub fn steps(&self, omega_m: impl Iterator<Item = f64>, psi_r: &[Complex<f64>], t: f64, wandering: &Wandering) -> Vec<Step> {
        omega_m.zip(psi_r).enumerate().map(|(k, (w, psi))| self.step(w, *psi, t, *wandering.step(k))).collect()
    }

    /// Fluxes a sample later, at a held voltage.
    pub fn driven(&self, x: Fluxes, omega_m: f64, u: Complex<f64>, t: f64) -> Fluxes {
        // The mean of the explicit slopes, as a classical Runge-Kutta step has it.
        let a = self.rates(omega_m);
        let rate = |x: Fluxes| [a[0][0] * x[0] + a[0][1] * x[1] + u, a[1][0] * x[0] + a[1][1] * x[1]];
        let add = |x: Fluxes, d: Fluxes, h: f64| [x[0] + d[0] * h, x[1] + d[1] * h];
        let k1 = rate(x);
        let k2 = rate(add(x, k1, 0.5 * t));
        let k3 = rate(add(x, k2, 0.5 * t));
        let k4 = rate(add(x, k3, t));
        std::array::from_fn(|n| x[n] + (k1[n] + k2[n] * 2.0 + k3[n] * 2.0 + k4[n]) * (t / 6.0))
    }
}

fn product(a: &[[Complex<f64>; 2]; 2], b: &[[Complex<f64>; 2]; 2]) -> [[Complex<f64>; 2]; 2] {
    std::array::from_fn(|r| std::array::from_fn(|c| a[r][0] * b[0][c] + a[r][1] * b[1][c]))
}

impl Step {
    /// The state a sample later.
    #[inline]
    pub fn next(&self, x: &Vector) -> Vector {
        let [s, r] = [Complex::new(x[0], x[1]), Complex::new(x[2], x[3])];
        let row = |n: usize| self.phi[n][0] * s + self.phi[n][1] * r + self.speed[n] * x[SPEED] + self.slope[n] * x[SLOPE];
        let (s, r) = (row(0), row(1));
        let f = &self.onward.f;
        let onward = |n: usize| f[(n, 0)] * x[SPEED] + f[(n, 1)] * x[SLOPE];
        Vector::from([s.re, s.im, r.re, r.im, onward(0), onward(1)])
    }

    /// The same as a matrix.
    pub fn matrix(&self) -> Matrix {
        let mut f = Matrix::zeros();
        for c in 0..6 {
            let mut unit = Vector::zeros();
            unit[c] = 1.0;
            f.set_column(c, &self.next(&unit));
        }
        f
    }

    /// The covariance a sample later.
    pub fn carried(&self, p: &Matrix) -> Matrix {
        let f = self.matrix();
        let mut p = f * p * f.transpose();
        let mut wandered = p.fixed_view_mut::<2, 2>(SPEED, SPEED);
        wandered += self.onward.q;
        (p + p.transpose()) * 0.5
    }
}
