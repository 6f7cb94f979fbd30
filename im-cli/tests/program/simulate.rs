//! `im simulate` and `im effects`, and what every command does with wrong usage.

use std::fs;

use crate::common::{Folder, done, example, im, json, refused, text};

#[test]
fn both_examples_run_and_their_recordings_are_read_again() {
    let dir = Folder::new("examples");
    for (scenario, rows) in [("scenario_dol.toml", 10_000), ("scenario_vhz.toml", 30_000)] {
        let (out, inside) = (dir.path("run.csv"), dir.path("inside.csv"));
        let args = ["simulate", "--motor", &example("motor.toml"), "--scenario", &example(scenario), "-o", &out];
        let text = done(&[&args[..], &["--internals", &inside]].concat());
        assert!(text.contains(&format!("{rows} rows")) && text.contains("rpm"), "{text}");
        let csv = dir.read("run.csv");
        assert!(csv.starts_with("t_s,u_alpha_V,u_beta_V,i_alpha_A,i_beta_A,omega_m_rad_s,tau_load_Nm\n"));
        assert_eq!(csv.lines().count(), rows + 1);
        assert_eq!(dir.read("inside.csv").lines().count(), rows + 1);
        let again = dir.file("again.toml", "[scenario]\nname = \"again\"\n[recording]\nfile = \"run.csv\"\n");
        let piped = done(&["simulate", "--motor", &example("motor.toml"), "--scenario", &again, "-o", "-"]);
        assert_eq!(piped.lines().count(), rows + 1);
    }
}

/// From a motor that says what it leaves: two columns more, which no command takes for sensors. Without, not a byte is another.
#[test]
fn a_refined_motor_says_how_far_off_a_simulation_is() {
    let dir = Folder::new("bands");
    let motor = fs::read_to_string(example("motor.toml")).unwrap();
    let bands = "\n[prediction]\ncurrent_a = 0.5\ncurrent_per_ampere = 0.02\nspeed_rad_s = 1.5\nspeed_rad_s_per_ampere = 0.0\n";
    let refined = dir.file("refined.toml", &(motor + bands));
    let simulate = |motor: &str, out: &str| {
        let out = dir.path(out);
        done(&["simulate", "--motor", motor, "--scenario", &example("scenario_dol.toml"), "-o", &out])
    };
    let said = simulate(&refined, "run.csv");
    assert!(said.contains("i_band_A, omega_band_rad_s: 95 % of readings lie within"), "{said}");
    assert!(!simulate(&example("motor.toml"), "plain.csv").contains("band_A"));
    let (with, plain) = (dir.read("run.csv"), dir.read("plain.csv"));
    assert!(with.starts_with("t_s,u_alpha_V,u_beta_V,i_alpha_A,i_beta_A,omega_m_rad_s,tau_load_Nm,i_band_A,omega_band_rad_s\n"));
    let cut: String = with.lines().map(|l| l.rsplitn(3, ',').last().unwrap().to_owned() + "\n").collect();
    assert_eq!(cut, plain);
    let row: Vec<f64> = with.lines().nth(5000).unwrap().split(',').map(|x| x.parse().unwrap()).collect();
    assert_eq!(row[7..], [0.5f64.hypot(0.02 * row[3].hypot(row[4])), 1.5]);
    for motor in [example("motor.toml"), refined] {
        let of = |run: &str| json(&["compare", "--motor", &motor, "--data", &dir.path(run), "--json"]);
        let (with, plain) = (of("run.csv"), of("plain.csv"));
        assert_eq!(with["guessed"], serde_json::json!([]));
        assert_eq!((&with["total"], &with["errors"][0]["rmse"]), (&plain["total"], &plain["errors"][0]["rmse"]));
    }
}

#[test]
fn the_same_seed_gives_the_same_recording() {
    let dir = Folder::new("seed");
    let run = |seed: &str, out: &str| {
        let out = dir.path(out);
        let args = ["simulate", "--motor", &example("motor.toml"), "--scenario", &example("scenario_dol.toml")];
        let text = done(&[&args[..], &["-o", &out, "--seed", seed, "--json"]].concat());
        assert!(text.contains("\"rows\":10000") && text.contains("\"effects\":[\"iron_loss\"]"), "{text}");
        fs::read(out).unwrap()
    };
    assert_eq!(run("5", "a.csv"), run("5", "b.csv"));
    assert_ne!(run("5", "a.csv"), run("6", "b.csv"));
}

#[test]
fn bad_input_is_refused_with_its_place() {
    let dir = Folder::new("bad");
    let motor = fs::read_to_string(example("motor.toml")).unwrap();
    let scenario = fs::read_to_string(example("scenario_vhz.toml")).unwrap();
    let out = dir.path("run.csv");
    let with_motor = |text: &str| {
        let m = dir.file("motor.toml", text);
        refused(&["simulate", "--motor", &m, "--scenario", &example("scenario_dol.toml"), "-o", &out])
    };
    let with_scenario = |text: &str| {
        let s = dir.file("scenario.toml", text);
        refused(&["simulate", "--motor", &example("motor.toml"), "--scenario", &s, "-o", &out])
    };
    let text = with_motor(&motor.replace("inductance_h = 0.156", "inductance_h = -0.2"));
    assert!(text.contains("motor.toml:11: magnetizing_inductance_h = -0.2 must be positive and finite\n"), "{text}");
    assert!(text.contains(" 11 | magnetizing_inductance_h = -0.2\n    | ^^^^^^^^^^^^^^^^^^^^^^^^\n"), "{text}");
    let text = with_motor(&motor.replace("[effects.iron_loss]", "[effects.iron_los]"));
    assert!(text.contains("did you mean iron_loss?"), "{text}");
    assert!(with_motor("").contains("machine is missing"));
    assert!(with_motor("\u{0}\u{1}").contains("motor.toml:1: not TOML"));
    let text = with_scenario(&scenario.replace("carrier_frequency_hz = 10e3", "carrier_frequency_hz = 7e3"));
    assert!(text.contains("holds 1.400 periods"), "{text}");
    let text = with_scenario(&scenario.replace("kind = \"carrier_pwm\"", "kind = \"delta_modulation\""));
    assert!(text.contains("carrier_frequency_hz is given for kind"), "{text}");
    let controller = "[scenario]\nduration_s = 1\n[controller]\nname = \"x\"\n";
    assert!(with_scenario(controller).contains("no controller named \"x\"; there are indirect_field_orientation,"));
    let fluxless = controller.replace('x', "kenne");
    assert!(with_scenario(&fluxless).contains("[controller] rotor_flux_vs is zero"));
    let recording = "[scenario]\nname = \"again\"\n[recording]\nfile = \"cut.csv\"\n";
    dir.file("cut.csv", "t_s,u_alpha_V,u_beta_V,i_alpha_A,i_beta_A,omega_m_rad_s\n0,1,2,3,4,5\n0.1,1,,3,4,5\n");
    let text = with_scenario(recording);
    assert!(text.contains("cut.csv:3: u_beta_V is empty") && text.contains(" 3 | 0.1,1,,3,4,5\n   |       ^\n"), "{text}");
    assert!(with_scenario(&recording.replace("cut", "none")).contains("none.csv: cannot read it: no such file"));
    assert!(!dir.has("run.csv"), "nothing is written when something is wrong");
    let nowhere = dir.path("none/run.csv");
    let args = ["simulate", "--motor", &example("motor.toml"), "--scenario", &example("scenario_dol.toml"), "-o", &nowhere];
    assert!(refused(&args).contains("cannot write it: no such file or folder"));
}

#[test]
fn every_controller_of_a_scenario_brings_the_machine_to_speed() {
    let dir = Folder::new("controllers");
    let text = fs::read_to_string(example("scenario_drive.toml")).unwrap();
    for name in ["indirect_field_orientation", "direct_field_orientation", "kenne", "jadot"] {
        let scenario = dir.file("scenario.toml", &text.replace("indirect_field_orientation", name));
        let args = ["simulate", "--motor", &example("motor.toml"), "--scenario", &scenario, "-o", &dir.path("run.csv"), "--json"];
        let summary = json(&args);
        let speed = summary["final_speed_rad_s"].as_f64().unwrap();
        // The last speed reference of the example; half a rad/s for noise and the carrier's ripple.
        assert!((speed + 60.0).abs() < 0.5, "{name}: {speed}");
    }
}

/// By name alone: the law comes from the motor's circuit. At 60 rad/s the torque asked for, and no more current than the law's.
#[test]
fn a_scenario_names_the_drive_of_least_current() {
    let dir = Folder::new("mtpa");
    let toml = "[scenario]\nduration_s = 2.5\nsample_time_s = 1e-4\n[controller]\nname = \"mtpa\"\ntorque_nm = 10\n\
        [load]\nimposed_speed_rad_s = 60\n\
        [inverter]\nkind = \"delta_modulation\"\ndc_voltage_v = 600\nperiod_s = 1e-4\ndead_time_s = 2e-6\n";
    let scenario = dir.file("scenario.toml", toml);
    let (run, inside) = (dir.path("run.csv"), dir.path("inside.csv"));
    let args = ["simulate", "--motor", &example("motor.toml"), "--scenario", &scenario, "-o", &run, "--internals", &inside];
    done(&args);
    // The mean over the last half second.
    let mean = |file: &str, of: &dyn Fn(&[f64], &[&str]) -> f64| {
        let text = dir.read(file);
        let mut lines = text.lines();
        let names: Vec<&str> = lines.next().unwrap().split(',').collect();
        let rows: Vec<Vec<f64>> = lines.map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect();
        rows[rows.len() - 5000..].iter().map(|r| of(r, &names)).sum::<f64>() / 5000.0
    };
    let column = |name: &'static str| move |r: &[f64], names: &[&str]| r[names.iter().position(|n| *n == name).unwrap()];
    let torque = mean("inside.csv", &column("torque_Nm"));
    // Iron loss, which the law does not know, takes a little.
    assert!((torque / 10.0 - 1.0).abs() < 0.03, "{torque} Nm");
    let squared = mean("run.csv", &|r, names| column("i_alpha_A")(r, names).powi(2) + column("i_beta_A")(r, names).powi(2));
    // Least current of the linear machine: T = (3/2) n_p (L_m²/L_r) I², rms; ripple of 100 µs decisions beside it.
    let least = (10.0f64 / (3.0 * 0.156 * 0.156 / 0.16)).sqrt();
    let rms = (squared / 2.0).sqrt();
    assert!((least..1.08 * least).contains(&rms), "{rms} A, least {least} A");
    // Its commands are currents: another inverter is refused in words.
    let averaged = dir.file("averaged.toml", &toml[..toml.find("[inverter]").unwrap()]);
    let args = ["simulate", "--motor", &example("motor.toml"), "--scenario", &averaged, "-o", &dir.path("no.csv")];
    assert!(refused(&args).contains("a current reference needs delta modulation"), "{}", refused(&args));
}

/// Fig. 4 of Kwon et al. without the speed sensor, on the machine of Table V: the same speed as with it. A wrong name is refused with the right ones.
#[test]
fn a_scenario_takes_the_speed_from_an_observer() {
    let dir = Folder::new("sensorless");
    let text = fs::read_to_string(example("scenario_kwon_4.toml")).unwrap();
    let motor = example("motor_kwon_table_v.toml");
    let speed = |text: &str| {
        let scenario = dir.file("scenario.toml", text);
        let args = ["simulate", "--motor", &motor, "--scenario", &scenario, "-o", &dir.path("run.csv"), "--json"];
        json(&args)["final_speed_rad_s"].as_f64().unwrap()
    };
    let lines = |keep: &dyn Fn(&str) -> bool| text.lines().filter(|l| keep(l)).map(|l| format!("{l}\n")).collect::<String>();
    let (measured, estimated) = (speed(&lines(&|l| !l.starts_with("observer"))), speed(&text));
    assert!((measured - 91.5).abs() < 0.5 && (estimated / measured - 1.0).abs() < 0.01, "{measured} {estimated}");
    let wrong = dir.file("wrong.toml", &text.replace("\"thau\"", "\"tau\""));
    let args = ["simulate", "--motor", &motor, "--scenario", &wrong, "-o", &dir.path("no.csv")];
    assert!(refused(&args).contains("no observer named \"tau\"; there are"), "{}", refused(&args));
    let reads = dir.file("reads.toml", &text.replace("\"thau\"", "\"current-model\""));
    let args = ["simulate", "--motor", &motor, "--scenario", &reads, "-o", &dir.path("no.csv")];
    assert!(refused(&args).contains("needs a measured speed"), "{}", refused(&args));
}

/// The machine of Table V (Kwon et al.) runs, and is found again from a T circuit that is 10 to 25 % off, the laws of its air gap held.
#[test]
fn a_machine_with_an_air_gap_of_its_own_is_fitted() {
    let dir = Folder::new("air-gap");
    let motor = example("motor_kwon_table_v.toml");
    let scenario = dir.file(
        "scenario.toml",
        "[scenario]\nduration_s = 1.2\nsample_time_s = 2e-4\n[volts_per_hertz]\nvoltage_peak_v = 375.6\nfrequency_hz = 60\nboost_v = 4\n\
         ramp_hz_per_s = 120\nreference_hz = [[0, 0], [0.5, 60], [0.9, 60], [0.9, 30]]\n[load]\ntorque_nm = [[0, 0], [0.6, 0], [0.6, 120]]\n\
         [sensors]\ncurrent_noise_a = 0.3\nspeed_noise_rad_s = 0.1\n",
    );
    let run = dir.path("run.csv");
    done(&["simulate", "--motor", &motor, "--scenario", &scenario, "-o", &run]);
    let keys = ["stator_resistance_ohm", "rotor_resistance_ohm", "magnetizing_inductance_h", "inertia_kg_m2"];
    let value = |text: &str, key: &str| -> f64 {
        let line = text.lines().find(|l| l.starts_with(&format!("{key} ="))).unwrap();
        line.rsplit("= ").next().unwrap().parse().unwrap()
    };
    let truth = fs::read_to_string(&motor).unwrap();
    let mut guess = truth.clone();
    for (key, factor) in keys.into_iter().zip([0.8, 1.25, 1.1, 0.8]) {
        let old = value(&truth, key);
        guess = guess.replace(&format!("{key} = {old:?}"), &format!("{key} = {:?}", factor * old));
    }
    assert_ne!(guess, truth);
    done(&["fit", "--motor", &dir.file("guess.toml", &guess), "--train", &run, "-o", &dir.path("fitted.toml")]);
    let fitted = dir.read("fitted.toml");
    for key in keys {
        let (is, was) = (value(&fitted, key), value(&truth, key));
        assert!((is / was - 1.0).abs() < 0.03, "{key}: {is}, {was}");
    }
    // The laws are as they were given.
    for key in ["m4_vs", "l_r3", "reference_flux_vs"] {
        assert_eq!(value(&fitted, key), value(&truth, key));
    }
}

#[test]
fn wrong_usage_ends_with_status_2() {
    for args in [&[][..], &["simulate"], &["simulat"], &["effects", "show", "iron_los"], &["effects", "show"]] {
        let o = im(args);
        assert_eq!(o.status.code(), Some(2), "{args:?}");
        assert!(!text(&o.stderr).contains('\x1b'));
    }
    assert!(text(&im(&["effects", "show", "iron_los"]).stderr).contains("'iron_loss'"));
}

#[test]
fn every_card_fits_a_terminal_and_is_json_too() {
    let list = done(&["effects"]);
    let names: Vec<&str> = list.lines().take_while(|l| !l.is_empty()).filter_map(|l| l.split_whitespace().next()).collect();
    assert_eq!(names.len(), im_model::EffectId::ALL.len(), "{list}");
    for name in names {
        for extra in [&[][..], &["--motor", &example("motor.toml")]] {
            let card = done(&[&["effects", "show", name], extra].concat());
            assert!(card.lines().all(|l| l.chars().count() <= 80), "{card}");
            assert!(!card.contains('\x1b') && card.contains(&format!("[effects.{name}]")) && card.contains("Shows"));
            let v = json(&[&["effects", "show", name, "--json"], extra].concat());
            assert_eq!(v["effect"], name);
            assert!(!v["parameters"].as_array().unwrap().is_empty());
        }
    }
    assert_eq!(json(&["effects", "--json"])["effects"].as_array().unwrap().len(), im_model::EffectId::ALL.len());
}

#[test]
fn shells_get_what_there_is_to_complete() {
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let script = done(&["completions", shell]);
        assert!(script.contains("diagnose") && script.contains("next-test") && script.contains("holdout"), "{shell}");
    }
}
