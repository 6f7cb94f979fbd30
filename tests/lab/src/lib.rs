//! For tests, examples and benches alone: what several of them share, and what takes more crates than one.
#![allow(missing_docs, reason = "names, and the papers named at the head of each file, say what a study holds")]

pub mod aqdm;
pub mod cost;
pub mod jadot_experiment;
pub mod kenne_study;
pub mod kwon;
pub mod observation;
pub mod observer_error;
