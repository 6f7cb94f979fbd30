//! A scenario: what drives the machine, what loads it, what is recorded.

use crate::error::{Bound, ModelError};
use crate::recording::Recording;
use crate::simulation::bridge::Bridge;
use crate::simulation::carrier_pwm::CarrierPwm;
use crate::simulation::controller::Reference;
use crate::simulation::delta_modulator::DeltaModulator;
use crate::simulation::profile::Profile;
use crate::simulation::sensors::Sensors;
use crate::simulation::supply::{Mains, VoltsPerHertz};
use crate::state::State;
use crate::steady_state::Held;

/// Everything about a run but the machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// What the recording is called.
    pub name: String,
    /// How long, s.
    pub duration_s: f64,
    /// Sampling time of control and sensors, s.
    pub sample_time_s: f64,
    /// Every how many samples a row is recorded, from 1. The recorded voltage is the mean over them.
    pub record_every: u32,
    /// Where the voltage comes from.
    pub source: Source,
    /// What makes the voltage.
    pub inverter: Inverter,
    /// What brakes the shaft.
    pub load: Load,
    /// When given, the rotor turns at this speed (rad/s) whatever the torque.
    pub imposed_speed: Option<Profile>,
    /// Where the run begins.
    pub start: Start,
    /// What the data acquisition adds.
    pub sensors: Sensors,
}

/// Where the voltage comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// The voltages of a recording, and its load torque where it has one, are commanded again. Its sampling time is used.
    Recording(Recording),
    /// The mains: direct on line.
    Mains(Mains<f64>),
    /// An inverter keeping volts per hertz along a frequency profile, Hz.
    VoltsPerHertz(VoltsPerHertz<f64>, Profile),
    /// A rotating current reference for a delta modulator.
    RotatingCurrent {
        /// Peak, A.
        amplitude_a: Profile,
        /// Frequency, Hz.
        frequency_hz: Profile,
    },
    /// A controller, handed to the simulation.
    Controller {
        /// Which, for those who make controllers from files.
        name: String,
        /// The observer whose speed it takes in place of the sensor's, where there is one.
        observer: Option<String>,
        /// What is asked of it.
        references: References,
    },
}

/// What is asked of a controller over time.
#[derive(Clone, Debug, PartialEq)]
pub struct References {
    /// Mechanical speed, rad/s.
    pub speed_rad_s: Profile,
    /// Rotor flux linkage, Vs.
    pub rotor_flux_vs: Profile,
    /// Torque, Nm.
    pub torque_nm: Profile,
}

impl References {
    /// The references at a time, s.
    pub fn at(&self, t: f64) -> Reference<f64> {
        Reference { omega_m: self.speed_rad_s.at(t), rotor_flux_vs: self.rotor_flux_vs.at(t), torque_nm: self.torque_nm.at(t) }
    }
}

/// What makes the voltage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Inverter {
    /// The command is applied as it is, held over the sample; within the hexagon if a dc voltage is given.
    Averaged {
        /// Voltage of the dc link, V.
        dc_voltage_v: Option<f64>,
    },
    /// Carrier modulation. A sample is a whole number of half carrier periods.
    CarrierPwm(CarrierPwm<f64>, Bridge<f64>),
    /// Delta modulation. A sample is a whole number of its periods.
    DeltaModulation(DeltaModulator<f64>, Bridge<f64>),
}

impl Inverter {
    /// The period that divides the sampling time, s.
    pub fn period_s(&self) -> Option<f64> {
        match self {
            Self::Averaged { .. } => None,
            Self::CarrierPwm(pwm, _) => Some(pwm.half_period_s),
            Self::DeltaModulation(delta, _) => Some(delta.period_s),
        }
    }
}

/// The load torque: τ = profile(t) + c ω|ω|.
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    /// Torque over time, Nm.
    pub torque_nm: Profile,
    /// Quadratic part (fans, pumps), Nm s².
    pub quadratic_nm_s2: f64,
}

impl Load {
    /// No load.
    pub fn none() -> Self {
        Self { torque_nm: Profile::constant(0.0), quadratic_nm_s2: 0.0 }
    }

    /// The torque at a time (s) and speed of the load (rad/s), Nm.
    pub fn at(&self, t: f64, omega: f64) -> f64 {
        self.torque_nm.at(t) + self.quadratic_nm_s2 * omega * omega.abs()
    }
}

/// Where a run begins.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// Standstill, cold, unmagnetized.
    Rest,
    /// The sinusoidal steady state at the source's first voltage and frequency.
    SteadyState(Held),
    /// A given state.
    State(State<f64>),
}

impl Scenario {
    /// A run of the mains onto a machine at rest, without load, at 10 kHz: change what differs.
    pub fn direct_on_line(voltage_peak_v: f64, frequency_hz: f64, duration_s: f64) -> Self {
        Self {
            name: "direct_on_line".to_owned(),
            duration_s,
            sample_time_s: 1e-4,
            record_every: 1,
            source: Source::Mains(Mains { voltage_peak_v, frequency_hz, phase_rad: 0.0, closing_s: 0.0 }),
            inverter: Inverter::Averaged { dc_voltage_v: None },
            load: Load::none(),
            imposed_speed: None,
            start: Start::Rest,
            sensors: Sensors::default(),
        }
    }

    /// The sampling time in use, s: that of the recording, if one is the source.
    pub fn sampling_time_s(&self) -> f64 {
        if let Source::Recording(r) = &self.source { r.sample_time_s } else { self.sample_time_s }
    }

    /// The number of samples.
    pub fn samples(&self) -> usize {
        let n = (self.duration_s / self.sampling_time_s()).round() as usize;
        if let Source::Recording(r) = &self.source { n.min(r.len()) } else { n }
    }

    /// Checks every value, alone and against the others.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        Bound::Within(1e-7, 1.0).check("sample_time_s", self.sampling_time_s())?;
        Bound::Positive.check("duration_s", self.duration_s)?;
        Bound::Within(1.0, 1e9).check("samples in duration_s", self.duration_s / self.sampling_time_s())?;
        Bound::Within(1.0, 1e6).check("record_every", f64::from(self.record_every))?;
        // What fits in the memory of a workstation.
        let rows = self.duration_s / self.sampling_time_s() / f64::from(self.record_every);
        Bound::Within(0.0, 1e8).check("rows (raise record_every): duration_s/sample_time_s/record_every", rows)?;
        Bound::Within(-1e9, 1e9).check("quadratic_nm_s2", self.load.quadratic_nm_s2)?;
        self.sensors.validate()?;
        let nyquist = Bound::Within(0.0, 0.5 / self.sampling_time_s());
        match &self.source {
            Source::Mains(mains) => {
                mains.validate()?;
                nyquist.check("frequency_hz", mains.frequency_hz.abs())?;
            }
            Source::VoltsPerHertz(v, profile) => {
                v.validate()?;
                nyquist.check("reference_hz", profile.largest())?;
            }
            Source::RotatingCurrent { frequency_hz, .. } => nyquist.check("frequency_hz", frequency_hz.largest())?,
            Source::Recording(_) | Source::Controller { .. } => {}
        }
        match self.inverter {
            Inverter::Averaged { dc_voltage_v } => Bound::Positive.check("dc_voltage_v", dc_voltage_v.unwrap_or(1.0))?,
            Inverter::CarrierPwm(_, bridge) | Inverter::DeltaModulation(_, bridge) => bridge.validate()?,
        }
        if let Some(period) = self.inverter.period_s() {
            Bound::Within(1e-7, self.sampling_time_s() * (1.0 + 1e-9)).check("period of the inverter, s", period)?;
        }
        Ok(())
    }
}
