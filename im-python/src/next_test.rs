//! The manoeuvre that best settles what is open.

use im_diagnose::next_test::{Limits, Sensing, Supply, open_after, propose, to_json};
use im_diagnose::sources::Refused;
use im_diagnose::worst_case::machines_after;
use im_model::EffectId;
use pyo3::prelude::*;
use serde_json::Value;

use crate::errors::refused;
use crate::motor::Motor;
use crate::work::work;

/// What `im next-test --json` prints; `diagnosis` is the text of a `diagnosis.json`.
#[pyfunction]
pub fn next_test(
    py: Python<'_>,
    motor: &Motor,
    effects: Vec<String>,
    diagnosis: Option<&str>,
    mains: Option<bool>,
    limits: (Option<f64>, f64, f64),
) -> PyResult<String> {
    let unknown = |name: &String| refused(format!("there is no effect called {name}; imkit.effects() lists them"));
    let named = effects.iter().map(|name| EffectId::from_name(name).ok_or_else(|| unknown(name)));
    let mut open = named.collect::<PyResult<Vec<_>>>()?;
    let diagnosis: Option<Value> = diagnosis.map(serde_json::from_str).transpose().map_err(refused)?;
    open.extend(diagnosis.iter().flat_map(open_after));
    open.sort_unstable();
    open.dedup();
    if open.is_empty() {
        return Ok(to_json(&[], &[]).to_string());
    }
    let (current, speed, torque) = limits;
    let asked = mains.map(|mains| if mains { Supply::Mains } else { Supply::Drive });
    let supply = Supply::of(asked, diagnosis.as_ref());
    let limits = Limits { supply, current: current.unwrap_or(Limits::on(supply).current), speed, torque };
    let found = work(py, "simulating manoeuvres", 0, || {
        let safe_for = machines_after(&motor.file, diagnosis.as_ref(), &open);
        let sensing = Sensing::after(&motor.file, diagnosis.as_ref());
        propose(&motor.file, &open, sensing, &limits, &safe_for).map_err(|e| Refused::fit(&motor.label, &e))
    })?;
    Ok(to_json(&open, &found.map_err(refused)?).to_string())
}
