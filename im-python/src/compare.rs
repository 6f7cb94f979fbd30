//! Where a model and recordings disagree.

use im_diagnose::case::Case;
use im_diagnose::consistency;
use im_diagnose::intake::{Finding, FindingKind};
use im_diagnose::report::{self, Meta, compare_html, compare_terminal};
use im_diagnose::sources::{Refused, followed, meaningful};
use pyo3::prelude::*;
use pyo3::types::PyList;
use serde_json::json;

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
    noticed: Vec<Finding>,
}

#[pyfunction]
pub fn compare(py: Python<'_>, motor: &Motor, data: Vec<Recording>, anyway: bool, threads: usize) -> PyResult<Comparison> {
    let (file, data) = (motor.file.clone(), sources(data));
    let made = work(py, "looking where the model fails", threads, || {
        let mut taken = Vec::new();
        for source in &data {
            taken.extend(source.long_enough(source.read(&file).map_err(|e| Refused::Input(e.to_string()))?)?);
        }
        let mut noticed = im_diagnose::intake::findings(taken.iter());
        // What else is wrong is what a comparison shows; by a wrong clock nothing can be simulated.
        let clock: Vec<_> = noticed.iter().filter(|f| f.kind == FindingKind::TimeUnit).cloned().collect();
        meaningful(&clock, anyway)?;
        taken.iter().try_for_each(|t| followed(&file, &motor.label, t))?;
        let case = Case::from_intake(file.clone(), taken, None);
        if !noticed.iter().any(Finding::stops) {
            noticed.extend(consistency::check(&case));
        }
        Ok::<_, Refused>((report::Comparison::new(file.clone(), case.train), noticed))
    })?;
    let (inner, noticed) = made.map_err(refused)?;
    let quality = noticed.iter().map(Finding::line).collect();
    let meta = Meta { program: crate::diagnose::program(), quality: Some(quality), ..Meta::default() };
    Ok(Comparison { inner, meta, noticed })
}

#[pymethods]
impl Comparison {
    fn json(&self) -> String {
        let mut report = self.inner.to_json();
        report["data_quality"] = json!(self.noticed);
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
