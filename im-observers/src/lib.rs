//! Flux and speed observers for induction machines, for firmware: no `std`, no allocation, no panic on the step path, f32 and f64.
//!
//! ```text
//! Machine, Rating ─► Basis ─┐
//!                           ├─► FullOrder, Kubota, Derdiyok, Utkin, Thau, Kalman, CurrentModel ─► step(&self, &mut State, &Input) -> Estimate
//! gains (im-design) ────────┘
//! ```
//!
//! [`Basis`] is the machine as all observers see it, with limits and what is known of iron and inverter. Each observer adds its own gains,
//! plain numbers with the field names that `im-design` writes. Everything is checked at construction; [`Observer::step`] cannot fail, and
//! its [`Estimate`] carries a [`ObserverStatus`]: whatever comes in, the state stays finite, the estimate says whether it may be used, and valid
//! samples bring it back.
//!
//! | Observer | Estimates | Converges | Step limit |
//! | --- | --- | --- | --- |
//! | [`CurrentModel`] | flux, from a measured speed | always, at η | none |
//! | [`FullOrder`] | flux, speed, R_s | every speed and load, but at ω_s = 0, for every gain | hω_n² < λ + η |
//! | [`Kubota`] | flux, speed | every load with [`KubotaGains::stabilized`], but at ω_e = 0 | hK_P(n_pβλ)² < 2 |
//! | [`Derdiyok`] | flux, speed, 1/T_r | current: ν₀ large enough; flux: with the anchor | none (implicit) |
//! | [`Utkin`] | flux, speed | not proven; mapped in `docs/background/observers.md` | none (implicit) |
//! | [`Thau`] | flux, speed | in a certified box with a designed gain; L = 0 with friction | h²μn_pβλ² < 1 |
//! | [`Kalman`] | flux, speed | not proven; the baseline | none (implicit) |
//!
//! Equations and sources stand at the head of each file; figures in `docs/background/observers.md`.
//!
//! # Features
//!
//! None: the crate is `no_std` as it stands. `im_model/std` may be on beside it.

#![cfg_attr(not(test), no_std)]

mod basis;
mod current_model;
mod derdiyok;
mod error;
mod full_order;
mod interface;
mod kalman;
mod kubota;
mod named;
mod registry;
mod saturation;
mod thau;
mod tustin;
mod utkin;

pub use basis::{Basis, Discretization, Limits};
pub use current_model::{CurrentModel, CurrentModelState};
pub use derdiyok::{Derdiyok, DerdiyokGains, DerdiyokState};
pub use error::ObserverError;
pub use full_order::{FullOrder, FullOrderGains, FullOrderState};
pub use interface::{Estimate, Input, Observer, ObserverStatus};
pub use kalman::{Kalman, KalmanGains, KalmanState};
pub use kubota::{Kubota, KubotaGains, KubotaState};
pub use named::{Gains, Named, StartingGains};
pub use registry::{NAMES, Visit, each};
pub use thau::{LoadTorqueModel, Thau, ThauBoxGains, ThauGains, ThauState};
pub use utkin::{Utkin, UtkinGains, UtkinState};

/// The example of the README is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
