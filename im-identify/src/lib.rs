//! Parameters of induction machines from measurements.
//!
//! [`offline`] (feature `std`, default): output-error fitting of any set of parameters to recordings, all at once, with exact
//! sensitivities, standard errors and what the data do not determine.
//!
//! [`online`]: identifiers that run beside a drive, sample by sample; `no_std`, without allocation.
//!
//! # Features
//!
//! | feature | default | gives |
//! | --- | --- | --- |
//! | `std` | yes | [`offline`] and what it needs (nalgebra, rayon); without it the crate is `no_std` |

#![cfg_attr(not(any(feature = "std", test)), no_std)]

#[cfg(feature = "std")]
pub mod offline;
pub mod online;

/// The example of the README is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
