//! Recordings as laboratories have them.

mod draft;
mod findings;
mod mapping;
mod measured;
mod simulated;
mod tables;
