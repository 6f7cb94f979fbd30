//! What can be wrong with gains and options.

use im_model::{Bound, ModelError};
use thiserror::Error;

/// Why an observer cannot be built. Once built, its step cannot fail.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ObserverError {
    /// A value is not finite or outside its bound.
    #[error(transparent)]
    Value(#[from] ModelError),
    /// The sampling time is too long for these gains.
    #[error("{what} is unstable at a sampling time of {sample_time_s:.3e} s, which may be at most {limit_s:.3e} s; {remedy}")]
    StepTooLong {
        /// Which part.
        what: &'static str,
        /// The sampling time, s.
        sample_time_s: f64,
        /// The longest that is stable, s.
        limit_s: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A gain matrix does not have the shape x + jy of a machine without a preferred axis.
    #[error("{name}: rows {row}, {} differ from the form [x, -y; y, x] by {deviation:.3e} of their size; a gain in the frame at rest must have it", row + 1)]
    NotRotationInvariant {
        /// Which matrix.
        name: &'static str,
        /// Its first row, from 0.
        row: usize,
        /// Relative deviation.
        deviation: f64,
    },
}

/// Gains beyond this are none: they and what they are multiplied with stay within the range of `f32`.
pub(crate) const GAIN_MAX: f64 = 1e12;

/// A matrix whose entries are gains.
pub(crate) fn finite<const R: usize>(name: &'static str, rows: &[[f64; 2]; R]) -> Result<(), ObserverError> {
    for x in rows.iter().flatten() {
        Bound::Within(-GAIN_MAX, GAIN_MAX).check(name, *x)?;
    }
    Ok(())
}
