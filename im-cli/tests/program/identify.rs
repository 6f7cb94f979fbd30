//! `im identify`: replay and map.

use std::path::Path;

use crate::common::{Folder, done, example, im, json, refused};

#[test]
fn the_map_is_drawn_and_its_table_says_what_shows_where() {
    let out = Folder::new("map");
    let text = done(&["identify", "--motor", &example("motor.toml"), "--sensitivity-map", "--out", &out.path("")]);
    let line =
        |start: &str| text.lines().find(|l| l.starts_with(start)).unwrap_or_else(|| panic!("{start} in {text}")).to_owned();
    let last = |l: String| l.split_whitespace().rev().take(4).map(|x| x.parse::<f64>().unwrap()).collect::<Vec<_>>();
    // L_f, R_s, L, R_req from the right.
    assert!(last(line("1 % of the speed, no load"))[1] > 0.9);
    assert!(last(line("rated speed, rated load"))[3] > 0.6);
    let map = json(&["identify", "--motor", &example("motor.toml"), "--sensitivity-map", "--json"]);
    assert_eq!(map["points"][0]["share"].as_array().unwrap().len(), map["parameters"].as_array().unwrap().len());
    let svg = out.read("sensitivity.svg");
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
}

#[test]
fn a_simulated_start_is_replayed_and_every_row_written() {
    let out = Folder::new("replay");
    let run = out.path("run.csv");
    done(&["simulate", "--motor", &example("motor.toml"), "--scenario", &example("scenario_dol.toml"), "-o", &run]);
    let said = done(&["identify", "--motor", &example("motor.toml"), "--online", "--data", &run, "--out", &out.path("")]);
    assert!(said.contains("adapting: R_r"));
    let summary = json(&["identify", "--motor", &example("motor.toml"), "--online", "--data", &run, "--json"]);
    assert!(summary["final"]["kenne"]["rotor_resistance_ohm"].as_f64().unwrap() > 0.0 && summary["lost_rows"] == 0, "{summary}");
    let estimates = out.read("estimates.csv");
    let rows = out.read("run.csv").lines().count();
    // A header each; the first row of a recording has no sample before it.
    assert_eq!(estimates.lines().count(), rows - 1);
    let numbers = |l: &str| l.split(',').all(|x| x.parse::<f64>().is_ok_and(f64::is_finite));
    assert!(estimates.lines().skip(1).all(numbers));
    let columns = estimates.lines().next().unwrap().split(',').count();
    assert!(estimates.lines().all(|l| l.split(',').count() == columns));
    let svg = out.read("estimates.svg");
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.len() < 150_000 && !svg.contains("NaN"));
}

/// Dead time that nobody took off the voltage is taken for R_s, up to the end of its range: marked in the rows, counted, and said what it may be.
#[test]
fn an_estimate_on_its_bound_is_marked_in_every_row() {
    let out = Folder::new("bound");
    let run = out.path("run.csv");
    done(&["simulate", "--motor", &example("motor.toml"), "--scenario", &example("scenario_sensorless.toml"), "-o", &run]);
    let base = ["identify", "--motor", &example("motor.toml"), "--online", "--data", &run];
    let said = done(&[&base[..], &["--out", &out.path("")]].concat());
    // Twice the 1.5 Ω of the motor file.
    assert!(said.lines().filter(|l| l.contains(" 3! |")).count() >= 3, "{said}");
    let words = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("no estimate there: R_s (Kenné, both) in") && words.contains("dead time"), "{said}");
    let share = json(&[&base[..], &["--json"]].concat())["at_bound_share"].clone();
    assert!(share["kenne_both_stator_resistance"].as_f64().unwrap() > 0.3 && share["kenne_rotor_resistance"] == 0.0, "{share}");
    let rows = out.read("estimates.csv");
    let column = rows.lines().next().unwrap().split(',').position(|name| name == "kenne_both_stator_at_bound").unwrap();
    let (first, last) = (rows.lines().nth(1).unwrap(), rows.lines().last().unwrap());
    assert_eq!([first, last].map(|l| l.split(',').nth(column).unwrap()), ["0", "1"]);
}

/// A start of a real machine, its sensors saturated in part.
#[test]
#[ignore = "needs the recordings in ../shared, which cannot be copied"]
fn a_measured_start_is_taken_in_as_compare_takes_it() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let data = root.join("../../shared/recordings/measured/direct_on_line_4kw/Test_4_IM_Direct_Start.csv");
    let described = root.join("../im-diagnose/tests/recordings/direct_on_line_4kw");
    let [motor, mapping] =
        ["motor.toml", "Test_4_IM_Direct_Start.recording.toml"].map(|n| described.join(n).display().to_string());
    let out = Folder::new("measured");
    let data = data.display().to_string();
    let args = ["identify", "--online", "--motor", &motor, "--data", &data, "--mapping", &mapping, "--out", &out.path("")];
    let text = done(&args);
    assert!(text.contains("saturates from about") && text.contains("rows had no usable current"), "{text}");
    // Under load, from 1.1 to 1.5 s: the locked-rotor test gives 1.2 Ω, and the tachometer is good for a tenth of the slip.
    let rows = out.read("estimates.csv");
    let loaded: Vec<f64> = rows
        .lines()
        .skip(1)
        .map(|l| l.split(',').map(|x| x.parse::<f64>().unwrap()).collect::<Vec<_>>())
        .filter(|r| (1.1..1.5).contains(&r[0]))
        .map(|r| r[1])
        .collect();
    let mean = loaded.iter().sum::<f64>() / loaded.len() as f64;
    assert!((mean / 1.2 - 1.0).abs() < 0.1, "{mean}");
}

#[test]
fn missing_files_and_missing_choices_are_named() {
    let text = refused(&["identify", "--motor", &example("motor.toml"), "--online", "--data", "nowhere.csv"]);
    assert!(text.starts_with("error: nowhere.csv"), "{text}");
    assert_eq!(im(&["identify", "--motor", &example("motor.toml")]).status.code(), Some(2), "neither map nor replay");
    assert_eq!(im(&["identify", "--motor", &example("motor.toml"), "--online"]).status.code(), Some(2), "no recording");
}
