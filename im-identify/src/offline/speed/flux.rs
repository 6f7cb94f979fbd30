//! What small changes of speed and voltage do to fluxes and currents: the T circuit in the stationary frame, ω_e = n_p ω.
//!
//!   dψ_s/dt = u − R_s i_s,   dψ_r/dt = −R_r i_r + jω_e ψ_r,   i_s = (L_r ψ_s − L_m ψ_r)/Δ,   i_r = (L_s ψ_r − L_m ψ_s)/Δ,   Δ = L_s L_r − L_m²
//!
//! and so dδψ/dt = A δψ + (δu, jn_p ψ_r δω). Where the shaft turns freely, J dδω/dt = δτ − (D + J·nudge) δω with τ = (3/2) n_p (L_m/Δ) Im(ψ_s ψ_r*). The effects of a machine are left out: they make the filter's gains no less right, only less than best.

use im_model::{Complex, Machine};
use nalgebra::Vector4;

use super::super::channel::{Channel, ChannelKind};
use super::voltage::Wander;
use super::wandering::Onward;
use super::{MACHINE, Matrix, SLOPE, SPEED, Unknown, Vector};

/// The linear circuit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Electrical {
    /// −A without the speed: (ss, sr, rs, rr), 1/s.
    decay: [f64; 4],
    /// L_r/Δ and L_m/Δ: what the fluxes are of the stator current, 1/H.
    current: [f64; 2],
    pole_pairs: f64,
    /// What a torque is of Im(ψ_s ψ_r*), over the inertia, 1/(Vs)²s²; and friction over inertia, 1/s.
    shaft: [f64; 2],
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
    /// What a volt held over it adds to them.
    volt: Fluxes,
    /// What fluxes add to a speed that their torque moves, rad/s.
    torque: [f64; 4],
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
            shaft: [1.5 * f64::from(machine.pole_pairs()) * l_m / delta, p.viscous_friction_nm_s_per_rad]
                .map(|x| x / p.inertia_kg_m2),
        }
    }

    /// Pole pairs.
    pub fn pole_pairs(&self) -> f64 {
        self.pole_pairs
    }

    /// How much of a free rotor's speed is left after `t` seconds by its friction, and where it is nudged at a rate, 1/s.
    pub fn coasting(&self, nudge: f64, t: f64) -> f64 {
        (-(self.shaft[1] + nudge) * t).exp()
    }

    /// What a channel shows of the state.
    pub fn shown_by(&self, c: &Channel) -> Vector {
        let direction_rad = match c.kind {
            ChannelKind::Current { direction_rad } => direction_rad,
            ChannelKind::Speed => return Vector::from([0.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
            _ => return Vector::zeros(),
        };
        let (s, cos) = direction_rad.sin_cos();
        let [a, b] = self.current;
        Vector::from([a * cos, a * s, -b * cos, -b * s, 0.0, 0.0])
    }

    /// Variance of the current under white noise of the voltage with standard deviation `volts` at every row, A²: a walk that is forgotten with the
    /// leakage time constant.
    pub fn noise_by(&self, volts: f64, t: f64) -> f64 {
        let [l_r_over_delta, _] = self.current;
        (volts * l_r_over_delta).powi(2) * t / (2.0 * (self.decay[0] + self.decay[3]))
    }

    /// A at this speed.
    fn rates(&self, omega_m: f64) -> [[Complex<f64>; 2]; 2] {
        let [ss, sr, rs, rr] = self.decay.map(|d| Complex::new(-d, 0.0));
        [[ss, sr], [rs, rr + Complex::new(0.0, self.pole_pairs * omega_m)]]
    }

    /// Over a sample at this speed and these fluxes, whose torque moves a `free` shaft.
    pub fn step(&self, omega_m: f64, psi: Fluxes, t: f64, onward: Onward, free: bool) -> Step {
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
        let [psi_s, psi_r] = psi;
        let turned = Complex::new(0.0, self.pole_pairs) * psi_r;
        let speed = [integral[0][1] * turned, integral[1][1] * turned];
        // Im(δψ_s ψ_r* + ψ_s δψ_r*).
        let by = if free { self.shaft[0] * t } else { 0.0 };
        let torque = [-psi_r.im, psi_r.re, psi_s.im, -psi_s.re].map(|x| by * x);
        Step { phi, speed, slope: speed.map(|x| x * (0.5 * t)), volt: [integral[0][0], integral[1][0]], torque, onward }
    }

    /// What the slope beside a speed changes by at each row because that speed bends there, and not as the torque of these fluxes bends it, rad/s².
    pub fn bends(&self, omega_m: &[f64], psi: &[Fluxes], t: f64, push: f64) -> Vec<f64> {
        // From row to row the speed is a straight line, and the torque that of the mean of both.
        let bent = omega_m.windows(3).map(|w| (2.0 * w[1] - w[0] - w[2]) / t);
        bent.zip(self.pushes(psi)).map(|(bent, by)| bent + push * by).collect()
    }

    /// What the torque of these fluxes changes the slope of a speed by at each row, with the inertia of the machine, rad/s².
    pub fn pushes(&self, psi: &[Fluxes]) -> impl Iterator<Item = f64> {
        let of = |[s, r]: Fluxes| self.shaft[0] * (s * r.conj()).im;
        psi.windows(3).map(move |x| 0.5 * (of(x[2]) - of(x[0])))
    }

    /// Over all samples of a run: at what speed and fluxes are halfway, as they turn on by some hundredths of a radian.
    pub fn steps(&self, omega_m: &[f64], psi: &[Fluxes], t: f64, unknown: &Unknown) -> Vec<Step> {
        let step = |k: usize| {
            let later = (k + 1).min(psi.len() - 1);
            let halfway = std::array::from_fn(|n| (psi[k][n] + psi[later][n]) * 0.5);
            self.step(0.5 * (omega_m[k] + omega_m[later]), halfway, t, *unknown.speed.step(k), unknown.shaft_is_free)
        };
        (0..psi.len()).map(step).collect()
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
    /// The state a sample later, errors of the mains that wander so included.
    #[inline]
    pub fn next<const N: usize>(&self, x: &Vector<N>, mains: &[Wander]) -> Vector<N> {
        let [s, r] = [Complex::new(x[0], x[1]), Complex::new(x[2], x[3])];
        let row = |n: usize| self.phi[n][0] * s + self.phi[n][1] * r + self.speed[n] * x[SPEED] + self.slope[n] * x[SLOPE];
        let (mut s, mut r) = (row(0), row(1));
        let f = &self.onward.f;
        let onward = |n: usize| f[(n, 0)] * x[SPEED] + f[(n, 1)] * x[SLOPE];
        let moved: f64 = self.torque.iter().zip(x.iter()).map(|(t, x)| t * x).sum();
        let mut next = Vector::<N>::zeros();
        for (n, z) in mains.iter().enumerate().map(|(n, z)| (MACHINE + 2 * n, z)) {
            let off = Complex::new(x[n], x[n + 1]);
            s += self.volt[0] * off;
            r += self.volt[1] * off;
            let off = z.onward * off;
            (next[n], next[n + 1]) = (off.re, off.im);
        }
        for (n, x) in [s.re, s.im, r.re, r.im, onward(0) + moved, onward(1)].into_iter().enumerate() {
            next[n] = x;
        }
        next
    }

    /// The same as a matrix.
    pub fn matrix<const N: usize>(&self, mains: &[Wander]) -> Matrix<N> {
        let mut f = Matrix::<N>::zeros();
        for c in 0..N {
            let mut unit = Vector::<N>::zeros();
            unit[c] = 1.0;
            f.set_column(c, &self.next(&unit, mains));
        }
        f
    }

    /// The covariance a sample later, with noise of that standard deviation in the voltage, V.
    pub fn carried<const N: usize>(&self, p: &Matrix<N>, volts: f64, mains: &[Wander]) -> Matrix<N> {
        let f = self.matrix(mains);
        let mut p = f * p * f.transpose();
        let mut wandered = p.fixed_view_mut::<2, 2>(SPEED, SPEED);
        wandered += self.onward.q;
        if volts > 0.0 {
            let [s, r] = self.volt.map(|x| x * volts);
            let mut fluxes = p.fixed_view_mut::<4, 4>(0, 0);
            // α, and β a quarter of a turn on.
            for b in [[s.re, s.im, r.re, r.im], [-s.im, s.re, -r.im, r.re]].map(Vector4::from) {
                fluxes += b * b.transpose();
            }
        }
        for (n, z) in mains.iter().enumerate().map(|(n, z)| (MACHINE + 2 * n, z)) {
            p[(n, n)] += z.added_v2;
            p[(n + 1, n + 1)] += z.added_v2;
        }
        (p + p.transpose()) * 0.5
    }
}
