//! R_r *and* R_s by the method of Kenné et al.: the extension that the paper says is possible.
//!
//! (27) is bilinear in the resistances: with F the integrated right side, δ = R − R̂,
//!
//! ```text
//! F(R_r, R_s) − F(R̂_r, R̂_s) = δ_r f₁(R̂_s) + δ_s f₂(R̂_r) − δ_rδ_s g i
//! f₁ = g(u − R̂_s i) − γ₄ di/dt,   f₂ = γ₁(jω_e i − di/dt) − R̂_r g i
//! ```
//!
//! Two complex regressors and one complex equation per sample: both resistances follow from one operating point where f₁ and f₂ differ in
//! *direction*. In the steady state f₁/f₂ is proportional to ω_sω_g/(η + jω_g)², so that the angle between them is
//! 2 arctan(ω_g/η): none at no load, a right angle at the slip of maximum torque per flux. Where the
//! directions coincide R̂_s is held and R̂_r follows alone, as in the paper; where there is no rotor current both are held.
//!
//! Errors by least squares over a window (in units of the starting values, as the excitation is), then the sign law for each.

use super::super::{Estimate, ExcitationMonitor, Identifier, IdentifierStatus, Range, Sample, sign_law};
use super::current_model::{CurrentModel, Filters};
use super::rotor_resistance::{KenneSettings, clamped, share};
use im_model::space_vector::{dot, norm2};
use im_model::{Bound, Complex, ModelError, Rating, Scalar, WindingParameters};

/// What can be chosen beyond [`KenneSettings`], which speak of the rotor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResistancesSettings<T> {
    /// The filters, the rotor's law, and the window.
    pub rotor: KenneSettings<T>,
    /// k of the sign law for R_s, Ω/s.
    pub stator_rate_ohm_per_s: T,
    /// Boundary layer of R̂_s, Ω.
    pub stator_boundary_layer_ohm: T,
    /// Where R̂_s is kept, Ω.
    pub stator_range_ohm: Range<T>,
    /// Smallest eigenvalue, 0 to ½, above which both resistances are estimated.
    pub least_excitation: T,
}

impl<T: Scalar> ResistancesSettings<T> {
    /// As [`KenneSettings::for_rating`]; R̂_s from half to double the nominal value and by as much as all of it in a second.
    pub fn for_rating(windings: &WindingParameters<T>, pole_pairs: u32, rating: &Rating, sample_time_s: T) -> Self {
        let r_s = windings.stator_resistance_ohm;
        Self {
            rotor: KenneSettings::for_rating(windings, pole_pairs, rating, sample_time_s),
            stator_rate_ohm_per_s: r_s,
            stator_boundary_layer_ohm: r_s * T::from_f64(0.1),
            stator_range_ohm: Range::around(r_s, T::from_f64(2.0)),
            least_excitation: T::from_f64(3e-3),
        }
    }
}

/// R_r and R_s from current, voltage and speed; values in this order, Ω.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KenneResistances<T> {
    model: CurrentModel<T>,
    inverse_sample_time: T,
    sliding_gain: T,
    averaging: T,
    reach: [T; 2],
    layer: [T; 2],
    range: [Range<T>; 2],
    start: [T; 2],
    least_f_1: T,
    least_excitation: T,
    window_share: T,
}

/// What [`KenneResistances`] remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KenneResistancesState<T> {
    filters: Filters<T>,
    /// R̂_r, R̂_s, Ω.
    resistance: [T; 2],
    /// Means of f₁ and f₂, each times the resistance at the start, and of R_r f₁ + R_s f₂.
    regressor: [Complex<T>; 2],
    sum: Complex<T>,
    /// ⟨Re f̄ᵢ(sum)⟩ over the window, with the monitor's weight.
    right_side: [T; 2],
    monitor: ExcitationMonitor<T, 2>,
}

impl<T: Scalar> KenneResistances<T> {
    /// For a machine whose inductances are known; R̂_s starts at the windings'.
    ///
    /// # Errors
    /// Names the quantity that is out of bounds.
    pub fn try_new(
        windings: &WindingParameters<T>,
        pole_pairs: u32,
        settings: &ResistancesSettings<T>,
        sample_time_s: T,
    ) -> Result<Self, ModelError> {
        let (r, s) = (&settings.rotor, settings);
        r.check()?;
        Bound::Positive.check("stator_rate_ohm_per_s", s.stator_rate_ohm_per_s.value())?;
        Bound::NotNegative.check("stator_boundary_layer_ohm", s.stator_boundary_layer_ohm.value())?;
        Bound::Within(1e-6, 0.5).check("least_excitation", s.least_excitation.value())?;
        // They are the units of relative errors.
        Bound::Positive.check("start_ohm", r.start_ohm.value())?;
        Bound::Positive.check("stator_range_ohm", s.stator_range_ohm.low().value())?;
        let model = CurrentModel::try_new(windings, pole_pairs, r.high_gain_per_s, sample_time_s)?;
        let least = windings.derived(pole_pairs).beta * r.least_rotor_current_rate_a_per_s * r.start_ohm;
        Ok(Self {
            model,
            inverse_sample_time: T::one() / sample_time_s,
            sliding_gain: r.sliding_gain_a_per_s2,
            averaging: share(sample_time_s, r.averaging_time_s),
            reach: [r.rate_ohm_per_s * sample_time_s, s.stator_rate_ohm_per_s * sample_time_s],
            layer: [r.boundary_layer_ohm, s.stator_boundary_layer_ohm],
            range: [r.range_ohm, s.stator_range_ohm],
            start: [r.start_ohm, s.stator_range_ohm.project(windings.stator_resistance_ohm)],
            least_f_1: least * least,
            least_excitation: s.least_excitation,
            window_share: share(sample_time_s, r.excitation_window_s),
        })
    }
}

impl<T: Scalar> Identifier<T, 2> for KenneResistances<T> {
    type State = KenneResistancesState<T>;
    type Input = Sample<T>;

    fn start(&self) -> Self::State {
        let zero = Complex::new(T::zero(), T::zero());
        KenneResistancesState {
            filters: self.model.start(),
            resistance: self.start,
            regressor: [zero; 2],
            sum: zero,
            right_side: [T::zero(); 2],
            monitor: ExcitationMonitor::default(),
        }
    }

    fn step(&self, x: &mut Self::State, input: &Sample<T>) -> Estimate<T, 2> {
        let said = |x: &Self::State, adapting: [bool; 2], status| Estimate {
            values: x.resistance,
            adapting,
            at_bound: [self.range[0].binds(x.resistance[0]), self.range[1].binds(x.resistance[1])],
            excitation: x.monitor.excitation(),
            status,
        };
        let held = [false; 2];
        let Some(balance) = self.model.step(&mut x.filters, input, [x.resistance[1], x.resistance[0]]) else {
            *x = Self::State { resistance: x.resistance, filters: x.filters, ..self.start() };
            return said(x, held, if x.filters.lost { IdentifierStatus::LostSample } else { IdentifierStatus::Filling });
        };
        let [r_r, r_s] = x.resistance;
        let per_s = self.inverse_sample_time;
        let f_1 = (balance.q - balance.r * r_s) * per_s;
        let f_2 = (balance.p - balance.r * r_r) * per_s;
        let wanted = (balance.known - balance.p * r_s - balance.q * r_r + balance.r * (r_s * r_r)) * per_s;
        let equivalent = clamped(wanted, self.sliding_gain);
        // With the share of the estimates added, old samples say the same about the truth as new ones.
        x.sum += (equivalent + f_1 * r_r + f_2 * r_s - x.sum) * self.averaging;
        for (mean, now) in x.regressor.iter_mut().zip([f_1 * self.start[0], f_2 * self.start[1]]) {
            *mean += (now - *mean) * self.averaging;
        }
        if x.filters.filling > 0 {
            // What the filters do not yet show right would stay in the window for long.
            return said(x, held, IdentifierStatus::Filling);
        }
        let [f_1, f_2] = x.regressor;
        let excitation = x.monitor.add(&x.regressor, self.least_f_1, self.window_share);
        let weight = T::one() / (norm2(f_1) + norm2(f_2) + self.least_f_1);
        for (side, f) in x.right_side.iter_mut().zip(x.regressor) {
            *side += (dot(f, x.sum) * weight - *side) * self.window_share;
        }
        if !(x.right_side[0].is_finite() && x.right_side[1].is_finite()) {
            *x = Self::State { resistance: x.resistance, ..self.start() };
            return said(x, held, IdentifierStatus::LostSample);
        }
        if norm2(f_1) <= self.least_f_1 {
            return said(x, held, IdentifierStatus::NoExcitation);
        }
        // Truth over start, by the normal equations.
        let (a, b, d) = (x.monitor.information(0, 0), x.monitor.information(1, 0), x.monitor.information(1, 1));
        let [u, v] = x.right_side;
        let both = excitation.smallest >= self.least_excitation;
        let ratio = if both {
            let determinant = a * d - b * b;
            [(u * d - v * b) / determinant, (v * a - u * b) / determinant]
        } else {
            let as_it_is = r_s / self.start[1];
            [(u - b * as_it_is) / a, as_it_is]
        };
        if !(ratio[0].is_finite() && ratio[1].is_finite()) {
            return said(x, held, IdentifierStatus::NoExcitation);
        }
        for (k, truth) in ratio.into_iter().enumerate() {
            let error = x.resistance[k] - truth * self.start[k];
            let moved = x.resistance[k] + sign_law(error, self.reach[k], self.layer[k]);
            x.resistance[k] = self.range[k].project(moved);
        }
        said(x, [true, both], IdentifierStatus::Adapting)
    }
}
