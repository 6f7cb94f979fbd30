//! What can go wrong in a design.

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
    /// The region file does not fit the design.
    #[error("region file{}: {what}", line.map_or(String::new(), |l| format!(", line {l}")))]
    Region {
        /// Line, from 1, where the reader knows it.
        line: Option<usize>,
        /// What is wrong and what was expected.
        what: String,
    },
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
    /// A request that makes no sense.
    pub(crate) fn request(what: impl Into<String>) -> Self {
        DesignError::Request { what: what.into() }
    }
}
