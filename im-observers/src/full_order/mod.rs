//! Full-order flux observer with complete stability and on-line stator resistance, after Harnefors and Hinkkanen.
//!
//! ```text
//! ψ̂_s' = u − R̂_s i + g_s e,   ψ̂_R' = R_R i + aψ̂_R + g_r e,   e = i − î,   a = −α + jn_pω̂,   α = 1/T_r   (inverse-Γ form)
//! g_s = −L_σ λ b/a,   g_r = g_s − L_σ(λ + jn_pω̂),   b = b₀ + b₁|ω̂_s|
//! n_pω̂' = −ω_n² L_σ (ψ̂_R × e)/|ψ̂_R|²
//! ```
//!
//! **Stability.** A speed error ω̃ drives the rotor row by jω̃ψ̂_R. With these gains the current error that it causes is
//!
//! ```text
//! e = −(1/L_σ) G(s) jω̃ψ̂_R,   G(s) = s/(s² + (λ + α)s + λb),   Re 1/G(jν) = λ + α > 0 for every ν
//! ```
//!
//! in the frame at rest: real, the same at every speed, load and frequency, strictly positive real but at ν = 0. The speed law is an integrator from
//! e_q to ω̂, passive, and a passive loop around G is stable for every ω_n, b, λ > 0, motoring and regenerating, while ω_s ≠ 0. Without the
//! speed law it is a contraction: with z = −a(e + ψ̃_R/L_σ), (λb|e|² + |z|²)' = −2λb(λ + α)|e|². As λ and ω_n grow, what is left is the observer of reduced
//! order with the characteristic polynomial s² + bs + ω_s² (Hinkkanen, Harnefors, Luomi 2010).
//!
//! **Stator resistance.** In the steady state an error R̃_s shows as e_d = −2αR̃_s i_q/(L_σ(λ + α)ω_s): solved for R̃_s and integrated slowly, at
//! k ω_s²/(ω_s² + 8bk), an eighth of the slowest rate of the flux or less. Without torque nothing is seen of it and nothing is changed.
//!
//! **Sampled.** The machine goes through a sample, its voltage held, by its own matrix exponential (`Flow::exact` of `tustin.rs`); the mean of the current errors at both
//! ends of that way is fed back by the trapezoidal rule for the observer's flow M:
//!
//! ```text
//! x̂_p = e^{hA} x̂ + ∫e^{A(h − t)} B u dt,   x̂⁺ = x̂_p + (1 − hM/2)⁻¹ h L (e + e_p)/2,   M = A − LC
//! ```
//!
//! So a machine that obeys the model has no error in any sample, whatever the share of a turn that it takes, and with the trapezoidal rule for A too the error would be
//! contracted as the rule does it. Only the speed law is explicit: hω_n² < λ + α. Construction checks it.
//!
//! Sources: L. Harnefors, M. Hinkkanen, "Complete stability of reduced-order and full-order observers for sensorless IM drives", IEEE Trans. Ind.
//! Electron. 55 (2008); M. Hinkkanen, L. Harnefors, J. Luomi, "Reduced-order flux observers with stator-resistance adaptation for
//! speed-sensorless induction motor drives", IEEE Trans. Power Electron. 25 (2010). The gains g_s, g_r in this form: derived here.

use im_model::space_vector::{cross, dot, norm2};
use im_model::{Bound, Complex, Machine, Rating, Scalar};
use num_traits::Zero;

use crate::basis::{Basis, Watch};
use crate::error::{GAIN_MAX, ObserverError};
use crate::interface::{Estimate, Input, Observer};
use crate::named::{Gains, Named};
use crate::saturation::Electrical;
use crate::tustin::Flow;

/// R̂_s stays between these multiples of the R_s it began with: copper from −100 °C to 270 °C.
const STATOR_RANGE: [f64; 2] = [0.5, 2.0];

/// Rates of the observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullOrderGains {
    /// λ: bandwidth of the current error, 1/s.
    pub current_bandwidth_rad_s: f64,
    /// ω_n: the speed error obeys s² + (λ + α)s + ω_n² = 0 where λ is fast, rad/s.
    pub speed_bandwidth_rad_s: f64,
    /// b₀, 1/s.
    pub flux_damping_per_s: f64,
    /// b₁: the flux error obeys s² + bs + ω_s² = 0, its damping ratio is b₁/2 where ω_s is large.
    pub flux_damping_per_frequency: f64,
    /// k: how fast R̂_s follows, 1/s; 0 keeps the machine's R_s.
    pub stator_resistance_per_s: f64,
    /// Stator frequency above which R̂_s is left as it is, rad/s: there it no longer matters and other errors would be taken for it.
    pub stator_resistance_frequency_rad_s: f64,
    /// Torque-producing current below which R̂_s is left as it is, A.
    pub stator_resistance_current_a: f64,
}

impl FullOrderGains {
    /// What to start from for a machine: λ = 400 1/s, ω_n = λ/2, b = α/2 + 0.4|ω_s|; R̂_s at 2 1/s, up to the frequency at which R_s takes half of the emf,
    /// from a fifth of the rated torque on.
    pub fn for_machine(machine: &Machine<f64>, rating: &Rating) -> Self {
        let p = machine.parameters();
        let c = p.windings().derived(machine.pole_pairs());
        let current = rating.current_peak_a(p, machine.pole_pairs());
        // ψ_R = λL_m/L_r.
        let flux = rating.rotor_flux_vs * c.beta * c.sigma_l_s;
        let torque_current = rating.torque_nm / (1.5 * c.n_p * flux);
        Self {
            current_bandwidth_rad_s: 400.0,
            speed_bandwidth_rad_s: 200.0,
            flux_damping_per_s: 0.5 * c.eta,
            flux_damping_per_frequency: 0.4,
            stator_resistance_per_s: 2.0,
            stator_resistance_frequency_rad_s: 2.0 * p.stator_resistance_ohm * current / flux,
            stator_resistance_current_a: 0.2 * torque_current,
        }
    }

    fn validate(&self) -> Result<(), ObserverError> {
        let most = Bound::Within(f64::from(f32::MIN_POSITIVE), GAIN_MAX);
        most.check("current_bandwidth_rad_s", self.current_bandwidth_rad_s)?;
        most.check("speed_bandwidth_rad_s", self.speed_bandwidth_rad_s)?;
        most.check("flux_damping_per_s", self.flux_damping_per_s)?;
        Bound::Within(0.0, GAIN_MAX).check("flux_damping_per_frequency", self.flux_damping_per_frequency)?;
        Bound::Within(0.0, GAIN_MAX).check("stator_resistance_per_s", self.stator_resistance_per_s)?;
        most.check("stator_resistance_frequency_rad_s", self.stator_resistance_frequency_rad_s)?;
        Ok(Bound::OfMachines(1e-9, 1e9).check("stator_resistance_current_a", self.stator_resistance_current_a)?)
    }
}

/// The observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullOrder<T> {
    basis: Basis<T>,
    /// λ, b₀, b₁.
    bandwidth: T,
    damping: T,
    damping_per_frequency: T,
    /// hω_n².
    speed_sample: T,
    /// The adaptation of R̂_s, where it is on.
    stator: Option<StatorLaw<T>>,
}

/// How R̂_s follows.
#[derive(Clone, Copy, Debug, PartialEq)]
struct StatorLaw<T> {
    rate: T,
    inverse_frequency2: T,
    current2: T,
}

/// λ̂, î, ω̂ and R̂_s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullOrderState<T> {
    lambda: Complex<T>,
    i_hat: Complex<T>,
    omega_m: T,
    /// R̂_s/R_s.
    stator: T,
    watch: Watch<T>,
}

impl<T: Scalar> FullOrderState<T> {
    /// R̂_s over the machine's R_s.
    pub fn stator_resistance_ratio(&self) -> T {
        self.stator
    }
}

impl<T: Scalar> Default for FullOrderState<T> {
    fn default() -> Self {
        let zero = Complex::zero();
        Self { lambda: zero, i_hat: zero, omega_m: T::zero(), stator: T::one(), watch: Watch::default() }
    }
}

fn within<T: Scalar>(x: T, [low, high]: [f64; 2]) -> T {
    x.max(T::from_f64(low)).min(T::from_f64(high))
}

impl<T: Scalar> FullOrder<T> {
    /// The observer of a machine.
    ///
    /// # Errors
    /// A gain out of bounds, or a sampling time beyond the step limit of the speed law.
    pub fn try_new(basis: Basis<T>, gains: FullOrderGains) -> Result<Self, ObserverError> {
        gains.validate()?;
        let h = basis.sample_time_s.value();
        let omega2 = gains.speed_bandwidth_rad_s * gains.speed_bandwidth_rad_s;
        let limit_s = (gains.current_bandwidth_rad_s + basis.nominal.eta.value()) / omega2;
        if h >= limit_s {
            let (what, remedy) = ("the speed law", "lower speed_bandwidth_rad_s or raise current_bandwidth_rad_s");
            return Err(ObserverError::StepTooLong { what, sample_time_s: h, limit_s, remedy });
        }
        let f = T::from_f64;
        let square = |x: f64| x * x;
        Ok(Self {
            basis,
            bandwidth: f(gains.current_bandwidth_rad_s),
            damping: f(gains.flux_damping_per_s),
            damping_per_frequency: f(gains.flux_damping_per_frequency),
            speed_sample: f(h * omega2),
            stator: (gains.stator_resistance_per_s > 0.0).then(|| StatorLaw {
                rate: f(gains.stator_resistance_per_s),
                inverse_frequency2: f(1.0 / square(gains.stator_resistance_frequency_rad_s)),
                current2: f(square(gains.stator_resistance_current_a)),
            }),
        })
    }

    /// What the current error says of speed and stator resistance.
    #[inline(always)]
    fn adapt(&self, s: &mut FullOrderState<T>, c: &Electrical<T>, i_s: Complex<T>, e: Complex<T>, omega_s: T, b: T) {
        let basis = &self.basis;
        let top = basis.limits.speed_max_rad_s;
        // Below its limit the flux counts as if it were there: the law grows slow, not wild.
        let flux2 = norm2(s.lambda).max(basis.squares.flux_min);
        let inverse = T::one() / flux2;
        let omega_m = s.omega_m - self.speed_sample / (basis.n_p * c.beta) * cross(s.lambda, e) * inverse;
        s.omega_m = omega_m.min(top).max(-top);
        if let Some(law) = &self.stator {
            let (along, torque) = (dot(s.lambda, e), cross(s.lambda, i_s));
            let omega2 = omega_s * omega_s;
            let high = omega2 * law.inverse_frequency2;
            let rate =
                law.rate * omega2 / ((omega2 + b * law.rate * T::from_f64(8.0)) * (T::one() + high * high) + T::from_f64(1e-6));
            let seen = along * torque / (torque * torque + law.current2 * flux2);
            let lacking = -omega_s * (self.bandwidth + c.eta) * seen / (c.eta * c.stator_rate) * T::from_f64(0.5);
            // More than a quarter is not believed at once: in a transient the steady state says little.
            let change = basis.sample_time_s * rate * within(lacking, [-0.25, 0.25]);
            s.stator = within(s.stator + change, STATOR_RANGE);
        }
    }
}

impl<T: Scalar> Observer<T> for FullOrder<T> {
    type State = FullOrderState<T>;

    fn state_at(&self, rotor_flux_vs: Complex<T>, i_s: Complex<T>, omega_m: T) -> FullOrderState<T> {
        FullOrderState { lambda: rotor_flux_vs, i_hat: i_s, omega_m, stator: T::one(), watch: Watch::from_current(i_s) }
    }

    fn state_after(&self, before: &FullOrderState<T>, lambda: Complex<T>, i_s: Complex<T>, omega_m: T) -> FullOrderState<T> {
        FullOrderState { stator: before.stator, ..self.state_at(lambda, i_s, omega_m) }
    }

    fn stator_resistance_ratio(&self, state: &FullOrderState<T>) -> T {
        state.stator
    }

    fn flux_follows_voltage(&self) -> bool {
        true
    }

    #[inline]
    fn step(&self, s: &mut FullOrderState<T>, input: &Input<T>) -> Estimate<T> {
        let basis = &self.basis;
        let sample = basis.admit(&s.watch, input, s.i_hat);
        let c = basis.electrical(s.lambda, sample.i_mean);
        let (h, w) = (basis.sample_time_s, basis.n_p * s.omega_m);
        let a = Complex::new(-c.eta, w);
        let stator_rate = c.stator_rate * s.stator;
        // The field turns with the rotor and the slip.
        let flux2 = norm2(s.lambda).max(basis.squares.flux_min);
        let omega_s = w + c.eta_l_m * cross(s.lambda, sample.i_mean) / flux2;
        let b = self.damping + self.damping_per_frequency * omega_s.abs();
        let drive = sample.u_s.scale(c.inverse_sigma_l_s);
        // The machine's own way through the sample.
        let (x, i_before) = ([s.lambda, s.i_hat], s.i_hat);
        let d_lambda = a * s.lambda + s.i_hat.scale(c.eta_l_m);
        let d_psi = drive - s.i_hat.scale(stator_rate);
        let machine = Flow { a, c: c.eta_l_m, g: stator_rate, beta: c.beta };
        [s.lambda, s.i_hat] = machine.exact(x, [d_lambda, d_psi], h);
        if sample.measured {
            // What the current was off by on that way.
            let e = sample.i_mean - (i_before + s.i_hat).scale(T::from_f64(0.5));
            // g_s/L_σ, and −g_r referred as λ is.
            let g = a.conj().scale(-self.bandwidth * b / norm2(a));
            let c_r = (Complex::new(self.bandwidth, w) - g).scale(T::one() / c.beta);
            let (to_lambda, to_psi) = ((-c_r + c.eta_l_m) * e, (g - stator_rate) * e);
            [s.lambda, s.i_hat] = Flow { a, c: c_r, g, beta: c.beta }.step([s.lambda, s.i_hat], [to_lambda, to_psi], h);
        }
        if sample.trusted() {
            let e = sample.i_s - s.i_hat;
            self.adapt(s, &c, sample.i_s, e, omega_s, b);
        }
        let known = s.stator;
        let (estimate, finite) = basis.conclude(&mut s.watch, &sample, &c, &mut s.lambda, &mut s.i_hat, &mut s.omega_m);
        if !finite {
            *s = FullOrderState { stator: within(known, STATOR_RANGE), ..FullOrderState::default() };
        }
        estimate
    }
}

impl<T: Scalar> Named<T> for FullOrder<T> {
    const NAME: &'static str = "full-order";
    const TITLE: &'static str = "full-order";
    const TABLES: &'static [&'static str] = &["full_order"];

    fn made<G: Gains>(basis: Basis<T>, machine: &Machine<f64>, rating: &Rating, gains: &G) -> Result<Self, G::Error> {
        let usual = FullOrderGains::for_machine(machine, rating);
        let or = |key, usual| gains.number_or(key, usual);
        let given = FullOrderGains {
            current_bandwidth_rad_s: or("current_bandwidth_rad_s", usual.current_bandwidth_rad_s)?,
            speed_bandwidth_rad_s: or("speed_bandwidth_rad_s", usual.speed_bandwidth_rad_s)?,
            flux_damping_per_s: or("flux_damping_per_s", usual.flux_damping_per_s)?,
            flux_damping_per_frequency: or("flux_damping_per_frequency", usual.flux_damping_per_frequency)?,
            stator_resistance_per_s: or("stator_resistance_per_s", usual.stator_resistance_per_s)?,
            stator_resistance_frequency_rad_s: or("stator_resistance_frequency_rad_s", usual.stator_resistance_frequency_rad_s)?,
            stator_resistance_current_a: or("stator_resistance_current_a", usual.stator_resistance_current_a)?,
        };
        Ok(Self::try_new(basis, given)?)
    }
}

#[cfg(test)]
mod tests;
