//! A voltage that was measured with noise, on the mains: it drives the model, and what that makes of currents and speed is nothing that is missing.

use std::fs;

use crate::common::{Folder, done, example};

/// White noise of this standard deviation, V, on both axes of a canonical recording's voltage; without the columns `left_out`.
fn noisy(f: &Folder, from: &str, sigma_v: f64, seed: u64, left_out: &[&str]) -> String {
    let text = fs::read_to_string(f.path(from)).unwrap();
    let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let mut state = seed;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut field = |name: &str, value: &str| match name {
        "u_alpha_V" | "u_beta_V" => {
            let noise = sigma_v * (0..12).map(|_| uniform()).sum::<f64>();
            (value.parse::<f64>().unwrap() + noise).to_string()
        }
        _ => value.to_owned(),
    };
    let kept = |line: &str, of: &mut dyn FnMut(&str, &str) -> String| -> String {
        let all = names.iter().zip(line.split(',')).filter(|(n, _)| !left_out.contains(n));
        all.map(|(n, v)| of(n, v)).collect::<Vec<_>>().join(",") + "\n"
    };
    let mut lines = text.lines();
    let head = kept(lines.next().unwrap(), &mut |_, v| v.to_owned());
    let rows: String = lines.map(|l| kept(l, &mut field)).collect();
    f.file(&format!("noisy_{from}"), &(head + &rows))
}

#[test]
fn noise_of_a_measured_voltage_is_not_taken_for_something_that_is_missing() {
    let f = Folder::new("noisy-voltage");
    let motor = example("motor.toml");
    let bars = fs::read_to_string(&motor).unwrap() + "\n[effects.rotor_skin_effect]\nresistance_rise = 1.0\n";
    let bars = f.file("bars.toml", &bars);
    for (machine, wanted) in [(&motor, vec![]), (&bars, vec!["rotor_skin_effect"])] {
        for seed in ["1", "2"] {
            let (dol, to) = (example("scenario_dol.toml"), f.path(&format!("{seed}.csv")));
            done(&["simulate", "--motor", machine, "--scenario", &dol, "--seed", seed, "-o", &to]);
        }
        for left_out in [&[][..], &["tau_load_Nm"][..]] {
            // So much that, from row to row, it makes nearly as much of the currents as their sensors' noise does.
            let [train, holdout] = [("1.csv", 3), ("2.csv", 4)].map(|(name, seed)| noisy(&f, name, 3.0, seed, left_out));
            let (out, args) = (f.path("out"), ["diagnose", "--motor", &motor, "--train", &train, "--holdout", &holdout]);
            let said = done(&[&args[..], &["--out", &out]].concat());
            let found: serde_json::Value = serde_json::from_str(&f.read("out/diagnosis.json")).unwrap();
            let named: Vec<&str> = found["effects"].as_array().unwrap().iter().filter_map(|e| e.as_str()).collect();
            assert_eq!(found["verdict"], if wanted.is_empty() { "adequate" } else { "missing_effects" }, "{left_out:?}: {said}");
            assert_eq!(named, wanted, "{left_out:?}: {said}");
            let taken = said.split_once("behind the noise of its sensor, ").and_then(|(_, rest)| rest.split_once(" V rms"));
            let taken: f64 = taken.unwrap_or_else(|| panic!("{said}")).0.parse().unwrap();
            assert!((taken - 3.0).abs() < 0.2, "{taken}");
        }
    }
}
