//! Controllers in closed loop with the machine model.

mod bad_input;
mod common;
mod designed;
mod flying_start;
mod jadot_bench;
mod kenne_study;
mod limits;
mod mtpa;
mod random_machines;
mod table_v;
