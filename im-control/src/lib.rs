//! Controllers of induction machines, modulation and drive logic.
//!
//! Every controller implements [`im_model::simulation::Controller`]: what was measured and what is asked for at the beginning of a
//! sample go in, the voltage or current for the sample comes out. `no_std`, without allocation, `f32` and `f64`.
//!
//! # Features
//!
//! | feature | default | gives |
//! | --- | --- | --- |
//! | `std` | yes | controllers by name from a scenario's file, `std::error::Error` through `im-model`; without it the crate is `no_std` |

#![cfg_attr(not(any(feature = "std", test)), no_std)]

pub mod field_oriented;
pub mod jadot;
pub mod kenne;
pub mod modulation;
pub mod mtpa;

pub mod commissioning;
mod current_regulator;
mod delay;
pub mod direct_torque;
mod discrete_current;
mod drive;
mod error;
mod field_weakening;
mod flux;
mod flying_start;
mod guard;
mod load_torque;
mod machine_data;
#[cfg(feature = "std")]
pub mod named;
#[cfg(feature = "std")]
mod of_scenario;
mod optimal_flux;
mod overmodulation;
mod reference;
mod sensorless;
mod speed_loop;
mod speed_regulator;
mod stator_flux;
mod status;
mod vector;
pub mod volts_per_hertz;

pub use commissioning::{
    Commissioned, Commissioning, CommissioningFault, CommissioningPlan, CommissioningStage, Fit, Found, MagnetizingPoint,
    NO_LOAD_LEVELS,
};
pub use current_regulator::{CurrentRegulator, Regulated, Turning};
pub use direct_torque::{DirectTorque, DirectTorqueGains};
pub use discrete_current::{CurrentControl, DiscreteCurrent};
pub use drive::{Drive, DriveLimits};
pub use error::ControlError;
pub use field_oriented::{FieldOriented, FieldOrientedGains, Orientation};
pub use field_weakening::FieldWeakening;
pub use flux::{RotorFlux, RotorFluxModel};
pub use flying_start::{BeginsAt, Caught, FlyingStart};
pub use jadot::{Jadot, JadotGains};
pub use kenne::{Kenne, KenneGains};
pub use load_torque::{LoadTorqueEstimate, LoadTorqueObserver};
pub use machine_data::MachineData;
pub use mtpa::{Mtpa, MtpaGains, MtpaLaw};
#[cfg(feature = "std")]
pub use of_scenario::of_scenario;
pub use optimal_flux::{FluxAim, Iron, OptimalFlux};
pub use overmodulation::{SIX_STEP, overmodulated};
pub use reference::{ReferenceShaper, Shaped};
pub use sensorless::Sensorless;
pub use speed_loop::SpeedLoop;
pub use speed_regulator::SpeedRegulator;
pub use status::{DriveStatus, Reports};
pub use volts_per_hertz::{VoltsPerHertz, VoltsPerHertzGains};

#[cfg(test)]
mod tests;

/// The examples of the README are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
