//! Exact arithmetic: the field that equations are written over, and the definiteness test.

mod field;
mod interval;
mod ldl;

pub use field::{Field, Rational, rational};
pub use interval::Interval;
pub use ldl::{NotPositive, positive_definite};
