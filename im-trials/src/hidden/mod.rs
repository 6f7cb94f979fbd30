//! A simulator of machines with hidden effects, to judge diagnosis with.
//!
//! It shares no equations' code and no functional forms with the model crate: currents of the circuit's branches are its states instead of
//! fluxes, with incremental inductances, the rotor in rotor coordinates and an adaptive integrator; its curves of saturation, friction and
//! dead time are others; its drives and manoeuvres are its own.
//!
//! ```
//! use im_trials::hidden::{TrialCase, EffectKind, Sampling, Strength, simulate};
//!
//! let mut case = TrialCase::new(3, &[(EffectKind::IronLoss, Strength::Medium)], 1);
//! case.sampling = Some(Sampling { sample_s: 1e-4, duration_s: 0.05 });
//! let trial = simulate(&case);
//! assert_eq!(trial.train[0].rows(), 500);
//! assert_eq!(trial.truth.effects[0].kind, EffectKind::IronLoss);
//! ```

pub mod chance;
pub mod curve;
pub mod drive;
pub mod effect;
pub mod integrator;
pub mod machine;
pub mod manoeuvre;
pub mod outfit;
pub mod outside;
pub mod plane;
pub mod plant;
pub mod run;
pub mod sensors;
pub mod slow_core;
pub mod smooth_sign;
pub mod steady;
pub mod table;
pub mod trial;

#[cfg(test)]
mod physics;

pub use effect::{EffectKind, Strength};
pub use machine::CatalogueMachine;
pub use manoeuvre::{Excitation, Part, Sampling};
pub use outfit::HiddenEffect;
pub use sensors::Noise;
pub use table::Table;
pub use trial::{Change, Trial, TrialCase, Truth, simulate};
