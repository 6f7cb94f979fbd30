//! Judges of the workspace: what the other crates claim is tried here on data they did not make.

pub mod course;
pub mod own_effect;

pub use im_trials::{campaign, hidden};
