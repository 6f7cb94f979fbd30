//! The main job: compare the model with measurements, see where it fails, learn which physical effect is missing, add it, and watch
//! the error fall.
//!
//! * [`intake`]: foreign files to experiments, with what is wrong with the data; [`case`]: a motor with its recordings;
//!   [`sources`]: from files and options to that.
//! * [`search`]: scores that nominate effects and the refits that decide; [`diagnosis`]: the verdict, with everything that led to it.
//! * [`localise`], [`residual_tests`]: where the model fails, and what the residual depends on; [`next_test`]: the manoeuvre that
//!   separates rivals.
//! * [`report`]: terminal, HTML and JSON.
//!
//! # Features
//!
//! | feature | default | gives |
//! | --- | --- | --- |
//! | `parquet` | no | recordings in Parquet files, with every compression that needs Rust alone |
//! | `hdf5` | no | recordings in MAT files of version 7.3 |
//! | `parquet-zstd` | no | also those compressed with zstd, for which a C compiler is needed |

pub mod case;
pub mod consistency;
pub mod diagnosis;
pub mod fitted;
pub mod form_error;
pub mod format;
pub mod held_ratio;
mod input_noise;
mod instruments;
pub mod intake;
pub mod knowledge;
pub mod learn;
pub mod left_error;
pub mod loads;
pub mod localise;
pub mod losses;
mod manoeuvres;
pub mod next_test;
pub mod noise;
pub mod report;
pub mod residual_tests;
pub mod residuals;
pub mod search;
mod shaft_lines;
pub mod sources;
pub mod statistics;
pub mod steady_curve;
mod table_balance;
pub mod table_file;
pub mod tables;
pub mod torque_column;
pub mod uncertainty;
pub mod validation;
mod winding;
pub mod worst_case;

/// The example of the README is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
