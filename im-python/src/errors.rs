//! The one exception for input that is not as it should be, with the program's message.

use std::fmt::Display;

use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;

create_exception!(
    imkit,
    InputError,
    PyValueError,
    "Input that is not as it should be; the message says what, where, and what to do."
);

/// The exception for an error of the crates.
pub fn refused(e: impl Display) -> PyErr {
    InputError::new_err(e.to_string())
}
