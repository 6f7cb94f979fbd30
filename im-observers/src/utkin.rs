//! The sliding-mode observer of Utkin, Guldner and Shi (Kwon et al., Section V).
//!
//! ```text
//! λ̂' = (−η + jn_pω̂)λ̂ + ηL_m î,   î' = −β(−η + jn_pω̂)λ̂ − γî + u/σL_s,   ω̂ = ω₀ sign(s_n),   s_n = λ̂ × (î − i)
//! ```
//!
//! The speed shown is ω̂ filtered: the equivalent control. Nobody has proven that the flux converges; Utkin et al. say so. Where it does
//! is mapped in `docs/background/observers.md`: as in Kubota's observer without feedback, not when regenerating at low frequency.
//!
//! What practice adds: a **boundary layer** of width φ for the sign (forward Euler then needs hn_pβ|λ|²ω₀/φ < 2, checked), and
//! **implicit sliding**: ω̂ such that s_n = 0 at the *end* of the sample, within ±ω₀. Per sample a speed changed by δ moves s_n by
//! −hn_p(β|λ̂|² + λ̂·ê)δ, so that one division gives it; there is no chatter and no step limit.

use im_model::space_vector::{cross, dot, j, norm2};
use im_model::{Bound, Complex, Machine, Rating, Scalar};
use num_traits::Zero;

use crate::basis::{Basis, Discretization, Watch};
use crate::error::{GAIN_MAX, ObserverError};
use crate::interface::{Estimate, Input, Observer};
use crate::named::{Gains, Named};
use crate::tustin::{Flow, warped};

/// Gains as `im-design` gives them (`utkin`), with the options of practice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UtkinGains {
    /// ω₀, mechanical rad/s.
    pub omega0_rad_s: f64,
    /// Width φ of the boundary layer in s_n, A Vs; 0 is the sign itself.
    pub boundary_layer_avs: f64,
    /// Corner of the filter that gives the equivalent speed, rad/s; 0 shows ω̂ itself, in practice [`Self::USUAL_FILTER_RAD_S`].
    pub filter_rad_s: f64,
}

impl UtkinGains {
    /// The filter to start from, rad/s; where a certificate gives ω₀ alone, this is taken with it. It is on the speed shown, so that
    /// what the certificate proves, that s_n is attracted to zero, holds with it as without.
    pub const USUAL_FILTER_RAD_S: f64 = 100.0;

    /// What to start from for a machine: twice the rated speed, a filter of 100 rad/s.
    pub fn for_machine(machine: &Machine<f64>, rating: &Rating) -> Self {
        let speed = 2.0 * core::f64::consts::PI * rating.electrical_frequency_hz / f64::from(machine.pole_pairs());
        Self { omega0_rad_s: 2.0 * speed, boundary_layer_avs: 0.0, filter_rad_s: Self::USUAL_FILTER_RAD_S }
    }

    fn validate(&self) -> Result<(), ObserverError> {
        Bound::Within(f64::from(f32::MIN_POSITIVE), GAIN_MAX).check("omega0_rad_s", self.omega0_rad_s)?;
        Bound::Within(0.0, GAIN_MAX).check("boundary_layer_avs", self.boundary_layer_avs)?;
        Ok(Bound::Within(0.0, GAIN_MAX).check("filter_rad_s", self.filter_rad_s)?)
    }
}

/// The observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Utkin<T> {
    basis: Basis<T>,
    omega0: T,
    /// φ/ω₀ (implicit), ω₀/φ with 0 for the sign (Euler).
    layer: T,
    filter: T,
    discretization: Discretization,
}

/// λ̂, î and the filtered speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UtkinState<T> {
    lambda: Complex<T>,
    i_hat: Complex<T>,
    omega_m: T,
    watch: Watch<T>,
}

impl<T: Scalar> Default for UtkinState<T> {
    fn default() -> Self {
        Self { lambda: Complex::zero(), i_hat: Complex::zero(), omega_m: T::zero(), watch: Watch::default() }
    }
}

impl<T: Scalar> Utkin<T> {
    /// With [`Discretization::Implicit`].
    ///
    /// # Errors
    /// A gain out of bounds.
    pub fn try_new(basis: Basis<T>, gains: UtkinGains) -> Result<Self, ObserverError> {
        Self::discretized(basis, gains, Discretization::Implicit)
    }

    /// With a chosen discretization.
    ///
    /// # Errors
    /// A gain out of bounds, or a boundary layer too narrow for forward Euler.
    pub fn discretized(basis: Basis<T>, gains: UtkinGains, discretization: Discretization) -> Result<Self, ObserverError> {
        gains.validate()?;
        let h = basis.sample_time_s.value();
        let layer = match discretization {
            Discretization::Implicit => gains.boundary_layer_avs / gains.omega0_rad_s,
            Discretization::ForwardEuler if gains.boundary_layer_avs > 0.0 => {
                let flux = basis.limits.flux_max_vs.value();
                let slope = basis.n_p.value() * basis.nominal.beta.value() * flux * flux * gains.omega0_rad_s;
                let limit_s = 2.0 * gains.boundary_layer_avs / slope;
                if h >= limit_s {
                    let (what, remedy) = (
                        "forward Euler in the boundary layer at the largest flux",
                        "widen boundary_layer_avs or take Discretization::Implicit",
                    );
                    return Err(ObserverError::StepTooLong { what, sample_time_s: h, limit_s, remedy });
                }
                gains.omega0_rad_s / gains.boundary_layer_avs
            }
            Discretization::ForwardEuler => 0.0,
        };
        let filter = if gains.filter_rad_s > 0.0 { 1.0 - Scalar::exp(-h * gains.filter_rad_s) } else { 1.0 };
        let f = T::from_f64;
        Ok(Self { basis, omega0: f(gains.omega0_rad_s), layer: f(layer), filter: f(filter), discretization })
    }
}

impl<T: Scalar> Observer<T> for Utkin<T> {
    type State = UtkinState<T>;

    fn state_at(&self, rotor_flux_vs: Complex<T>, i_s: Complex<T>, omega_m: T) -> UtkinState<T> {
        UtkinState { lambda: rotor_flux_vs, i_hat: i_s, omega_m, watch: Watch::from_current(i_s) }
    }

    #[inline]
    fn step(&self, s: &mut UtkinState<T>, input: &Input<T>) -> Estimate<T> {
        let b = &self.basis;
        let sample = b.admit(&s.watch, input, s.i_hat);
        let c = b.electrical(s.lambda, sample.i_mean);
        let h = b.sample_time_s;
        let top = self.omega0;
        let drive = sample.u_s.scale(c.inverse_sigma_l_s);
        let rates = |omega: T, s: &UtkinState<T>| {
            let a = Complex::new(-c.eta, b.n_p * omega);
            (a, [a * s.lambda + s.i_hat.scale(c.eta_l_m), drive - s.i_hat.scale(c.stator_rate)])
        };
        let omega = match self.discretization {
            Discretization::Implicit => {
                // With the speed that was right so far …
                let before = s.omega_m;
                let (a, rates) = rates(before, s);
                let flow = Flow { a, c: c.eta_l_m, g: c.stator_rate, beta: c.beta };
                [s.lambda, s.i_hat] = flow.step([s.lambda, s.i_hat], rates, warped(h, a.im));
                if sample.measured {
                    // … and what it must change by.
                    let e = s.i_hat - sample.i_s;
                    let flux2 = norm2(s.lambda).max(b.squares.flux_min);
                    let slope =
                        (h * b.n_p * (c.beta * flux2 + dot(s.lambda, e))).max(h * b.n_p * c.beta * flux2 * T::from_f64(0.1));
                    let wanted = before + cross(s.lambda, e) / (slope + self.layer);
                    let omega = wanted.min(top).max(-top);
                    let turn = j(s.lambda).scale(h * b.n_p * (omega - before));
                    s.lambda += turn;
                    s.i_hat -= turn.scale(c.beta);
                    omega
                } else {
                    before
                }
            }
            Discretization::ForwardEuler => {
                let s_n = cross(s.lambda, s.i_hat - sample.i_before);
                let omega = if !self.layer.is_zero() {
                    (s_n * self.layer).min(top).max(-top)
                } else if s_n > T::zero() {
                    top
                } else if s_n < T::zero() {
                    -top
                } else {
                    T::zero()
                };
                let (_, [d_lambda, d_psi]) = rates(omega, s);
                s.lambda += d_lambda.scale(h);
                s.i_hat += (d_psi - d_lambda.scale(c.beta)).scale(h);
                omega
            }
        };
        s.omega_m += self.filter * (omega - s.omega_m);
        let (estimate, finite) = b.conclude(&mut s.watch, &sample, &c, &mut s.lambda, &mut s.i_hat, &mut s.omega_m);
        if !finite {
            *s = UtkinState::default();
        }
        estimate
    }
}

impl<T: Scalar> Named<T> for Utkin<T> {
    const NAME: &'static str = "utkin";
    const TITLE: &'static str = "Utkin";
    const TABLES: &'static [&'static str] = &["utkin", "sampled_utkin"];
    const BESIDE_THE_PROOF: &'static str =
        "the proof, that s_n = 0 is attractive, holds with any: the filter is on the speed shown";

    fn made<G: Gains>(basis: Basis<T>, machine: &Machine<f64>, rating: &Rating, gains: &G) -> Result<Self, G::Error> {
        let usual = UtkinGains::for_machine(machine, rating);
        let given = match gains.table() {
            None => usual,
            Some(_) => UtkinGains {
                omega0_rad_s: gains.needed("omega0_rad_s")?,
                boundary_layer_avs: gains.number_or("boundary_layer_avs", usual.boundary_layer_avs)?,
                filter_rad_s: gains.number_or("filter_rad_s", usual.filter_rad_s)?,
            },
        };
        Ok(Self::discretized(basis, given, gains.discretization())?)
    }
}
