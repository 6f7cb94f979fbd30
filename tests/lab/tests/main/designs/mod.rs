//! Designs: what is certified checks exactly, holds in simulation and on the code of observers and controllers, and cannot be forged.

mod every_kind;
mod kenne;
mod random_machines;
mod real_code;
mod simulations;
mod support;
