//! NumPy arrays to space vectors and back.

use num_complex::Complex;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::errors::refused;

pub type Numbers<'py> = PyReadonlyArray1<'py, f64>;
pub type Vectors<'py> = PyReadonlyArray1<'py, Complex<f64>>;

/// That arrays have one length.
pub fn same_length(lengths: &[(&str, usize)]) -> PyResult<usize> {
    let (first, n) = lengths[0];
    match lengths.iter().find(|(_, m)| *m != n) {
        None => Ok(n),
        Some((name, m)) => Err(refused(format!("{name} has {m} values, {first} has {n}: they must have as many"))),
    }
}

/// A new array of what `of` says of each row.
pub fn each<'py, R, T: numpy::Element>(py: Python<'py>, rows: &[R], of: impl Fn(&R) -> T) -> Bound<'py, PyArray1<T>> {
    PyArray1::from_vec(py, rows.iter().map(of).collect())
}
