//! Judges of the workspace: what the other crates claim is tried here on data they did not make.
//!
//! [`hidden`] is a simulator of its own, kept apart from the model crate on purpose.

pub mod campaign;
pub mod hidden;
pub mod own_effect;
