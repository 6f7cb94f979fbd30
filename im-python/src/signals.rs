//! Measured, modelled and residual of every sample, as columns.

use im_diagnose::report::SignalTable;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// One dict for each recording: its name, then each column as an array; NaN where there is no number.
pub fn columns<'py>(py: Python<'py>, table: &SignalTable) -> PyResult<Bound<'py, PyList>> {
    let out = PyList::empty(py);
    for (name, columns) in &table.recordings {
        let one = PyDict::new(py);
        one.set_item("recording", name)?;
        for (name, values) in table.columns.iter().zip(columns) {
            one.set_item(name, PyArray1::from_slice(py, values))?;
        }
        out.append(one)?;
    }
    Ok(out)
}
