//! Around any controller: what is believed of the sensors, what may be asked for, what leaves towards the inverter.
//!
//! - A sample that is no number or beyond what the sensor can show is replaced: the current by the last one turned by the rotor's
//!   electrical angle, the speed and the dc voltage by the last ones. After [`DriveLimits::lost_samples_max`] in a row the drive is
//!   *blocked*: it goes on with its last command, turned with the rotor and fading out. (A zero voltage would be a short circuit of a
//!   machine that carries flux. Firmware opens its bridge on [`DriveStatus::BLOCKED`].) Once as many good samples have come in a row, the
//!   controller starts anew from its first state, as in a flying start.
//! - References that are no numbers are replaced by the last ones; others are brought within limits and slew rates.
//! - A command that is no number restarts the controller.

use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::norm2;
use im_model::{Bound, Complex, ModelError, Scalar};

use crate::error::ControlError;
use crate::flying_start::{BeginsAt, Caught};
use crate::guard::{self, is_sample_time};
use crate::machine_data::MachineData;
use crate::modulation::DeadTimeCompensation;
use crate::status::{DriveStatus, Reports};
use crate::vector::{clamp, is_finite, rotation, shortened, within_hexagon};

/// What is believed and what may be asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveLimits<T> {
    /// n_p.
    pub pole_pairs: u32,
    /// A measured current beyond this is not believed, A (the range of the sensor).
    pub current_range_a: T,
    /// A believed current beyond this is an overcurrent, A.
    pub overcurrent_a: T,
    /// A measured speed beyond this is not believed, rad/s.
    pub speed_range_rad_s: T,
    /// Speed references are kept within ±this, rad/s.
    pub speed_max_rad_s: T,
    /// Rotor flux references are kept from zero to this, Vs.
    pub rotor_flux_max_vs: T,
    /// Torque references are kept within ±this, Nm.
    pub torque_max_nm: T,
    /// Fastest change of the speed reference, rad/s².
    pub speed_slew_rad_s2: T,
    /// Fastest change of the torque reference, Nm/s.
    pub torque_slew_nm_per_s: T,
    /// The largest voltage commanded where no dc voltage limits it, V.
    pub voltage_max_v: T,
    /// So many lost samples in a row are bridged.
    pub lost_samples_max: u16,
    /// How fast a blocked drive fades out, s.
    pub fade_s: T,
}

impl<T: Scalar> DriveLimits<T> {
    /// Generous limits for a machine: sensors to four times the current limit, overcurrent at one and a half times; speed to three times
    /// `speed_rated_rad_s`, flux to 1.3 times `rotor_flux_vs`, torque to what the current gives at that flux; slew rates of full speed
    /// in 50 ms and full torque in 5 ms; ten lost samples.
    pub fn generous(machine: &MachineData<T>, speed_rated_rad_s: T, rotor_flux_vs: T) -> Self {
        let c = T::from_f64;
        let w = &machine.windings;
        let k_r = w.mutual_inductance_h / w.rotor_inductance_h;
        let torque = c(1.5) * machine.n_p() * k_r * rotor_flux_vs * machine.current_max_a;
        let speed = speed_rated_rad_s * c(3.0);
        Self {
            pole_pairs: machine.pole_pairs,
            current_range_a: machine.current_max_a * c(4.0),
            overcurrent_a: machine.current_max_a * c(1.5),
            speed_range_rad_s: speed * c(1.5),
            speed_max_rad_s: speed,
            rotor_flux_max_vs: rotor_flux_vs * c(1.3),
            torque_max_nm: torque,
            speed_slew_rad_s2: speed * c(20.0),
            torque_slew_nm_per_s: torque * c(200.0),
            voltage_max_v: c(3.0) * speed_rated_rad_s * machine.n_p() * rotor_flux_vs * k_r.max(T::one()),
            lost_samples_max: 10,
            fade_s: c(0.1),
        }
    }

    /// Checks the values: all positive and finite.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        Bound::Within(1.0, 100.0).check("pole_pairs", f64::from(self.pole_pairs))?;
        for (quantity, x) in [
            ("current_range_a", self.current_range_a),
            ("overcurrent_a", self.overcurrent_a),
            ("speed_range_rad_s", self.speed_range_rad_s),
            ("speed_max_rad_s", self.speed_max_rad_s),
            ("rotor_flux_max_vs", self.rotor_flux_max_vs),
            ("torque_max_nm", self.torque_max_nm),
            ("speed_slew_rad_s2", self.speed_slew_rad_s2),
            ("torque_slew_nm_per_s", self.torque_slew_nm_per_s),
            ("voltage_max_v", self.voltage_max_v),
            ("fade_s", self.fade_s),
        ] {
            guard::SIZE.check(quantity, x.value())?;
        }
        Ok(())
    }
}

/// A controller that is looked after.
#[derive(Clone, Copy, Debug)]
pub struct Drive<T, C> {
    limits: DriveLimits<T>,
    dead_time: Option<DeadTimeCompensation<T>>,
    voltage_offset_v: Complex<T>,
    first: C,
    controller: C,
    state: State<T>,
}

#[derive(Clone, Copy, Debug)]
struct State<T> {
    /// The last believed measurement.
    believed: Measured<T>,
    reference: Reference<T>,
    started: bool,
    command: Command<T>,
    compensation: Complex<T>,
    lost: u16,
    good: u16,
    blocked: bool,
    status: DriveStatus,
}

impl<T: Scalar, C: Clone> Drive<T, C> {
    /// Looks after a controller in its first state.
    ///
    /// # Errors
    /// A limit out of bounds.
    pub fn try_new(controller: C, limits: &DriveLimits<T>) -> Result<Self, ControlError> {
        limits.validate()?;
        let (o, z) = (T::zero(), Complex::new(T::zero(), T::zero()));
        let believed = Measured { i_s: z, omega_m: o, u_s: z, dc_voltage_v: o, sample_time_s: T::from_f64(1e-4) };
        let reference = Reference { omega_m: o, rotor_flux_vs: o, torque_nm: o };
        let state = State {
            believed,
            reference,
            started: false,
            command: Command::Voltage(z),
            compensation: z,
            lost: 0,
            good: 0,
            blocked: false,
            status: DriveStatus::OK,
        };
        Ok(Self { limits: *limits, dead_time: None, voltage_offset_v: z, first: controller.clone(), controller, state })
    }

    /// Adds what the dead time takes to every voltage command; the controller does not see it.
    ///
    /// # Errors
    /// A quantity out of bounds.
    pub fn compensating(mut self, dead_time: &DeadTimeCompensation<T>) -> Result<Self, ControlError> {
        dead_time.validate()?;
        self.dead_time = Some(*dead_time);
        Ok(self)
    }

    /// Takes what the inverter makes too much, whatever the command, off every voltage command, V; the controller does not see it.
    ///
    /// # Errors
    /// One that is no number.
    pub fn with_voltage_offset(self, voltage_offset_v: Complex<T>) -> Result<Self, ControlError> {
        guard::check_number("voltage offset", voltage_offset_v)?;
        Ok(Self { voltage_offset_v, ..self })
    }

    /// What is taken off every voltage command, V.
    pub(crate) fn voltage_offset(&self) -> Complex<T> {
        self.voltage_offset_v
    }

    /// The controller.
    pub fn controller(&self) -> &C {
        &self.controller
    }

    /// The controller begins anew, and with it the slew of the references.
    pub(crate) fn restart(&mut self) {
        self.controller = self.first.clone();
        // What follows is not this drive's command.
        (self.state.started, self.state.compensation) = (false, Complex::new(T::zero(), T::zero()));
    }

    /// What the last command holds for the dead time and against the offset, V.
    pub(crate) fn compensation(&self) -> Complex<T> {
        self.state.compensation
    }

    /// The controller, to set something in it (a rotor resistance, a load torque).
    pub fn controller_mut(&mut self) -> &mut C {
        &mut self.controller
    }
}

impl<T: Scalar, C: Controller<T> + Reports + Clone> Drive<T, C> {
    /// What to believe of a measurement.
    #[inline]
    fn believe(&mut self, m: &Measured<T>) -> (Measured<T>, DriveStatus) {
        let (l, s) = (&self.limits, &self.state);
        let last = &s.believed;
        // A sampling time that no drive has is a fault of the caller's clock.
        let t_ok = is_sample_time(m.sample_time_s);
        let sample_time_s = if t_ok { m.sample_time_s } else { last.sample_time_s };
        let speed_ok = m.omega_m.is_finite() && m.omega_m.abs() <= l.speed_range_rad_s;
        let omega_m = if speed_ok { m.omega_m } else { last.omega_m };
        let current_ok = t_ok && is_finite(m.i_s) && norm2(m.i_s) <= l.current_range_a * l.current_range_a;
        let n_p = T::from_f64(f64::from(l.pole_pairs));
        let i_s = if current_ok { m.i_s } else { last.i_s * rotation(n_p * omega_m * sample_time_s) };
        let dc_ok = m.dc_voltage_v >= T::zero() && m.dc_voltage_v <= l.voltage_max_v * T::from_f64(1e3);
        let dc_voltage_v = if dc_ok { m.dc_voltage_v } else { last.dc_voltage_v };
        let u_s = if is_finite(m.u_s) { m.u_s - s.compensation } else { last.u_s };
        let status = DriveStatus::OK
            .and_if(!current_ok, DriveStatus::CURRENT_LOST)
            .and_if(!speed_ok, DriveStatus::SPEED_LOST)
            .and_if(!dc_ok, DriveStatus::DC_VOLTAGE_LOST)
            .and_if(norm2(i_s) > l.overcurrent_a * l.overcurrent_a, DriveStatus::OVERCURRENT);
        (Measured { i_s, omega_m, u_s, dc_voltage_v, sample_time_s }, status)
    }

    /// What of a reference is passed on.
    #[inline]
    fn admit(&self, r: &Reference<T>, m: &Measured<T>) -> (Reference<T>, DriveStatus) {
        let (l, last) = (&self.limits, &self.state.reference);
        let mut status = DriveStatus::OK;
        let mut one = |x: T, last: T, low: T, high: T| {
            status = status.and_if(!x.is_finite(), DriveStatus::REFERENCE_LOST);
            let x = if x.is_finite() { x } else { last };
            status = status.and_if(x < low || x > high, DriveStatus::REFERENCE_LIMITED);
            clamp(x, low, high)
        };
        let omega_m = one(r.omega_m, last.omega_m, -l.speed_max_rad_s, l.speed_max_rad_s);
        let rotor_flux_vs = one(r.rotor_flux_vs, last.rotor_flux_vs, T::zero(), l.rotor_flux_max_vs);
        let torque_nm = one(r.torque_nm, last.torque_nm, -l.torque_max_nm, l.torque_max_nm);
        // A drive begins from the speed that the machine has.
        let from = if self.state.started { last.omega_m } else { m.omega_m };
        let slew = |from: T, to: T, rate: T| clamp(to, from - rate * m.sample_time_s, from + rate * m.sample_time_s);
        let omega_m = slew(from, omega_m, l.speed_slew_rad_s2);
        let torque_nm = slew(last.torque_nm, torque_nm, l.torque_slew_nm_per_s);
        (Reference { omega_m, rotor_flux_vs, torque_nm }, status)
    }

    /// The last command, turned with the rotor and fading.
    fn fading(&self, m: &Measured<T>) -> Command<T> {
        let n_p = T::from_f64(f64::from(self.limits.pole_pairs));
        let share = (T::one() - m.sample_time_s / self.limits.fade_s).max(T::zero());
        let turn = rotation(n_p * m.omega_m * m.sample_time_s) * share;
        match self.state.command {
            Command::Voltage(u) => Command::Voltage(u * turn),
            Command::Current(i) => Command::Current(i * turn),
        }
    }
}

impl<T: Scalar, C: Controller<T> + Reports + Clone> Controller<T> for Drive<T, C> {
    #[inline]
    fn step(&mut self, measured: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        let (m, seen) = self.believe(measured);
        let (r, asked) = self.admit(reference, &m);
        let mut status = seen.and(asked);
        let lost = status.has(DriveStatus::CURRENT_LOST) || status.has(DriveStatus::SPEED_LOST);

        let s = &mut self.state;
        (s.lost, s.good) = if lost { (s.lost.saturating_add(1), 0) } else { (0, s.good.saturating_add(1)) };
        if s.lost > self.limits.lost_samples_max {
            s.blocked = true;
        } else if s.blocked && s.good > self.limits.lost_samples_max {
            s.blocked = false;
            self.controller = self.first.clone();
            status = status.and(DriveStatus::RESTARTED);
        }
        (s.believed, s.reference) = (m, r);
        if self.state.blocked {
            // The slew begins again where the machine is.
            (self.state.reference.omega_m, self.state.reference.torque_nm) = (m.omega_m, T::zero());
            self.state.compensation = Complex::new(T::zero(), T::zero());
            self.state.command = self.fading(&m);
            self.state.status = status.and(DriveStatus::BLOCKED);
            return self.state.command;
        }
        self.state.started = true;

        let (z, l) = (Complex::new(T::zero(), T::zero()), &self.limits);
        let command = self.controller.step(&m, &r);
        let finite = match command {
            Command::Voltage(x) | Command::Current(x) => is_finite(x),
        };
        if !finite {
            self.controller = self.first.clone();
            status = status.and(DriveStatus::RESTARTED);
        }
        self.state.compensation = z;
        self.state.command = match if finite { command } else { self.fading(&m) } {
            Command::Voltage(u) => {
                let added = self.dead_time.map_or(z, |d| d.voltage(m.i_s, m.dc_voltage_v)) - self.voltage_offset_v;
                let made = within_hexagon(shortened(u + added, l.voltage_max_v), m.dc_voltage_v);
                self.state.compensation = added;
                Command::Voltage(made)
            }
            Command::Current(i) => Command::Current(shortened(i, l.overcurrent_a)),
        };
        self.state.status = status.and(self.controller.status());
        self.state.command
    }
}

impl<T: Scalar, C: BeginsAt<T>> BeginsAt<T> for Drive<T, C> {
    fn begin_at(&mut self, caught: &Caught<T>) {
        self.controller.begin_at(caught);
    }

    #[inline]
    fn draw_flux(&mut self, rotor_flux_vs: Complex<T>, share: T) {
        self.controller.draw_flux(rotor_flux_vs, share);
    }
}

impl<T: Scalar, C: Reports> Reports for Drive<T, C> {
    fn status(&self) -> DriveStatus {
        self.state.status
    }
}
