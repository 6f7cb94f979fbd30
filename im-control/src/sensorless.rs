//! A controller without a speed sensor: the speed is an observer's.
//!
//! With [`Mtpa`](crate::Mtpa) and the observer of Section VI this is the drive of Kwon et al., Fig. 4, with ω̂ in the place of ω (Section X):
//!
//! ```text
//! i_ai, i_bi, u_abi, u_bci ─► u₁, i ─► observer ─► ω̂ ─► θ̇_e = n_p ω̂ + ω_s(T*) ─► K_s^e ─► SCR (Fig. 5) ─► i*_abci ─► delta modulator
//! T* ─► I_s(T*), ω_s(T*) ─┘                                                     └─ I_s(T*) ─┘
//! ```
//!
//! The observer takes the mean voltage of the sample that ended and the current now, and its speed goes to the controller in the same sample. The
//! measured speed is not looked at.

use im_model::Scalar;
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_observers::{Estimate, Input, Observer};

use crate::flying_start::{BeginsAt, Caught};
use crate::status::{DriveStatus, Reports};

/// A controller that takes its speed from an observer.
#[derive(Clone, Copy, Debug)]
pub struct Sensorless<T, C, O: Observer<T>>
where
    T: Scalar,
{
    controller: C,
    observer: O,
    state: O::State,
    estimate: Option<Estimate<T>>,
}

impl<T: Scalar, C, O: Observer<T>> Sensorless<T, C, O> {
    /// On a machine at rest without flux.
    pub fn new(controller: C, observer: O) -> Self {
        Self { controller, observer, state: O::State::default(), estimate: None }
    }

    /// On a machine that turns at about a speed (rad/s), without flux.
    pub fn turning(controller: C, observer: O, omega_m: T) -> Self {
        let none = im_model::Complex::new(T::zero(), T::zero());
        let state = observer.state_at(none, none, omega_m);
        Self { controller, observer, state, estimate: None }
    }

    /// What the observer said last.
    pub fn estimate(&self) -> Option<&Estimate<T>> {
        self.estimate.as_ref()
    }

    /// The controller behind.
    pub fn controller(&self) -> &C {
        &self.controller
    }
}

impl<T: Scalar, C: Controller<T>, O: Observer<T>> Controller<T> for Sensorless<T, C, O> {
    #[inline]
    fn step(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        let estimate = self.observer.step(&mut self.state, &Input::new(m.u_s, m.i_s));
        self.estimate = Some(estimate);
        self.controller.step(&Measured { omega_m: estimate.omega_m, ..*m }, reference)
    }
}

/// The observer begins with the flux that was found, too.
impl<T: Scalar, C: BeginsAt<T>, O: Observer<T>> BeginsAt<T> for Sensorless<T, C, O> {
    fn begin_at(&mut self, caught: &Caught<T>) {
        self.state = self.observer.state_at(caught.rotor_flux_vs, caught.i_s, caught.omega_m);
        self.controller.begin_at(caught);
    }
}

impl<T: Scalar, C: Reports, O: Observer<T>> Reports for Sensorless<T, C, O> {
    /// The controller's, and that the speed is lost where the estimate is not to be trusted.
    fn status(&self) -> DriveStatus {
        let lost = self.estimate.is_none_or(|e| !e.status.is_valid());
        self.controller.status().and_if(lost, DriveStatus::SPEED_LOST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::{Complex, Machine, machines};
    use im_observers::{Basis, LoadTorqueModel, Thau, ThauGains};

    /// Gives back what it is told of the speed.
    #[derive(Clone, Copy)]
    struct Told(f64);
    impl Controller<f64> for Told {
        fn step(&mut self, m: &Measured<f64>, _: &Reference<f64>) -> Command<f64> {
            self.0 = m.omega_m;
            Command::Current(Complex::new(0.0, 0.0))
        }
    }
    impl Reports for Told {}
    impl BeginsAt<f64> for Told {
        fn begin_at(&mut self, caught: &Caught<f64>) {
            self.0 = caught.omega_m;
        }
    }

    #[test]
    fn the_controller_sees_the_observers_speed_and_never_the_sensors() {
        let m = machines::JADOT_TABLE_I;
        let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
        let basis = Basis::try_new(&machine, &m.rating, 1e-4).unwrap();
        let thau = Thau::try_new(basis, ThauGains::published(), LoadTorqueModel::EqualToTorque).unwrap();
        let mut drive = Sensorless::turning(Told(0.0), thau, 90.0);
        let (i_s, u_s) = (Complex::new(3.0, 1.0), Complex::new(100.0, 20.0));
        let measured = Measured { i_s, omega_m: f64::NAN, u_s, dc_voltage_v: 560.0, sample_time_s: 1e-4 };
        let mut state = thau.state_at(Complex::new(0.0, 0.0), Complex::new(0.0, 0.0), 90.0);
        for _ in 0..50 {
            drive.step(&measured, &Reference { omega_m: 0.0, rotor_flux_vs: 0.0, torque_nm: 1.0 });
            let estimate = thau.step(&mut state, &Input::new(u_s, i_s));
            assert_eq!(drive.controller().0, estimate.omega_m);
        }
        // Without flux the speed cannot be told.
        assert!(drive.status().has(DriveStatus::SPEED_LOST));
        let flux = Complex::new(0.9, 0.0);
        drive.begin_at(&Caught { rotor_flux_vs: flux, i_s, u_s, omega_m: 40.0, sample_time_s: 1e-4 });
        assert_eq!(drive.state, thau.state_at(flux, i_s, 40.0));
        assert_eq!(drive.controller().0, 40.0);
    }
}
