//! What a bench has not measured, or knows beforehand: no load torque, tolerances, values that are held, a nameplate; and every sample in a file.

use std::fs;

use crate::common::{Folder, demo, done, json, refused};

/// The demo's recording without its last column.
fn without_load(f: &Folder, name: &str) -> String {
    let csv = fs::read_to_string(demo(name)).unwrap();
    let cut: String = csv.lines().map(|l| l.rsplit_once(',').unwrap().0.to_owned() + "\n").collect();
    assert!(cut.starts_with("t_s,") && !cut.contains("tau_load"));
    f.file(name, &cut)
}

#[test]
fn without_a_load_torque_the_cause_is_named_and_the_load_is_shown() {
    let f = Folder::new("unloaded");
    let [a, b, c] = ["train1.csv", "train2.csv", "holdout.csv"].map(|n| without_load(&f, n));
    let signals = f.path("signals.csv");
    let motor = demo("motor.toml");
    let args = ["diagnose", "--motor", &motor, "--train", &a, "--train", &b, "--holdout", &c, "--signals", &signals];
    let story = done(&[&args[..], &["--out", &f.path("out")]].concat());
    let story = story.split_whitespace().collect::<Vec<_>>().join(" ");
    let found: serde_json::Value = serde_json::from_str(&f.read("out/diagnosis.json")).unwrap();
    // The same effects as with the load torque, but for none that acts on the shaft.
    assert_eq!(found["verdict"], "missing_effects", "{story}");
    assert!(story.contains("Load torque, found") && story.contains("Not determined without the load"), "{story}");
    let loads = &found["loads"];
    assert_eq!(loads["found"].as_array().unwrap().len(), 3, "{loads}");
    assert!(loads["not_determined_without"].as_array().unwrap().iter().any(|e| e == "coulomb_friction"), "{loads}");
    assert!(found["parameters"]["inertia_kg_m2"].is_null(), "J is not seen");
    assert!(f.read("out/report.html").contains("Load torque, found"));
    // Measured less modelled is the residual, and the load is there.
    let csv = f.read("signals.csv");
    let mut lines = csv.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| names.iter().position(|n| *n == name).unwrap_or_else(|| panic!("{name} in {names:?}"));
    let row: Vec<&str> = lines.nth(500).unwrap().split(',').collect();
    let x = |name: &str| row[at(name)].parse::<f64>().unwrap();
    assert!((x("i_alpha_A_measured") - x("i_alpha_A_modelled") - x("i_alpha_A_residual")).abs() < 1e-9);
    assert!(x("tau_load_Nm_found").is_finite() && x("tau_load_Nm_std") > 0.0 && x("omega_m_rad_s_measured").is_finite());
    let rows = |name: &str| fs::read_to_string(demo(name)).unwrap().lines().count() - 1;
    assert_eq!(csv.lines().count() - 1, rows("train1.csv") + rows("train2.csv") + rows("holdout.csv"));
}

#[test]
fn compare_writes_every_sample_and_refuses_a_file_that_it_reads() {
    let f = Folder::new("signals");
    let (motor, data) = (demo("motor.toml"), without_load(&f, "train1.csv"));
    done(&["compare", "--motor", &motor, "--data", &data, "--signals", &f.path("s.csv")]);
    assert!(f.read("s.csv").starts_with("recording,t_s,i_alpha_A_measured,i_alpha_A_modelled,i_alpha_A_residual,"));
    let message = refused(&["compare", "--motor", &motor, "--data", &data, "--signals", &data]);
    assert!(message.contains("read by this command"), "{message}");
}

#[test]
fn what_is_known_beforehand_holds_a_fit() {
    let f = Folder::new("known");
    let (data, text) = (demo("train1.csv"), fs::read_to_string(demo("motor.toml")).unwrap());
    let given: f64 = text.lines().find_map(|l| l.strip_prefix("stator_resistance_ohm = ")).unwrap().parse().unwrap();
    let fitted = |motor: &str, more: &[&str]| {
        let all = json(&[&["fit", "--motor", motor, "--train", &data, "--json"], more].concat());
        all["parameters"]["stator_resistance_ohm"]["after"].as_f64()
    };
    let free = fitted(&demo("motor.toml"), &[]).unwrap();
    assert!((free / given - 1.0).abs() > 0.01, "{free}");
    // A tolerance far below what the recording determines keeps the value near; none holds it, and it is then no estimate.
    let line = |x: &str| text.replace(&format!("stator_resistance_ohm = {given}"), &format!("stator_resistance_ohm = {x}"));
    let near = f.file("near.toml", &line(&format!("{{ value = {given}, tolerance = 1e-5 }}")));
    let near = fitted(&near, &[]).unwrap();
    assert!((near / given - 1.0).abs() < 0.1 * (free / given - 1.0).abs(), "{near} {free} {given}");
    assert_eq!(fitted(&demo("motor.toml"), &["--fix", "stator_resistance_ohm"]), None);
    let message = refused(&["fit", "--motor", &demo("motor.toml"), "--train", &data, "--fix", "resistance"]);
    assert!(message.contains("--fix resistance") && message.contains("stator_resistance_ohm"), "{message}");
}

#[test]
fn a_nameplate_makes_a_motor_with_tolerances() {
    let f = Folder::new("nameplate");
    let plate = [
        "motor",
        "--power-w",
        "4000",
        "--voltage-v",
        "400",
        "--current-a",
        "8.1",
        "--speed-rpm",
        "1440",
        "--power-factor",
        "0.83",
    ];
    let motor = f.path("motor.toml");
    let table = done(&[&plate[..], &["-o", &motor]].concat());
    assert!(f.read("motor.toml").contains("pole_pairs = 2") && f.read("motor.toml").contains("tolerance = "), "{table}");
    let measured = json(&[&plate[..], &["--terminal-resistance-ohm", "3.0", "--json"]].concat());
    assert_eq!(measured["parameters"]["stator_resistance_ohm"]["value"], 1.5);
    let mut bad = plate;
    bad[10] = "1.2";
    assert!(refused(&bad).contains("power_factor"));
    // What it makes is a motor like any other.
    done(&["compare", "--motor", &motor, "--data", &demo("train1.csv")]);
}

#[test]
fn losses_are_segregated_from_two_tables_with_their_intervals() {
    let f = Folder::new("losses");
    let head = "V_LL_V,I_A,P_3ph_W,n_rpm,T_Nm\n";
    let free = "400,4.0,330,1499,\n300,2.9,215,1499,\n200,1.95,140,1498,\n150,1.5,118,1497,\n100,1.1,101,1494,\n";
    let loaded =
        "400,9.4,5260,1432,30\n400,8.3,4480,1443,26\n400,6.6,3330,1458,19.5\n400,5.2,2220,1473,13\n400,4.3,1200,1487,6.5\n";
    let (free, loaded) = (f.file("free.csv", &(head.to_owned() + free)), f.file("load.csv", &(head.to_owned() + loaded)));
    let motor = demo("motor.toml");
    let args = ["losses", "--motor", &motor, "--table", &free, "--table", &loaded, "--terminal-resistance-ohm", "3.0"];
    let all = json(&[&args[..], &["--winding-c", "75", "--json"]].concat());
    let losses = &all["losses"];
    assert_eq!((losses["constant_by"].as_str(), losses["points"].as_array().unwrap().len()), (Some("voltages"), 5), "{losses}");
    for part in ["stator_w", "rotor_w", "iron_w", "friction_windage_w", "stray_w", "total_w", "efficiency"] {
        let e = &losses["points"][0][part];
        assert!(e["value"].as_f64().unwrap() > 0.0 && e["half_95"].as_f64().unwrap() > 0.0, "{part}: {e}");
    }
    let text = done(&args);
    assert!(text.contains("friction and windage") && text.contains("efficiency"), "{text}");
    assert!(refused(&[&args[..7], &["--terminal-resistance-ohm=-1"]].concat()).contains("--terminal-resistance-ohm"));
}
