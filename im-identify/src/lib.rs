//! Parameters of induction machines from measurements.
//!
//! [`offline`] (feature `std`, default): output-error fitting of any set of parameters to recordings, all at once, with exact
//! sensitivities, standard errors and what the data do not determine.

#![cfg_attr(not(any(feature = "std", test)), no_std)]

#[cfg(feature = "std")]
pub mod offline;
