//! Running a machine through a scenario: supply or controller, inverter, load, sensors; the result is a [`Recording`](crate::Recording).
//!
//! Time is sampled. At t_k the sensors are read (row k of the recording), the source or the [`Controller`] gives its [`Command`]
//! for [t_k, t_{k+1}), the inverter makes a voltage of it, and the machine is integrated over the sample with the load torque held.
//! With the averaged inverter the command is held over the sample, so that running the recording again gives the same numbers; the
//! switched ones ([`CarrierPwm`], [`DeltaModulator`] on a [`Bridge`]) act at the instants of their edges.
//!
//! Without `std` the parts are there that firmware shares: the controller's interface, bridge, modulators and supplies.

mod bridge;
mod carrier_pwm;
mod controller;
mod delta_modulator;
mod supply;

#[cfg(feature = "std")]
mod internals_csv;
#[cfg(feature = "std")]
mod profile;
#[cfg(feature = "std")]
mod run;
#[cfg(feature = "std")]
mod scenario;
#[cfg(feature = "std")]
mod scenario_file;
#[cfg(feature = "std")]
mod sensors;
#[cfg(all(test, feature = "std"))]
mod tests;

pub use bridge::{Bridge, Fed, Legs};
pub use carrier_pwm::CarrierPwm;
pub use controller::{Command, Controller, Measured, Reference, SinglePrecision};
pub use delta_modulator::DeltaModulator;
pub use supply::{Mains, VoltsPerHertz};

#[cfg(feature = "std")]
pub use profile::Profile;
#[cfg(feature = "std")]
pub use run::{Internals, Run, Simulation, SimulationError};
#[cfg(feature = "std")]
pub use scenario::{Inverter, Load, References, Scenario, Source, Start};
#[cfg(feature = "std")]
pub use sensors::Sensors;
