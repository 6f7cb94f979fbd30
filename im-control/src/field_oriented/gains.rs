//! Gains of field orientation.

use im_model::{ModelError, Scalar};

use crate::current_regulator::CurrentRegulator;
use crate::discrete_current::CurrentControl;
use crate::field_weakening::FieldWeakening;
use crate::guard;
use crate::machine_data::MachineData;
use crate::optimal_flux::{FluxAim, Iron, OptimalFlux};
use crate::reference::ReferenceShaper;

/// Where the flux is taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Orientation<T> {
    /// From current and speed.
    Indirect,
    /// Above a frequency of the field from the voltage.
    Direct {
        /// That frequency, rad/s.
        crossover_rad_s: T,
    },
}

/// Bandwidths of the loops, and what they follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOrientedGains<T> {
    /// Where the flux is taken from.
    pub orientation: Orientation<T>,
    /// Of the current loop, rad/s.
    pub current_bandwidth_rad_s: T,
    /// Of the flux loop, rad/s.
    pub flux_bandwidth_rad_s: T,
    /// Of the speed loop, rad/s.
    pub speed_bandwidth_rad_s: T,
    /// The most of that bandwidth over the square of the flux, 1/(s Vs²): with an estimated speed an error of the leakage is a loop that the speed loop feeds, the more the
    /// less flux there is. `None`: the bandwidth is the same at every flux.
    pub speed_bandwidth_per_flux2: Option<T>,
    /// The torque reference is followed in place of the speed reference.
    pub follows_torque: bool,
    /// How the speed reference is shaped.
    pub reference: ReferenceShaper<T>,
    /// How the flux gives way to the voltage.
    pub field_weakening: FieldWeakening<T>,
    /// How the current is regulated.
    pub current_control: CurrentControl,
    /// Beyond the circle of the link up to six steps; `field_weakening.voltage_share` may then be up to 1.1.
    pub overmodulates: bool,
    /// Makes the flux follow the torque; without, it is what is asked for.
    pub optimal_flux: Option<OptimalFlux<T>>,
}

impl<T: Scalar> FieldOrientedGains<T> {
    /// Gains that suit a sampling time: the current loop as fast as sampling and delay allow, the flux and the speed loop a twentieth of
    /// it at most; the acceleration that 80 % of the current limit gives at `rotor_flux_vs`.
    pub fn typical(machine: &MachineData<T>, rotor_flux_vs: T, sample_time_s: T) -> Self {
        let c = T::from_f64;
        let lag = sample_time_s + machine.voltage_delay_s;
        let current = CurrentRegulator::bandwidth_for(lag);
        let w = &machine.windings;
        let psi = rotor_flux_vs * w.mutual_inductance_h / w.rotor_inductance_h;
        let torque = c(1.5 * 0.8) * machine.n_p() * psi * machine.current_max_a;
        Self {
            orientation: Orientation::Indirect,
            current_bandwidth_rad_s: current,
            flux_bandwidth_rad_s: (current * c(0.05)).min(c(30.0)),
            speed_bandwidth_rad_s: (current * c(0.05)).min(c(40.0)),
            speed_bandwidth_per_flux2: None,
            follows_torque: false,
            reference: ReferenceShaper {
                bandwidth_rad_s: (current * c(0.1)).min(c(100.0)),
                acceleration_max_rad_s2: torque / w.inertia_kg_m2,
            },
            field_weakening: FieldWeakening { bandwidth_per_s: c(15.0), voltage_share: c(0.92) },
            current_control: CurrentControl::Continuous,
            overmodulates: false,
            optimal_flux: None,
        }
    }

    /// The same with the flux from the voltage above 5 Hz.
    #[must_use]
    pub fn direct(self) -> Self {
        Self { orientation: Orientation::Direct { crossover_rad_s: T::from_f64(31.4) }, ..self }
    }

    /// The same with the flux of least current or loss, for iron that is known; the flux asked for is the largest.
    #[must_use]
    pub fn with_optimal_flux(self, aim: FluxAim, iron: Iron<T>) -> Self {
        Self { optimal_flux: Some(OptimalFlux::new(aim, iron)), ..self }
    }

    /// The same with the current regulated in sampled time, for few samples in a turn of the field; 0.15 over the sampling time is its bandwidth, whatever the delay.
    #[must_use]
    pub fn discrete(self, sample_time_s: T) -> Self {
        let current_bandwidth_rad_s = T::from_f64(0.15) / sample_time_s;
        Self { current_control: CurrentControl::Discrete, current_bandwidth_rad_s, ..self }
    }

    /// The same with overmodulation, to 1.05 of the inscribed circle in the steady state.
    #[must_use]
    pub fn overmodulating(self) -> Self {
        let field_weakening = FieldWeakening { voltage_share: T::from_f64(1.05), ..self.field_weakening };
        Self { overmodulates: true, field_weakening, ..self }
    }

    pub(super) fn validate(&self) -> Result<(), ModelError> {
        guard::SIZE.check("current_bandwidth_rad_s", self.current_bandwidth_rad_s.value())?;
        guard::SIZE.check("flux_bandwidth_rad_s", self.flux_bandwidth_rad_s.value())?;
        guard::SIZE.check("speed_bandwidth_rad_s", self.speed_bandwidth_rad_s.value())?;
        if let Some(per_flux2) = self.speed_bandwidth_per_flux2 {
            guard::SIZE.check("speed_bandwidth_per_flux2", per_flux2.value())?;
        }
        if let Orientation::Direct { crossover_rad_s } = self.orientation {
            guard::SIZE.check("crossover_rad_s", crossover_rad_s.value())?;
        }
        self.reference.validate()?;
        self.optimal_flux.map_or(Ok(()), |o| o.validate())?;
        self.field_weakening.validate_to(if self.overmodulates { 1.1 } else { 1.0 })
    }
}
