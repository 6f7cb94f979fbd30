//! Where a model and recordings disagree.

use im_diagnose::report::{self, Meta, compare_html, compare_terminal};
use im_diagnose::sources::Refused;
use pyo3::prelude::*;
use pyo3::types::PyList;
use serde_json::json;

use crate::diagnose::PROGRAM;
use crate::errors::refused;
use crate::motor::Motor;
use crate::recording::{Recording, sources};
use crate::signals::columns;
use crate::work::work;

/// A model beside recordings.
#[pyclass(frozen, module = "imkit._native")]
pub struct Comparison {
    inner: report::Comparison,
    meta: Meta,
    /// What was taken for what in recordings without a mapping, a sentence each.
    guessed: Vec<String>,
}

#[pyfunction]
pub fn compare(py: Python<'_>, motor: &Motor, data: Vec<Recording>, anyway: bool, threads: usize) -> PyResult<Comparison> {
    let (file, data) = (motor.file.clone(), sources(data));
    let made = work(py, "looking where the model fails", threads, || {
        let mut taken = Vec::new();
        for source in &data {
            taken.extend(source.long_enough(source.read(&file).map_err(|e| Refused::Input(e.to_string()))?)?);
        }
        let guessed: Vec<String> = taken.iter().filter_map(|t| t.draft.as_ref()).flat_map(|d| d.guesses.clone()).collect();
        Ok::<_, Refused>((report::Comparison::of_intake(&file, &motor.label, taken, anyway)?, guessed))
    })?;
    let ((inner, noticed), guessed) = made.map_err(refused)?;
    let meta = Meta { program: PROGRAM.into(), quality: Some(noticed), ..Meta::default() };
    Ok(Comparison { inner, meta, guessed })
}

#[pymethods]
impl Comparison {
    fn json(&self) -> String {
        let mut report = self.inner.to_json();
        report["guessed"] = json!(self.guessed);
        report["data_quality"] = json!(self.meta.quality);
        report.to_string()
    }

    fn html(&self) -> String {
        compare_html(&self.inner, &self.meta)
    }

    fn text(&self, width: usize) -> String {
        compare_terminal(&self.inner, &self.meta, width)
    }

    fn signals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        columns(py, &self.inner.signals())
    }
}
