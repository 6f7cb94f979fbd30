//! The whole loop.

use std::path::PathBuf;

use im_diagnose::diagnosis::{self, diagnose as run};
use im_diagnose::intake::Finding;
use im_diagnose::report::{self, Meta, NextTest, SignalTable, Story};
use im_diagnose::search::Options;
use im_diagnose::sources::{Refused, Sources, by_fit};
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::errors::refused;
use crate::motor::Motor;
use crate::recording::{Recording, sources};
use crate::signals::columns;
use crate::work::work;

/// The answer, with everything that led to it.
#[pyclass(frozen, module = "imkit._native")]
pub struct Diagnosis {
    inner: diagnosis::Diagnosis,
    meta: Meta,
    noticed: Vec<Finding>,
    signals: SignalTable,
    text: String,
    html: String,
}

/// What reports say that they were made by.
pub fn program() -> String {
    concat!("imkit ", env!("CARGO_PKG_VERSION")).to_owned()
}

/// What is asked for, as the library takes it.
pub fn asked(
    motor: &Motor,
    train: Vec<Recording>,
    holdout: Option<Recording>,
    tables: Vec<(PathBuf, Option<PathBuf>)>,
    fix: Vec<String>,
    anyway: bool,
) -> Sources {
    Sources {
        train: sources(train),
        tables,
        holdout: holdout.map(|h| h.source),
        fix,
        anyway,
        ..Sources::new(motor.file.clone(), motor.label.clone())
    }
}

#[pyfunction]
#[allow(clippy::too_many_arguments)] // The options of the program.
pub fn diagnose(
    py: Python<'_>,
    motor: &Motor,
    train: Vec<Recording>,
    holdout: Option<Recording>,
    tables: Vec<(PathBuf, Option<PathBuf>)>,
    fix: Vec<String>,
    anyway: bool,
    significance: f64,
    threads: usize,
) -> PyResult<Diagnosis> {
    if !(significance > 0.0 && significance < 0.5) {
        return Err(refused(format!("significance {significance} must lie between 0 and 0.5")));
    }
    let asked = asked(motor, train, holdout, tables, fix, anyway);
    let made = work(py, "fitting and scoring", threads, || {
        let (case, mut noticed) = asked.case()?;
        let options = Options { significance, ..asked.options() };
        let inner = run(case, options).map_err(|e| Refused::fit(&asked.label, &e))?;
        noticed.retain(|f| !inner.refutes(f));
        noticed.extend(by_fit(&noticed, &inner.case.motor, &inner.refined.machine));
        let quality = Some(noticed.iter().map(Finding::line).collect());
        let meta = Meta { program: program(), next_test: NextTest::after(&inner), quality, ..Meta::default() };
        let story = Story::new(&inner, &meta);
        let (signals, text, html) = (story.signals(), report::terminal(&story, 100), report::html(&story));
        Ok::<_, Refused>(Diagnosis { inner, meta, noticed, signals, text, html })
    })?;
    made.map_err(refused)
}

#[pymethods]
impl Diagnosis {
    fn json(&self) -> String {
        let mut answer = self.inner.to_json();
        answer["data_quality"] = serde_json::json!(self.noticed);
        answer.to_string()
    }

    #[getter]
    fn html(&self) -> &str {
        &self.html
    }

    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    fn signals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        columns(py, &self.signals)
    }

    #[getter]
    fn refined(&self) -> Motor {
        Motor::new(self.inner.refined.clone())
    }

    #[getter]
    fn given(&self) -> Motor {
        Motor::new(self.inner.case.motor.clone())
    }

    /// The files that the program writes into a folder.
    fn write(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        work(py, "writing", 0, || report::write(&folder, &Story::new(&self.inner, &self.meta)))?.map(|_| ()).map_err(refused)
    }
}
