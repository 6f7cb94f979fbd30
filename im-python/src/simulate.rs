//! A machine through a scenario.

use std::path::Path;

use im_control::{MtpaLaw, of_scenario};
use im_design::mtpa::laws;
use im_identify::offline::stop;
use im_model::MotorFile;
use im_model::simulation::{Scenario, Simulation};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::refused;
use crate::motor::Motor;
use crate::recording::{Recording, canonical};
use crate::work::work;

/// `scenario` is the text of a `scenario.toml`; files that it names are looked for in `folder`.
#[pyfunction]
pub fn simulate<'py>(
    py: Python<'py>,
    motor: &Motor,
    scenario: &str,
    label: &str,
    folder: &str,
    seed: Option<u64>,
) -> PyResult<(Recording, Bound<'py, PyDict>)> {
    let mut scenario = Scenario::parse(scenario, label, Path::new(folder)).map_err(refused)?;
    if let Some(seed) = seed {
        scenario.sensors.seed = seed;
    }
    let file = &motor.file;
    let run = work(py, "simulating", 1, || {
        // It is made where it runs: a controller need not be sent to another thread.
        let mut controller = of_scenario(&scenario, file, least_current).map_err(|e| format!("{label}: {e}"))?;
        let mut look = |_, _| stop::check();
        let mut simulation = Simulation::new(&file.machine, &scenario).with_internals().with_progress(&mut look);
        if let Some(controller) = &mut controller {
            simulation = simulation.controlled_by(controller.as_mut());
        }
        simulation.run().map_err(|e| format!("{label}: {e}"))
    })?;
    let run = run.map_err(refused)?;
    let inside = PyDict::new(py);
    let r = &run.recording;
    let time = (0..r.len()).map(|k| r.time_s(k)).collect();
    inside.set_item("t_s", PyArray1::from_vec(py, time))?;
    if let Some(i) = &run.internals {
        inside.set_item("torque_Nm", PyArray1::from_slice(py, &i.torque_nm))?;
        inside.set_item("psi_m_Vs", PyArray1::from_slice(py, &i.psi_m))?;
        let speed = i.states.iter().map(|x| x.omega_m).collect();
        inside.set_item("omega_m_rad_s", PyArray1::from_vec(py, speed))?;
        inside.set_item("psi_s_Vs", PyArray1::from_vec(py, i.states.iter().map(|x| x.psi_s).collect()))?;
        inside.set_item("psi_r_Vs", PyArray1::from_vec(py, i.states.iter().map(|x| x.psi_r).collect()))?;
    }
    for (name, half_widths) in motor.file.prediction.map_or_else(Vec::new, |p| p.columns(&run.recording)) {
        inside.set_item(name, PyArray1::from_vec(py, half_widths))?;
    }
    Ok((canonical(&run.recording)?, inside))
}

fn least_current(motor: &MotorFile) -> Result<MtpaLaw<f64>, String> {
    let refused = |e: String| format!("no law of least current for this motor: {e}");
    let law = laws::for_drive(motor).map_err(|e| refused(e.to_string()))?;
    MtpaLaw::series(law.torque_n_m, &law.current, &law.slip).map_err(|e| refused(e.to_string()))
}
