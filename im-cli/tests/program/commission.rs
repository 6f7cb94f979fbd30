//! `im commission`: the motor that it writes is read again, and is the one that was hidden.

use std::fs;

use im_model::MotorFile;

use crate::common::{Folder, example, json, refused};

#[test]
fn the_motor_that_is_found_is_the_hidden_one() {
    let dir = Folder::new("commission");
    let (found, record) = (dir.path("found.toml"), dir.path("run.csv"));
    let args = ["commission", "--motor", &example("motor.toml"), "-o", &found, "--record", &record, "--json"];
    let summary = json(&args);
    assert!(summary["peak_current_a"].as_f64() < summary["current_limit_a"].as_f64().map(|x| 1.33 * x), "{summary}");
    assert!(summary["drive_time_s"].as_f64().unwrap() < 120.0, "{summary}");
    for symbol in ["R_s", "R_R", "L_sigma", "L_M", "J"] {
        let error = summary["parameters"][symbol]["error"].as_f64().unwrap();
        assert!(error.abs() < 0.05, "{symbol}: {summary}");
    }
    let (found, hidden) = (MotorFile::read(&found).unwrap(), MotorFile::read(example("motor.toml")).unwrap());
    assert_eq!(found.machine.pole_pairs(), hidden.machine.pole_pairs());
    assert!(found.machine.effects().inverter_nonlinearity.voltage_v > 10.0, "2 us of 594 V at 10 kHz, and a volt");
    assert!(dir.read("run.csv").lines().count() > 30_000);
}

#[test]
fn what_cannot_be_commissioned_is_said() {
    let dir = Folder::new("commission-locked");
    let locked = fs::read_to_string(example("scenario_drive.toml")).unwrap();
    let locked = locked.replace("torque_nm = [[0, 0], [0.8, 0], [0.8, 15], [1.4, 15], [1.4, 0]]", "imposed_speed_rad_s = 0");
    let scenario = dir.file("locked.toml", &locked);
    let out = dir.path("found.toml");
    let text = refused(&["commission", "--motor", &example("motor.toml"), "--scenario", &scenario, "-o", &out]);
    assert!(text.contains("the commissioning ended early: the shaft does not accelerate"), "{text}");
    assert!(!dir.has("found.toml"));
}
