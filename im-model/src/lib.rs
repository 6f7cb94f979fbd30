//! Three-phase induction machine: parameters, equations of motion, physical effects, simulation.
//!
//! # Conventions
//!
//! SI units. Space vectors are complex, amplitude-invariant (peak values), star-equivalent; torque carries 3/2. Stationary frame
//! α-β, positive sequence a-b-c. `omega_m` is mechanical, rad/s; `omega_e = n_p·omega_m` electrical. Load torque is positive
//! against positive rotation. Numbers in files and public fields carry their unit in the name.
//!
//! # Layers
//!
//! [`TParameters`] and [`Effects`] make a [`Machine`], checked once. [`Plant`] is the machine prepared for
//! stepping: equations of motion in any [`Scalar`] (`f32`, `f64`, [`Dual`] for exact sensitivities), without allocation or `std`.
//! [`Bench`] adds what lies around the machine in sampled time: voltage delay and sensors.
//!
//! # Features
//!
//! | feature | default | gives |
//! | --- | --- | --- |
//! | `std` | yes | files, scenarios and recordings; without it the crate is `no_std` and does not allocate |

#![cfg_attr(not(any(feature = "std", test)), no_std)]

pub mod aqdm;
pub mod effects;
pub mod machines;
pub mod simulation;
pub mod space_vector;
pub mod state_space;

mod air_gap;
#[cfg(feature = "std")]
mod atomic_file;
mod bench;
mod dual;
mod error;
#[cfg(feature = "std")]
mod file_error;
#[cfg(feature = "std")]
mod file_kind;
mod flux_map;
mod instant;
mod integral;
mod machine;
#[cfg(feature = "std")]
mod motor_file;
mod nameplate;
mod parameters;
mod plant;
#[cfg(feature = "std")]
mod prediction;
mod rating;
#[cfg(feature = "std")]
mod recording;
#[cfg(feature = "std")]
mod recording_csv;
#[cfg(feature = "std")]
mod rows;
mod scalar;
#[cfg(feature = "std")]
mod shard;
mod state;
mod steady_state;
#[cfg(feature = "std")]
mod text_file;
#[cfg(feature = "std")]
pub mod toml_text;
#[cfg(feature = "std")]
mod utf16;
#[cfg(feature = "std")]
mod winding;

pub use air_gap::AirGapSaturation;
#[cfg(feature = "std")]
pub use atomic_file::{abandon_files, check_writable, write_atomically};
pub use bench::Bench;
pub use dual::{Derivative, Dual, DualNumber, SingleDual};
pub use effects::{EffectId, Effects, Extra};
pub use error::{Bound, ModelError};
#[cfg(feature = "std")]
pub use file_error::{FileError, Problem};
#[cfg(feature = "std")]
pub use file_kind::FileKind;
pub use instant::{Currents, Output, PlantInput, Powers};
pub use machine::{Machine, ParameterId};
#[cfg(feature = "std")]
pub use motor_file::{Known, MotorFile, TerminalResistance, WARMER_IN_USE, WINDING_C};
pub use nameplate::{DesignClass, Nameplate, NameplateGuess};
pub use num_complex::Complex;
pub use parameters::{
    BaseParameter, DerivedConstants, GammaParameters, InverseGammaParameters, KenneConstants, TParameters, WindingParameters,
};
pub use plant::{Evaluation, Ledger, Plant, SUBSTEPS_MAX};
#[cfg(feature = "std")]
pub use prediction::{ErrorBand, Prediction};
pub use rating::Rating;
#[cfg(feature = "std")]
pub use recording::Recording;
#[cfg(feature = "std")]
pub use recording_csv::{CanonicalColumns, VectorColumns};
#[cfg(feature = "std")]
pub use rows::{Rows, TextFormat, fields_of, number_in, sampling_time, time_of_day};
pub use scalar::Scalar;
#[cfg(feature = "std")]
pub use shard::Shard;
pub use state::{LoadLaw, State};
pub use steady_state::{Held, steady_state};
#[cfg(feature = "std")]
pub use text_file::read_text;
#[cfg(feature = "std")]
pub use utf16::AsUtf8;
#[cfg(feature = "std")]
pub use winding::Conductor;

/// The example of the README is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
