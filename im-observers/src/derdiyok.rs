//! The sliding-mode observer of Derdiyok, Güven, Rehman, Inanc and Xu (Kwon et al., Section IV).
//!
//! ```text
//! î' = βν − γî + u/σL_s,   ν = −ν₀ sign(î − i) per component;   in sliding ν_eq = A_ωλ = (η − jn_pω)λ
//! λ̂' = −ν_eq + ηL_m i,   η̂ = Re(ν_eq λ̂*)/|λ̂|²,   n_pω̂ = −Im(ν_eq λ̂*)/|λ̂|²
//! ```
//!
//! Sliding needs ν₀ > |A_ωλ| (`im_design::sliding`). With βν_eq from (7), −ν_eq + ηL_m i = (L_r/L_m)(u − R_s i − σL_s i'): the flux is the
//! voltage model's, a bare integral. Errors at the start and offsets stay for ever; η̂ is learnt, but nothing pulls λ̂.
//!
//! What practice adds, each by its option:
//! * **boundary layer**: saturation of width φ for the sign. Forward Euler needs φ ≥ hβν₀ (checked); the implicit form needs none.
//! * **implicit sliding** (Acary, Brogliato): ν with s_k = 0 at the *end* of the sample, ν = −sat((î_p − i)/(b + φ/ν₀)), b = ∫βe^{−γt}dt. No
//!   chatter, at any step; ν is then the exact mean of A_ωλ over the sample, plus noise of σ_i√2/(hβ).
//! * **equivalent-control filter**: ν and λ̂ both through one first-order filter. (η − jn_pω)λ = ν holds for the filtered pair at constant
//!   speed: the filter costs no phase.
//! * **anchor**: η is known roughly, and η̂ = η holds only for the right λ̂. With 2k/(η² + n_p²ω̂²)·(η + jn_pω̂)(η̂ − η)λ̂ added, an error d of
//!   the flux obeys, averaged over a turn of the field, d' = −k d: the direction η + jn_pω̂ is what makes the mean real.
//!
//! Filter and anchor act on λ̂, ν_eq and ω̂, none of which is in the equation of î: that the current slides for the ν₀ of a certificate holds
//! with both, as without. That the flux converges is no part of the proof.

use im_model::space_vector::{cross, dot, norm2};
use im_model::{Bound, Complex, Machine, Rating, Scalar};
use num_traits::Zero;

use crate::basis::{Basis, Discretization, Watch};
use crate::error::{GAIN_MAX, ObserverError};
use crate::interface::{Estimate, Input, Observer};
use crate::named::{Gains, Named};
use crate::tustin::step1;

/// Gains as `im-design` gives them (`derdiyok`), with the options of practice; zero switches each off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DerdiyokGains {
    /// ν₀, V.
    pub nu0: f64,
    /// Width φ of the boundary layer, A; 0 is the sign itself.
    pub boundary_layer_a: f64,
    /// Corner of the filter for the equivalent control, rad/s; 0 takes it unfiltered, in practice [`Self::USUAL_FILTER_RAD_S`].
    pub filter_rad_s: f64,
    /// k: how fast the flux is drawn to where the nominal 1/T_r holds, 1/s; 0 is the bare integral as published, in practice
    /// [`Self::USUAL_ANCHOR_PER_S`].
    pub anchor_per_s: f64,
}

impl DerdiyokGains {
    /// The filter to start from, rad/s; where a certificate gives ν₀ alone, this is taken with it.
    pub const USUAL_FILTER_RAD_S: f64 = 200.0;
    /// The anchor to start from, 1/s; taken with a certificate's ν₀ too. Without it any error of R_s stays in the flux.
    pub const USUAL_ANCHOR_PER_S: f64 = 10.0;

    /// As published, with the smallest ν₀ (plus 5 %) for a region: λ_max √(η² + n_p²ω_max²), V.
    pub fn published(machine: &Machine<f64>, flux_max_vs: f64, speed_max_rad_s: f64) -> Self {
        let c = machine.parameters().windings().derived(machine.pole_pairs());
        let w = c.n_p * speed_max_rad_s;
        let nu0 = 1.05 * flux_max_vs * Scalar::sqrt(c.eta * c.eta + w * w);
        Self { nu0, boundary_layer_a: 0.0, filter_rad_s: 0.0, anchor_per_s: 0.0 }
    }

    /// What to start from for a machine: 1.2 times rated flux, twice rated speed, a filter of 200 rad/s, an anchor of 10 1/s.
    pub fn for_machine(machine: &Machine<f64>, rating: &Rating) -> Self {
        let speed = 2.0 * core::f64::consts::PI * rating.electrical_frequency_hz / f64::from(machine.pole_pairs());
        let published = Self::published(machine, 1.2 * rating.rotor_flux_vs, 2.0 * speed);
        Self { filter_rad_s: Self::USUAL_FILTER_RAD_S, anchor_per_s: Self::USUAL_ANCHOR_PER_S, ..published }
    }

    fn validate(&self) -> Result<(), ObserverError> {
        Bound::Within(f64::from(f32::MIN_POSITIVE), GAIN_MAX).check("nu0", self.nu0)?;
        Bound::Within(0.0, GAIN_MAX).check("boundary_layer_a", self.boundary_layer_a)?;
        Bound::Within(0.0, GAIN_MAX).check("filter_rad_s", self.filter_rad_s)?;
        Ok(Bound::Within(0.0, GAIN_MAX).check("anchor_per_s", self.anchor_per_s)?)
    }
}

/// The observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derdiyok<T> {
    basis: Basis<T>,
    nu0: T,
    /// φ/ν₀ or, for Euler, 1/φ with 0 for the sign.
    layer: T,
    /// Share of the new value in a sample of the filter.
    filter: T,
    anchor: T,
    discretization: Discretization,
}

/// î, λ̂, the filtered pair, and what they say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DerdiyokState<T> {
    lambda: Complex<T>,
    i_hat: Complex<T>,
    nu_filtered: Complex<T>,
    lambda_filtered: Complex<T>,
    omega_m: T,
    eta: T,
    watch: Watch<T>,
}

impl<T: Scalar> DerdiyokState<T> {
    /// The estimate of 1/T_r = η, 1/s.
    pub fn inverse_rotor_time_constant_per_s(&self) -> T {
        self.eta
    }
}

impl<T: Scalar> Default for DerdiyokState<T> {
    fn default() -> Self {
        let zero = Complex::zero();
        Self {
            lambda: zero,
            i_hat: zero,
            nu_filtered: zero,
            lambda_filtered: zero,
            omega_m: T::zero(),
            eta: T::zero(),
            watch: Watch::default(),
        }
    }
}

impl<T: Scalar> Derdiyok<T> {
    /// With [`Discretization::Implicit`].
    ///
    /// # Errors
    /// A gain out of bounds.
    pub fn try_new(basis: Basis<T>, gains: DerdiyokGains) -> Result<Self, ObserverError> {
        Self::discretized(basis, gains, Discretization::Implicit)
    }

    /// With a chosen discretization.
    ///
    /// # Errors
    /// A gain out of bounds, or a boundary layer too narrow for forward Euler.
    pub fn discretized(basis: Basis<T>, gains: DerdiyokGains, discretization: Discretization) -> Result<Self, ObserverError> {
        gains.validate()?;
        let h = basis.sample_time_s.value();
        let slope = basis.nominal.beta.value() * gains.nu0;
        let layer = match discretization {
            Discretization::Implicit => gains.boundary_layer_a / gains.nu0,
            Discretization::ForwardEuler if gains.boundary_layer_a > 0.0 => {
                let limit_s = gains.boundary_layer_a / slope;
                if h > limit_s {
                    let (what, remedy) =
                        ("forward Euler in the boundary layer", "widen boundary_layer_a or take Discretization::Implicit");
                    return Err(ObserverError::StepTooLong { what, sample_time_s: h, limit_s, remedy });
                }
                1.0 / gains.boundary_layer_a
            }
            Discretization::ForwardEuler => 0.0,
        };
        let f = T::from_f64;
        let filter = if gains.filter_rad_s > 0.0 { -Scalar::exp(-h * gains.filter_rad_s) + 1.0 } else { 1.0 };
        Ok(Self {
            basis,
            nu0: f(gains.nu0),
            layer: f(layer),
            filter: f(filter),
            anchor: f(2.0 * gains.anchor_per_s),
            discretization,
        })
    }
}

impl<T: Scalar> Observer<T> for Derdiyok<T> {
    type State = DerdiyokState<T>;

    fn state_at(&self, rotor_flux_vs: Complex<T>, i_s: Complex<T>, omega_m: T) -> DerdiyokState<T> {
        let eta = self.basis.nominal.eta;
        let nu = Complex::new(eta, -self.basis.n_p * omega_m) * rotor_flux_vs;
        DerdiyokState {
            lambda: rotor_flux_vs,
            i_hat: i_s,
            nu_filtered: nu,
            lambda_filtered: rotor_flux_vs,
            omega_m,
            eta,
            watch: Watch::from_current(i_s),
        }
    }

    #[inline]
    fn step(&self, s: &mut DerdiyokState<T>, input: &Input<T>) -> Estimate<T> {
        let b = &self.basis;
        let sample = b.admit(&s.watch, input, s.i_hat);
        let c = b.electrical(s.lambda, sample.i_mean);
        let h = b.sample_time_s;
        let drive = sample.u_s.scale(c.inverse_sigma_l_s);
        let limit = |x: T| x.min(T::one()).max(-T::one());
        let nu = match self.discretization {
            Discretization::Implicit => {
                let gamma = Complex::new(-c.gamma(), T::zero());
                let predicted = step1(gamma, s.i_hat, drive, h);
                // ∫₀ʰ βe^{−γt}dt by the same rule.
                let reach = step1(gamma, Complex::zero(), Complex::new(c.beta, T::zero()), h).re;
                let nu = if sample.trusted() {
                    let gap = (predicted - sample.i_s).scale(T::one() / ((reach + self.layer) * self.nu0));
                    Complex::new(limit(gap.re), limit(gap.im)).scale(-self.nu0)
                } else {
                    // A wrong voltage would stay in the flux: go on with what is believed of the machine.
                    Complex::new(c.eta, -b.n_p * s.omega_m) * s.lambda
                };
                s.i_hat = if sample.trusted() || !sample.measured { predicted + nu.scale(reach) } else { sample.i_s };
                nu
            }
            Discretization::ForwardEuler => {
                let e = s.i_hat - sample.i_before;
                let one = T::one();
                let sign = |x: T| {
                    if !self.layer.is_zero() {
                        limit(x * self.layer)
                    } else if x > T::zero() {
                        one
                    } else if x < T::zero() {
                        -one
                    } else {
                        T::zero()
                    }
                };
                let nu = Complex::new(sign(e.re), sign(e.im)).scale(-self.nu0);
                s.i_hat += (nu.scale(c.beta) - s.i_hat.scale(c.gamma()) + drive).scale(h);
                nu
            }
        };
        s.lambda += (sample.i_mean.scale(c.eta_l_m) - nu).scale(h);
        s.nu_filtered += (nu - s.nu_filtered).scale(self.filter);
        // ν is the mean over the sample; so must λ̂ be: its value at the middle.
        let middle = s.lambda - (sample.i_mean.scale(c.eta_l_m) - nu).scale(h * T::from_f64(0.5));
        s.lambda_filtered += (middle - s.lambda_filtered).scale(self.filter);
        let least = b.squares.flux_min;
        let inverse = T::one() / norm2(s.lambda_filtered).max(least);
        s.eta = dot(s.nu_filtered, s.lambda_filtered) * inverse;
        let w = -cross(s.lambda_filtered, s.nu_filtered) * inverse;
        let top = b.limits.speed_max_rad_s;
        s.omega_m = (w / b.n_p).min(top).max(-top);
        if !self.anchor.is_zero() {
            // Held to what an error of the size of the flux itself could cause.
            let w = b.n_p * s.omega_m;
            let most = c.eta + w.abs();
            let mismatch = (s.eta - c.eta).min(most).max(-most);
            let size = self.anchor * mismatch / (c.eta * c.eta + w * w);
            s.lambda += Complex::new(c.eta, w) * s.lambda.scale(size * h);
        }
        let (estimate, finite) = b.conclude(&mut s.watch, &sample, &c, &mut s.lambda, &mut s.i_hat, &mut s.omega_m);
        if !finite {
            *s = DerdiyokState::default();
        }
        estimate
    }
}

impl<T: Scalar> Named<T> for Derdiyok<T> {
    const NAME: &'static str = "derdiyok";
    const TITLE: &'static str = "Derdiyok";
    const TABLES: &'static [&'static str] = &["derdiyok", "sampled_derdiyok"];
    const BESIDE_THE_PROOF: &'static str = "the proof, that the current error slides, holds with any: they act on the estimated flux alone, which it says nothing of";

    fn made<G: Gains>(basis: Basis<T>, machine: &Machine<f64>, rating: &Rating, gains: &G) -> Result<Self, G::Error> {
        let usual = DerdiyokGains::for_machine(machine, rating);
        let given = match gains.table() {
            None => usual,
            Some(_) => DerdiyokGains {
                nu0: gains.needed("nu0")?,
                boundary_layer_a: gains.number_or("boundary_layer_a", usual.boundary_layer_a)?,
                filter_rad_s: gains.number_or("filter_rad_s", usual.filter_rad_s)?,
                anchor_per_s: gains.number_or("anchor_per_s", usual.anchor_per_s)?,
            },
        };
        Ok(Self::discretized(basis, given, gains.discretization())?)
    }
}
