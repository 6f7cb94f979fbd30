//! Scenarios and drives shared by the tests.

use im_control::named::{NAMES, Setting, Supervised, named};
use im_control::{DriveLimits, Iron, MachineData, MtpaLaw};
use im_model::simulation::{Inverter, Load, Profile, References, Scenario, Source};
use im_model::{Machine, Rating};

/// They follow less exactly: a voltage vector for each sample, and no speed at all.
const BASELINES: [&str; 2] = ["direct_torque", "volts_per_hertz"];

/// What a test needs to know of a machine and its drive.
#[derive(Clone, Copy)]
pub struct DriveCase {
    pub known: MachineData<f64>,
    pub rating: Rating,
    pub dc_voltage_v: f64,
    pub sample_time_s: f64,
}

impl DriveCase {
    /// A drive for a machine: 1.5 times rated current; a dc link that gives the rated voltage with a twelfth to spare.
    pub fn new(machine: &Machine<f64>, rating: &Rating, delay_s: f64) -> Self {
        let current = 1.5 * rating.current_peak_a(machine.parameters(), machine.pole_pairs());
        let known = MachineData::of(machine, current).delayed(delay_s);
        Self { known, rating: *rating, dc_voltage_v: rating.phase_voltage_peak_v * 3f64.sqrt() / 0.92, sample_time_s: 1e-4 }
    }

    pub fn speed_rad_s(&self) -> f64 {
        self.rating.synchronous_speed_rad_s(self.known.pole_pairs)
    }

    pub fn limits(&self) -> DriveLimits<f64> {
        DriveLimits::generous(&self.known, self.speed_rad_s(), self.rating.rotor_flux_vs)
    }

    /// A drive by name.
    pub fn drive(&self, name: &str, mtpa: Option<MtpaLaw<f64>>) -> Box<dyn Supervised> {
        let Self { known, rating, dc_voltage_v, sample_time_s } = *self;
        let setting = Setting {
            machine: known,
            rating,
            dc_voltage_v,
            sample_time_s,
            dead_time: None,
            iron: Iron::ideal(),
            mtpa,
            observer: None,
        };
        named(name, &setting).unwrap()
    }

    /// Every speed drive but the baselines, by name.
    pub fn drives(self) -> impl Iterator<Item = (&'static str, Box<dyn Supervised>)> {
        self.with_baselines().filter(|(name, _)| !BASELINES.contains(name))
    }

    /// Every speed drive, by name.
    pub fn with_baselines(self) -> impl Iterator<Item = (&'static str, Box<dyn Supervised>)> {
        let names = NAMES.into_iter().map(|(name, _)| name).filter(|name| *name != "mtpa");
        names.map(move |name| (name, self.drive(name, None)))
    }

    pub fn scenario(&self, speed: Profile, load: Profile, duration_s: f64) -> Scenario {
        Scenario {
            name: "test".into(),
            source: Source::Controller {
                name: "test".into(),
                observer: None,
                references: References {
                    speed_rad_s: speed,
                    rotor_flux_vs: (0.95 * self.rating.rotor_flux_vs).into(),
                    torque_nm: 0.0.into(),
                },
            },
            inverter: Inverter::Averaged { dc_voltage_v: Some(self.dc_voltage_v) },
            load: Load { torque_nm: load, quadratic_nm_s2: 0.0 },
            sample_time_s: self.sample_time_s,
            ..Scenario::direct_on_line(0.0, 50.0, duration_s)
        }
    }
}

pub fn points(p: &[[f64; 2]]) -> Profile {
    Profile::points(p).unwrap()
}
