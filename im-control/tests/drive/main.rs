//! Controllers in closed loop with the machine model.

#[path = "../../lab/aqdm.rs"]
mod aqdm;
mod bad_input;
mod common;
mod designed;
mod flying_start;
mod limits;
mod mtpa;
mod random_machines;
mod table_v;
