//! Why a controller cannot be made.

use im_model::ModelError;
use im_observers::ObserverError;
use thiserror::Error;

/// A number that a controller is made from is out of bounds.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ControlError {
    /// A quantity of the machine or of a gain set is out of bounds.
    #[error(transparent)]
    Quantity(#[from] ModelError),
    /// The observer of the drive cannot be made.
    #[error(transparent)]
    Observer(#[from] ObserverError),
    /// A loop is too fast for its sampling.
    #[error("{quantity} = {value} is too fast for a sample of {sample_time_s} s behind a delay of {delay_s} s: at most {limit}")]
    TooFast {
        /// The quantity.
        quantity: &'static str,
        /// Its value, 1/s.
        value: f64,
        /// Sampling time, s.
        sample_time_s: f64,
        /// Delay, s.
        delay_s: f64,
        /// Largest value, 1/s.
        limit: f64,
    },
}
