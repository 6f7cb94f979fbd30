//! The parameters of a motor, its effects as they are.

use std::path::PathBuf;

use im_diagnose::fitted::Fitted;
use im_diagnose::sources::{Refused, by_fit};
use pyo3::prelude::*;
use serde_json::json;

use crate::diagnose::asked;
use crate::errors::refused;
use crate::motor::Motor;
use crate::recording::Recording;
use crate::work::work;

/// A fitted motor.
#[pyclass(frozen, module = "imkit._native")]
pub struct Fit {
    inner: Fitted,
    json: String,
}

#[pyfunction]
#[allow(clippy::too_many_arguments)] // The options of the program.
pub fn fit(
    py: Python<'_>,
    motor: &Motor,
    train: Vec<Recording>,
    holdout: Option<Recording>,
    tables: Vec<(PathBuf, Option<PathBuf>)>,
    fix: Vec<String>,
    anyway: bool,
    threads: usize,
) -> PyResult<Fit> {
    let asked = asked(motor, train, holdout, tables, fix, anyway);
    let made = work(py, "fitting", threads, || {
        let (case, mut noticed) = asked.case()?;
        let inner = Fitted::new(case, asked.options()).map_err(|e| Refused::fit(&asked.label, &e))?;
        noticed.extend(by_fit(&noticed, &inner.before, &inner.after.machine, inner.supply));
        let mut report = inner.to_json();
        report["data_quality"] = json!(noticed);
        Ok::<_, Refused>(Fit { inner, json: report.to_string() })
    })?;
    made.map_err(refused)
}

#[pymethods]
impl Fit {
    fn json(&self) -> &str {
        &self.json
    }

    #[getter]
    fn motor(&self) -> Motor {
        Motor::new(self.inner.after.clone())
    }
}
