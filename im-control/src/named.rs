//! Controllers by name, with typical gains, looked after: for programs and comparisons on a host.

use im_identify::online::{Fixed, Lambda};
use im_model::simulation::Controller;
use im_model::{Machine, Rating};
use im_observers::{Basis, Named, ObserverError, StartingGains, Visit, each};
use thiserror::Error;

use crate::direct_torque::{DirectTorque, DirectTorqueGains};
use crate::error::ControlError;
use crate::field_oriented::{FieldOriented, FieldOrientedGains};
use crate::field_weakening::FieldWeakening;
use crate::jadot::{Jadot, JadotGains};
use crate::kenne::{Kenne, KenneGains};
use crate::machine_data::MachineData;
use crate::modulation::DeadTimeCompensation;
use crate::mtpa::{Mtpa, MtpaGains, MtpaLaw};
use crate::optimal_flux::{FluxAim, Iron};
use crate::status::Reports;
use crate::volts_per_hertz::{VoltsPerHertz, VoltsPerHertzGains};
use crate::{BeginsAt, Drive, DriveLimits, FlyingStart, Sensorless};

/// A controller that says how it is doing, and may be sent to another thread.
pub trait Supervised: Controller<f64> + Reports + Send {}
impl<C: Controller<f64> + Reports + Send> Supervised for C {}

/// The names, and what each controller follows.
pub const NAMES: [(&str, &str); 9] = [
    ("indirect_field_orientation", "speed and rotor flux; flux from current and speed"),
    ("direct_field_orientation", "speed and rotor flux; flux from the voltage above 5 Hz"),
    (
        "least_current_field_orientation",
        "speed with the flux of least current for the torque; iron known; the flux asked for is the largest",
    ),
    (
        "least_loss_field_orientation",
        "speed with the flux of least copper and iron loss; iron known; the flux asked for is the largest",
    ),
    ("kenne", "speed and rotor flux; sliding modes of Kenné et al."),
    ("jadot", "speed and rotor flux; passivity-based regulation of Jadot et al., parameters fixed"),
    ("direct_torque", "speed and rotor flux; a voltage vector for each sample, suits 25 us; baseline"),
    ("volts_per_hertz", "speed and rotor flux without seeing either; slip compensated; baseline"),
    ("mtpa", "torque with the least current, of Kwon et al.; gives currents, for delta modulation"),
];

/// What a controller is made for.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// The machine as the controller knows it.
    pub machine: MachineData<f64>,
    /// Its rating.
    pub rating: Rating,
    /// Voltage of the dc link, V.
    pub dc_voltage_v: f64,
    /// Sampling time, s.
    pub sample_time_s: f64,
    /// What the bridge takes, where it is to be compensated.
    pub dead_time: Option<DeadTimeCompensation<f64>>,
    /// What is known of the iron, for the flux of least current or loss.
    pub iron: Iron<f64>,
    /// The law for `mtpa`.
    pub mtpa: Option<MtpaLaw<f64>>,
    /// The observer, by name, whose speed stands in for the sensor's, with the machine that it is made for.
    pub observer: Option<(&'static str, Machine<f64>)>,
}

/// Why there is no such controller.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum NamedError {
    /// The name is not one of [`NAMES`].
    #[error("there is no controller named \"{0}\"; there are {list}", list = NAMES.map(|(name, _)| name).join(", "))]
    Unknown(String),
    /// The observer's name is not one of `im_observers::NAMES`.
    #[error("there is no observer named \"{0}\"; there are {list}", list = im_observers::NAMES.join(", "))]
    UnknownObserver(String),
    /// `mtpa` needs a law.
    #[error("the controller mtpa needs a law for current and slip")]
    NoLaw,
    /// The observer does not suit.
    #[error(transparent)]
    Observer(#[from] ObserverError),
    /// An observer that reads the speed cannot stand in for it.
    #[error("the observer {0} needs a measured speed")]
    NeedsSpeed(&'static str),
    /// The machine does not suit.
    #[error(transparent)]
    Control(#[from] ControlError),
}

/// Makes a controller.
///
/// # Errors
/// The name is unknown, or a quantity is out of bounds.
pub fn named(name: &str, setting: &Setting) -> Result<Box<dyn Supervised>, NamedError> {
    let Setting { machine, rating, dc_voltage_v, sample_time_s, .. } = *setting;
    let flux = rating.rotor_flux_vs;
    let field_oriented = FieldOrientedGains::typical(&machine, flux, sample_time_s);
    match name {
        "indirect_field_orientation" => setting.caught(FieldOriented::try_new(&machine, &field_oriented)?),
        "direct_field_orientation" => setting.caught(FieldOriented::try_new(&machine, &field_oriented.direct())?),
        "least_current_field_orientation" | "least_loss_field_orientation" => {
            let aim = if name == "least_loss_field_orientation" { FluxAim::LeastLoss } else { FluxAim::LeastCurrent };
            setting.caught(FieldOriented::try_new(&machine, &field_oriented.with_optimal_flux(aim, setting.iron))?)
        }
        "kenne" => setting.caught(Kenne::try_new(&machine, &KenneGains::typical(&machine, flux, dc_voltage_v, sample_time_s))?),
        "jadot" => {
            let parameters = regulation_parameters(&machine);
            let fixed = Fixed::try_new(parameters.into()).map_err(ControlError::from)?;
            setting.caught(Jadot::try_new(&machine, &JadotGains::typical(&machine, flux, sample_time_s), fixed)?)
        }
        "direct_torque" => {
            let gains = DirectTorqueGains::typical(&machine, flux, dc_voltage_v, sample_time_s);
            setting.caught(DirectTorque::try_new(&machine, &gains)?)
        }
        "volts_per_hertz" => {
            let gains = VoltsPerHertzGains::typical(&machine, flux);
            setting.caught(VoltsPerHertz::try_new(&machine, &gains, sample_time_s)?)
        }
        "mtpa" => {
            let law = setting.mtpa.ok_or(NamedError::NoLaw)?;
            let mtpa = Mtpa::try_new(&machine, &law, &MtpaGains::typical(&machine))?;
            setting.tracked(mtpa)
        }
        other => Err(NamedError::Unknown(other.to_owned())),
    }
}

impl Setting {
    /// A controller of voltages, with the speed of the sensor or of the observer.
    fn caught<C>(&self, controller: C) -> Result<Box<dyn Supervised>, NamedError>
    where
        C: Controller<f64> + BeginsAt<f64> + Reports + Clone + Send + 'static,
    {
        match self.observer {
            None => self.looked_after(FlyingStart::try_new(controller, &self.machine, self.sample_time_s)?),
            Some(observer) => self.sensorless(controller, observer, false),
        }
    }

    /// A controller of currents.
    fn tracked<C>(&self, controller: C) -> Result<Box<dyn Supervised>, NamedError>
    where
        C: Controller<f64> + BeginsAt<f64> + Reports + Clone + Send + 'static,
    {
        match self.observer {
            None => {
                let start = FlyingStart::try_new(controller, &self.machine, self.sample_time_s)?;
                self.looked_after(start.tracking_currents())
            }
            Some(observer) => self.sensorless(controller, observer, true),
        }
    }

    fn limits(&self) -> DriveLimits<f64> {
        let speed = self.rating.synchronous_speed_rad_s(self.machine.pole_pairs);
        DriveLimits::generous(&self.machine, speed, self.rating.rotor_flux_vs)
    }

    fn looked_after<C>(&self, controller: C) -> Result<Box<dyn Supervised>, NamedError>
    where
        C: Controller<f64> + Reports + Clone + Send + 'static,
    {
        let mut drive = Drive::try_new(controller, &self.limits())?;
        if let Some(dead_time) = &self.dead_time {
            drive = drive.compensating(dead_time)?;
        }
        Ok(Box::new(drive))
    }

    fn sensorless<C>(
        &self,
        controller: C,
        (name, machine): (&'static str, Machine<f64>),
        currents: bool,
    ) -> Result<Box<dyn Supervised>, NamedError>
    where
        C: Controller<f64> + BeginsAt<f64> + Reports + Clone + Send + 'static,
    {
        let basis = Basis::try_new(&machine, &self.rating, self.sample_time_s)?.with_saturation(&machine);
        let mut search = WithSpeedOf { name, controller: Some(controller), setting: self, basis, machine, currents, made: None };
        each(&mut search);
        search.made.unwrap_or_else(|| Err(NamedError::UnknownObserver(name.to_owned())))
    }
}

/// A controller with the speed of the observer of a name.
struct WithSpeedOf<'a, C> {
    name: &'static str,
    controller: Option<C>,
    setting: &'a Setting,
    basis: Basis<f64>,
    machine: Machine<f64>,
    currents: bool,
    made: Option<Result<Box<dyn Supervised>, NamedError>>,
}

impl<C: Controller<f64> + BeginsAt<f64> + Reports + Clone + Send + 'static> WithSpeedOf<'_, C> {
    fn make<O: Named<f64> + 'static>(&self, controller: C) -> Result<Box<dyn Supervised>, NamedError> {
        let s = self.setting;
        let observer = O::made(self.basis, &self.machine, &s.rating, &StartingGains)?;
        let mut drive = Sensorless::try_new(controller, observer, &s.machine, &s.limits(), s.sample_time_s)?;
        if let Some(dead_time) = &s.dead_time {
            drive = drive.compensating(dead_time)?;
        }
        Ok(Box::new(if self.currents { drive.tracking_currents() } else { drive }))
    }
}

impl<C: Controller<f64> + BeginsAt<f64> + Reports + Clone + Send + 'static> Visit<f64> for WithSpeedOf<'_, C> {
    fn visit<O: Named<f64> + 'static>(&mut self) {
        if O::NAME != self.name {
            return;
        }
        let Some(controller) = self.controller.take() else { return };
        self.made = Some(if O::NEEDS_SPEED { Err(NamedError::NeedsSpeed(O::NAME)) } else { self.make::<O>(controller) });
    }
}

fn regulation_parameters(machine: &MachineData<f64>) -> im_model::InverseGammaParameters<f64> {
    let w = &machine.windings;
    let k = w.mutual_inductance_h / w.rotor_inductance_h;
    let l = k * w.mutual_inductance_h;
    im_model::InverseGammaParameters {
        stator_resistance_ohm: w.stator_resistance_ohm,
        rotor_resistance_ohm: k * k * w.rotor_resistance_ohm,
        leakage_inductance_h: w.stator_inductance_h - l,
        magnetizing_inductance_h: l,
    }
}

impl JadotGains<f64> {
    /// Gains that suit a sampling time, by the polynomials of `im_design::jadot` at a damping of 1/√2: natural frequencies of the current
    /// loop of 0.15 over sampling time plus delay (1000 rad/s at most) and of the speed loop of a fortieth of that, but not faster than 0.6(R_s + R_req)/L_f, the rate of (20); λ of Section V.
    /// The proof over a region is `im_design`'s.
    pub fn typical(machine: &MachineData<f64>, rotor_flux_vs: f64, sample_time_s: f64) -> Self {
        let p = regulation_parameters(machine);
        let lag = sample_time_s + machine.voltage_delay_s;
        let total = p.stator_resistance_ohm + p.rotor_resistance_ohm;
        let damping2 = core::f64::consts::SQRT_2;
        // Above what the resistances alone damp.
        let current = (0.15 / lag).min(1000.0).max(1.5 * total / (damping2 * p.leakage_inductance_h));
        // (20) must be fast against the speed loop: with R = R_s + R_req in the lag, Routh asks for k_i < R/L_f.
        let speed = (current / 40.0).min(25.0).min(0.6 * total / p.leakage_inductance_h);
        let k_p = damping2 * current * p.leakage_inductance_h - total;
        let w = &machine.windings;
        let phi = rotor_flux_vs * w.mutual_inductance_h / w.rotor_inductance_h;
        let n_p = f64::from(machine.pole_pairs);
        let kappa_flux2 = 1.5 * n_p * n_p / w.inertia_kg_m2 * phi * phi / p.rotor_resistance_ohm;
        Self {
            current_proportional_ohm: k_p,
            current_integral_per_s: p.leakage_inductance_h * current * current / k_p,
            speed_proportional: damping2 * speed / kappa_flux2,
            speed_integral_per_s: speed / damping2,
            lambda: Lambda::Scheduled,
            field_weakening: Some(FieldWeakening { bandwidth_per_s: 15.0, voltage_share: 0.92 }),
        }
    }
}
