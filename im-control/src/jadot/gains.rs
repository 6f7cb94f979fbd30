//! Gains of the two loops, and what limits them.

use im_identify::online::Lambda;
use im_model::{ModelError, Scalar};

use crate::field_weakening::FieldWeakening;
use crate::guard;

/// Gains of (12), (22), (25). `im_design::jadot` makes them for wanted bandwidths, with a proof; its fields have the same names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JadotGains<T> {
    /// K_P of (25), Ω.
    pub current_proportional_ohm: T,
    /// K_I of (25), 1/s.
    pub current_integral_per_s: T,
    /// k_p of (12), 1.
    pub speed_proportional: T,
    /// k_i of (12), 1/s.
    pub speed_integral_per_s: T,
    /// λ of (22).
    pub lambda: Lambda<T>,
    /// How the flux gives way to the voltage limit; `None` to keep it.
    pub field_weakening: Option<FieldWeakening<T>>,
}

impl<T: Scalar> JadotGains<T> {
    /// Table II, for the 4-kW machine of Table I, with λ of Section V in its proper unit.
    pub fn of_the_paper() -> Self {
        Self {
            current_proportional_ohm: T::from_f64(7.0),
            current_integral_per_s: T::from_f64(790.0),
            speed_proportional: T::from_f64(1.4),
            speed_integral_per_s: T::from_f64(15.7),
            lambda: Lambda::Scheduled,
            field_weakening: Some(FieldWeakening { bandwidth_per_s: T::from_f64(20.0), voltage_share: T::from_f64(0.92) }),
        }
    }

    /// Checks the values: gains positive (the integral ones may be zero).
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        guard::SIZE.check("current_proportional_ohm", self.current_proportional_ohm.value())?;
        guard::SIZE_OR_ZERO.check("current_integral_per_s", self.current_integral_per_s.value())?;
        guard::SIZE.check("speed_proportional", self.speed_proportional.value())?;
        guard::SIZE_OR_ZERO.check("speed_integral_per_s", self.speed_integral_per_s.value())?;
        self.lambda.validate()?;
        self.field_weakening.map_or(Ok(()), |f| f.validate())
    }
}
