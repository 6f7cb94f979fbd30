//! Controllers in closed loop with the machine model.

mod bad_input;
mod common;
mod designed;
mod limits;
mod mtpa;
mod random_machines;
mod sensorless;
