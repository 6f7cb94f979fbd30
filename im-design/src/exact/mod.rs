//! Exact arithmetic: the field that equations are written over, and the definiteness test.

mod field;
mod ldl;

pub use field::{Field, Rational, rational};
pub use ldl::{NotPositive, positive_definite};
