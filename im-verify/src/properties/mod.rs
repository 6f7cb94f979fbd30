//! Properties of anything that implements the traits: an observer of `im-observers`, a controller of `im-model`.

mod held;
mod run_up;
mod steady;

pub mod controller;
pub mod observer;

pub use held::{HeldMachine, Operating};
pub use run_up::{RAMP_S, RunUp};
pub use steady::Steady;
