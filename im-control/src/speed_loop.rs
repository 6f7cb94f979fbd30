//! Speed control around a controller that follows torque.

use im_model::Scalar;
use im_model::simulation::{Command, Controller, Measured, Reference};

use crate::error::ControlError;
use crate::flying_start::{BeginsAt, Caught};
use crate::reference::{ReferenceShaper, Shaped};
use crate::speed_regulator::SpeedRegulator;
use crate::status::{DriveStatus, Reports};

/// A speed regulator in front of a torque controller.
#[derive(Clone, Copy, Debug)]
pub struct SpeedLoop<T, C> {
    regulator: SpeedRegulator<T>,
    shaper: ReferenceShaper<T>,
    torque_max_nm: T,
    inner: C,
    shaped: Option<Shaped<T>>,
    integral: T,
}

impl<T: Scalar, C> SpeedLoop<T, C> {
    /// `torque_max_nm` is what the inner controller can do. Its torque must follow several times faster than the regulator's bandwidth.
    ///
    /// # Errors
    /// A quantity out of bounds.
    pub fn try_new(
        regulator: &SpeedRegulator<T>,
        shaper: &ReferenceShaper<T>,
        torque_max_nm: T,
        inner: C,
    ) -> Result<Self, ControlError> {
        regulator.validate()?;
        shaper.validate()?;
        im_model::Bound::Positive.check("torque_max_nm", torque_max_nm.value())?;
        let (regulator, shaper) = (*regulator, *shaper);
        Ok(Self { regulator, shaper, torque_max_nm, inner, shaped: None, integral: T::zero() })
    }
}

impl<T: Scalar, C: Controller<T>> Controller<T> for SpeedLoop<T, C> {
    #[inline]
    fn step(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        // A turning machine is caught at its speed.
        let shaped = self.shaped.get_or_insert(Shaped::at(m.omega_m));
        self.shaper.step(shaped, reference.omega_m, m.sample_time_s);
        let torque_nm = self.regulator.step(&mut self.integral, shaped, m.omega_m, self.torque_max_nm, m.sample_time_s);
        self.inner.step(m, &Reference { torque_nm, ..*reference })
    }
}

impl<T, C: BeginsAt<T>> BeginsAt<T> for SpeedLoop<T, C> {
    fn begin_at(&mut self, caught: &Caught<T>) {
        self.inner.begin_at(caught);
    }
}

impl<T: Scalar, C: Reports> Reports for SpeedLoop<T, C> {
    fn status(&self) -> DriveStatus {
        self.inner.status()
    }
}
