//! Ranges that the numbers of a certificate must lie in: a statement about a machine that nobody has, or a region that none has, is refused.
//!
//! The ranges are wide, a factor of a hundred and more beyond the machines that are built, from fractional watts to tens of megawatts.

use super::check::CheckError;

/// Periods that are designed for, s.
pub(crate) const PERIODS_S: std::ops::Range<f64> = 1e-10..100.0;

/// Where the number of a key must lie.
#[derive(Clone, Copy)]
enum Range {
    /// Between two positive numbers.
    Positive(f64, f64),
    /// From zero to one.
    NotNegative(f64),
    /// Of either sign, up to a size.
    Magnitude(f64),
    /// Strictly between zero and one.
    Share,
    /// Entries of a matrix or a series, and reserves that are nearly zero: zero, or of a size whose squares are no rounding.
    Entry,
}

/// By key; the first whose end fits.
const RANGES: [(&str, Range); 25] = [
    ("stator_resistance_ohm", Range::Positive(1e-6, 1e4)),
    ("rotor_resistance_ohm", Range::Positive(1e-6, 1e4)),
    ("inductance_h", Range::Positive(1e-7, 1e3)),
    ("inertia_kg_m2", Range::Positive(1e-9, 1e7)),
    ("viscous_friction_n_m_s", Range::NotNegative(1e6)),
    ("viscous_friction_nm_s_per_rad", Range::NotNegative(1e6)),
    ("pole_pairs", Range::Positive(1.0, 100.0)),
    ("period_s", Range::Positive(PERIODS_S.start, PERIODS_S.end)),
    ("contraction", Range::Share),
    ("tolerance", Range::Share),
    ("torque_n_m", Range::Positive(1e-6, 1e8)),
    ("voltage_max_v", Range::Positive(1e-3, 1e6)),
    ("flux_max_vs", Range::NotNegative(1e4)),
    ("flux_min_vs", Range::Positive(1e-6, 1e4)),
    ("flux_error_max_vs", Range::NotNegative(1e4)),
    ("_max_a", Range::NotNegative(1e7)),
    ("_max_rad_s", Range::NotNegative(1e6)),
    ("omega0_rad_s", Range::Positive(1e-6, 1e9)),
    ("nu0", Range::Positive(1e-9, 1e9)),
    ("lipschitz", Range::Positive(1e-12, 1e6)),
    ("rate_per_s", Range::NotNegative(1e9)),
    ("_rad_s", Range::Magnitude(1e6)),
    ("_vs", Range::Magnitude(1e4)),
    ("_ratio", Range::Positive(1e-3, 1e3)),
    ("", Range::Entry),
];

/// Keys of two numbers that are a range: ascending.
const ASCENDING: [&str; 6] = ["_rad_s", "_vs", "_current_d_a", "_current_q_a", "_ratio", "torque_n_m"];

impl Range {
    fn refuses(self, x: f64) -> Option<String> {
        let (good, usual) = match self {
            Range::Positive(low, high) => ((low..=high).contains(&x), format!("between {low:e} and {high:e}")),
            Range::NotNegative(high) => ((0.0..=high).contains(&x), format!("between 0 and {high:e}")),
            Range::Magnitude(high) => (x.abs() <= high, format!("between {:e} and {high:e}", -high)),
            Range::Share => (x > 0.0 && x < 1.0, "between 0 and 1".into()),
            Range::Entry => (x == 0.0 || (1e-200..=1e30).contains(&x.abs()), "zero, or of a size between 1e-200 and 1e30".into()),
        };
        (!good).then_some(usual)
    }
}

/// Every number of a part of a certificate, by its key.
///
/// # Errors
/// The first that is out of range, with the range.
pub(super) fn check(key: &str, value: &toml::Value) -> Result<(), CheckError> {
    match value {
        toml::Value::Float(x) => number(key, *x),
        // Whole numbers are counts: of poles, of cells.
        toml::Value::Integer(x) => number(key, *x as f64),
        toml::Value::Array(items) => {
            if let ([toml::Value::Float(low), toml::Value::Float(high)], true) =
                (items.as_slice(), ASCENDING.iter().any(|end| key.ends_with(end)))
                && low > high
            {
                return Err(CheckError::OutOfRange {
                    key: key.into(),
                    value: *high,
                    range: format!("at least {low:e}, its lower end"),
                });
            }
            items.iter().try_for_each(|item| check(key, item))
        }
        toml::Value::Table(table) => table.iter().try_for_each(|(key, item)| check(key, item)),
        _ => Ok(()),
    }
}

pub(super) fn number(key: &str, x: f64) -> Result<(), CheckError> {
    let found = RANGES.iter().find(|(end, _)| key.ends_with(end));
    match found.and_then(|(_, range)| range.refuses(x)) {
        Some(range) => Err(CheckError::OutOfRange { key: key.into(), value: x, range }),
        None => Ok(()),
    }
}
