//! A motor before and after, on a recording that neither has seen.

use im_diagnose::sources::Refused;
use im_diagnose::validation::Validation;
use pyo3::prelude::*;

use crate::errors::refused;
use crate::motor::Motor;
use crate::recording::Recording;
use crate::work::work;

/// What `im validate --json` prints.
#[pyfunction]
pub fn validate(py: Python<'_>, before: &Motor, after: &Motor, data: Recording, anyway: bool) -> PyResult<String> {
    let found = work(py, "simulating", 0, || {
        let taken = data.source.recording(&after.file)?;
        Ok::<_, Refused>(
            Validation::new((&before.file, &before.label), (&after.file, &after.label), taken, anyway)?.to_json().to_string(),
        )
    })?;
    found.map_err(refused)
}
