//! Time-scale separated adaptation, (32)–(34): slow against the machine, on the voltage that the integral action holds.
//!
//! dθ̂ᵢ/dt = θ̂ᵢ (g/‖B‖²) Re(B̄ᵢ K_Pη),   g = (2/3) T̂_r⁻¹ in the paper

use super::super::{Estimate, Identifier};
use super::parameters::{RegulationParameters, steady_regressor};
use super::scheme::{Adaptation, Adapted, Scheme, SchemeSettings, Tracking};
use im_model::space_vector::dot;
use im_model::{Bound, ModelError, Scalar};

/// The scheme with its gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeScale<T> {
    scheme: Scheme<T>,
    /// g times T_r.
    share: T,
}

/// What [`TimeScale`] remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeScaleState<T>(Adapted<T>);

impl<T: Scalar> TimeScale<T> {
    /// The paper's g T_r.
    pub const PAPER_SHARE: f64 = 2.0 / 3.0;

    /// The gain is g/‖B‖² with g = `share_of_rotor_rate` times the estimated 1/T_r. A tenth of the controller's slowest rate keeps the time
    /// scales apart for certain (`im_design::jadot`); the paper takes ⅔.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn try_new(settings: &SchemeSettings<T>, share_of_rotor_rate: T) -> Result<Self, ModelError> {
        Bound::Positive.check("share_of_rotor_rate", share_of_rotor_rate.value())?;
        Ok(Self { scheme: Scheme::try_new(settings)?, share: share_of_rotor_rate })
    }
}

impl<T: Scalar> Identifier<T, 4> for TimeScale<T> {
    type State = TimeScaleState<T>;
    type Input = Tracking<T>;

    fn start(&self) -> TimeScaleState<T> {
        TimeScaleState(self.scheme.start())
    }

    fn step(&self, TimeScaleState(x): &mut TimeScaleState<T>, t: &Tracking<T>) -> Estimate<T, 4> {
        let p = self.scheme.parameters(x);
        let b = steady_regressor(&p, t.phi_ref, t.i_ref, t.omega_s(), t.omega_g);
        let reach = self.share * p.inverse_rotor_time_constant() * self.scheme.sample_time;
        // No error counts for more than all of the parameter: transients that (32) knows nothing of.
        self.scheme.adapt(x, t, &b, |inverse| b.map(|b| (dot(b, t.held_v) * inverse).max(-T::one()).min(T::one()) * reach));
        self.scheme.estimate(x)
    }
}

impl<T: Scalar> Adaptation<T> for TimeScale<T> {
    fn parameters(&self, state: &TimeScaleState<T>) -> RegulationParameters<T> {
        self.scheme.parameters(&state.0)
    }
}
