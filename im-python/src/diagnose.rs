//! The whole loop.

use std::path::PathBuf;

use im_diagnose::diagnosis::{self, diagnose as run};
use im_diagnose::learn::own_source;
use im_diagnose::report::{Files, Meta, SignalTable, Story, terminal};
use im_diagnose::search::{Learning, Options, Significance};
use im_diagnose::sources::{Refused, Sources};
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::errors::refused;
use crate::motor::Motor;
use crate::recording::{Recording, sources};
use crate::signals::columns;
use crate::work::work;

/// What reports say that they were made by.
pub const PROGRAM: &str = concat!("imkit ", env!("CARGO_PKG_VERSION"));

/// The answer, with everything that led to it.
#[pyclass(frozen, module = "imkit._native")]
pub struct Diagnosis {
    inner: diagnosis::Diagnosis,
    files: Files,
    signals: SignalTable,
    text: String,
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

/// `learning`: "never", "unexplained" or "always".
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
    learning: &str,
    threads: usize,
) -> PyResult<Diagnosis> {
    let significance = Significance::try_from(significance).map_err(refused)?;
    let (learning, what) = match learning {
        "always" => (Learning::Always, "fitting, scoring and learning"),
        "unexplained" => (Learning::Unexplained, "fitting and scoring"),
        _ => (Learning::Never, "fitting and scoring"),
    };
    let asked = asked(motor, train, holdout, tables, fix, anyway);
    let made = work(py, what, threads, || {
        let (case, noticed) = asked.case()?;
        let options = Options { significance, learning, ..asked.options() };
        let inner = run(case, options).map_err(|e| Refused::fit(&asked.label, &e))?;
        let meta = Meta { program: PROGRAM.into(), ..Meta::of(&inner, noticed) };
        let story = Story::new(&inner, &meta);
        let (files, signals, text) = (Files::of(&story), story.signals(), terminal(&story, 100));
        Ok::<_, Refused>(Diagnosis { inner, files, signals, text })
    })?;
    made.map_err(refused)
}

#[pymethods]
impl Diagnosis {
    fn json(&self) -> &str {
        &self.files.diagnosis
    }

    #[getter]
    fn html(&self) -> &str {
        &self.files.report
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

    /// The first learned curve as an effect of one's own, in Rust.
    fn rust(&self) -> PyResult<String> {
        own_source(&self.inner.learned).map_err(refused)
    }

    /// The files that the program writes into a folder.
    fn write(&self, folder: PathBuf) -> PyResult<()> {
        self.files.write(folder).map(|_| ()).map_err(refused)
    }
}
