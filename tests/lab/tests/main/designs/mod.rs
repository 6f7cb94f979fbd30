//! Designs: what is certified checks exactly, holds in simulation and on the code of observers and controllers, and cannot be forged.

mod attacks;
mod every_kind;
mod generated;
mod kenne;
mod random_machines;
mod real_code;
mod simulations;
mod support;
