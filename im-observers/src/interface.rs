//! What goes into an observer and what comes out of it: the same for all of them.

use im_model::simulation::Measured;
use im_model::{Complex, Scalar};

/// One sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input<T> {
    /// Mean stator voltage at the machine over the sample that ends now, V: of the command that acted over it, after the inverter's limit. With a voltage
    /// delay of a sample that is the command of the call before the last (docs/firmware.md).
    pub u_s: Complex<T>,
    /// Stator current now, A. NaN stands for a sample that was lost: the observer then predicts, and says so.
    pub i_s: Complex<T>,
    /// Mechanical speed as measured, rad/s; only the [`CurrentModel`](crate::CurrentModel) looks at it.
    pub omega_m: Option<T>,
}

impl<T: Scalar> Input<T> {
    /// Voltage and current, without a speed sensor.
    pub fn new(u_s: Complex<T>, i_s: Complex<T>) -> Self {
        Self { u_s, i_s, omega_m: None }
    }

    /// A sample whose current was lost.
    pub fn lost(u_s: Complex<T>) -> Self {
        let nan = T::from_f64(f64::NAN);
        Self::new(u_s, Complex::new(nan, nan))
    }

    /// With a measured speed, rad/s.
    #[must_use]
    pub fn with_speed(mut self, omega_m: T) -> Self {
        self.omega_m = Some(omega_m);
        self
    }
}

/// Where the voltage acts without delay; behind one it takes `im_control::Sensorless`.
impl<T: Scalar> From<&Measured<T>> for Input<T> {
    fn from(m: &Measured<T>) -> Self {
        Self { u_s: m.u_s, i_s: m.i_s, omega_m: Some(m.omega_m) }
    }
}

/// What an observer says, each sample. All numbers are finite, whatever came in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<T> {
    /// Rotor flux linkage λ_r in the stator frame, Vs.
    pub rotor_flux_vs: Complex<T>,
    /// Mechanical speed, rad/s.
    pub omega_m: T,
    /// Electromagnetic torque from the estimated flux and the measured current, Nm.
    pub torque_nm: T,
    /// i_s − î_s, A: near zero where model and machine agree.
    pub residual_a: Complex<T>,
    /// Whether this can be used, and why not.
    pub status: ObserverStatus,
}

/// Reasons not to trust an estimate. Empty is valid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ObserverStatus(u8);

impl ObserverStatus {
    /// Nothing is wrong.
    pub const VALID: Self = Self(0);
    /// The current was not a finite number, or beyond its limit: this sample is a prediction.
    pub const CURRENT_LOST: Self = Self(1);
    /// The voltage was not a finite number: the one before was taken.
    pub const VOLTAGE_LOST: Self = Self(2);
    /// The voltage was beyond its limit and was cut: what the machine received is not known.
    pub const VOLTAGE_LIMITED: Self = Self(4);
    /// The flux is below its limit: it does not show the speed.
    pub const FLUX_LOW: Self = Self(8);
    /// A state ran into its limit and was held there.
    pub const LIMITED: Self = Self(16);
    /// A state was no longer finite: the observer started again from rest.
    pub const RESTARTED: Self = Self(32);
    /// Fewer samples without fault than the settling time: the estimate is still coming in.
    pub const SETTLING: Self = Self(64);
    /// The current residual is beyond its limit: model and machine disagree.
    pub const RESIDUAL: Self = Self(128);

    const NAMES: [&'static str; 8] = [
        "current lost",
        "voltage lost",
        "voltage limited",
        "flux low",
        "state limited",
        "restarted",
        "settling",
        "residual large",
    ];

    /// Whether the estimate can be used.
    pub const fn is_valid(self) -> bool {
        self.0 == 0
    }

    /// Whether all of `other`'s reasons are among these.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Both.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    pub(crate) fn add_if(&mut self, condition: bool, reason: Self) {
        self.0 |= if condition { reason.0 } else { 0 };
    }

    /// Whether a reason is among these that a single sample does not mend: settling starts anew.
    pub(crate) const fn is_fault(self) -> bool {
        self.0 & !(Self::SETTLING.0 | Self::RESIDUAL.0) != 0
    }

    /// The names of the reasons.
    pub fn reasons(self) -> impl Iterator<Item = &'static str> {
        Self::NAMES.into_iter().enumerate().filter(move |(k, _)| self.0 & (1 << k) != 0).map(|(_, name)| name)
    }
}

impl core::fmt::Display for ObserverStatus {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if self.is_valid() {
            return f.write_str("valid");
        }
        for (k, name) in self.reasons().enumerate() {
            write!(f, "{}{name}", if k > 0 { ", " } else { "" })?;
        }
        Ok(())
    }
}

/// An observer in sampled time. What is proven at construction is not checked again: the step cannot fail, and takes no memory.
pub trait Observer<T: Scalar> {
    /// What it carries from sample to sample; `default` is a machine at rest without flux.
    type State: Copy + Default;

    /// A state that starts from an estimate: rotor flux linkage (Vs), stator current (A), mechanical speed (rad/s).
    fn state_at(&self, rotor_flux_vs: Complex<T>, i_s: Complex<T>, omega_m: T) -> Self::State;

    /// As [`state_at`](Self::state_at), and what was learnt before of the machine's parameters stays.
    fn state_after(&self, before: &Self::State, rotor_flux_vs: Complex<T>, i_s: Complex<T>, omega_m: T) -> Self::State {
        let _ = before;
        self.state_at(rotor_flux_vs, i_s, omega_m)
    }

    /// R̂_s over the machine's R_s: one where it is not learnt.
    fn stator_resistance_ratio(&self, state: &Self::State) -> T {
        let _ = state;
        T::one()
    }

    /// Whether the flux follows the voltage, where there is enough of it, so that an error of ω̂ does not show in it as it does in a current model.
    fn flux_follows_voltage(&self) -> bool {
        false
    }

    /// Takes one sample in.
    fn step(&self, state: &mut Self::State, input: &Input<T>) -> Estimate<T>;
}

impl<T: Scalar, O: Observer<T>> Observer<T> for &O {
    type State = O::State;

    fn state_at(&self, rotor_flux_vs: Complex<T>, i_s: Complex<T>, omega_m: T) -> Self::State {
        (**self).state_at(rotor_flux_vs, i_s, omega_m)
    }

    fn state_after(&self, before: &Self::State, rotor_flux_vs: Complex<T>, i_s: Complex<T>, omega_m: T) -> Self::State {
        (**self).state_after(before, rotor_flux_vs, i_s, omega_m)
    }

    fn stator_resistance_ratio(&self, state: &Self::State) -> T {
        (**self).stator_resistance_ratio(state)
    }

    fn flux_follows_voltage(&self) -> bool {
        (**self).flux_follows_voltage()
    }

    fn step(&self, state: &mut Self::State, input: &Input<T>) -> Estimate<T> {
        (**self).step(state, input)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_lists_its_reasons() {
        assert!(ObserverStatus::VALID.is_valid() && ObserverStatus::default().is_valid());
        let s = ObserverStatus::FLUX_LOW.and(ObserverStatus::SETTLING);
        assert!(!s.is_valid() && s.contains(ObserverStatus::FLUX_LOW) && !s.contains(ObserverStatus::RESIDUAL) && s.is_fault());
        assert!(!ObserverStatus::SETTLING.and(ObserverStatus::RESIDUAL).is_fault());
        let mut text = [0u8; 64];
        let n = {
            use std::io::Write;
            let mut rest = &mut text[..];
            write!(rest, "{s}").unwrap();
            64 - rest.len()
        };
        assert_eq!(&text[..n], b"flux low, settling");
    }
}
