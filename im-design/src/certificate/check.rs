//! Deciding obligations exactly.

use crate::exact::{Field, NotPositive, Rational, positive_definite};
use crate::matrix::Matrix;
use serde::{Deserialize, Serialize};

/// One thing that must hold for a claim to be true.
#[derive(Clone, Debug)]
pub enum Obligation<F> {
    /// A symmetric matrix that must be positive definite.
    Definite(String, Matrix<F>),
    /// A number that must be positive, of any size.
    Positive(String, F),
    /// A number that must exceed another.
    Exceeds(String, F, F),
    /// One that the design goes to the limit of: its margin is tight by construction.
    Limit(Box<Obligation<F>>),
}

impl<F> Obligation<F> {
    /// The same, where the design takes the smallest gain, or the largest claim, that it leaves.
    #[must_use]
    pub fn limit(self) -> Self {
        Obligation::Limit(Box::new(self))
    }
}

/// How clearly an obligation holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Margin {
    /// Which obligation.
    pub name: String,
    /// Smallest pivot of LDLᵀ over its diagonal entry; the number; or by how much it exceeds the other.
    pub margin: f64,
    /// What the margin is a part of: 1 for a matrix, the number that must be exceeded. None where any positive number will do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Tight by construction: the design goes to the limit here.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub tight: bool,
}

/// Why a certificate is refused.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum CheckError {
    /// Not a certificate file, or fields are missing, unknown or of the wrong shape.
    #[error("not a certificate: {0}")]
    Malformed(String),
    /// The text was altered after it was written.
    #[error("altered: the digest says {written:.12}…, the content gives {computed:.12}…. {now}")]
    Altered {
        /// Digest in the file.
        written: String,
        /// Digest of the content.
        computed: String,
        /// What the content claims now: whether it is true, and which margin is another.
        now: String,
    },
    /// An obligation is false.
    #[error("false: {name} is not positive definite (pivot {pivot} is {value:.3e})")]
    Indefinite {
        /// Which obligation.
        name: String,
        /// Index of the pivot, from 0.
        pivot: usize,
        /// Its value.
        value: f64,
    },
    /// An obligation is false.
    #[error("false: {name} = {value:.3e} is not positive")]
    NotPositive {
        /// Which obligation.
        name: String,
        /// Its value.
        value: f64,
    },
    /// A number that no machine, or no region of operation, has.
    #[error("{key} = {value:e} must be {range}")]
    OutOfRange {
        /// Its key in the file.
        key: String,
        /// Its value.
        value: f64,
        /// Where it must lie.
        range: String,
    },
    /// A margin in the file is not the one the content has.
    #[error("the margin of {0} is not the one recomputed")]
    Margin(String),
}

/// Decide all obligations exactly.
///
/// # Errors
/// The first that is false.
pub(crate) fn decide(obligations: &[Obligation<Rational>]) -> Result<Vec<Margin>, CheckError> {
    obligations.iter().map(|obligation| margin(obligation, false)).collect()
}

fn margin(obligation: &Obligation<Rational>, tight: bool) -> Result<Margin, CheckError> {
    let not_positive = |name: &str, value: f64| CheckError::NotPositive { name: name.to_owned(), value };
    let zero = Rational::from_f64(0.0);
    let (name, margin, scale) = match obligation {
        Obligation::Limit(inner) => return self::margin(inner, true),
        Obligation::Positive(name, value) if *value > zero => (name, value.to_f64(), None),
        Obligation::Positive(name, value) => return Err(not_positive(name, value.to_f64())),
        Obligation::Exceeds(name, more, less) if more > less => (name, (more - less).to_f64(), Some(less.to_f64())),
        Obligation::Exceeds(name, more, less) => return Err(not_positive(name, (more - less).to_f64())),
        Obligation::Definite(name, matrix) => match positive_definite(matrix) {
            Ok(margin) => (name, margin, Some(1.0)),
            Err(NotPositive::Pivot(pivot, value)) => {
                return Err(CheckError::Indefinite { name: name.clone(), pivot, value });
            }
            Err(NotPositive::Asymmetric(i, j)) => {
                return Err(CheckError::Malformed(format!("{name} is not symmetric at ({i}, {j})")));
            }
        },
    };
    Ok(Margin { name: name.clone(), margin, scale, tight })
}
