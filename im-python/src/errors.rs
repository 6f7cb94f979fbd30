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

/// The exception for an error of the crates, with the words of a call for those of the command line.
pub fn refused(e: impl Display) -> PyErr {
    let words = [("--anyway", "anyway=True"), ("--fix ", "fix: "), ("im effects show NAME", "imkit.effects()")];
    InputError::new_err(words.iter().fold(e.to_string(), |text, (from, to)| text.replace(from, to)))
}
