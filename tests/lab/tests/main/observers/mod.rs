//! Observers on simulated machines.

mod claims;
mod corrections;
mod faults;
mod options;
mod starting;
mod symmetry;
