//! A start with a warm winding and a table at room temperature, in one fit: the resistances are those of the motor file's temperature.

use std::path::Path;

use im_diagnose::fitted::Fitted;
use im_diagnose::intake::FindingKind;
use im_diagnose::sources::{Source, Sources};
use im_model::simulation::{Scenario, Simulation};
use im_model::{BaseParameter, Complex, Machine, MotorFile, ParameterId};

use crate::simulated::{Folder, MAPPING, MOTOR, SCENARIO, columns_of, csv, motor};

const COLD_C: f64 = 25.0;
const WARM_C: f64 = 78.0;

/// R_s of copper, R_r of aluminium.
fn resistances(c: f64) -> [f64; 2] {
    [1.5 * (235.0 + c) / (235.0 + COLD_C), 0.9 * (225.0 + c) / (225.0 + COLD_C)]
}

/// The T circuit with the rotor at a slip, at `u` V rms of a phase: current, A, and power of three phases, W.
fn circuit(u: f64, slip: f64, c: f64) -> [f64; 2] {
    let [rs, rr] = resistances(c);
    let w = std::f64::consts::TAU * 50.0;
    let (leakage, magnetizing) = (Complex::new(0.0, w * 0.004), Complex::new(0.0, w * 0.156));
    let rotor = leakage + rr / slip;
    let i = u / (leakage + rs + magnetizing * rotor / (magnetizing + rotor));
    [i.norm(), 3.0 * u * i.re]
}

/// Rotor held at 25 °C, and under load at 60 °C.
fn table() -> String {
    let mut text = "V_LL_V,I_A,P_3ph_W,n_rpm,winding_C\n".to_string();
    for (u, slip, c) in [(30.0, 1.0, COLD_C), (45.0, 1.0, COLD_C), (60.0, 1.0, COLD_C), (230.9, 0.02, 60.0), (230.9, 0.04, 60.0)]
    {
        let [i, p] = circuit(u, slip, c);
        text += &format!("{:.4},{i:.5},{p:.3},{:.3},{c}\n", u * 3f64.sqrt(), 1500.0 * (1.0 - slip));
    }
    text
}

/// The fit to a start with the winding at 78 °C and to the table; the mapping says so with `line`.
fn fitted(name: &str, line: &str, with_table: bool) -> (Fitted, bool) {
    let folder = Folder::new(name);
    let mut warm = *motor().machine.parameters();
    [warm.stator_resistance_ohm, warm.rotor_resistance_ohm] = resistances(WARM_C);
    let scenario = Scenario::parse(SCENARIO, "scenario.toml", Path::new("")).unwrap();
    let run = Simulation::new(&Machine::base(warm, 2).unwrap(), &scenario).run().unwrap().recording;
    folder.put("run.recording.toml", format!("{line}\n{MAPPING}"));
    let run = folder.put("run.csv", csv(&columns_of(&run)));
    let given = MOTOR.replace("[machine]", &format!("[machine]\nwinding_c = {COLD_C}"));
    let given = given.replace("stator_resistance_ohm = 1.5", "stator_resistance_ohm = 1.65");
    let given = given.replace("rotor_resistance_ohm = 0.9", "rotor_resistance_ohm = 0.78");
    let mut sources = Sources::new(MotorFile::parse(&given, "motor.toml").unwrap(), "motor.toml".into());
    sources.train = vec![Source::File(run, None)];
    if with_table {
        sources.tables = vec![(folder.put("points.csv", table()), None)];
    }
    let (case, findings) = sources.case().unwrap();
    let noticed = findings.iter().any(|f| f.kind == FindingKind::WindingTemperature);
    (Fitted::new(case, sources.options()).unwrap(), noticed)
}

fn resistances_of(fitted: &Fitted) -> [f64; 2] {
    [BaseParameter::StatorResistance, BaseParameter::RotorResistance].map(|p| fitted.after.machine.get(ParameterId::Base(p)))
}

#[test]
fn a_warm_recording_and_a_cold_table_give_one_pair_of_resistances() {
    for with_table in [false, true] {
        let (fit, noticed) = fitted("warm", &format!("winding_c = {WARM_C}"), with_table);
        assert!(!noticed && fit.after.winding_c == Some(COLD_C));
        for (found, truth) in resistances_of(&fit).into_iter().zip(resistances(COLD_C)) {
            assert!((found / truth - 1.0).abs() < 0.01, "{found} Ω, true {truth}, table {with_table}");
        }
    }
}

#[test]
fn a_recording_that_says_no_temperature_is_taken_as_cold() {
    let (fit, _) = fitted("silent", "", false);
    for (found, warm) in resistances_of(&fit).into_iter().zip(resistances(WARM_C)) {
        assert!((found / warm - 1.0).abs() < 0.01, "{found} Ω, in the run {warm}");
    }
    // Beside a table with temperatures it is said.
    assert!(fitted("silent_beside", "", true).1);
}
