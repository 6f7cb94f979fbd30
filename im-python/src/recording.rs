//! A recording: a file that is read when a motor asks for it, or columns in memory.

use std::path::PathBuf;

use im_diagnose::intake::mapping::Mapping;
use im_diagnose::intake::{Columns, IntakeError};
use im_diagnose::sources::Source;
use im_model::Complex;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::Numbers;
use crate::errors::refused;
use crate::motor::Motor;

/// Where a recording comes from.
#[pyclass(frozen, module = "imkit._native", from_py_object)]
#[derive(Clone)]
pub struct Recording {
    pub source: Source,
}

/// Time, voltage, current, speed.
type Reals<'py> = Bound<'py, PyArray1<f64>>;
type Vectors<'py> = Bound<'py, PyArray1<Complex<f64>>>;
type Rows<'py> = (Reals<'py>, Vectors<'py>, Vectors<'py>, Option<Reals<'py>>);

/// Columns of the canonical form.
pub fn canonical(r: &im_model::Recording) -> PyResult<Recording> {
    let n = r.len();
    let mut columns = vec![
        ("t_s".to_owned(), (0..n).map(|k| r.time_s(k)).collect()),
        ("u_alpha_V".to_owned(), r.u_s.iter().map(|u| u.re).collect()),
        ("u_beta_V".to_owned(), r.u_s.iter().map(|u| u.im).collect()),
        ("i_alpha_A".to_owned(), r.i_s.iter().map(|i| i.re).collect()),
        ("i_beta_A".to_owned(), r.i_s.iter().map(|i| i.im).collect()),
        ("omega_m_rad_s".to_owned(), r.omega_m.clone()),
    ];
    columns.extend(r.tau_load.iter().map(|tau| ("tau_load_Nm".to_owned(), tau.clone())));
    let columns = Columns::try_new(&r.name, columns, None).map_err(refused)?;
    Ok(Recording { source: Source::Columns(Box::new(columns)) })
}

#[pymethods]
impl Recording {
    #[staticmethod]
    fn file(path: PathBuf, mapping: Option<PathBuf>) -> Self {
        Self { source: Source::File(path, mapping) }
    }

    /// `mapping` is the text of a `recording.toml`; `keys`: messages are to name the key of the top instead of its line.
    #[staticmethod]
    fn columns(name: &str, columns: Vec<(String, Numbers<'_>)>, mapping: Option<&str>, keys: bool) -> PyResult<Self> {
        let parse = if keys { Mapping::parse_keys } else { Mapping::parse };
        let mapping = mapping.map(|text| parse(text, "mapping")).transpose().map_err(refused)?;
        let columns = columns.into_iter().map(|(name, x)| (name, x.as_array().to_vec())).collect();
        Ok(Self { source: Source::Columns(Box::new(Columns::try_new(name, columns, mapping).map_err(refused)?)) })
    }

    #[getter]
    fn name(&self) -> String {
        self.source.label()
    }

    /// The columns in memory; `None` for a file.
    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Source::Columns(c) = &self.source else { return Ok(None) };
        let out = PyDict::new(py);
        for (name, x) in c.names.iter().zip(c.values.iter()) {
            out.set_item(name, PyArray1::from_slice(py, x))?;
        }
        Ok(Some(out))
    }

    /// The columns of a file as they stand in it.
    fn read(&self) -> PyResult<Self> {
        let Source::File(path, mapping) = &self.source else { return Ok(self.clone()) };
        let columns = im_diagnose::intake::columns_of(path, mapping.as_deref()).map_err(refused)?;
        Ok(Self { source: Source::Columns(Box::new(columns)) })
    }

    /// The same under another name, where it stands in memory.
    fn renamed(&self, name: &str) -> Self {
        let mut other = self.clone();
        if let Source::Columns(c) = &mut other.source {
            name.clone_into(&mut c.label);
        }
        other
    }

    /// What was noticed about the data with this motor, a sentence each; and the mapping that was guessed, where there was none, as text.
    fn check(&self, motor: &Motor) -> PyResult<(Vec<String>, Option<String>)> {
        let taken = match self.source.read(&motor.file) {
            Ok(taken) => taken,
            Err(IntakeError::Unmapped { draft, .. }) => return Ok((draft.missing, Some(draft.text))),
            Err(e) => return Err(refused(e)),
        };
        let draft = taken.iter().find_map(|t| t.draft.as_ref()).map(|d| d.text.clone());
        Ok((im_diagnose::intake::findings(taken.iter()).iter().map(im_diagnose::intake::Finding::line).collect(), draft))
    }

    /// Time, voltage, current and speed as a drive would have seen them, by the mapping; what was left out is NaN, and `None` a speed that was not
    /// measured.
    fn replay<'py>(&self, py: Python<'py>, motor: &Motor) -> PyResult<Rows<'py>> {
        let taken = self.source.mapped(&motor.file).and_then(|all| self.source.only(all)).map_err(refused)?;
        let r = taken.replay();
        let t: Vec<f64> = (0..r.len()).map(|k| r.time_s(k)).collect();
        let speed = r.omega_m.iter().any(|w| w.is_finite()).then(|| PyArray1::from_slice(py, &r.omega_m));
        Ok((PyArray1::from_slice(py, &t), PyArray1::from_slice(py, &r.u_s), PyArray1::from_slice(py, &r.i_s), speed))
    }
}

/// Recordings as the library takes them.
pub fn sources(recordings: Vec<Recording>) -> Vec<Source> {
    recordings.into_iter().map(|r| r.source).collect()
}
