//! Properties of anything that implements the traits: an observer of `im-observers`, a controller of `im-model`.

mod steady;

pub mod observer;

pub use steady::Steady;
