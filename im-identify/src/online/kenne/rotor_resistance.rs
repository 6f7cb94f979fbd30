//! Kenné et al., (27)–(38): R_r by a variable-structure model of the current and the sign law.
//!
//! ```text
//! dx̂₁/dt = f̃₀ + R̂_r f̃₁ + u_x,   u_x = −K Sign(x̂₁ − x̃₁)                       (32)
//! u_eq = −f̃₁(R̂_r − R_r),   e = −f̃₁ᵀu_eq/‖f̃₁‖²,   dR̂_r/dt = −k sign(e)        (35)–(37)
//! ```
//!
//! **In sampled time** the sign in (32) is taken at the *end* of the sample (implicit Euler for set-valued functions): u_x is then what
//! leads x̂₁ exactly onto x̃₁ as long as |u_x| ≤ K, and ±K beyond. The surface is reached without chattering at any period (the explicit
//! sign chatters by Kh, 16 A/s at the paper's K and period), and u_x is the mean of the equivalent control over the sample. A
//! first-order mean follows, as in the paper; f̃₁ passes the same mean, and so does R̂_r f̃₁ + u_x, which does not depend on R̂_r, in
//! place of u_x alone: otherwise the law chases estimates as old as the mean, and cycles.
//!
//! **Where it sees nothing.** f₁ = β di_r/dt. "‖f̃₁‖² > 0 in the stable region" is not so: at no load i_r = 0. The estimate is
//! held below a rotor current that the settings name. A resistance that varies adds β i_r dR_r/dt to (27), at right angles to
//! f₁ in the steady state, so that it does not disturb the projection; what a speed that varies adds is in `current_model.rs`.

use super::super::{Estimate, ExcitationMonitor, Identifier, IdentifierStatus, Range, Sample, finite, sign_law};
use super::current_model::{CurrentModel, Filters};
use im_model::space_vector::{dot, norm2};
use im_model::{Bound, Complex, ModelError, Rating, Scalar, WindingParameters};

/// What can be chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KenneSettings<T> {
    /// Γ of (29), (30), 1/s. High to follow fast, low against noise.
    pub high_gain_per_s: T,
    /// K of (32), A/s²; (34) says how large (`im_design::kenne`).
    pub sliding_gain_a_per_s2: T,
    /// Time constant of the mean that stands for the equivalent control, s; 1 ms in the paper.
    pub averaging_time_s: T,
    /// k_Rr of (37), Ω/s; above the fastest change μ of R_r.
    pub rate_ohm_per_s: T,
    /// Within this error, Ω, the law is linear: a low-pass of time constant layer/k. Zero: the sign law.
    pub boundary_layer_ohm: T,
    /// Where R̂_r is kept, Ω.
    pub range_ohm: Range<T>,
    /// R̂_r at the start, Ω.
    pub start_ohm: T,
    /// |di_r/dt| below which nothing is learnt, A/s: rotor current (referred as the windings are) times stator frequency.
    pub least_rotor_current_rate_a_per_s: T,
    /// Window of the excitation monitor, s.
    pub excitation_window_s: T,
}

/// R_r from current, voltage and speed; the estimate is in the reference of the windings given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KenneRotorResistance<T> {
    model: CurrentModel<T>,
    r_s: T,
    sample_time: T,
    inverse_sample_time: T,
    sliding_gain: T,
    /// K times the averaging time, A/s.
    farthest: T,
    /// h over the averaging time, as a share of the new value.
    averaging: T,
    reach: T,
    layer: T,
    range: Range<T>,
    start: T,
    /// Squared.
    least_f_1: T,
    window_share: T,
}

/// What [`KenneRotorResistance`] remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KenneRotorResistanceState<T> {
    filters: Filters<T>,
    /// R̂_r, Ω.
    resistance: T,
    /// x̃₁ less x̂₁ of (32): zero on the sliding surface, A/s.
    off_surface: Complex<T>,
    /// Means of f̃₁ and of R̂_r f̃₁ + u_x.
    f_1: Complex<T>,
    slope: Complex<T>,
    monitor: ExcitationMonitor<T, 1>,
}

impl<T: Scalar> KenneRotorResistanceState<T> {
    /// x̃₁ − x̂₁, A/s: zero while the model slides, that is, while (34) holds.
    pub fn off_surface_a_per_s(&self) -> Complex<T> {
        self.off_surface
    }
}

/// h/τ as a share, exact for a value held over the sample.
pub(super) fn share<T: Scalar>(sample_time_s: T, time_s: T) -> T {
    T::one() - (-sample_time_s / time_s).exp()
}

/// z with each component within ±limit.
pub(super) fn clamped<T: Scalar>(z: Complex<T>, limit: T) -> Complex<T> {
    Complex::new(z.re.max(-limit).min(limit), z.im.max(-limit).min(limit))
}

impl<T: Scalar> KenneSettings<T> {
    /// For a machine of this rating, sampled every `sample_time_s`: filters of about twice the rated frequency, R̂_r from a third to three times
    /// the nominal value and by as much as its double in a second, held below a tenth of the rated rotor current at rated frequency.
    pub fn for_rating(windings: &WindingParameters<T>, pole_pairs: u32, rating: &Rating, sample_time_s: T) -> Self {
        let c = T::from_f64;
        let r_r = windings.rotor_resistance_ohm;
        let omega = c(2.0 * core::f64::consts::PI * rating.electrical_frequency_hz);
        // τ = (3/2) n_p ψ_r i_r
        let rotor_current = c(rating.torque_nm / (1.5 * f64::from(pole_pairs) * rating.rotor_flux_vs));
        let rated_rate = rotor_current * omega;
        let beta = windings.derived(pole_pairs).beta;
        Self {
            high_gain_per_s: omega + omega,
            // (34) with the widest error and a threefold current, sinusoidal; over any voltage: `im_design::kenne`.
            sliding_gain_a_per_s2: beta * rated_rate * r_r * c(9.0),
            averaging_time_s: c(1e-3).max(sample_time_s + sample_time_s),
            rate_ohm_per_s: r_r + r_r,
            boundary_layer_ohm: r_r * c(0.1),
            range_ohm: Range::around(r_r, c(3.0)),
            start_ohm: r_r,
            least_rotor_current_rate_a_per_s: rated_rate * c(0.1),
            excitation_window_s: c(0.5),
        }
    }

    pub(super) fn check(&self) -> Result<(), ModelError> {
        Bound::Positive.check("sliding_gain_a_per_s2", self.sliding_gain_a_per_s2.value())?;
        Bound::Positive.check("averaging_time_s", self.averaging_time_s.value())?;
        Bound::Positive.check("rate_ohm_per_s", self.rate_ohm_per_s.value())?;
        Bound::NotNegative.check("boundary_layer_ohm", self.boundary_layer_ohm.value())?;
        Bound::Within(self.range_ohm.low().value(), self.range_ohm.high().value()).check("start_ohm", self.start_ohm.value())?;
        Bound::Positive.check("least_rotor_current_rate_a_per_s", self.least_rotor_current_rate_a_per_s.value())?;
        Bound::Positive.check("excitation_window_s", self.excitation_window_s.value())
    }
}

impl<T: Scalar> KenneRotorResistance<T> {
    /// For a machine whose other parameters are known, called every `sample_time_s`.
    ///
    /// # Errors
    /// Names the quantity that is out of bounds.
    pub fn try_new(
        windings: &WindingParameters<T>,
        pole_pairs: u32,
        settings: &KenneSettings<T>,
        sample_time_s: T,
    ) -> Result<Self, ModelError> {
        settings.check()?;
        let model = CurrentModel::try_new(windings, pole_pairs, settings.high_gain_per_s, sample_time_s)?;
        let beta = windings.derived(pole_pairs).beta;
        let least = beta * settings.least_rotor_current_rate_a_per_s;
        Ok(Self {
            model,
            r_s: windings.stator_resistance_ohm,
            sample_time: sample_time_s,
            inverse_sample_time: T::one() / sample_time_s,
            sliding_gain: settings.sliding_gain_a_per_s2,
            farthest: settings.sliding_gain_a_per_s2 * settings.averaging_time_s,
            averaging: share(sample_time_s, settings.averaging_time_s),
            reach: settings.rate_ohm_per_s * sample_time_s,
            layer: settings.boundary_layer_ohm,
            range: settings.range_ohm,
            start: settings.start_ohm,
            least_f_1: least * least,
            window_share: share(sample_time_s, settings.excitation_window_s),
        })
    }
}

impl<T: Scalar> Identifier<T, 1> for KenneRotorResistance<T> {
    type State = KenneRotorResistanceState<T>;
    type Input = Sample<T>;

    fn start(&self) -> Self::State {
        let zero = Complex::new(T::zero(), T::zero());
        KenneRotorResistanceState {
            filters: self.model.start(),
            resistance: self.start,
            off_surface: zero,
            f_1: zero,
            slope: zero,
            monitor: ExcitationMonitor::default(),
        }
    }

    fn step(&self, x: &mut Self::State, input: &Sample<T>) -> Estimate<T, 1> {
        let said = |x: &Self::State, status| Estimate {
            values: [x.resistance],
            adapting: [status == IdentifierStatus::Adapting],
            at_bound: [self.range.binds(x.resistance)],
            excitation: x.monitor.excitation(),
            status,
        };
        let Some(balance) = self.model.step(&mut x.filters, input, [self.r_s, x.resistance]) else {
            *x = Self::State { resistance: x.resistance, monitor: x.monitor, filters: x.filters, ..self.start() };
            return said(x, if x.filters.lost { IdentifierStatus::LostSample } else { IdentifierStatus::Filling });
        };
        let f_1 = (balance.q - balance.r * self.r_s) * self.inverse_sample_time;
        let f_0_gone = (balance.known - balance.p * self.r_s) * self.inverse_sample_time;
        // (32): what leads back onto the surface by the end of the sample.
        let wanted = x.off_surface * self.inverse_sample_time + f_0_gone - f_1 * x.resistance;
        let u_x = clamped(wanted, self.sliding_gain);
        // Not farther off than the mean takes to come back.
        x.off_surface = clamped((wanted - u_x) * self.sample_time, self.farthest);
        x.f_1 += (f_1 - x.f_1) * self.averaging;
        x.slope += (f_1 * x.resistance + u_x - x.slope) * self.averaging;
        x.monitor.add(&[x.f_1], self.least_f_1, self.window_share);
        if x.filters.filling > 0 {
            return said(x, IdentifierStatus::Filling);
        }
        let size = norm2(x.f_1);
        if size <= self.least_f_1 {
            return said(x, IdentifierStatus::NoExcitation);
        }
        // (36): f̃₁ᵀ(R̂_r f̃₁ + u_x)/‖f̃₁‖² is R_r.
        let error = x.resistance - dot(x.f_1, x.slope) / size;
        if !error.is_finite() || !finite(x.off_surface) {
            *x = Self::State { resistance: x.resistance, monitor: x.monitor, ..self.start() };
            return said(x, IdentifierStatus::LostSample);
        }
        x.resistance = self.range.project(x.resistance + sign_law(error, self.reach, self.layer));
        said(x, IdentifierStatus::Adapting)
    }
}
