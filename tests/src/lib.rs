//! Judges of the workspace: what the other crates claim is tried here on data they did not make.

pub mod course;
#[rustfmt::skip]
#[allow(missing_docs, clippy::all, clippy::pedantic, reason = "as `im learn --rust` writes them")]
pub mod learned;
pub mod own_effect;
pub mod slow_reversal;

pub use im_trials::{campaign, hidden, learning};
