//! The BLAS and LAPACK symbols that Clarabel's semidefinite cone calls, in pure Rust.
//!
//! Clarabel's `sdp` feature compiles against `blas-sys` and `lapack-sys` without a provider and leaves twelve routines
//! in two precisions (`d…_`, `s…_`) undefined. This crate defines them over [`faer`], so that the whole workspace builds
//! with cargo and a C linker, without Fortran, C or a downloaded library. It implements those twelve routines for the
//! arguments LAPACK documents (column-major, leading dimensions, strides, workspace queries); the job `'O'` of the
//! singular value decompositions is refused with a negative `info`.
//!
//! Link it with `use im_lapack as _;`. With the feature `system-lapack` nothing is exported and the system's `liblapack`
//! and `libblas` are linked instead.
//!
//! * [`kernels`] is the mathematics, safe, over matrix views; this is what the tests compare with nalgebra.
//! * [`dense`] are eigenvalues, norms and equations that gain design asks for itself.
//! * `export` turns C pointers into views and calls the kernels; all `unsafe` of the host crates is in there.
//!
//! # Features
//!
//! | feature | default | gives |
//! | --- | --- | --- |
//! | `pure-rust` | yes | the symbols, from this crate |
//! | `system-lapack` | no | none: the system's libraries are linked, whatever `pure-rust` says |

pub mod dense;
#[cfg(all(feature = "pure-rust", not(feature = "system-lapack")))]
mod export;
pub mod kernels;

#[cfg(feature = "system-lapack")]
#[link(name = "lapack")]
#[link(name = "blas")]
// SAFETY: declares no items; it only names the libraries to link.
unsafe extern "C" {}

/// The example of the README is a test.
#[cfg(all(doctest, feature = "pure-rust", not(feature = "system-lapack")))]
#[doc = include_str!("../README.md")]
pub struct Readme;
