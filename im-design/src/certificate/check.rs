//! Deciding obligations exactly.

use crate::exact::{Field, NotPositive, Rational, positive_definite};
use crate::matrix::Matrix;
use serde::{Deserialize, Serialize};

/// One thing that must hold for a claim to be true.
#[derive(Clone, Debug)]
pub enum Obligation<F> {
    /// A symmetric matrix that must be positive definite.
    Definite(String, Matrix<F>),
    /// A number that must be positive.
    Positive(String, F),
}

/// How clearly an obligation holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Margin {
    /// Which obligation.
    pub name: String,
    /// Smallest pivot of LDLᵀ over its diagonal entry, or the number itself.
    pub margin: f64,
}

/// Why a certificate is refused.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum CheckError {
    /// Not a certificate file, or fields are missing, unknown or of the wrong shape.
    #[error("not a certificate: {0}")]
    Malformed(String),
    /// The text was altered after it was written.
    #[error("altered: the digest says {written}, the content gives {computed}")]
    Altered {
        /// Digest in the file.
        written: String,
        /// Digest of the content.
        computed: String,
    },
    /// An obligation is false.
    #[error("false: {name} is not positive definite (pivot {pivot} is {value:e})")]
    Indefinite {
        /// Which obligation.
        name: String,
        /// Index of the pivot, from 0.
        pivot: usize,
        /// Its value.
        value: f64,
    },
    /// An obligation is false.
    #[error("false: {name} = {value:e} is not positive")]
    NotPositive {
        /// Which obligation.
        name: String,
        /// Its value.
        value: f64,
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
    let mut margins = Vec::with_capacity(obligations.len());
    for obligation in obligations {
        let (name, margin) = match obligation {
            Obligation::Positive(name, value) => {
                if *value <= Rational::from_f64(0.0) {
                    return Err(CheckError::NotPositive { name: name.clone(), value: value.to_f64() });
                }
                (name, value.to_f64())
            }
            Obligation::Definite(name, matrix) => match positive_definite(matrix) {
                Ok(margin) => (name, margin),
                Err(NotPositive::Pivot(pivot, value)) => {
                    return Err(CheckError::Indefinite { name: name.clone(), pivot, value });
                }
                Err(NotPositive::Asymmetric(i, j)) => {
                    return Err(CheckError::Malformed(format!("{name} is not symmetric at ({i}, {j})")));
                }
            },
        };
        margins.push(Margin { name: name.clone(), margin });
    }
    Ok(margins)
}
