//! Field weakening: the flux that the voltage allows.
//!
//! dψ_lim/dt = a (u_max − |u|)/|ω_s|, 0.05 ψ_ref ≤ ψ_lim ≤ ψ_ref: with |u| ≈ |ω_s| ψ the limit settles where the voltage asked for meets
//! u_max = ν U_dc/√3, at the rate a, whatever the parameters are.

use im_model::{Bound, ModelError, Scalar};

use crate::guard;
use crate::vector::clamp;

/// How the flux gives way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldWeakening<T> {
    /// a, 1/s.
    pub bandwidth_per_s: T,
    /// ν: what part of the voltage may be used in steady state; the rest is for the current regulators.
    pub voltage_share: T,
}

impl<T: Scalar> FieldWeakening<T> {
    /// Checks the values: a rate, and a share from a tenth to one.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        self.validate_to(1.0)
    }

    /// The same with a share up to `most`.
    pub(crate) fn validate_to(&self, most: f64) -> Result<(), ModelError> {
        guard::SIZE.check("bandwidth_per_s", self.bandwidth_per_s.value())?;
        Bound::Within(0.1, most).check("voltage_share", self.voltage_share.value())
    }

    /// The flux limit for this sample, starting from that of the last; `voltage` is what was asked for, in the same flux unit times
    /// rad/s, and `omega_s` the frequency of the field.
    #[inline]
    pub fn step(&self, limit: &mut T, wanted: T, voltage: T, omega_s: T, dc_voltage_v: T, sample_time_s: T) -> T {
        if dc_voltage_v <= T::zero() {
            *limit = wanted;
            return wanted;
        }
        let u_max = self.voltage_share * dc_voltage_v * T::from_f64(1.0 / 1.732_050_807_568_877_2);
        // At less than 0.3 of the voltage the flux has little part in it.
        let induced = (omega_s.abs() * wanted).max(u_max * T::from_f64(0.3));
        let rate = self.bandwidth_per_s * (u_max - voltage) * wanted / induced;
        *limit = clamp(*limit + rate * sample_time_s, wanted * T::from_f64(0.05), wanted);
        *limit
    }
}
