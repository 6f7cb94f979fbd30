//! The extended Kalman filter for flux and speed: the baseline among the observers.
//!
//! ```text
//! λ' = aλ + ηL_m i + w_λ,   i' = −βaλ − γi + (u + w_u)/σL_s,   ω' = w_ω,   a = −η + jn_pω,   y = i + v
//! x⁺ = f(x, u),   P⁺ = FPFᵀ + Q,   K = PHᵀ(HPHᵀ + R)⁻¹,   x = x⁺ + K(y − Hx⁺),   P = (1 − KH)P⁺(1 − KH)ᵀ + KRKᵀ
//! ```
//!
//! f is the trapezoidal rule of `tustin.rs` and F its own derivative, so that a covariance is propagated as the state is. Voltage and
//! rotor are taken as noisy, the speed as a random walk: five states, no mechanics. Both currents are taken in one after the other, which
//! needs no matrix inverse. P is in per unit, as `f32` has no room for amperes beside radians; it is begun anew where it is no longer one
//! or grows beyond what is not known at the beginning.
//!
//! Linearized around its estimate: there is no proof of convergence. Like every observer it does not see the speed at ω_s = 0.
//!
//! Source: Y.-R. Kim, S.-K. Sul, M.-H. Park, "Speed sensorless vector control of induction motor using extended Kalman filter", IEEE
//! Trans. Ind. Appl. 30 (1994). Without its rotor resistance as a sixth state; F of the implicit rule: derived here.

use core::array::from_fn;

use im_model::{Bound, Complex, Machine, Rating, Scalar};
use num_traits::Zero;

use crate::basis::{Basis, Watch};
use crate::error::{GAIN_MAX, ObserverError};
use crate::interface::{Estimate, Input, Observer};
use crate::named::{Gains, Named};
use crate::tustin::{Flow, warped};

/// Standard deviations of what is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KalmanGains {
    /// v: of a measured current, A.
    pub current_noise_a: f64,
    /// w_u: of the voltage over a sample, V.
    pub voltage_noise_v: f64,
    /// w_λ: of the rotor's voltage over a sample, V.
    pub rotor_noise_v: f64,
    /// w_ω: of the speed after a second, rad/s; grows with the root of time.
    pub speed_walk_rad_s: f64,
}

impl KalmanGains {
    /// What to start from for a machine: 1 % of rated current, 2 % of rated voltage, a half per cent of it in the rotor, half
    /// of the synchronous speed in a second.
    pub fn for_machine(machine: &Machine<f64>, rating: &Rating) -> Self {
        Self {
            current_noise_a: 0.01 * rating.current_peak_a(machine.parameters(), machine.pole_pairs()),
            voltage_noise_v: 0.02 * rating.phase_voltage_peak_v,
            rotor_noise_v: 0.005 * rating.phase_voltage_peak_v,
            speed_walk_rad_s: 0.5 * rating.synchronous_speed_rad_s(machine.pole_pairs()),
        }
    }

    fn validate(&self) -> Result<(), ObserverError> {
        let most = Bound::OfMachines(1e-9, GAIN_MAX);
        most.check("current_noise_a", self.current_noise_a)?;
        most.check("voltage_noise_v", self.voltage_noise_v)?;
        Bound::Within(0.0, GAIN_MAX).check("rotor_noise_v", self.rotor_noise_v)?;
        Ok(most.check("speed_walk_rad_s", self.speed_walk_rad_s)?)
    }
}

/// The filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kalman<T> {
    basis: Basis<T>,
    /// Rated rotor flux, stator current and speed: the units of P.
    flux_vs: T,
    current_a: T,
    speed_rad_s: T,
    /// Variances of a sample, per unit; that of i for an inverse σL_s of 1.
    q_flux: T,
    q_voltage: T,
    q_speed: T,
    r: T,
}

/// Symmetric, per unit: of (λ_a, λ_b, i_a, i_b), between them and ω, of ω.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Covariance<T> {
    xx: [[T; 4]; 4],
    xw: [T; 4],
    ww: T,
}

/// λ̂, î, ω̂ and their covariance, none before the first sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KalmanState<T> {
    lambda: Complex<T>,
    i_hat: Complex<T>,
    omega_m: T,
    covariance: Option<Covariance<T>>,
    watch: Watch<T>,
}

impl<T: Scalar> Default for KalmanState<T> {
    fn default() -> Self {
        let zero = Complex::zero();
        Self { lambda: zero, i_hat: zero, omega_m: T::zero(), covariance: None, watch: Watch::default() }
    }
}

/// A standard deviation of the speed of 1 per unit, and of the flux; the current is measured.
const AT_FIRST: [f64; 3] = [1.0, 0.01, 1.0];

impl<T: Scalar> Covariance<T> {
    fn at_first() -> Self {
        let [flux, current, speed] = AT_FIRST.map(T::from_f64);
        let diagonal = [flux, flux, current, current];
        let xx = from_fn(|i| from_fn(|k| if i == k { diagonal[i] } else { T::zero() }));
        Self { xx, xw: [T::zero(); 4], ww: speed }
    }

    /// FPFᵀ + Q with F = [A f; 0 1] and Q diagonal.
    #[inline(always)]
    fn predicted(&self, a: &[[T; 4]; 4], f: &[T; 4], q: [T; 3]) -> Self {
        let times = |m: &[T; 4], x: &[T; 4]| m[0] * x[0] + m[1] * x[1] + m[2] * x[2] + m[3] * x[3];
        // Rows of A P, for P is symmetric.
        let ap: [[T; 4]; 4] = from_fn(|i| from_fn(|k| times(&a[i], &self.xx[k])));
        let aw: [T; 4] = from_fn(|i| times(&a[i], &self.xw));
        let half: [T; 4] = from_fn(|i| aw[i] + f[i] * self.ww * T::from_f64(0.5));
        let noise = [q[0], q[0], q[1], q[1]];
        let mut xx = [[T::zero(); 4]; 4];
        for i in 0..4 {
            for k in 0..=i {
                let p = times(&ap[i], &a[k]) + half[i] * f[k] + f[i] * half[k];
                let p = if i == k { p + noise[i] } else { p };
                (xx[i][k], xx[k][i]) = (p, p);
            }
        }
        Self { xx, xw: from_fn(|i| aw[i] + f[i] * self.ww), ww: self.ww + q[2] }
    }

    /// Takes in a component of the current, 2 or 3, measured with the variance r: the gain.
    #[inline(always)]
    fn corrected<const AXIS: usize>(&mut self, r: T) -> ([T; 4], T) {
        let (column, w) = (self.xx[AXIS], self.xw[AXIS]);
        let inverse = T::one() / (column[AXIS] + r);
        let k = column.map(|p| p * inverse);
        let k_w = w * inverse;
        // (1 − KH)P(1 − KH)ᵀ + KRKᵀ, with the gain that makes it P − K(PHᵀ)ᵀ.
        for (row, k) in self.xx.iter_mut().zip(k) {
            for (p, c) in row.iter_mut().zip(column) {
                *p -= k * c;
            }
        }
        for (p, c) in self.xw.iter_mut().zip(column) {
            *p -= k_w * c;
        }
        self.ww -= k_w * w;
        (k, k_w)
    }

    /// Whether every variance is one, and not beyond what it was before anything was known.
    #[inline(always)]
    fn is_one(&self) -> bool {
        let [flux, current, speed] = AT_FIRST.map(T::from_f64);
        let within = |p: T, most: T| p > T::zero() && p <= most;
        within(self.xx[0][0], flux)
            & within(self.xx[1][1], flux)
            & within(self.xx[2][2], current)
            & within(self.xx[3][3], current)
            & within(self.ww, speed)
    }
}

impl<T: Scalar> Kalman<T> {
    /// The filter of a machine.
    ///
    /// # Errors
    /// A standard deviation or the rating out of bounds.
    pub fn try_new(basis: Basis<T>, machine: &Machine<f64>, rating: &Rating, gains: KalmanGains) -> Result<Self, ObserverError> {
        gains.validate()?;
        rating.validate()?;
        let h = basis.sample_time_s.value();
        let flux = rating.rotor_flux_vs;
        let current = rating.current_peak_a(machine.parameters(), machine.pole_pairs());
        let speed = rating.synchronous_speed_rad_s(machine.pole_pairs());
        let square = |x: f64| T::from_f64(x * x);
        Ok(Self {
            basis,
            flux_vs: T::from_f64(flux),
            current_a: T::from_f64(current),
            speed_rad_s: T::from_f64(speed),
            q_flux: square(h * gains.rotor_noise_v / flux),
            q_voltage: square(h * gains.voltage_noise_v / current),
            q_speed: T::from_f64(h) * square(gains.speed_walk_rad_s / speed),
            r: square(gains.current_noise_a / current),
        })
    }

    /// F over a sample, per unit: of (λ, i), and how they move with ω. `doubled` is λ⁺ + λ.
    #[inline(always)]
    fn derivative(&self, flow: &Flow<T, T>, h: T, doubled: Complex<T>) -> ([[T; 4]; 4], [T; 4]) {
        let (o, zero) = (Complex::new(T::one(), T::zero()), Complex::zero());
        let [ll, il] = flow.step([o, zero], [flow.a, zero], h);
        let [li, ii] = flow.step([zero, o], [Complex::new(flow.c, T::zero()), Complex::new(-flow.g, T::zero())], h);
        let turned = Complex::new(-doubled.im, doubled.re) * (self.basis.n_p * T::from_f64(0.5));
        let [lw, iw] = flow.step([zero; 2], [turned, zero], h);
        let (flux, current) = (self.flux_vs, self.current_a);
        let (li, il) = (li * (current / flux), il * (flux / current));
        let a = [
            [ll.re, -ll.im, li.re, -li.im],
            [ll.im, ll.re, li.im, li.re],
            [il.re, -il.im, ii.re, -ii.im],
            [il.im, il.re, ii.im, ii.re],
        ];
        let (by_flux, by_current) = (self.speed_rad_s / flux, self.speed_rad_s / current);
        (a, [lw.re * by_flux, lw.im * by_flux, iw.re * by_current, iw.im * by_current])
    }
}

impl<T: Scalar> Observer<T> for Kalman<T> {
    type State = KalmanState<T>;

    fn state_at(&self, rotor_flux_vs: Complex<T>, i_s: Complex<T>, omega_m: T) -> KalmanState<T> {
        KalmanState { lambda: rotor_flux_vs, i_hat: i_s, omega_m, covariance: None, watch: Watch::from_current(i_s) }
    }

    #[inline]
    fn step(&self, s: &mut KalmanState<T>, input: &Input<T>) -> Estimate<T> {
        let b = &self.basis;
        let sample = b.admit(&s.watch, input, s.i_hat);
        let c = b.electrical(s.lambda, sample.i_mean);
        let w = b.n_p * s.omega_m;
        let h = warped(b.sample_time_s, w);
        let flow = Flow { a: Complex::new(-c.eta, w), c: c.eta_l_m, g: c.stator_rate, beta: c.beta };
        let before = s.lambda;
        let d_lambda = flow.a * s.lambda + s.i_hat * c.eta_l_m;
        let d_psi = sample.u_s * c.inverse_sigma_l_s - s.i_hat * c.stator_rate;
        [s.lambda, s.i_hat] = flow.step([s.lambda, s.i_hat], [d_lambda, d_psi], h);

        let (a, f) = self.derivative(&flow, h, before + s.lambda);
        let q_current = self.q_voltage * c.inverse_sigma_l_s * c.inverse_sigma_l_s;
        let known = s.covariance.unwrap_or_else(Covariance::at_first);
        let mut p = known.predicted(&a, &f, [self.q_flux, q_current, self.q_speed]);
        if sample.measured {
            let inverse = T::one() / self.current_a;
            let (k, k_w) = p.corrected::<2>(self.r);
            let first = (sample.i_s.re - s.i_hat.re) * inverse;
            self.move_by(s, &k, k_w, first);
            let (k, k_w) = p.corrected::<3>(self.r);
            let second = (sample.i_s.im - s.i_hat.im) * inverse;
            self.move_by(s, &k, k_w, second);
        }
        s.covariance = p.is_one().then_some(p);
        let (estimate, finite) = b.conclude(&mut s.watch, &sample, &c, &mut s.lambda, &mut s.i_hat, &mut s.omega_m);
        if !finite {
            *s = KalmanState::default();
        }
        estimate
    }
}

impl<T: Scalar> Kalman<T> {
    #[inline(always)]
    fn move_by(&self, s: &mut KalmanState<T>, k: &[T; 4], k_w: T, e: T) {
        s.lambda += Complex::new(k[0], k[1]) * (e * self.flux_vs);
        s.i_hat += Complex::new(k[2], k[3]) * (e * self.current_a);
        s.omega_m += k_w * e * self.speed_rad_s;
    }
}

impl<T: Scalar> Named<T> for Kalman<T> {
    const NAME: &'static str = "kalman";
    const TITLE: &'static str = "extended Kalman filter";
    const TABLES: &'static [&'static str] = &["kalman"];

    fn made<G: Gains>(basis: Basis<T>, machine: &Machine<f64>, rating: &Rating, gains: &G) -> Result<Self, G::Error> {
        let usual = KalmanGains::for_machine(machine, rating);
        let or = |key, usual| gains.number_or(key, usual);
        let given = KalmanGains {
            current_noise_a: or("current_noise_a", usual.current_noise_a)?,
            voltage_noise_v: or("voltage_noise_v", usual.voltage_noise_v)?,
            rotor_noise_v: or("rotor_noise_v", usual.rotor_noise_v)?,
            speed_walk_rad_s: or("speed_walk_rad_s", usual.speed_walk_rad_s)?,
        };
        Ok(Self::try_new(basis, machine, rating, given)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::saturation::Electrical;
    use im_model::{Bench, PlantInput, State, machines};
    use proptest::prelude::*;

    fn filter() -> (Machine<f64>, Kalman<f64>) {
        let m = machines::MOTULATOR_2_2_KW;
        let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
        let basis = Basis::try_new(&machine, &m.rating, 1e-4).unwrap();
        let gains = KalmanGains::for_machine(&machine, &m.rating);
        (machine, Kalman::try_new(basis, &machine, &m.rating, gains).unwrap())
    }

    fn constants(machine: &Machine<f64>) -> Electrical<f64> {
        Electrical::new(machine.parameters(), machine.pole_pairs())
    }

    /// x⁺ of x = (λ, i, ω), by the flow alone.
    fn next(machine: &Machine<f64>, x: [f64; 5], h: f64, u: Complex<f64>) -> [f64; 5] {
        let c = constants(machine);
        let a = Complex::new(-c.eta, f64::from(machine.pole_pairs()) * x[4]);
        let (l, i) = (Complex::new(x[0], x[1]), Complex::new(x[2], x[3]));
        let flow = Flow { a, c: c.eta_l_m, g: c.stator_rate, beta: c.beta };
        let rates = [a * l + i * c.eta_l_m, u * c.inverse_sigma_l_s - i * c.stator_rate];
        let [l, i] = flow.step([l, i], rates, h);
        [l.re, l.im, i.re, i.im, x[4]]
    }

    proptest! {
        /// F is the derivative of f: against differences, in the filter's units.
        #[test]
        fn f_is_the_derivative(
            l in prop::array::uniform2(-1.0..1.0f64), i in prop::array::uniform2(-10.0..10.0f64), omega in -300.0..300.0f64,
            u in prop::array::uniform2(-300.0..300.0f64),
        ) {
            let (machine, filter) = filter();
            let (c, h) = (constants(&machine), 1e-4);
            let x = [l[0], l[1], i[0], i[1], omega];
            let u = Complex::new(u[0], u[1]);
            let x1 = next(&machine, x, h, u);
            let flow =
                Flow { a: Complex::new(-c.eta, f64::from(machine.pole_pairs()) * omega), c: c.eta_l_m, g: c.stator_rate, beta: c.beta };
            let (a, f) = filter.derivative(&flow, h, Complex::new(l[0] + x1[0], l[1] + x1[1]));
            let unit = [filter.flux_vs, filter.flux_vs, filter.current_a, filter.current_a, filter.speed_rad_s];
            for k in 0..5 {
                let at = |d: f64| { let mut y = x; y[k] += d * unit[k]; next(&machine, y, h, u) };
                let (up, down) = (at(1e-4), at(-1e-4));
                for r in 0..4 {
                    let seen = (up[r] - down[r]) / (2e-4 * unit[r]);
                    let stated = if k < 4 { a[r][k] } else { f[r] };
                    prop_assert!((seen - stated).abs() < 1e-7, "{r} {k}: {seen} {stated}");
                }
            }
        }

        /// A variance never grows by a measurement and stays one, also after many samples of any machine state.
        #[test]
        fn the_covariance_stays_one(
            l in prop::array::uniform2(-1.0..1.0f64), omega in -300.0..300.0f64, n in 1usize..300,
        ) {
            let (machine, filter) = filter();
            let (c, h) = (constants(&machine), 1e-4);
            let flow =
                Flow { a: Complex::new(-c.eta, f64::from(machine.pole_pairs()) * omega), c: c.eta_l_m, g: c.stator_rate, beta: c.beta };
            let (a, f) = filter.derivative(&flow, h, Complex::new(2.0 * l[0], 2.0 * l[1]));
            let q = [filter.q_flux, filter.q_voltage * c.inverse_sigma_l_s * c.inverse_sigma_l_s, filter.q_speed];
            let mut p = Covariance::at_first();
            for _ in 0..n {
                let predicted = p.predicted(&a, &f, q);
                p = predicted;
                p.corrected::<2>(filter.r);
                p.corrected::<3>(filter.r);
                for k in 0..4 {
                    prop_assert!(p.xx[k][k] > 0.0 && p.xx[k][k] <= predicted.xx[k][k] * (1.0 + 1e-12));
                    for r in 0..4 {
                        prop_assert!((p.xx[k][r] - p.xx[r][k]).abs() < 1e-12);
                        prop_assert!(p.xx[k][r] * p.xx[k][r] <= p.xx[k][k] * p.xx[r][r] * (1.0 + 1e-9));
                    }
                    prop_assert!(p.xw[k] * p.xw[k] <= p.xx[k][k] * p.ww * (1.0 + 1e-9));
                }
                prop_assert!(p.ww > 0.0 && p.ww <= predicted.ww);
            }
        }
    }

    /// Numbers of variance 1 that look random and are the same each time.
    fn white(k: i32) -> f64 {
        let x = (f64::from(k) * 12.9898 + 4.1).sin() * 43_758.545_3;
        3f64.sqrt() * (2.0 * (x - x.floor()) - 1.0)
    }

    /// A loaded machine on the grid, the filter switched on while it runs up, with the noise that it expects: 0.7 % of the speed is left.
    #[test]
    fn it_finds_a_machine_that_runs_up() {
        let (machine, filter) = filter();
        let mut bench = Bench::new(&machine, State::default(), 1e-4);
        let (mut state, mut sum) = (KalmanState::default(), 0.0);
        for k in 0..12_000 {
            let u = im_model::space_vector::unit(0.031_415_9 * f64::from(k)) * 326.6;
            bench.advance(&PlantInput::new(u, 5.0));
            if k < 1000 {
                continue;
            }
            let o = bench.output();
            let noise = Complex::new(white(2 * k), white(2 * k + 1)) * (filter.r.sqrt() * filter.current_a);
            let e = filter.step(&mut state, &Input::new(u, o.i_s + noise));
            if k >= 2000 {
                assert!((e.omega_m - o.omega_m).abs() < 8.0, "{k}: {} {}", e.omega_m, o.omega_m);
            }
            if k >= 8000 {
                assert!(e.status.is_valid(), "{k}: {}", e.status);
                assert!((e.rotor_flux_vs - bench.state().psi_r).norm() < 0.02, "{k}");
                sum += (e.omega_m - o.omega_m).powi(2) / 4000.0;
            }
        }
        assert!(sum.sqrt() < 1.1, "{}", sum.sqrt());
    }
}
