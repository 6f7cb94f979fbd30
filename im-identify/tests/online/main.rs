//! On-line identifiers on simulated machines: the claims of Kenné et al. and Jadot et al., and what happens without their assumptions.

mod bad_input;
mod bench;
mod follower;
mod jadot;
mod kenne;
mod ramp;
mod replay;
mod replay_simulated;
mod settings;
