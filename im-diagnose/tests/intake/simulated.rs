//! A direct-on-line start of a 4-kW machine, as a laboratory might write it down.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use im_diagnose::intake::{Finding, FindingKind, Intake, IntakeError, read};
use im_model::simulation::{Scenario, Simulation};
use im_model::space_vector::to_phases;
use im_model::{MotorFile, Recording};

pub const MOTOR: &str = "[machine]\nname = \"4 kW\"\npole_pairs = 2\n[machine.parameters]\nstator_resistance_ohm = 1.5\n\
    rotor_resistance_ohm = 0.9\nstator_leakage_inductance_h = 0.004\nrotor_leakage_inductance_h = 0.004\n\
    magnetizing_inductance_h = 0.156\ninertia_kg_m2 = 0.03\nviscous_friction_nm_s_per_rad = 0.002\n[machine.rating]\n\
    torque_nm = 26.0\nelectrical_frequency_hz = 50.0\nphase_voltage_peak_v = 326.6\nrotor_flux_vs = 0.95\n";

pub const SCENARIO: &str = "[scenario]\nname = \"start\"\nduration_s = 0.6\nsample_time_s = 2e-4\n[mains]\nvoltage_peak_v = 326.6\n\
    frequency_hz = 50\nclosing_s = 0.02\n[load]\ntorque_nm = [[0, 0], [0.35, 0], [0.35, 10]]\n[sensors]\ncurrent_noise_a = 0.05\n\
    speed_noise_rad_s = 0.1\nseed = 1\n";

pub fn motor() -> MotorFile {
    MotorFile::parse(MOTOR, "motor.toml").unwrap()
}

/// The recording in canonical columns.
pub fn start() -> &'static Recording {
    static RUN: OnceLock<Recording> = OnceLock::new();
    RUN.get_or_init(|| {
        let scenario = Scenario::parse(SCENARIO, "scenario.toml", Path::new("")).unwrap();
        let mut r = Simulation::new(&motor().machine, &scenario).run().unwrap().recording;
        r.name = "run".into();
        r
    })
}

/// The columns of a three-phase laboratory file: t, u1 u2 u3, i1 i2 i3, n (rpm), T.
pub fn columns() -> Vec<(&'static str, Vec<f64>)> {
    columns_of(start())
}

/// The same of another run.
pub fn columns_of(r: &Recording) -> Vec<(&'static str, Vec<f64>)> {
    let phases = |x: &[im_model::Complex<f64>], p: usize| x.iter().map(|v| to_phases(*v)[p]).collect::<Vec<f64>>();
    let mut all = vec![("t_s", (0..r.len()).map(|k| r.time_s(k)).collect())];
    all.extend(["u1_V", "u2_V", "u3_V"].into_iter().enumerate().map(|(p, n)| (n, phases(&r.u_s, p))));
    all.extend(["i1_A", "i2_A", "i3_A"].into_iter().enumerate().map(|(p, n)| (n, phases(&r.i_s, p))));
    all.push(("n_rpm", r.omega_m.iter().map(|w| w * 30.0 / std::f64::consts::PI).collect()));
    all.push(("T_Nm", r.tau_load.clone().unwrap_or_else(|| vec![0.0; r.len()])));
    all
}

pub const MAPPING: &str = "[time]\ncolumn = \"t_s\"\n[voltage]\na = \"u1_V\"\nb = \"u2_V\"\nc = \"u3_V\"\n[current]\na = \"i1_A\"\n\
    b = \"i2_A\"\nc = \"i3_A\"\n[speed]\ncolumn = \"n_rpm\"\n[load]\ncolumn = \"T_Nm\"\n";

pub fn column<'a>(all: &'a mut [(&'static str, Vec<f64>)], name: &str) -> &'a mut Vec<f64> {
    &mut all.iter_mut().find(|(n, _)| *n == name).unwrap().1
}

pub fn csv(all: &[(&str, Vec<f64>)]) -> String {
    let mut text = all.iter().map(|(n, _)| *n).collect::<Vec<_>>().join(",");
    text.push('\n');
    for k in 0..all[0].1.len() {
        text += &all.iter().map(|(_, x)| format!("{:?}", x[k])).collect::<Vec<_>>().join(",");
        text.push('\n');
    }
    text
}

/// A folder that goes away with the test.
pub struct Folder(pub tempfile::TempDir);

impl Folder {
    /// `name` is only to be seen in messages: the folder is this call's alone.
    pub fn new(name: &str) -> Self {
        Self(tempfile::Builder::new().prefix(&format!("im-intake-{name}-")).tempdir().unwrap())
    }

    pub fn put(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

pub fn take(path: &Path) -> Result<Intake, IntakeError> {
    read(path, None, &motor()).map(|mut all| all.remove(0))
}

/// Writes the columns and a mapping into a folder and takes them in.
pub fn taken(name: &str, all: &[(&str, Vec<f64>)], mapping: &str) -> Intake {
    let folder = Folder::new(name);
    folder.put("run.recording.toml", mapping);
    take(&folder.put("run.csv", csv(all))).unwrap()
}

pub fn of(found: &[Finding], kind: FindingKind) -> Vec<&Finding> {
    found.iter().filter(|f| f.kind == kind).collect()
}
