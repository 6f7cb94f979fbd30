//! The program from outside: what it prints, writes and returns.

mod commission;
mod common;
#[cfg(feature = "design")]
mod design;
mod fleet;
mod identify;
#[cfg(unix)]
mod interrupt;
mod main_job;
mod mistakes;
mod noisy_voltage;
mod observe;
mod outputs;
mod simulate;
mod switched_supply;
mod unmeasured;
#[cfg(feature = "verify")]
mod verify;
