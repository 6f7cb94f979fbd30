//! `im identify` from outside.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn im(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_im")).args(args).output().unwrap()
}

fn example(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name).display().to_string()
}

fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("im-identify-{name}-{}", std::process::id()));
    fs::create_dir_all(&path).unwrap();
    path
}

#[test]
fn the_map_is_drawn_and_its_table_says_what_shows_where() {
    let out = folder("map");
    let said = im(&["identify", "--motor", &example("motor.toml"), "--sensitivity-map", "--out", out.to_str().unwrap()]);
    let text = String::from_utf8(said.stdout).unwrap();
    assert_eq!(said.status.code(), Some(0));
    let line =
        |start: &str| text.lines().find(|l| l.starts_with(start)).unwrap_or_else(|| panic!("{start} in {text}")).to_owned();
    let last = |l: String| l.split_whitespace().rev().take(4).map(|x| x.parse::<f64>().unwrap()).collect::<Vec<_>>();
    // L_f, R_s, L, R_req from the right.
    assert!(last(line("1 % of the speed, no load"))[1] > 0.9);
    assert!(last(line("rated speed, rated load"))[3] > 0.6);
    let svg = fs::read_to_string(out.join("sensitivity.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn a_simulated_start_is_replayed_and_every_row_written() {
    let out = folder("replay");
    let run = out.join("run.csv").display().to_string();
    let made = im(&["simulate", "--motor", &example("motor.toml"), "--scenario", &example("scenario_dol.toml"), "-o", &run]);
    assert_eq!(made.status.code(), Some(0), "{}", String::from_utf8_lossy(&made.stderr));
    let said = im(&["identify", "--motor", &example("motor.toml"), "--online", "--data", &run, "--out", out.to_str().unwrap()]);
    assert_eq!(said.status.code(), Some(0), "{}", String::from_utf8_lossy(&said.stderr));
    assert!(String::from_utf8(said.stdout).unwrap().contains("adapting: R_r"));
    let estimates = fs::read_to_string(out.join("estimates.csv")).unwrap();
    let rows = fs::read_to_string(&run).unwrap().lines().count();
    // A header each; the first row of a recording has no sample before it.
    assert_eq!(estimates.lines().count(), rows - 1);
    let numbers = |l: &str| l.split(',').all(|x| x.parse::<f64>().is_ok_and(f64::is_finite));
    assert!(estimates.lines().skip(1).all(numbers));
    let columns = estimates.lines().next().unwrap().split(',').count();
    assert!(estimates.lines().all(|l| l.split(',').count() == columns));
    let svg = fs::read_to_string(out.join("estimates.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.len() < 150_000 && !svg.contains("NaN"));
    fs::remove_dir_all(out).unwrap();
}

/// A start of a real machine, its sensors saturated in part; skipped where it is not at hand.
#[test]
fn a_measured_start_is_taken_in_as_compare_takes_it() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let data = root.join("../../shared/recordings/measured/direct_on_line_4kw/Test_4_IM_Direct_Start.csv");
    if !data.is_file() {
        println!("skipped: the measured start is not here");
        return;
    }
    let described = root.join("../im-diagnose/tests/recordings/direct_on_line_4kw");
    let [motor, mapping] =
        ["motor.toml", "Test_4_IM_Direct_Start.recording.toml"].map(|n| described.join(n).display().to_string());
    let out = folder("measured");
    let data = data.display().to_string();
    let args =
        ["identify", "--online", "--motor", &motor, "--data", &data, "--mapping", &mapping, "--out", out.to_str().unwrap()];
    let said = im(&args);
    let text = String::from_utf8(said.stdout).unwrap();
    assert_eq!(said.status.code(), Some(0), "{}", String::from_utf8_lossy(&said.stderr));
    assert!(text.contains("saturates from about") && text.contains("rows had no usable current"), "{text}");
    // Under load, from 1.1 to 1.5 s: the locked-rotor test gives 1.2 Ω, and the tachometer is good for a tenth of the slip.
    let rows = fs::read_to_string(out.join("estimates.csv")).unwrap();
    let loaded: Vec<f64> = rows
        .lines()
        .skip(1)
        .map(|l| l.split(',').map(|x| x.parse::<f64>().unwrap()).collect::<Vec<_>>())
        .filter(|r| (1.1..1.5).contains(&r[0]))
        .map(|r| r[1])
        .collect();
    let mean = loaded.iter().sum::<f64>() / loaded.len() as f64;
    assert!((mean / 1.2 - 1.0).abs() < 0.1, "{mean}");
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn missing_files_and_missing_choices_are_named() {
    let said = im(&["identify", "--motor", &example("motor.toml"), "--online", "--data", "nowhere.csv"]);
    let text = String::from_utf8(said.stderr).unwrap();
    assert!(said.status.code() == Some(1) && text.starts_with("error: nowhere.csv"), "{text}");
    assert_eq!(im(&["identify", "--motor", &example("motor.toml")]).status.code(), Some(2), "neither map nor replay");
    assert_eq!(im(&["identify", "--motor", &example("motor.toml"), "--online"]).status.code(), Some(2), "no recording");
}
