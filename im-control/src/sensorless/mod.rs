//! The drive without a speed sensor: any observer with any controller, their start and their supervision.
//!
//! ```text
//! i, u ─► delay of the voltage ─► observer ─► ω̂ ─► Drive (limits, lost samples, dead time) ─► controller ─► command
//!                              └► search: current at zero, flux and speed from the emf ─► observer and controller begin there
//! ```
//!
//! - **Start.** For 20 ms the current is held at zero ([`EmfSearch`]). A machine that turns with flux is caught as it is; one without flux begins at
//!   ω̂ = 0, and while it is magnetized the observer finds the speed: ψ_R' = R_R i + aψ_R shows ω from the first currents on, at any speed.
//! - **Offsets** of the current sensors, found while no current flows, are taken off ([`Sensorless::with_current_offset`]): one in a hundred of the rated current is a flux
//!   that stands still, and near zero frequency the speed is lost by it.
//! - **Unlike phases**, N of u = R_s i + N ī, are taken off the voltage that the observer gets ([`Sensorless::with_resistance_asymmetry`]): near zero frequency, where R_s i is
//!   all of the voltage, a few per cent of R_s in one direction are a flux that is not there.
//! - **An offset of the voltage**, what the inverter makes too much whatever the command, is taken off every command ([`Sensorless::with_voltage_offset`]): two thousandths of the
//!   rated voltage are a tenth of the emf at 1 Hz, and stand still.
//! - **Voltage.** [`Measured::u_s`] is what was commanded over the sample that ended. What the machine had of it, a `voltage_delay_s` later and without what was
//!   added for the dead time, is what the observer gets.
//! - **Flux.** While the speed changes ω̂ lags, and a current model driven by it is off by the lag: the slip that it makes is another than the torque's, which at rated
//!   torque within a tenth of a second is half of it. The observer's flux follows the voltage and does not lag: above 5 Hz the controller is drawn to it
//!   ([`BeginsAt::draw_flux`]). Near zero frequency the voltage shows no flux; what the inverter keeps for itself could hold the field still, and the current model alone decides.
//! - **Supervision.** Where the estimate is not to be trusted for 0.2 s (a residual that stays, no flux, states at their limits), or the
//!   [`Drive`] restarts its controller, the search begins again: the drive finds its machine and goes on. What the observer learnt of R_s stays.
//! - **Zero stator frequency** is passed, not held: within ±0.05 Hz no observer sees the speed, and [`DriveStatus::SPEED_UNSEEN`] says so.
//!
//! With [`Mtpa`](crate::Mtpa) and the observer of Section VI this is the drive of Kwon et al., Fig. 4, with ω̂ in the place of ω (Section X). The measured speed is
//! never looked at.

mod search;

use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::{cross, norm2};
use im_model::{Complex, Scalar};
use im_observers::{Estimate, Input, Observer, ObserverStatus};

use crate::delay::Delayed;
use crate::error::ControlError;
use crate::flying_start::{BeginsAt, Caught};
use crate::guard;
use crate::machine_data::MachineData;
use crate::modulation::DeadTimeCompensation;
use crate::status::{DriveStatus, Reports};
use crate::vector::is_finite;
use crate::{Drive, DriveLimits};
use search::{EmfSearch, Found};

/// How long an estimate may be doubtful before the machine is searched anew, s.
const DOUBT_S: f64 = 0.2;
/// Stator frequency below which the speed is not seen, rad/s.
const UNSEEN_RAD_S: f64 = 0.3;
/// Stator frequency above which the controller takes the observer's flux, rad/s, and how fast, 1/s for each rad/s beyond: by a tenth of the rated frequency what the dead
/// time leaves is no more than a per cent or two of the emf.
const FLUX_SEEN_RAD_S: f64 = 31.4;
const FLUX_DRAWN: f64 = 4.0;

/// A drive whose speed is an observer's.
#[derive(Clone, Copy, Debug)]
pub struct Sensorless<T: Scalar, C, O: Observer<T>> {
    drive: Drive<T, C>,
    observer: O,
    search: EmfSearch<T>,
    /// ηL_m, H/s: the slip is this times the torque-producing current over the flux.
    slip: T,
    pole_pairs: T,
    offset_a: Complex<T>,
    asymmetry_ohm: Complex<T>,
    draws_flux: bool,
    state: State<T, O::State>,
}

#[derive(Clone, Copy, Debug)]
struct State<T, S> {
    observer: S,
    voltage: Delayed<T>,
    searching: bool,
    estimate: Option<Estimate<T>>,
    doubtful_s: T,
    status: DriveStatus,
}

impl<T: Scalar, C: Controller<T> + BeginsAt<T> + Reports + Clone, O: Observer<T>> Sensorless<T, C, O> {
    /// For a machine at rest or turning, with flux or without, sampled every `sample_time_s`.
    ///
    /// # Errors
    /// Machine data, a limit or the sampling time out of bounds.
    pub fn try_new(
        controller: C,
        observer: O,
        machine: &MachineData<T>,
        limits: &DriveLimits<T>,
        sample_time_s: T,
    ) -> Result<Self, ControlError> {
        let search = EmfSearch::try_new(machine, limits, sample_time_s)?;
        let w = &machine.windings;
        let draws_flux = observer.flux_follows_voltage();
        Ok(Self {
            drive: Drive::try_new(controller, limits)?,
            observer,
            search,
            slip: w.rotor_resistance_ohm * w.mutual_inductance_h / w.rotor_inductance_h,
            pole_pairs: machine.n_p(),
            offset_a: Complex::new(T::zero(), T::zero()),
            asymmetry_ohm: Complex::new(T::zero(), T::zero()),
            draws_flux,
            state: State {
                observer: O::State::default(),
                voltage: Delayed::new(machine.voltage_delay_s / sample_time_s),
                searching: true,
                estimate: None,
                doubtful_s: T::zero(),
                status: DriveStatus::OK,
            },
        })
    }

    /// Adds what the dead time takes to every voltage command; neither controller nor observer sees it.
    ///
    /// # Errors
    /// A quantity out of bounds.
    pub fn compensating(self, dead_time: &DeadTimeCompensation<T>) -> Result<Self, ControlError> {
        Ok(Self { drive: self.drive.compensating(dead_time)?, ..self })
    }

    /// What the current sensors show of no current, A.
    ///
    /// # Errors
    /// One that is no number.
    pub fn with_current_offset(self, offset_a: Complex<T>) -> Result<Self, ControlError> {
        guard::check_number("current offset", offset_a)?;
        Ok(Self { offset_a, ..self })
    }

    /// What the stator resistance differs by with the direction of the current, u = R_s i + N ī: N, Ω.
    ///
    /// # Errors
    /// One that is no number.
    pub fn with_resistance_asymmetry(self, asymmetry_ohm: Complex<T>) -> Result<Self, ControlError> {
        guard::check_number("resistance asymmetry", asymmetry_ohm)?;
        Ok(Self { asymmetry_ohm, ..self })
    }

    /// What reaches the terminals beside what is commanded, u = u* + u_0: u_0, V.
    ///
    /// # Errors
    /// One that is no number.
    pub fn with_voltage_offset(self, voltage_offset_v: Complex<T>) -> Result<Self, ControlError> {
        Ok(Self { drive: self.drive.with_voltage_offset(voltage_offset_v)?, ..self })
    }

    /// The controller keeps its own flux, whatever the observer says: for machines whose leakage depends on how fast a current changes (deep bars).
    #[must_use]
    pub fn with_flux_of_controller(self) -> Self {
        Self { draws_flux: false, ..self }
    }

    /// Before a controller whose commands are currents, with an inverter that tracks them.
    #[must_use]
    pub fn tracking_currents(self) -> Self {
        Self { search: self.search.tracking_currents(), ..self }
    }

    /// What the observer said last.
    pub fn estimate(&self) -> Option<&Estimate<T>> {
        self.state.estimate.as_ref()
    }

    /// What the observer carries: a learnt stator resistance, for one.
    pub fn observer_state(&self) -> &O::State {
        &self.state.observer
    }

    /// The controller behind.
    pub fn controller(&self) -> &C {
        self.drive.controller()
    }

    /// The search has ended: observer and controller begin where the machine is.
    fn begin(&mut self, found: Found<T>, m: &Measured<T>) {
        let s = &mut self.state;
        s.searching = false;
        s.observer = self.observer.state_after(&s.observer, found.rotor_flux_vs, m.i_s, found.omega_m);
        if norm2(found.rotor_flux_vs) > T::zero() {
            self.drive.begin_at(&Caught {
                rotor_flux_vs: found.rotor_flux_vs,
                i_s: m.i_s,
                u_s: m.u_s,
                omega_m: found.omega_m,
                sample_time_s: m.sample_time_s,
            });
        }
    }

    /// The machine is searched anew from the next sample on.
    fn search_again(&mut self) {
        self.search.restart();
        (self.state.searching, self.state.doubtful_s) = (true, T::zero());
    }

    /// The sample without a speed: what the search can do with.
    fn searching(&mut self, m: &Measured<T>, u_s: Complex<T>) -> Command<T> {
        let (command, found) = self.search.step(m, u_s);
        self.state.status = DriveStatus::CATCHING.and(DriveStatus::MAGNETIZING);
        if let Some(found) = found {
            self.begin(found, m);
        }
        command
    }

    /// The drive with the speed of the estimate.
    fn driving(&mut self, m: &Measured<T>, reference: &Reference<T>, estimate: &Estimate<T>) -> Command<T> {
        let command = self.drive.step(&Measured { omega_m: estimate.omega_m, ..*m }, reference);
        let mut status = self.drive.status();
        let e = estimate.status;
        let magnetizing = status.has(DriveStatus::MAGNETIZING);
        let doubtful = e.contains(ObserverStatus::RESIDUAL)
            || e.contains(ObserverStatus::LIMITED)
            || e.contains(ObserverStatus::RESTARTED)
            || e.contains(ObserverStatus::FLUX_LOW) && !magnetizing;
        let s = &mut self.state;
        s.doubtful_s = if doubtful { s.doubtful_s + m.sample_time_s } else { T::zero() };
        let lambda = estimate.rotor_flux_vs;
        let slip = self.slip * cross(lambda, m.i_s) / norm2(lambda).max(T::from_f64(1e-12));
        let omega_s = self.pole_pairs * estimate.omega_m + slip;
        status = status
            .and_if(doubtful, DriveStatus::SPEED_LOST)
            .and_if(!magnetizing && omega_s.abs() < T::from_f64(UNSEEN_RAD_S), DriveStatus::SPEED_UNSEEN);
        let beyond = omega_s.abs() - T::from_f64(FLUX_SEEN_RAD_S);
        // Not so where the current is no number.
        if self.draws_flux && beyond > T::zero() && !doubtful && !status.has(DriveStatus::RESTARTED) {
            self.drive.draw_flux(lambda, (beyond * m.sample_time_s * T::from_f64(FLUX_DRAWN)).min(T::one()));
        }
        if s.doubtful_s > T::from_f64(DOUBT_S) {
            self.drive.restart();
            status = status.and(DriveStatus::RESTARTED);
        }
        if status.has(DriveStatus::RESTARTED) {
            self.search_again();
        }
        self.state.status = status;
        command
    }
}

impl<T: Scalar, C: Controller<T> + BeginsAt<T> + Reports + Clone, O: Observer<T>> Controller<T> for Sensorless<T, C, O> {
    #[inline]
    fn step(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        let sample_time_s = if guard::is_sample_time(m.sample_time_s) { m.sample_time_s } else { self.search.sample_time_s() };
        let m = &Measured { sample_time_s, i_s: m.i_s - self.offset_a, ..*m };
        // The search adds nothing for the dead time, and takes no offset off.
        let added = if self.state.searching { -self.drive.voltage_offset() } else { self.drive.compensation() };
        // Copper that is warmer is so in every direction.
        let asymmetry = self.asymmetry_ohm * self.observer.stator_resistance_ratio(&self.state.observer);
        let more = if is_finite(m.i_s) { asymmetry * m.i_s.conj() } else { Complex::new(T::zero(), T::zero()) };
        let u_s = self.state.voltage.step(m.u_s - added) - more;
        let estimate = self.observer.step(&mut self.state.observer, &Input::new(u_s, m.i_s));
        self.state.estimate = Some(estimate);
        if self.state.searching { self.searching(m, u_s) } else { self.driving(m, reference, &estimate) }
    }
}

impl<T: Scalar, C, O: Observer<T>> Reports for Sensorless<T, C, O> {
    fn status(&self) -> DriveStatus {
        self.state.status
    }
}

#[cfg(test)]
mod tests;
