//! A motor: the content of a `motor.toml`.

use std::path::PathBuf;

use im_diagnose::steady_curve::torque_speed;
use im_model::{
    BaseParameter, DesignClass, EffectId, Effects, GammaParameters, InverseGammaParameters, Machine, MotorFile, Nameplate,
    ParameterId, Rating, TParameters, TerminalResistance,
};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::refused;

/// A motor: name, base parameters, rating, effects, and what is known of its parameters.
#[pyclass(frozen, module = "imkit._native", from_py_object)]
#[derive(Clone)]
pub struct Motor {
    pub file: MotorFile,
    /// Its name in messages: its file, where it came from one.
    pub label: String,
}

impl Motor {
    pub fn new(file: MotorFile) -> Self {
        let label = file.name.clone();
        Self { file, label }
    }

    fn of_circuit(name: &str, pole_pairs: u32, p: TParameters<f64>) -> PyResult<Self> {
        p.validate().map_err(refused)?;
        let rating = Rating::guess(&p, pole_pairs);
        let effects = Effects::scaled(&rating, &p, pole_pairs);
        let machine = Machine::try_new(p, pole_pairs, effects).map_err(refused)?;
        Ok(Self::new(MotorFile::new(name, machine, rating)))
    }
}

#[pymethods]
impl Motor {
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let file = MotorFile::read(&path).map_err(refused)?;
        Ok(Self { file, label: path.display().to_string() })
    }

    #[staticmethod]
    fn parse(text: &str, label: &str) -> PyResult<Self> {
        let file = MotorFile::parse(text, label).map_err(refused)?;
        Ok(Self { file, label: label.to_owned() })
    }

    #[staticmethod]
    #[allow(clippy::too_many_arguments)] // As many as stand on a nameplate.
    fn from_nameplate(
        name: &str,
        power_w: f64,
        line_voltage_rms_v: f64,
        line_current_rms_a: f64,
        speed_rpm: f64,
        power_factor: f64,
        frequency_hz: f64,
        locked_rotor_current_ratio: Option<f64>,
        breakdown_torque_ratio: Option<f64>,
        design: Option<&str>,
        terminal_resistance_ohm: Option<f64>,
        resistance_at_c: Option<f64>,
    ) -> PyResult<Self> {
        let class = |name| {
            DesignClass::from_name(name)
                .ok_or_else(|| refused(format!("design {name:?} is not known; it is {}", DesignClass::NAMES)))
        };
        let design = design.map(class).transpose()?;
        let resistance = terminal_resistance_ohm.map(|ohm| TerminalResistance { ohm, at_c: resistance_at_c });
        let plate = Nameplate {
            power_w,
            line_voltage_rms_v,
            line_current_rms_a,
            speed_rpm,
            frequency_hz,
            power_factor,
            locked_rotor_current_ratio,
            breakdown_torque_ratio,
            locked_rotor_torque_ratio: None,
            design,
        };
        let made = MotorFile::from_nameplate(name, &plate, resistance);
        Ok(Self::new(made.map_err(|e| refused(format!("the nameplate: {e}")))?.0))
    }

    /// R_s, R_r, L_ls, L_lr, L_m, J, D.
    #[staticmethod]
    fn from_t(name: &str, pole_pairs: u32, values: [f64; 7]) -> PyResult<Self> {
        Self::of_circuit(name, pole_pairs, TParameters::from_values(values))
    }

    /// R_s, R_R, L_ℓ, L_s of the Γ circuit; L_ls/L_lr; J, D.
    #[staticmethod]
    fn from_gamma(name: &str, pole_pairs: u32, values: [f64; 4], leakage_ratio: f64, mechanics: [f64; 2]) -> PyResult<Self> {
        let [stator_resistance_ohm, rotor_resistance_ohm, leakage_inductance_h, stator_inductance_h] = values;
        let g = GammaParameters { stator_resistance_ohm, rotor_resistance_ohm, leakage_inductance_h, stator_inductance_h };
        Self::of_circuit(name, pole_pairs, g.to_t(leakage_ratio, mechanics[0], mechanics[1]))
    }

    /// R_s, R_R, L_σ, L_M of the inverse-Γ circuit; L_ls/L_lr; J, D.
    #[staticmethod]
    fn from_inverse_gamma(
        name: &str,
        pole_pairs: u32,
        values: [f64; 4],
        leakage_ratio: f64,
        mechanics: [f64; 2],
    ) -> PyResult<Self> {
        let [stator_resistance_ohm, rotor_resistance_ohm, leakage_inductance_h, magnetizing_inductance_h] = values;
        let g = InverseGammaParameters {
            stator_resistance_ohm,
            rotor_resistance_ohm,
            leakage_inductance_h,
            magnetizing_inductance_h,
        };
        Self::of_circuit(name, pole_pairs, g.to_t(leakage_ratio, mechanics[0], mechanics[1]))
    }

    fn to_toml(&self) -> String {
        self.file.to_toml()
    }

    fn write(&self, path: PathBuf) -> PyResult<()> {
        self.file.write(path).map_err(refused)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.file.name
    }

    #[getter]
    fn label(&self) -> &str {
        &self.label
    }

    #[getter]
    fn pole_pairs(&self) -> u32 {
        self.file.machine.pole_pairs()
    }

    /// The T circuit and the mechanics, by key.
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let out = PyDict::new(py);
        for (p, value) in BaseParameter::ALL.into_iter().zip(self.file.machine.parameters().values()) {
            out.set_item(p.key(), value)?;
        }
        Ok(out)
    }

    fn gamma<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let g = self.file.machine.parameters().gamma();
        let out = PyDict::new(py);
        out.set_item("stator_resistance_ohm", g.stator_resistance_ohm)?;
        out.set_item("rotor_resistance_ohm", g.rotor_resistance_ohm)?;
        out.set_item("leakage_inductance_h", g.leakage_inductance_h)?;
        out.set_item("stator_inductance_h", g.stator_inductance_h)?;
        Ok(out)
    }

    fn inverse_gamma<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let g = self.file.machine.parameters().inverse_gamma();
        let out = PyDict::new(py);
        out.set_item("stator_resistance_ohm", g.stator_resistance_ohm)?;
        out.set_item("rotor_resistance_ohm", g.rotor_resistance_ohm)?;
        out.set_item("leakage_inductance_h", g.leakage_inductance_h)?;
        out.set_item("magnetizing_inductance_h", g.magnetizing_inductance_h)?;
        Ok(out)
    }

    fn rating<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let r = &self.file.rating;
        let out = PyDict::new(py);
        out.set_item("torque_nm", r.torque_nm)?;
        out.set_item("electrical_frequency_hz", r.electrical_frequency_hz)?;
        out.set_item("phase_voltage_peak_v", r.phase_voltage_peak_v)?;
        out.set_item("rotor_flux_vs", r.rotor_flux_vs)?;
        Ok(out)
    }

    /// The effects that are on, each with its parameters.
    fn effects<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let out = PyDict::new(py);
        for e in self.file.machine.effects().active() {
            let values = PyDict::new(py);
            for (k, p) in e.parameters().iter().enumerate() {
                values.set_item(p.key, self.file.machine.get(ParameterId::Effect(e, k)))?;
            }
            out.set_item(e.name(), values)?;
        }
        Ok(out)
    }

    /// Speed (rad/s), torque (Nm) and peak current (A) in steady states on a sinusoidal supply.
    fn torque_speed<'py>(
        &self,
        py: Python<'py>,
        phase_voltage_peak_v: Option<f64>,
        frequency_hz: Option<f64>,
        points: usize,
    ) -> [Bound<'py, PyArray1<f64>>; 3] {
        let r = &self.file.rating;
        let (u, f) = (phase_voltage_peak_v.unwrap_or(r.phase_voltage_peak_v), frequency_hz.unwrap_or(r.electrical_frequency_hz));
        let curve = torque_speed(&self.file.machine, u, f, points);
        let column = |k: usize| PyArray1::from_vec(py, curve.iter().map(|point| point[k]).collect());
        [0, 1, 2].map(column)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.file.to_toml() == other.file.to_toml()
    }

    /// So that it can be sent to other processes.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String, String))> {
        Ok((py.get_type::<Self>().getattr("parse")?, (self.file.to_toml(), self.label.clone())))
    }
}

/// The library of effects: name, title, what it is, how it shows, which test excites it, and its parameters with units.
#[pyfunction]
pub fn effects<'py>(py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let one = |e: EffectId| {
        let card = e.card();
        let out = PyDict::new(py);
        out.set_item("effect", e.name())?;
        out.set_item("title", card.title)?;
        out.set_item("what", card.what)?;
        out.set_item("shows", card.shows)?;
        out.set_item("test", card.test)?;
        out.set_item("parameters", e.parameters().iter().map(|p| (p.key, p.unit)).collect::<Vec<_>>())?;
        Ok(out)
    };
    EffectId::ALL.iter().copied().map(one).collect()
}
