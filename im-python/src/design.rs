//! Gains with proofs, and the check of a proof.

use im_design::certificate::Margin;
use im_design::gains::{GainSet, Value};
use im_design::request::{Kind, Period, design_for, design_sampled};
use im_design::{DesignModel, LinearMachine};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::refused;
use crate::motor::Motor;
use crate::work::work;

/// Gains with everything that their proof needs.
#[pyclass(frozen, module = "imkit._native")]
pub struct Certificate {
    inner: im_design::Certificate,
    margins: Vec<Margin>,
    text: String,
}

/// `period`: seconds, or "largest".
#[pyfunction]
pub fn design(py: Python<'_>, kind: &str, motor: &Motor, region: &str, period: Option<&str>) -> PyResult<Certificate> {
    let kind: Kind = kind.parse().map_err(refused)?;
    let period: Option<Period> = period.map(str::parse).transpose().map_err(refused)?;
    let machine = &motor.file.machine;
    let made = work(py, "designing and proving", 0, || {
        let inner = match period {
            Some(period) => design_sampled(kind, DesignModel::Machine(LinearMachine::from(machine)), region, period),
            None => design_for(kind, machine, region),
        };
        let inner = inner.map_err(|e| e.to_string())?;
        let text = inner.to_text().map_err(|e| e.to_string())?;
        Ok::<_, String>(Certificate { margins: inner.margins.clone(), inner, text })
    })?;
    made.map_err(refused)
}

/// A commented region file for a design.
#[pyfunction]
pub fn example_region(kind: &str) -> PyResult<&'static str> {
    let kind: Kind = kind.parse().map_err(refused)?;
    Ok(kind.example_region())
}

/// Decides a certificate again, exactly; an altered or false one is refused.
#[pyfunction]
pub fn check(py: Python<'_>, text: &str, label: &str) -> PyResult<Certificate> {
    let checked = work(py, "verifying", 0, || im_design::Certificate::check_text(text))?;
    let (inner, margins) = checked.map_err(|e| refused(format!("{label}: refused: {e}")))?;
    Ok(Certificate { inner, margins, text: text.to_owned() })
}

#[pymethods]
impl Certificate {
    #[getter]
    fn kind(&self) -> String {
        GainSet::from(&self.inner.design).kind
    }

    /// The file that `im design` writes.
    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    #[getter]
    fn digest(&self) -> &str {
        &self.inner.digest
    }

    /// The gains without their proof, as a table that observers take.
    #[getter]
    fn gains_toml(&self) -> String {
        GainSet::from(&self.inner.design).to_toml()
    }

    /// Name, margin: what was decided, and by how much it holds.
    fn margins(&self) -> Vec<(String, f64)> {
        self.margins.iter().map(|m| (m.name.clone(), m.margin)).collect()
    }

    fn gains<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let out = PyDict::new(py);
        for gain in GainSet::from(&self.inner.design).gains {
            match gain.value {
                Value::Scalar(x) => out.set_item(gain.name, x)?,
                Value::Range(x) => out.set_item(gain.name, x.to_vec())?,
                Value::List(x) => out.set_item(gain.name, x)?,
                Value::Matrix(m) => {
                    let rows: Vec<Vec<f64>> = (0..m.rows()).map(|i| (0..m.cols()).map(|j| m[(i, j)]).collect()).collect();
                    out.set_item(gain.name, rows)?;
                }
            }
        }
        Ok(out)
    }

    /// In what the certificate's machine differs from a motor: key, there, here.
    fn differences(&self, motor: &Motor) -> PyResult<Vec<(String, String, String)>> {
        let found = self.inner.differences(&motor.file.machine).map_err(refused)?;
        Ok(found.into_iter().map(|d| (d.key.to_string(), d.certified.to_string(), d.motor.to_string())).collect())
    }
}
