//! Speed control around a controller that follows torque.

use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::{Complex, Scalar};

use crate::error::ControlError;
use crate::flying_start::{BeginsAt, Caught};
use crate::guard;
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
    /// The last torque asked for, and the last speed reference that was a number.
    torque_nm: T,
    omega_m: T,
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
        guard::SIZE.check("torque_max_nm", torque_max_nm.value())?;
        let (regulator, shaper) = (*regulator, *shaper);
        Ok(Self {
            regulator,
            shaper,
            torque_max_nm,
            inner,
            shaped: None,
            integral: T::zero(),
            torque_nm: T::zero(),
            omega_m: T::zero(),
        })
    }
}

impl<T: Scalar, C: Controller<T>> Controller<T> for SpeedLoop<T, C> {
    /// A sample that cannot be computed with leaves the torque standing; should the state leave the finite range, it begins anew.
    #[inline]
    fn step(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        // The currents and voltages are for the controller inside to judge.
        let [none, one] = [T::zero(), T::one()];
        let seen = Measured { i_s: Complex::new(none, none), ..guard::without_voltages(m) };
        if guard::is_usable(&seen, one) {
            if reference.omega_m.is_finite() {
                self.omega_m = reference.omega_m;
            }
            // A turning machine is caught at its speed.
            let shaped = self.shaped.get_or_insert(Shaped::at(m.omega_m));
            self.shaper.step(shaped, self.omega_m, m.sample_time_s);
            let (wanted, limit) = (*shaped, self.torque_max_nm);
            self.torque_nm = self.regulator.step(&mut self.integral, &wanted, m.omega_m, limit, m.sample_time_s);
            if !(wanted.speed.is_finite() && wanted.second.is_finite() && self.integral.is_finite() && self.torque_nm.is_finite())
            {
                (self.shaped, self.integral, self.torque_nm) = (None, none, none);
            }
        }
        self.inner.step(m, &Reference { torque_nm: self.torque_nm, ..*reference })
    }
}

impl<T, C: BeginsAt<T>> BeginsAt<T> for SpeedLoop<T, C> {
    fn begin_at(&mut self, caught: &Caught<T>) {
        self.inner.begin_at(caught);
    }

    #[inline]
    fn draw_flux(&mut self, rotor_flux_vs: Complex<T>, share: T) {
        self.inner.draw_flux(rotor_flux_vs, share);
    }
}

impl<T: Scalar, C: Reports> Reports for SpeedLoop<T, C> {
    fn status(&self) -> DriveStatus {
        self.inner.status()
    }
}
