//! Observers that step over whole arrays.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use im_model::{Machine, Rating};
use im_observers::{Basis, Estimate, Gains, Input, Named, ObserverError, Visit, each};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toml::Value;

use crate::arrays::{Numbers, Vectors, each as column, same_length};
use crate::errors::refused;
use crate::motor::Motor;

/// An observer with its state: steps of the next array go on where the last one ended.
#[pyclass(frozen, module = "imkit._native")]
pub struct Observer {
    /// Threads of Python that share it wait for each other.
    steps: Mutex<Box<dyn Steps + Send>>,
    needs_speed: bool,
    added: Vec<(&'static str, f64)>,
}

trait Steps {
    fn step(&mut self, input: &Input<f64>) -> Estimate<f64>;
    fn reset(&mut self);
    /// Another one in the same state.
    fn copied(&self) -> Box<dyn Steps + Send>;
}

struct Held<O: Named<f64>> {
    observer: O,
    state: O::State,
}

impl<O: Named<f64> + 'static> Steps for Held<O> {
    fn step(&mut self, input: &Input<f64>) -> Estimate<f64> {
        self.observer.step(&mut self.state, input)
    }

    fn reset(&mut self) {
        self.state = O::State::default();
    }

    fn copied(&self) -> Box<dyn Steps + Send> {
        Box::new(Self { observer: self.observer.clone(), state: self.state })
    }
}

/// Gains by key, from one table of a gains file; without one, those an observer starts from.
struct Table {
    name: Option<String>,
    values: toml::Table,
    /// What the observer took beside the table; what is zero is off.
    added: RefCell<Vec<(&'static str, f64)>>,
}

struct Wrong(String);

impl From<ObserverError> for Wrong {
    fn from(e: ObserverError) -> Self {
        Self(e.to_string())
    }
}

fn float(v: &Value) -> Option<f64> {
    v.as_float().or_else(|| v.as_integer().map(|x| x as f64)).filter(|x| x.is_finite())
}

fn pair(v: &Value) -> Option<[f64; 2]> {
    v.as_array()?.iter().map(float).collect::<Option<Vec<_>>>()?.try_into().ok()
}

impl Table {
    fn get<X>(&self, key: &str, expected: &str, read: impl Fn(&Value) -> Option<X>) -> Result<Option<X>, Wrong> {
        let Some(value) = self.values.get(key) else { return Ok(None) };
        read(value).map(Some).ok_or_else(|| Wrong(format!("{key} = {value}, expected {expected}")))
    }

    fn need<X>(&self, key: &str, expected: &str, read: impl Fn(&Value) -> Option<X>) -> Result<X, Wrong> {
        self.get(key, expected, read)?.ok_or_else(|| Wrong(format!("{key} is missing: {expected}")))
    }
}

impl Gains for Table {
    type Error = Wrong;

    fn table(&self) -> Option<&str> {
        self.name.as_deref()
    }

    fn number(&self, key: &str) -> Result<Option<f64>, Wrong> {
        self.get(key, "a finite number", float)
    }

    fn note_usual(&self, key: &'static str, usual: f64) {
        if self.name.is_some() {
            self.added.borrow_mut().push((key, usual));
        }
    }

    fn needed(&self, key: &str) -> Result<f64, Wrong> {
        self.need(key, "a finite number", float)
    }

    fn range(&self, key: &str) -> Result<[f64; 2], Wrong> {
        self.need(key, "two numbers, [lower, upper]", pair)
    }

    fn rows<const R: usize>(&self, key: &str) -> Result<[[f64; 2]; R], Wrong> {
        let rows = |v: &Value| v.as_array()?.iter().map(pair).collect::<Option<Vec<_>>>()?.try_into().ok();
        self.need(key, &format!("{R} rows of two numbers"), rows)
    }
}

struct Search<'a> {
    name: &'a str,
    machine: &'a Machine<f64>,
    rating: &'a Rating,
    basis: Basis<f64>,
    gains: toml::Table,
    made: Option<Result<Observer, Wrong>>,
}

impl Search<'_> {
    fn table<O: Named<f64>>(&self) -> Result<Table, Wrong> {
        if self.gains.is_empty() {
            return Ok(Table { name: None, values: toml::Table::new(), added: RefCell::default() });
        }
        let found = O::TABLES.iter().find_map(|name| Some((*name, self.gains.get(*name)?.as_table()?)));
        let (name, values) = found.ok_or_else(|| {
            let present: Vec<&str> = self.gains.keys().map(String::as_str).collect();
            Wrong(format!("gains: [{}] is missing; there are {}", O::TABLES.join("] or ["), present.join(", ")))
        })?;
        Ok(Table { name: Some(name.to_owned()), values: values.clone(), added: RefCell::default() })
    }
}

impl Visit<f64> for Search<'_> {
    fn visit<O: Named<f64> + 'static>(&mut self) {
        if O::NAME != self.name {
            return;
        }
        let made = self.table::<O>().and_then(|gains| {
            let observer = O::made(self.basis, self.machine, self.rating, &gains)?;
            Ok((observer, gains.added.into_inner()))
        });
        self.made = Some(made.map(|(observer, added)| Observer {
            steps: Mutex::new(Box::new(Held { observer, state: O::State::default() })),
            needs_speed: O::NEEDS_SPEED,
            added,
        }));
    }
}

#[pymethods]
impl Observer {
    /// `gains` is the text of a gains file: tables of numbers.
    #[new]
    fn new(name: &str, motor: &Motor, sample_time_s: f64, gains: &str, plain: bool) -> PyResult<Self> {
        let m = &motor.file;
        let mut basis = Basis::try_new(&m.machine, &m.rating, sample_time_s).map_err(refused)?;
        if !plain {
            basis = basis.with_saturation(&m.machine);
            basis = basis.with_inverter(m.machine.effects().inverter_nonlinearity).map_err(refused)?;
        }
        let gains = gains.parse().map_err(|e| refused(format!("gains: {e}")))?;
        let mut search = Search { name, machine: &m.machine, rating: &m.rating, basis, gains, made: None };
        each(&mut search);
        let unknown = || refused(format!("there is no observer named {name}; there are {}", im_observers::NAMES.join(", ")));
        search.made.ok_or_else(unknown)?.map_err(|e| refused(e.0))
    }

    #[getter]
    fn needs_speed(&self) -> bool {
        self.needs_speed
    }

    /// Gains that it starts from, taken where those given have none.
    #[getter]
    fn gains_not_given(&self) -> BTreeMap<&'static str, f64> {
        self.added.iter().copied().collect()
    }

    /// Another one in the same state.
    fn copied(&self) -> Self {
        let steps = self.steps.lock().unwrap_or_else(PoisonError::into_inner).copied();
        Self { steps: Mutex::new(steps), needs_speed: self.needs_speed, added: self.added.clone() }
    }

    fn reset(&self) {
        self.steps.lock().unwrap_or_else(PoisonError::into_inner).reset();
    }

    /// Row k: the mean voltage over the sample that ends there, the current then, and the measured speed where there is one.
    fn run<'py>(
        &self,
        py: Python<'py>,
        u_s: Vectors<'_>,
        i_s: Vectors<'_>,
        omega_m: Option<Numbers<'_>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (u, i) = (u_s.as_array(), i_s.as_array());
        let n = same_length(&[("u_s", u.len()), ("i_s", i.len())])?;
        let w = omega_m.as_ref().map(|w| w.as_array());
        if let Some(w) = &w {
            same_length(&[("u_s", n), ("omega_m_rad_s", w.len())])?;
        } else if self.needs_speed {
            return Err(refused("this observer needs a measured speed; choose another observer"));
        }
        let input = |k: usize| Input { omega_m: w.as_ref().map(|w| w[k]), ..Input::new(u[k], i[k]) };
        let rows: Vec<Estimate<f64>> = py.detach(|| {
            let mut steps = self.steps.lock().unwrap_or_else(PoisonError::into_inner);
            (0..n).map(|k| steps.step(&input(k))).collect()
        });
        let out = PyDict::new(py);
        out.set_item("omega_m_rad_s", column(py, &rows, |e| e.omega_m))?;
        out.set_item("psi_r_Vs", column(py, &rows, |e| e.rotor_flux_vs))?;
        out.set_item("torque_Nm", column(py, &rows, |e| e.torque_nm))?;
        out.set_item("residual_A", column(py, &rows, |e| e.residual_a))?;
        out.set_item("valid", column(py, &rows, |e| e.status.is_valid()))?;
        Ok(out)
    }
}
