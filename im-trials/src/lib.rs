//! Trials of the main job on data that the other crates did not make.
//!
//! [`hidden`] is a simulator of its own: it shares no equation with `im-model`, so that what both agree on is not an echo. [`campaign`]
//! hides effects in it and puts the recordings before `im-diagnose`, which knows nothing of them. [`fleet`] makes many motors of few types.

pub mod campaign;
pub mod fleet;
pub mod hidden;
pub mod learning;

/// The example of the README is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
