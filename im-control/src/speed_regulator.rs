//! Speed regulator: proportional-integral with feedforward of a differentiable reference, by internal model control.
//!
//! τ = Jω̇* + 2aJ (ω* − ω) + x,   dx/dt = a² J (ω* − ω) + ½a (τ̄ − τ)
//!
//! with τ̄ the torque after its limit. The reference is followed exactly; a load torque of T shows as T s/(J(s + a)²).

use im_model::{ModelError, Scalar};

use crate::guard;
use crate::reference::Shaped;
use crate::vector::within;

/// The regulator's data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedRegulator<T> {
    /// a, rad/s.
    pub bandwidth_rad_s: T,
    /// J, kg m².
    pub inertia_kg_m2: T,
}

impl<T: Scalar> SpeedRegulator<T> {
    /// Checks the values: both positive.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        guard::SIZE.check("bandwidth_rad_s", self.bandwidth_rad_s.value())?;
        guard::SIZE.check("inertia_kg_m2", self.inertia_kg_m2.value())
    }

    /// One sample: torque within ±`limit`, Nm. `integral` is x, Nm.
    #[inline]
    pub fn step(&self, integral: &mut T, wanted: &Shaped<T>, omega_m: T, limit: T, sample_time_s: T) -> T {
        let (a, j) = (self.bandwidth_rad_s, self.inertia_kg_m2);
        let e = (wanted.speed - omega_m) * (a * j);
        let torque = wanted.rate * j + e + e + *integral;
        let limited = within(torque, limit);
        *integral += a * (e + (limited - torque) * T::from_f64(0.5)) * sample_time_s;
        limited
    }
}
