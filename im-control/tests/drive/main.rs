//! Controllers in closed loop with the machine model.

#[path = "../../lab/aqdm.rs"]
mod aqdm;
mod bad_input;
mod common;
mod designed;
#[path = "../../examples/jadot_studies/experiment.rs"]
#[allow(dead_code)]
mod experiment;
mod flying_start;
mod jadot_bench;
#[path = "../../examples/kenne_studies/bench.rs"]
#[allow(dead_code)]
mod kenne_bench;
mod kenne_study;
mod limits;
mod mtpa;
mod random_machines;
mod table_v;
