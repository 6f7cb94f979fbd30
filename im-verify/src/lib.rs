//! Claims of three papers, and extensions, as properties that can be tried on any machine: each with cases that follow from (seed, claim,
//! index) alone, shrinking to a simple counterexample, and campaigns over cores and machines.
//!
//! * [`claims::all`]: the claims. Each is a [`Claim`]: the paper's words and place ([`Origin`]), statement, assumptions, variables, property, and what was found.
//! * [`Campaign`] runs them in [`Block`]s; [`Journal`] keeps blocks on disk, so that a campaign is resumed, or put together from shards;
//!   [`Row`] sums them up with a confidence interval.
//! * [`shrunk`] makes a failing case simple; [`case_file`] writes it down and reads it again.
//! * [`properties`]: the same properties for a user's own observer or controller, written against the traits of `im-observers` and
//!   `im-model`; `examples/verify_my_observer.rs` shows it.
//!
//! Where a crate of the workspace implements what is claimed, the property runs that code, so that it tests the code as well as the claim.

pub mod case_file;
pub mod claims;
pub mod page;
pub mod properties;

mod campaign;
mod claim;
mod journal;
mod random;
mod shrink;
mod statistics;
mod subject;
mod summary;
mod variable;
mod verdict;

pub use campaign::{Block, Campaign, KEPT};
pub use claim::{C, Claim, ClaimCase, Cost, Found, Origin, Paper, Point};
pub use journal::{Journal, JournalError};
pub use random::Draws;
pub use shrink::shrunk;
pub use statistics::clopper_pearson;
pub use subject::{MACHINE, Machines, Subject};
pub use summary::{CONFIDENCE, Outcome, Row};
pub use variable::{Scale, Variable};
pub use verdict::Verdict;

/// The example of the README is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
