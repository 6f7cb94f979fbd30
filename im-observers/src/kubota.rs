//! The adaptive full-order observer of Kubota, Matsuse and Nakano (Kwon et al., Section III).
//!
//! ```text
//! λ̂' = aλ̂ + ηL_m î + l₁e,   î' = −βaλ̂ − γî + u/σL_s + l₂e,   a = −η + jn_pω̂,   e = i − î
//! ω̂  = K_P ε + K_I ∫ε dt,   ε = n_pβ(e_a λ̂_b − e_b λ̂_a) = −n_pβ λ̂ × e
//! ```
//!
//! The correction is printed L_r(î − i) in the paper's summary; (2) needs L_r(i − î). L is affine in speed, L₀ + ω̂L₁: gain scheduling.
//! As published the loop is unstable when regenerating at low frequency, without feedback for 0 < ω_e/(n_pω) < (R_s/σL_s)/(γ + η);
//! [`KubotaGains::stabilized`] is the gain of `im-design` (`kubota_loop`) that is stable at every speed and load but at ω_e = 0.
//!
//! **Step limits.** [`Discretization::Implicit`] keeps any continuous certificate of (A − LC) at every step (`tustin.rs`). What remains
//! sampled is the proportional path: hK_P(n_pβ|λ|)² < 2. Forward Euler needs |1 + hs| ≤ 1 for the poles s of A − LC at every speed:
//! [`KubotaGains::euler_step_limit_s`]. Construction checks both.

use im_model::space_vector::{cross, norm2};
use im_model::{Bound, Complex, Machine, Rating, Scalar};
use num_traits::Zero;

use crate::basis::{Basis, Discretization, Sample, Watch};
use crate::error::{GAIN_MAX, ObserverError, finite};
use crate::interface::{Estimate, Input, Observer};
use crate::named::{Gains, Named};
use crate::saturation::Electrical;
use crate::tustin::{Flow, warped};

/// Gains as `im-design` gives them (`kubota_loop`; L alone from `kubota`, `sampled`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KubotaGains {
    /// L₀, rows (λ_a, λ_b, i_a, i_b), columns (i_a, i_b): Ω for the fluxes, 1/s for the currents.
    pub gain: [[f64; 2]; 4],
    /// L₁: the gain at the mechanical speed ω (rad/s) is L₀ + ω L₁.
    pub gain_per_speed: [[f64; 2]; 4],
    /// K_P, rad/s per A·Vs/H.
    pub proportional: f64,
    /// K_I, K_P's unit per s.
    pub integral: f64,
    /// Current error |e| at which the feedback is faded to half, L/(1 + |e|²/fade²), A; 0 never fades. The stabilized gain is proven around the
    /// machine; far from it, switched on to a running machine, it has equilibria of its own at ω̂ ≈ 0. Without feedback there are none.
    pub fade_a: f64,
}

impl KubotaGains {
    /// The gains of the speed law for a machine at rated flux: its proportional path alone would close at the frequency `bandwidth`,
    /// K_P(n_pβλ_N)² = bandwidth (rad/s), and K_I = K_P·bandwidth/4.
    pub fn speed_law(machine: &Machine<f64>, rating: &Rating, bandwidth: f64) -> (f64, f64) {
        let c = machine.parameters().windings().derived(machine.pole_pairs());
        let lever = c.n_p * c.beta * rating.rotor_flux_vs;
        let proportional = bandwidth / (lever * lever);
        (proportional, proportional * bandwidth * 0.25)
    }

    /// No feedback: the model with the speed law alone.
    pub fn without_feedback(proportional: f64, integral: f64) -> Self {
        Self { gain: [[0.0; 2]; 4], gain_per_speed: [[0.0; 2]; 4], proportional, integral, fade_a: 0.0 }
    }

    /// Stable at every speed and every load, for any K_P, K_I > 0, while ω_e ≠ 0:
    /// l₁ = (−R_s/σL_s − l₂ + (η + jn_pω)/ρ)/β, l₂ = 0 (`im_design::kubota_loop::stabilized`). Smaller ρ is faster and noisier.
    ///
    /// # Errors
    /// ρ that is not positive and finite.
    pub fn stabilized(machine: &Machine<f64>, rho: f64, proportional: f64, integral: f64) -> Result<Self, ObserverError> {
        Bound::Positive.check("rho", rho)?;
        let p = machine.parameters();
        let c = p.windings().derived(machine.pole_pairs());
        let l1 = (c.eta / rho - p.stator_resistance_ohm / c.sigma_l_s) / c.beta;
        let slope = c.n_p / (rho * c.beta);
        let o = [0.0; 2];
        Ok(Self {
            gain: [[l1, 0.0], [0.0, l1], o, o],
            gain_per_speed: [[0.0, -slope], [slope, 0.0], o, o],
            proportional,
            integral,
            fade_a: 0.0,
        })
    }

    /// What to start from for a machine: the stabilized gain with ρ = 0.3 and a speed law of 400 rad/s, faded from a current
    /// error of 10 % of the locked-rotor current on.
    ///
    /// # Errors
    /// None for a valid machine and rating.
    pub fn for_machine(machine: &Machine<f64>, rating: &Rating) -> Result<Self, ObserverError> {
        let (proportional, integral) = Self::speed_law(machine, rating, 400.0);
        let c = machine.parameters().windings().derived(machine.pole_pairs());
        let omega_e = 2.0 * core::f64::consts::PI * rating.electrical_frequency_hz;
        let fade_a = 0.1 * rating.phase_voltage_peak_v / (omega_e * c.sigma_l_s);
        Ok(Self { fade_a, ..Self::stabilized(machine, 0.3, proportional, integral)? })
    }

    /// The longest step at which forward Euler is stable with this gain for all speeds up to a mechanical one, s:
    /// the least −2Re(s)/|s|² of the poles. Zero or less when the continuous observer is unstable.
    pub fn euler_step_limit_s(&self, machine: &Machine<f64>, speed_max_rad_s: f64) -> f64 {
        let c = Electrical::new(machine.parameters(), machine.pole_pairs());
        let n_p = f64::from(machine.pole_pairs());
        self.euler_limit(&c, n_p, speed_max_rad_s)
    }

    fn euler_limit(&self, c: &Electrical<f64>, n_p: f64, speed_max: f64) -> f64 {
        let [g, s] = [&self.gain, &self.gain_per_speed].map(|g| on_fluxes(g, c.beta));
        let mut limit = f64::INFINITY;
        for k in -20..=20 {
            let omega = speed_max * f64::from(k) / 20.0;
            let m = flow(c, n_p * omega, [0, 1].map(|k| g[k] + s[k] * omega));
            // On (λ̂, î): [a, c; −βa, −(g + βc)].
            let mean = (m.a - m.g - m.c * m.beta) * 0.5;
            let root = square_root(mean * mean + m.a * m.g);
            for pole in [mean + root, mean - root] {
                limit = limit.min(-2.0 * pole.re / pole.norm_sqr());
            }
        }
        limit
    }

    fn validate(&self) -> Result<(), ObserverError> {
        finite("gain", &self.gain)?;
        finite("gain_per_speed", &self.gain_per_speed)?;
        invariant("gain", &self.gain)?;
        invariant("gain_per_speed", &self.gain_per_speed)?;
        Bound::Within(0.0, GAIN_MAX).check("proportional", self.proportional)?;
        Bound::Within(0.0, GAIN_MAX).check("fade_a", self.fade_a)?;
        Ok(Bound::Positive.check("integral", self.integral)?)
    }
}

/// A − LC, for a gain on (λ̂, î + βλ̂).
#[inline(always)]
fn flow<T: Scalar>(c: &Electrical<T>, omega_e: T, l: [Complex<T>; 2]) -> Flow<T, Complex<T>> {
    Flow {
        a: Complex::new(-c.eta, omega_e),
        c: Complex::new(c.eta_l_m - l[0].re, -l[0].im),
        g: l[1] + c.stator_rate,
        beta: c.beta,
    }
}

/// The complex form [l₁, l₂] of a gain whose blocks are [x, −y; y, x].
pub(crate) fn structured(g: &[[f64; 2]; 4]) -> [Complex<f64>; 2] {
    [0, 2].map(|k| Complex::new(0.5 * (g[k][0] + g[k + 1][1]), 0.5 * (g[k + 1][0] - g[k][1])))
}

/// A gain's effect on (λ̂, î + βλ̂): [l₁, l₂ + βl₁].
fn on_fluxes(g: &[[f64; 2]; 4], beta: f64) -> [Complex<f64>; 2] {
    let [l1, l2] = structured(g);
    [l1, l2 + l1 * beta]
}

/// Solvers leave a little of the other form; more than this is another kind of gain.
const INVARIANCE: f64 = 1e-3;

fn invariant(name: &'static str, g: &[[f64; 2]; 4]) -> Result<(), ObserverError> {
    for row in [0, 2] {
        let size = g[row].iter().chain(&g[row + 1]).fold(0.0f64, |m, x| m.max(x.abs()));
        let other = (g[row][0] - g[row + 1][1]).abs().max((g[row + 1][0] + g[row][1]).abs());
        if other > INVARIANCE * size {
            return Err(ObserverError::NotRotationInvariant { name, row, deviation: other / size });
        }
    }
    Ok(())
}

fn square_root(z: Complex<f64>) -> Complex<f64> {
    let size = Scalar::sqrt(z.norm_sqr());
    let re = Scalar::sqrt(Scalar::max(0.5 * (size + z.re), 0.0));
    let im = Scalar::sqrt(Scalar::max(0.5 * (size - z.re), 0.0));
    Complex::new(re, if z.im < 0.0 { -im } else { im })
}

/// The observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kubota<T> {
    basis: Basis<T>,
    /// On (λ̂, î + βλ̂), β of the machine without saturation.
    gain: [Complex<T>; 2],
    gain_per_speed: [Complex<T>; 2],
    /// hK_I and K_P + hK_I.
    integral_sample: T,
    proportional_and_sample: T,
    /// 1/fade², 0 for none.
    fade: T,
    discretization: Discretization,
}

/// λ̂, î, ω̂ and the integral of the speed law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KubotaState<T> {
    lambda: Complex<T>,
    i_hat: Complex<T>,
    omega_m: T,
    integral: T,
    watch: Watch<T>,
}

impl<T: Scalar> Default for KubotaState<T> {
    fn default() -> Self {
        let zero = Complex::zero();
        Self { lambda: zero, i_hat: zero, omega_m: T::zero(), integral: T::zero(), watch: Watch::default() }
    }
}

impl<T: Scalar> Kubota<T> {
    /// With [`Discretization::Implicit`].
    ///
    /// # Errors
    /// Gains that are not finite or not rotation-invariant, or a sampling time beyond the step limits.
    pub fn try_new(basis: Basis<T>, gains: KubotaGains) -> Result<Self, ObserverError> {
        Self::discretized(basis, gains, Discretization::Implicit)
    }

    /// With a chosen discretization.
    ///
    /// # Errors
    /// As [`try_new`](Self::try_new).
    pub fn discretized(basis: Basis<T>, gains: KubotaGains, discretization: Discretization) -> Result<Self, ObserverError> {
        gains.validate()?;
        let h = basis.sample_time_s.value();
        let c = basis.nominal.cast::<f64>();
        let lever = basis.n_p.value() * c.beta * basis.limits.flux_max_vs.value();
        let limit_s = 2.0 / (gains.proportional * lever * lever);
        if h >= limit_s {
            let (what, remedy) =
                ("the proportional path of the speed law at the largest flux", "lower proportional or flux_max_vs");
            return Err(ObserverError::StepTooLong { what, sample_time_s: h, limit_s, remedy });
        }
        if discretization == Discretization::ForwardEuler {
            let limit_s = gains.euler_limit(&c, basis.n_p.value(), basis.limits.speed_max_rad_s.value());
            if h > limit_s {
                let (what, remedy) = ("forward Euler with this gain", "take Discretization::Implicit, or a smaller gain");
                return Err(ObserverError::StepTooLong { what, sample_time_s: h, limit_s, remedy });
            }
        }
        let cast = |g| on_fluxes(g, c.beta).map(|z| Complex::new(T::from_f64(z.re), T::from_f64(z.im)));
        Ok(Self {
            basis,
            gain: cast(&gains.gain),
            gain_per_speed: cast(&gains.gain_per_speed),
            integral_sample: T::from_f64(h * gains.integral),
            proportional_and_sample: T::from_f64(gains.proportional + h * gains.integral),
            fade: T::from_f64(if gains.fade_a > 0.0 { 1.0 / (gains.fade_a * gains.fade_a) } else { 0.0 }),
            discretization,
        })
    }
}

impl<T: Scalar> Observer<T> for Kubota<T> {
    type State = KubotaState<T>;

    fn state_at(&self, rotor_flux_vs: Complex<T>, i_s: Complex<T>, omega_m: T) -> KubotaState<T> {
        KubotaState { lambda: rotor_flux_vs, i_hat: i_s, omega_m, integral: omega_m, watch: Watch::from_current(i_s) }
    }

    #[inline]
    fn step(&self, s: &mut KubotaState<T>, input: &Input<T>) -> Estimate<T> {
        let sample = self.basis.admit(&s.watch, input, s.i_hat);
        if sample.measured { self.advanced(s, &sample) } else { self.predicted(s, input) }
    }
}

impl<T: Scalar> Kubota<T> {
    /// A sample that was lost: there is nothing to correct by, e = 0 and L = 0. In a place of its own, so that no other sample asks for it.
    #[cold]
    fn predicted(&self, s: &mut KubotaState<T>, input: &Input<T>) -> Estimate<T> {
        let sample = self.basis.admit(&s.watch, input, s.i_hat);
        self.advanced(s, &sample)
    }

    #[inline(always)]
    fn advanced(&self, s: &mut KubotaState<T>, sample: &Sample<T>) -> Estimate<T> {
        let b = &self.basis;
        let c = b.electrical(s.lambda, sample.i_mean);
        let (h, w) = (b.sample_time_s, b.n_p * s.omega_m);
        // L, and the rates (λ̂', (î + βλ̂)').
        let rates = |e: Complex<T>| {
            let share = if sample.measured { T::one() / (T::one() + norm2(e) * self.fade) } else { T::zero() };
            // By constant places: a loop over them can panic where it is not unrolled.
            let ([g_a, g_b], [v_a, v_b]) = (self.gain, self.gain_per_speed);
            let l = [g_a + v_a.scale(s.omega_m), g_b + v_b.scale(s.omega_m)].map(|l| l.scale(share));
            let d_lambda = Complex::new(-c.eta, w) * s.lambda + s.i_hat.scale(c.eta_l_m) + l[0] * e;
            let d_psi = sample.u_s.scale(c.inverse_sigma_l_s) - s.i_hat.scale(c.stator_rate) + l[1] * e;
            (l, [d_lambda, d_psi])
        };
        [s.lambda, s.i_hat] = match self.discretization {
            Discretization::Implicit => {
                let (l, rates) = rates(sample.i_mean - s.i_hat);
                flow(&c, w, l).step([s.lambda, s.i_hat], rates, warped(h, w))
            }
            Discretization::ForwardEuler => {
                let (_, [d_lambda, d_psi]) = rates(sample.i_before - s.i_hat);
                [s.lambda + d_lambda.scale(h), s.i_hat + (d_psi - d_lambda.scale(c.beta)).scale(h)]
            }
        };
        let epsilon = if sample.measured { cross(sample.i_s - s.i_hat, s.lambda) * (b.n_p * c.beta) } else { T::zero() };
        s.omega_m = s.integral + self.proportional_and_sample * epsilon;
        s.integral = b.within_speeds(s.integral + self.integral_sample * epsilon);
        let (estimate, finite) = b.conclude(&mut s.watch, sample, &c, &mut s.lambda, &mut s.i_hat, &mut s.omega_m);
        if !finite {
            *s = KubotaState::default();
        }
        estimate
    }
}

impl<T: Scalar> Named<T> for Kubota<T> {
    const NAME: &'static str = "kubota";
    const TITLE: &'static str = "Kubota";
    const TABLES: &'static [&'static str] = &["kubota_loop", "kubota", "sampled", "sampled_kubota_loop"];
    const BESIDE_THE_PROOF: &'static str = "the proof, of flux and current at a known speed, is without the speed law";

    fn made<G: Gains>(basis: Basis<T>, machine: &Machine<f64>, rating: &Rating, gains: &G) -> Result<Self, G::Error> {
        let usual = KubotaGains::for_machine(machine, rating)?;
        let given = match gains.table() {
            None => usual,
            Some(_) => KubotaGains {
                gain: gains.rows("gain")?,
                gain_per_speed: gains.rows("gain_per_speed")?,
                // A table of the observer's gain alone leaves the speed law to the machine.
                proportional: gains.number_or("proportional", usual.proportional)?,
                integral: gains.number_or("integral", usual.integral)?,
                fade_a: gains.number_or("fade_a", 0.0)?,
            },
        };
        Ok(Self::discretized(basis, given, gains.discretization())?)
    }
}
