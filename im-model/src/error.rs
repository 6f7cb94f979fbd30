//! What can be wrong with the numbers that describe a machine.

use thiserror::Error;

/// A quantity outside its physical range. The text names the quantity, its value and the bound.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ModelError {
    /// A quantity is not finite, or outside its bound.
    #[error("{quantity} = {} must be {bound}", Short(*.value))]
    OutOfBounds {
        /// Name of the quantity with its unit, as in files.
        quantity: &'static str,
        /// The offending value.
        value: f64,
        /// What is allowed.
        bound: Bound,
    },
    /// L_m² ≥ L_s L_r: the windings would be coupled more than perfectly.
    #[error("magnetizing inductance squared {squared} H² must be below L_s·L_r = {product} H²: leakage would not be positive")]
    CouplingNotPhysical {
        /// L_m², H².
        squared: f64,
        /// L_s L_r, H².
        product: f64,
    },
    /// No steady state was found at the requested operating point.
    #[error("no steady state at {frequency_hz} Hz with load torque {torque_nm} Nm: the machine cannot carry it")]
    NoSteadyState {
        /// Supply frequency, Hz.
        frequency_hz: f64,
        /// Requested load torque, Nm.
        torque_nm: f64,
    },
}

/// The range that a quantity must lie in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// Finite and > 0.
    Positive,
    /// Finite and ≥ 0.
    NotNegative,
    /// Within the closed interval.
    Within(f64, f64),
    /// A whole number, from the first to the second.
    Whole(u32, u32),
}

impl core::fmt::Display for Bound {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::Positive => f.write_str("positive and finite"),
            Self::NotNegative => f.write_str("zero or positive, and finite"),
            Self::Within(a, b) => write!(f, "from {} to {}", Short(a), Short(b)),
            Self::Whole(a, b) => write!(f, "a whole number from {a} to {b}"),
        }
    }
}

/// A number as people write it: 0.156, 1e300 rather than three hundred zeros.
struct Short(f64);

impl core::fmt::Display for Short {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let x = self.0;
        let size = if x < 0.0 { -x } else { x };
        if (size > 0.0 && size < 1e-4) || (size >= 1e7 && size.is_finite()) { write!(f, "{x:e}") } else { write!(f, "{x}") }
    }
}

impl Bound {
    /// Checks `value`; the error carries `quantity`.
    pub fn check(self, quantity: &'static str, value: f64) -> Result<(), ModelError> {
        let ok = value.is_finite()
            && match self {
                Self::Positive => value > 0.0,
                Self::NotNegative => value >= 0.0,
                Self::Within(a, b) => (a..=b).contains(&value),
                Self::Whole(a, b) => f64::from(value as u32) == value && (a..=b).contains(&(value as u32)),
            };
        if ok { Ok(()) } else { Err(ModelError::OutOfBounds { quantity, value, bound: self }) }
    }
}
