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
    TimeScaleState, TimeVarying, TimeVaryingGain, TimeVaryingState, Tracking, relative_sensitivity, steady_regressor,
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
    /// Mean stator voltage at the machine over the sample that ends now, V; behind a voltage delay not the last command, but what acted of those before.
    pub u_s: Complex<T>,
    /// Mechanical speed now, rad/s.
    pub omega_m: T,
}

impl<T: Scalar> Sample<T> {
    /// Numbers, of sizes that machines have: up to 10⁵ A, 10⁶ V, 10⁵ rad/s.
    fn is_one(&self) -> bool {
        let within = |z: Complex<T>, most: f64| z.re.abs() <= T::from_f64(most) && z.im.abs() <= T::from_f64(most);
        within(self.i_s, 1e5) && within(self.u_s, 1e6) && self.omega_m.abs() <= T::from_f64(1e5)
    }
}

/// How far current and speed may go within a sample: many times what voltage and torque do to them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reach<T> {
    /// A per V: h/σL_s, ten times.
    per_volt: T,
    /// rad/s.
    speed: T,
}

impl<T: Scalar> Reach<T> {
    /// For a leakage σL_s, H, and a sampling time, s; speeds change by up to 2·10⁵ rad/s².
    pub fn new(leakage_h: T, sample_time_s: T) -> Self {
        let c = T::from_f64;
        Self { per_volt: c(10.0) * sample_time_s / leakage_h, speed: c(2e5) * sample_time_s + c(5.0) }
    }
}

/// What is believed of samples: a current or a speed farther from the one before than machines go is an outlier, unless it stays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Belief<T> {
    before: Option<Sample<T>>,
    doubts: u8,
}

/// So many outliers in a row are left out; the next is believed.
const DOUBTS: u8 = 3;
/// Voltage that stands for noise and for what the flux induces where little is applied, V.
const LEAST_V: f64 = 100.0;

impl<T: Scalar> Belief<T> {
    /// Nothing seen yet.
    pub const fn new() -> Self {
        Self { before: None, doubts: 0 }
    }

    /// Whether to believe a sample; one that is believed is compared with next.
    pub fn admits(&mut self, s: &Sample<T>, reach: &Reach<T>) -> bool {
        if !s.is_one() {
            return false;
        }
        let outlier = self.before.is_some_and(|before| {
            let c = T::from_f64;
            let volts = s.u_s.re.abs() + s.u_s.im.abs() + before.u_s.re.abs() + before.u_s.im.abs() + c(LEAST_V);
            let size = before.i_s.re.abs() + before.i_s.im.abs();
            let room = reach.per_volt * volts + size * c(0.5);
            let gone = s.i_s - before.i_s;
            let faster = (s.omega_m - before.omega_m).abs() > reach.speed + before.omega_m.abs() * c(0.2);
            faster || gone.re.abs() > room || gone.im.abs() > room
        });
        if outlier && self.doubts < DOUBTS {
            self.doubts += 1;
            return false;
        }
        *self = Self { before: Some(*s), doubts: 0 };
        true
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
    /// A measurement was lost: not a number, infinite, or an outlier farther from the one before than any machine goes.
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
    /// Which of them are at an end of their range. Such a value is none: what was measured asks for more, or something else was taken for this parameter
    /// (dead time for R_s).
    pub at_bound: [bool; N],
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
