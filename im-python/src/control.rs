//! Controllers that step over whole arrays.

use std::sync::{Mutex, PoisonError};

use im_control::MachineData;
use im_control::named::{Setting, Supervised, named};
use im_design::mtpa::laws;
use im_model::simulation::{Command, Measured, Reference};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Numbers, Vectors, each, same_length};
use crate::errors::refused;
use crate::motor::Motor;

/// Largest current over rated current, where nobody says.
const OVERLOAD: f64 = 1.5;

/// A controller with its state, behind the limits of a drive.
#[pyclass(frozen, module = "imkit._native")]
pub struct Controller {
    /// Threads of Python that share it wait for each other.
    inner: Mutex<Box<dyn Supervised>>,
    sample_time_s: f64,
}

#[pymethods]
impl Controller {
    #[new]
    fn new(
        name: &str,
        motor: &Motor,
        sample_time_s: f64,
        dc_voltage_v: Option<f64>,
        current_limit_a: Option<f64>,
        observer: Option<&str>,
    ) -> PyResult<Self> {
        let m = &motor.file;
        let rated = m.rating.current_peak_a(m.machine.parameters(), m.machine.pole_pairs());
        let law = || {
            let law = laws::for_drive(m).map_err(refused)?;
            im_control::MtpaLaw::series(law.torque_n_m, &law.current, &law.slip).map_err(refused)
        };
        let observer = observer.map(|asked| {
            let known = im_observers::NAMES.into_iter().find(|name| *name == asked);
            known.map(|name| (name, m.machine)).ok_or_else(|| {
                refused(format!("there is no observer named {asked}; there are {}", im_observers::NAMES.join(", ")))
            })
        });
        let setting = Setting {
            machine: MachineData::of(&m.machine, current_limit_a.unwrap_or(OVERLOAD * rated))
                .delayed(m.machine.effects().voltage_delay.delay_s),
            rating: m.rating,
            dc_voltage_v: dc_voltage_v.unwrap_or(m.rating.phase_voltage_peak_v * 3f64.sqrt()),
            sample_time_s,
            dead_time: None,
            iron: im_control::Iron::of(&m.machine),
            mtpa: if name == "mtpa" { Some(law()?) } else { None },
            observer: observer.transpose()?,
        };
        Ok(Self { inner: Mutex::new(named(name, &setting).map_err(refused)?), sample_time_s })
    }

    /// Row k: what is measured at the beginning of a sample, the voltage over the sample before, and what is asked for.
    #[allow(clippy::too_many_arguments)] // What a controller sees.
    fn run<'py>(
        &self,
        py: Python<'py>,
        i_s: Vectors<'_>,
        omega_m: Numbers<'_>,
        u_s: Vectors<'_>,
        dc_voltage_v: Numbers<'_>,
        omega_m_ref: Numbers<'_>,
        rotor_flux_ref: Numbers<'_>,
        torque_ref: Numbers<'_>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (i, w, u, dc) = (i_s.as_array(), omega_m.as_array(), u_s.as_array(), dc_voltage_v.as_array());
        let (speed, flux, torque) = (omega_m_ref.as_array(), rotor_flux_ref.as_array(), torque_ref.as_array());
        let n = same_length(&[
            ("i_s", i.len()),
            ("omega_m_rad_s", w.len()),
            ("u_s", u.len()),
            ("dc_voltage_v", dc.len()),
            ("omega_m_ref_rad_s", speed.len()),
            ("rotor_flux_ref_vs", flux.len()),
            ("torque_ref_nm", torque.len()),
        ])?;
        let step = |controller: &mut dyn Supervised, k: usize| {
            let sample_time_s = self.sample_time_s;
            let measured = Measured { i_s: i[k], omega_m: w[k], u_s: u[k], dc_voltage_v: dc[k], sample_time_s };
            let asked = Reference { omega_m: speed[k], rotor_flux_vs: flux[k], torque_nm: torque[k] };
            let command = controller.step(&measured, &asked);
            (command, controller.status().to_string())
        };
        let rows: Vec<(Command<f64>, String)> = py.detach(|| {
            let mut controller = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            (0..n).map(|k| step(controller.as_mut(), k)).collect()
        });
        let nan = num_complex::Complex::new(f64::NAN, f64::NAN);
        let out = PyDict::new(py);
        out.set_item("u_s_V", each(py, &rows, |(c, _)| if let Command::Voltage(u) = c { *u } else { nan }))?;
        out.set_item("i_s_A", each(py, &rows, |(c, _)| if let Command::Current(i) = c { *i } else { nan }))?;
        out.set_item("status", rows.into_iter().map(|(_, status)| status).collect::<Vec<_>>())?;
        Ok(out)
    }
}
