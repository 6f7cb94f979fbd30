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
    /// A machine that changes too fast to be followed at a sampling time.
    #[error(
        "{part}.{quantity} = {} makes the machine change within {:.1e} s: {:.1e} steps for each sample of {} s, where {} are taken at most",
        Short(*.value), 1.0 / *.rate_per_s, *.sample_time_s * *.rate_per_s / 0.8, Short(*.sample_time_s), crate::plant::SUBSTEPS_MAX
    )]
    TooStiff {
        /// The effect that it belongs to, or the machine.
        part: &'static str,
        /// What makes it so.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// The fastest rate, 1/s.
        rate_per_s: f64,
        /// The sampling time, s.
        sample_time_s: f64,
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
    /// > 0, and of a size that single precision can square: [`SMALLEST`](Self::SMALLEST) to [`LARGEST`](Self::LARGEST).
    Positive,
    /// ≥ 0, at most [`LARGEST`](Self::LARGEST).
    NotNegative,
    /// Positive, and between two numbers beyond which no machine is.
    OfMachines(f64, f64),
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
            Self::OfMachines(a, b) => write!(f, "from {} to {}, where all machines are", Short(a), Short(b)),
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
    /// Smallest positive number that a quantity of a machine, in SI units, can have.
    pub const SMALLEST: f64 = 1e-12;
    /// Largest.
    pub const LARGEST: f64 = 1e12;

    /// Checks `value`; the error carries `quantity`.
    pub fn check(self, quantity: &'static str, value: f64) -> Result<(), ModelError> {
        let ok = value.is_finite()
            && match self {
                Self::Positive => (Self::SMALLEST..=Self::LARGEST).contains(&value),
                Self::NotNegative => (0.0..=Self::LARGEST).contains(&value),
                Self::Within(a, b) | Self::OfMachines(a, b) => (a..=b).contains(&value),
                Self::Whole(a, b) => f64::from(value as u32) == value && (a..=b).contains(&(value as u32)),
            };
        let bound = match self {
            Self::Positive | Self::NotNegative if value > 0.0 && value.is_finite() => {
                Self::OfMachines(Self::SMALLEST, Self::LARGEST)
            }
            Self::OfMachines(..) if !(value > 0.0 && value.is_finite()) => Self::Positive,
            bound => bound,
        };
        if ok { Ok(()) } else { Err(ModelError::OutOfBounds { quantity, value, bound }) }
    }
}
