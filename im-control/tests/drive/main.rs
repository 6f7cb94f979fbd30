//! Controllers in closed loop with the machine model.

mod bad_input;
mod common;
mod designed;
mod flying_start;
mod limits;
mod mtpa;
mod random_machines;
mod sensorless;
