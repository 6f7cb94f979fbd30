//! What can go wrong in a design.

use im_model::{FileError, Problem};

/// Why a design was not made.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum DesignError {
    /// A machine parameter is outside its physical range.
    #[error("{field} = {value} {requirement}")]
    Machine {
        /// Public field name, with its unit.
        field: &'static str,
        /// The value given.
        value: f64,
        /// What it must satisfy, e.g. "must be positive".
        requirement: &'static str,
    },
    /// The region file does not fit the design; says where and what was expected.
    #[error("{0}")]
    Region(FileError),
    /// The request itself makes no sense, whatever the machine.
    #[error("{what}")]
    Request {
        /// What is wrong and what to do.
        what: String,
    },
    /// No gain satisfies the request.
    #[error("infeasible: what binds is {constraint}; feasible would be {feasible}")]
    Infeasible {
        /// The constraint that binds.
        constraint: String,
        /// What would be feasible.
        feasible: String,
    },
    /// The solver stopped without an answer.
    #[error("the solver stopped with {status} in {problem}")]
    Solver {
        /// Which design.
        problem: &'static str,
        /// The solver's own words.
        status: String,
    },
    /// The solver's answer did not pass the exact check: rounding ate the margin.
    #[error("the design failed its own exact check: {0}")]
    Unproven(#[from] crate::certificate::CheckError),
}

impl DesignError {
    /// A region file as a whole that does not fit.
    pub(crate) fn region(what: impl Into<String>) -> Self {
        DesignError::Region(FileError::new("region file", None, None, Problem::Syntax { reason: what.into() }))
    }

    /// A request that makes no sense.
    pub(crate) fn request(what: impl Into<String>) -> Self {
        DesignError::Request { what: what.into() }
    }
}

/// A number asked for must be positive.
pub(crate) fn positive(name: &str, value: f64) -> Result<(), DesignError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(DesignError::request(format!("{name} = {value} must be positive and finite")))
}

/// A number asked for may be zero.
pub(crate) fn not_negative(name: &str, value: f64) -> Result<(), DesignError> {
    if value >= 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(DesignError::request(format!("{name} = {value} must be finite and not negative")))
}

/// A number asked for must lie between 0 and 1.
pub(crate) fn proportion(name: &str, value: f64) -> Result<(), DesignError> {
    if value > 0.0 && value < 1.0 {
        return Ok(());
    }
    Err(DesignError::request(format!("{name} = {value} must lie between 0 and 1")))
}

/// A range asked for may be a point, but not upside down.
pub(crate) fn ordered(name: &str, [low, high]: [f64; 2]) -> Result<(), DesignError> {
    if low <= high && low.is_finite() && high.is_finite() {
        return Ok(());
    }
    Err(DesignError::request(format!("{name} = [{low}, {high}] must be finite and ascending")))
}
