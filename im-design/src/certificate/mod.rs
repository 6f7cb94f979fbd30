//! Certificates: what a design claims, with everything needed to decide the claim again.
//!
//! A design states [`Obligation`]s, matrices that must be positive definite and numbers that must be positive, as
//! functions of the machine, the region, the gains and the proof data. The checker evaluates them over the rationals
//! and decides each by LDLᵀ. Nothing of the solver is used, and nothing is rounded. A digest over the canonical text
//! makes any alteration of a file visible, also one that would still be true.

mod check;
mod file;
mod subject;
mod theorem;
pub(crate) mod validity;

pub(crate) use check::decide;
pub use check::{CheckError, Margin, Obligation};
pub use file::{Certificate, Claim, Design, DesignModel};
pub use subject::Difference;
