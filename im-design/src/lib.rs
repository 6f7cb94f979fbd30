//! Gain design for induction machine observers and controllers, off line, with proofs.
//!
//! Every design returns plain gains and a [`certificate::Certificate`]: the machine, the region, the gains, a Lyapunov
//! matrix and the rate it proves. [`certificate::Certificate::check`] rebuilds every matrix inequality from those data
//! and decides it in exact rational arithmetic, without the solver; an altered file is refused.
//!
//! # Conventions
//! SI units; electrical quantities as in Kwon, Sudhoff, Żak, Hui (2005), eq. (1): stationary frame, peak-value space
//! vectors, state (ω, λ_a, λ_b, i_a, i_b) with ω the *mechanical* speed in rad/s. A rate α means that errors fall at
//! least like e^(−αt) in the norm of the certificate's P.
//!
//! # Map
//! * [`machine`], [`model`]: parameters, derived constants, the matrices of the papers, over floats and over rationals;
//! * [`exact`]: rationals and the definiteness test; [`lmi`]: variables, blocks, objective, over Clarabel;
//! * [`certificate`]: files and their checker;
//! * [`thau`], [`thau_box`], [`kubota`], [`kubota_loop`], [`sliding`], [`kenne`], [`jadot`], [`sampled`]: designs;
//! * [`mtpa`]: maximum torque per ampere, from an equivalent circuit with saturation;
//! * [`request`]: designs by name and region file; [`gains`]: gain sets as TOML and as Rust source; [`plot`]: SVG.
//!
//! # Features
//!
//! | feature | default | gives |
//! | --- | --- | --- |
//! | `pure-lapack` | yes | BLAS and LAPACK for the solver in Rust alone: cargo and a C linker build it |
//! | `system-lapack` | no | the system's BLAS and LAPACK instead, whatever `pure-lapack` says |

mod cells;
pub mod certificate;
pub mod error;
pub mod exact;
mod feasible;
pub mod gains;
pub mod jadot;
pub mod kenne;
pub mod kubota;
pub mod kubota_loop;
pub mod linalg;
pub mod lmi;
pub mod machine;
pub mod matrix;
pub mod model;
pub mod mtpa;
pub mod plot;
pub mod request;
pub mod sampled;
pub mod sliding;
pub mod thau;
pub mod thau_box;

pub use certificate::{Certificate, DesignModel};
pub use error::DesignError;
pub use machine::LinearMachine;

// Link the BLAS and LAPACK symbols that the solver calls.
use im_lapack as _;

/// The example of the README is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
