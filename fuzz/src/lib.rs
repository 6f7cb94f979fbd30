//! Every reader as a function of bytes: it may refuse, it may not panic, and what it takes is finite.

use std::io::Write;
use std::path::Path;

use im_design::request::{Kind, design};
use im_design::{Certificate, DesignModel, LinearMachine};
use im_diagnose::intake::{self, SteadyTable};
use im_model::simulation::Scenario;
use im_model::{MotorFile, Recording};

pub mod mutate;

/// The motor of the examples.
pub const MOTOR: &str = include_str!("../../examples/motor.toml");

/// A reader, by name, and what to begin from.
pub struct Target {
    /// As in `fuzz_targets/`.
    pub name: &'static str,
    /// Reads.
    pub read: fn(&[u8]),
    /// True inputs.
    pub seeds: fn() -> Vec<String>,
}

/// All readers.
pub const TARGETS: [Target; 8] = [
    Target { name: "motor", read: motor, seeds: || vec![MOTOR.into(), include_str!("../../examples/motor_kwon.toml").into()] },
    Target { name: "recording", read: recording, seeds: || vec![rows()] },
    Target { name: "mapping", read: mapping, seeds: || vec![MAPPING.into()] },
    Target {
        name: "scenario",
        read: scenario,
        seeds: || {
            vec![
                include_str!("../../examples/scenario_dol.toml").into(),
                include_str!("../../examples/scenario_drive.toml").into(),
                include_str!("../../examples/scenario_vhz.toml").into(),
            ]
        },
    },
    Target { name: "table", read: table, seeds: || vec![TABLE.into()] },
    Target { name: "certificate", read: certificate, seeds: || vec![sealed(Kind::Derdiyok), sealed(Kind::Kubota)] },
    Target {
        name: "region",
        read: region,
        seeds: || [Kind::Kubota, Kind::Derdiyok, Kind::Utkin, Kind::Kenne].map(|kind| kind.example_region().to_owned()).into(),
    },
    Target { name: "diagnosis", read: diagnosis, seeds: || vec![DIAGNOSIS.into()] },
];

const MAPPING: &str = "file = \"run.csv\"\n[time]\ncolumn = \"t\"\nunit = \"ms\"\n[voltage]\nab = \"u_ab\"\nbc = { column = \"u_bc\", gain = 2.0 }\n\
                       [current]\na = \"i_a\"\nb = { column = \"i_b\", offset = \"mean\" }\n[speed]\ncolumn = \"n\"\nunit = \"rpm\"\n";
const TABLE: &str = "V_LL_V,I_A,P_3ph_W,Q_3ph_var,n_rpm,T_Nm\n400,4.9,310,3300,1499,0\n400,6.1,1900,3500,1474,10\n400,8.0,3500,3800,1446,20\n";
const DIAGNOSIS: &str = "{\"schema\": 1, \"verdict\": \"missing_effects\", \"effects\": [\"iron_loss\"], \"alternatives\": {}, \"ranking\": [], \
                         \"steps\": [{\"effects\": [], \"train\": {\"chi2_per_sample\": 3.0, \"rmse\": {\"i_alpha_A\": 0.1}}, \
                         \"holdout\": null}], \"parameters\": {}}";

/// A short recording in canonical columns.
pub fn rows() -> String {
    let row = |k: u32| {
        let (t, w) = (f64::from(k) * 1e-4, 314.159 * f64::from(k) * 1e-4);
        format!("{t},{:.3},{:.3},{:.4},{:.4},{:.3},0.0\n", 326.0 * w.cos(), 326.0 * w.sin(), 5.0 * w.sin(), -5.0 * w.cos(), 150.0)
    };
    "t_s,u_alpha_V,u_beta_V,i_alpha_A,i_beta_A,omega_m_rad_s,tau_load_Nm\n".to_owned() + &(0..600).map(row).collect::<String>()
}

fn machine() -> DesignModel {
    let motor = MotorFile::parse(MOTOR, "motor.toml").expect("the example is one");
    DesignModel::Machine(LinearMachine::from(&motor.machine))
}

fn sealed(kind: Kind) -> String {
    design(kind, machine(), kind.example_region()).and_then(|c| Ok(c.to_text()?)).expect("the example is feasible")
}

fn text(data: &[u8]) -> Option<&str> {
    std::str::from_utf8(data).ok()
}

/// In a file of its own, for readers that take a path.
fn in_file(data: &[u8], end: &str, read: impl FnOnce(&Path)) {
    let mut file = tempfile::Builder::new().suffix(end).tempfile().expect("a file can be made");
    file.write_all(data).expect("it can be written");
    read(file.path());
}

/// `motor.toml`.
pub fn motor(data: &[u8]) {
    let Some(Ok(motor)) = text(data).map(|t| MotorFile::parse(t, "motor.toml")) else { return };
    assert!(motor.machine.parameters().values().iter().all(|x| x.is_finite()) && motor.rating.validate().is_ok());
}

/// A recording in canonical columns.
pub fn recording(data: &[u8]) {
    if let Ok(r) = Recording::from_csv(data, "run.csv") {
        assert!(r.sample_time_s > 0.0 && r.sample_time_s.is_finite());
    }
    let motor = MotorFile::parse(MOTOR, "motor.toml").expect("the example is one");
    in_file(data, ".csv", |path| drop(intake::read(path, None, &motor)));
}

/// `recording.toml`.
pub fn mapping(data: &[u8]) {
    in_file(data, ".toml", |path| drop(intake::read_mapping(path)));
}

/// A scenario.
pub fn scenario(data: &[u8]) {
    let Some(Ok(s)) = text(data).map(|t| Scenario::parse(t, "scenario.toml", Path::new("."))) else { return };
    assert!(s.duration_s.is_finite() && s.samples() > 0);
}

/// A table of steady states.
pub fn table(data: &[u8]) {
    in_file(data, ".csv", |path| {
        let Ok(t) = SteadyTable::read(path, None) else { return };
        assert!(t.rows.iter().all(|r| r.current_rms_a.is_finite() && r.phase_voltage_rms_v.is_finite()));
    });
}

/// A certificate: what is taken is true.
pub fn certificate(data: &[u8]) {
    let Some(Ok((c, margins))) = text(data).map(Certificate::check_text) else { return };
    assert!(margins.iter().all(|m| m.margin > 0.0) && c.plant.check().is_ok());
}

/// A region file, of each design that is quick.
pub fn region(data: &[u8]) {
    let Some(text) = text(data) else { return };
    for kind in [Kind::Kubota, Kind::Derdiyok, Kind::Utkin, Kind::Kenne] {
        if let Ok(c) = design(kind, machine(), text) {
            assert!(c.check().is_ok());
        }
    }
}

/// `diagnosis.json`.
pub fn diagnosis(data: &[u8]) {
    let Some(text) = text(data) else { return };
    drop(im_diagnose::report::SideBySide::parse("diagnosis.json", text));
}
