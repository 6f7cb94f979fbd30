//! Time-varying adaptation, (42)–(47): on the current error, with filters that carry what the errors of R_req and L do to the flux.
//!
//! ```text
//! χ₁' = −(T̂⁻¹ + jω_g)χ₁ − (R̂ i_ref − T̂⁻¹φ_ref),   χ₂' = −(T̂⁻¹ + jω_g)χ₂ − T̂⁻¹φ_ref                    (42)
//! W = −[(T̂⁻¹ − jω_r)χ₁ + R̂ i_ref − T̂⁻¹φ_ref,  (T̂⁻¹ − jω_r)χ₂ + T̂⁻¹φ_ref,  R̂_s i_ref,  L̂_f(jω_s i_ref + i_ref')]  (46)
//! dθ̂ᵢ/dt = θ̂ᵢ K_W Re(W̄ᵢ Δi) [L̂_f],   K_W constant or (36π)²/‖W‖²                                       (47)
//! ```
//!
//! With L_f, as (47) is printed, (36π)²/‖W‖² has the unit of a K_W and is a natural frequency of 36π rad/s; without it (49) is the rate of (48)
//! ([`TimeVaryingGain`] has both, and the constant K_W that Theorem 2 is about). (46) as printed leaves out i_ref', which (28) has and which costs nothing.
//!
//! **Theorem 2 as printed does not hold with the integral action (25).** Δi = 0 for ever asks for Wᵀθ = K_Pη, and η is then constant: any
//! θ with (W(t) − W(0))ᵀθ = 0 stays, η taking the rest. What must be persistently exciting is W *together with a constant*: two operating
//! points are not enough (`theorem_2_needs_an_integral_action_that_forgets`, `tests/online/jadot.rs`; the proof's own system: claim 59 of
//! `im-verify`). Two ways out keep the paper's
//! Lyapunov function: no integral action, or one that forgets, η' = K_IΔi − ρη, which adds −λ(K_Pρ/K_I)|η|² to V̇, puts η among the signals
//! that vanish, and leaves W alone to be exciting. ρ is asked of the host only while adapting, so that regulation keeps its integral action
//! where estimates are held.

use super::super::{Estimate, Identifier};
use super::parameters::RegulationParameters;
use super::scheme::{Adaptation, Adapted, Scheme, SchemeSettings, Tracking};
use im_model::space_vector::{dot, j};
use im_model::{Bound, Complex, ModelError, Scalar};

/// K_W of (47), the weights of the parameters apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeVaryingGain<T> {
    /// Constant, as in Theorem 2; (47) without L_f, which is part of the constant. 1/(V A s).
    Constant {
        /// The gain.
        per_v_a_s: T,
    },
    /// f²/‖W‖² of Section V-C with (47) as printed: f is a natural frequency, rad/s.
    Normalized {
        /// f.
        frequency_rad_s: T,
    },
    /// f²/‖W‖² with (47) without L_f: f² is a rate in Ω/s.
    NormalizedWithoutLeakage {
        /// f² of the paper, Ω/s.
        rate_ohm_per_s: T,
    },
}

impl<T: Scalar> TimeVaryingGain<T> {
    fn validate(&self) -> Result<(), ModelError> {
        match *self {
            Self::Constant { per_v_a_s } => Bound::Positive.check("per_v_a_s", per_v_a_s.value()),
            Self::Normalized { frequency_rad_s } => Bound::Positive.check("frequency_rad_s", frequency_rad_s.value()),
            Self::NormalizedWithoutLeakage { rate_ohm_per_s } => Bound::Positive.check("rate_ohm_per_s", rate_ohm_per_s.value()),
        }
    }

    /// The factor of Re(W̄Δi), for 1/‖W‖² and L̂_f.
    #[inline]
    fn at(&self, inverse: T, leakage_h: T) -> T {
        match *self {
            Self::Constant { per_v_a_s } => per_v_a_s,
            Self::Normalized { frequency_rad_s: f } => f * f * leakage_h * inverse,
            Self::NormalizedWithoutLeakage { rate_ohm_per_s } => rate_ohm_per_s * inverse,
        }
    }
}

/// The scheme with its gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeVarying<T> {
    scheme: Scheme<T>,
    gain: TimeVaryingGain<T>,
    leak: T,
}

/// What [`TimeVarying`] remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeVaryingState<T> {
    adapted: Adapted<T>,
    chi: [Complex<T>; 2],
    injection: Complex<T>,
}

impl<T: Scalar> TimeVarying<T> {
    /// The paper's f, rad/s.
    pub const PAPER_FREQUENCY: f64 = 36.0 * core::f64::consts::PI;

    /// The gain is f²/‖W‖² with f = `frequency_rad_s` and (47) as printed; ρ = `integral_leak_per_s`, zero for the paper's integral action.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn try_new(settings: &SchemeSettings<T>, frequency_rad_s: T, integral_leak_per_s: T) -> Result<Self, ModelError> {
        Self::with_gain(settings, TimeVaryingGain::Normalized { frequency_rad_s }, integral_leak_per_s)
    }

    /// With any of the gains; ρ as in [`Self::try_new`].
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn with_gain(settings: &SchemeSettings<T>, gain: TimeVaryingGain<T>, integral_leak_per_s: T) -> Result<Self, ModelError> {
        gain.validate()?;
        Bound::NotNegative.check("integral_leak_per_s", integral_leak_per_s.value())?;
        Ok(Self { scheme: Scheme::try_new(settings)?, gain, leak: integral_leak_per_s })
    }
}

impl<T: Scalar> Identifier<T, 4> for TimeVarying<T> {
    type State = TimeVaryingState<T>;
    type Input = Tracking<T>;

    fn start(&self) -> TimeVaryingState<T> {
        let zero = Complex::new(T::zero(), T::zero());
        TimeVaryingState { adapted: self.scheme.start(), chi: [zero; 2], injection: zero }
    }

    fn step(&self, x: &mut TimeVaryingState<T>, t: &Tracking<T>) -> Estimate<T, 4> {
        let (zero, one, h) = (T::zero(), T::one(), self.scheme.sample_time);
        let p = self.scheme.parameters(&x.adapted);
        let a = p.inverse_rotor_time_constant();
        let to_stator = Complex::new(a, -t.omega_r);
        let by_l = t.phi_ref * a;
        let by_r = t.i_ref * p.rotor_resistance_ohm - by_l;
        let w = [
            -(to_stator * x.chi[0] + by_r),
            -(to_stator * x.chi[1] + by_l),
            -t.i_ref * p.stator_resistance_ohm,
            -(j(t.i_ref) * t.omega_s() + t.i_ref_rate) * p.leakage_inductance_h,
        ];
        let change = self.scheme.adapt(&mut x.adapted, t, &w, |inverse| {
            let share = self.gain.at(inverse, p.leakage_inductance_h) * h;
            w.map(|w| dot(w, t.delta_i) * share)
        });
        // Δθ' = −θ̂'/θ̂, after projection.
        x.injection = -(x.chi[0] * change[0] + x.chi[1] * change[1]) / h;
        // (42), implicit.
        let slow = Complex::new(one + h * a, h * t.omega_g);
        let keep = slow.conj() / (slow.re * slow.re + slow.im * slow.im);
        for (chi, drive) in x.chi.iter_mut().zip([by_r, by_l]) {
            let next = (*chi - drive * h) * keep;
            // Filters of lost samples start anew.
            *chi = if super::super::finite(next) { next } else { Complex::new(zero, zero) };
        }
        self.scheme.estimate(&x.adapted)
    }
}

impl<T: Scalar> Adaptation<T> for TimeVarying<T> {
    fn parameters(&self, state: &TimeVaryingState<T>) -> RegulationParameters<T> {
        self.scheme.parameters(&state.adapted)
    }

    fn flux_injection(&self, state: &TimeVaryingState<T>) -> Complex<T> {
        state.injection
    }

    fn integral_leak_per_s(&self, state: &TimeVaryingState<T>) -> T {
        if self.scheme.estimate(&state.adapted).status.is_frozen() { T::zero() } else { self.leak }
    }
}
