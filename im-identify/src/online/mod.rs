//! On-line identifiers: parameters of a running machine, sample by sample. `no_std`, without allocation, `f32` and `f64`.
//!
//! An identifier is plain numbers, checked once ([`try_new`](KenneRotorResistance::try_new)); its state is a value of its own; a step
//! cannot fail. Each step says what it estimates, whether it adapts, and how well what it saw determines each parameter:
//!
//! | identifier | estimates | sees |
//! | --- | --- | --- |
//! | [`KenneRotorResistance`] | R_r | [`Sample`]: any drive |
//! | [`KenneResistances`] | R_r, R_s | [`Sample`]: any drive |
//! | [`TimeScale`], [`TimeVarying`] and their reduced forms | R_req, L, R_s, L_f | [`Tracking`]: how a reference generator is followed |
//! | [`Follower`] around one of these | R_req, L, R_s, L_f | [`Sample`]: any drive |
//!
//! Estimates that what was measured says nothing about are held, and flagged: no excitation, zero flux, a lost sample.

mod excitation;
mod filter;
mod jadot;
mod kenne;
mod law;
#[cfg(feature = "std")]
mod replay;
#[cfg(feature = "std")]
mod sensitivity;

use core::fmt::Debug;

use im_model::{Complex, Scalar};

pub use excitation::{Excitation, ExcitationMonitor};
pub use jadot::{
    Adaptation, DeadZone, Fixed, Follower, FollowerGains, FollowerState, Lambda, RegulationParameters, SchemeSettings, TimeScale,
    TimeScaleState, TimeVarying, TimeVaryingState, Tracking, relative_sensitivity, steady_regressor,
};
pub use kenne::{
    KenneResistances, KenneResistancesState, KenneRotorResistance, KenneRotorResistanceState, KenneSettings, ResistancesSettings,
};
pub use law::{Range, sign_law};
#[cfg(feature = "std")]
pub use replay::{ReplayRow, ReplayScheme, replay};
#[cfg(feature = "std")]
pub use sensitivity::SensitivityMap;

/// What an identifier sees at the end of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<T> {
    /// Stator current now, A.
    pub i_s: Complex<T>,
    /// Mean stator voltage over the sample that ends now, V.
    pub u_s: Complex<T>,
    /// Mechanical speed now, rad/s.
    pub omega_m: T,
}

impl<T: Scalar> Sample<T> {
    pub(crate) fn is_finite(&self) -> bool {
        finite(self.i_s) && finite(self.u_s) && self.omega_m.is_finite()
    }
}

impl<T: Scalar> From<&im_model::simulation::Measured<T>> for Sample<T> {
    fn from(m: &im_model::simulation::Measured<T>) -> Self {
        Self { i_s: m.i_s, u_s: m.u_s, omega_m: m.omega_m }
    }
}

/// Why nothing is learnt from a sample, or that something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum IdentifierStatus {
    /// At least one parameter moves.
    #[default]
    Adapting,
    /// The filters fill: after the start, and after a lost sample.
    Filling,
    /// The signals are too small, or too much alike, to tell the parameters by.
    NoExcitation,
    /// In the dead zone of the scheme.
    DeadZone,
    /// A measurement was lost (not a number, infinite).
    LostSample,
}

impl IdentifierStatus {
    /// Whether all estimates are held.
    pub fn is_frozen(self) -> bool {
        self != Self::Adapting
    }
}

/// What an identifier says after a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<T, const N: usize> {
    /// The estimates, always finite and within their ranges; see the identifier for which and in which unit.
    pub values: [T; N],
    /// Which of them move now.
    pub adapting: [bool; N],
    /// How much the last window says.
    pub excitation: Excitation<T, N>,
    /// Why.
    pub status: IdentifierStatus,
}

/// An identifier in sampled time. Steps cannot fail.
pub trait Identifier<T: Scalar, const N: usize> {
    /// What it remembers.
    type State: Copy + Debug;
    /// What it sees in a sample.
    type Input: Copy + Debug;
    /// Before the first sample.
    fn start(&self) -> Self::State;
    /// One sample.
    fn step(&self, state: &mut Self::State, input: &Self::Input) -> Estimate<T, N>;
}

pub(crate) fn finite<T: Scalar>(z: Complex<T>) -> bool {
    z.re.is_finite() && z.im.is_finite()
}

#[cfg(test)]
mod tests {
    use super::IdentifierStatus;

    #[test]
    fn estimates_move_in_one_status_only() {
        let held =
            [IdentifierStatus::Filling, IdentifierStatus::NoExcitation, IdentifierStatus::DeadZone, IdentifierStatus::LostSample];
        assert!(held.into_iter().all(IdentifierStatus::is_frozen) && !IdentifierStatus::Adapting.is_frozen());
    }
}
