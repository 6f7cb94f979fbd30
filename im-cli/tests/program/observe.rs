//! `im observe`: replay of recordings.

use std::fs;

use crate::common::{Folder, demo, done, im, json, refused, text};

#[test]
fn every_observer_follows_the_recording_and_writes_what_it_saw() {
    let rows = fs::read_to_string(demo("train1.csv")).unwrap().lines().filter(|l| !l.starts_with('#')).count();
    for observer in ["full-order", "kubota", "derdiyok", "utkin", "thau", "current-model"] {
        let dir = Folder::new(observer);
        let summary = summary(observer, &demo("train1.csv"), &["--out", &dir.path("")]);
        assert!(summary["valid_share"].as_f64().unwrap() > 0.2, "{observer}: {summary}");
        // The demo's motor.toml is wrong by design, and misses an effect: the speed, up to 130 rad/s, is found within 15 %.
        let rms = summary["speed_error_valid_rad_s"]["rms"].as_f64().unwrap();
        assert!(rms < 20.0, "{observer}: {summary}");
        let csv = dir.read("estimate.csv");
        assert_eq!(csv.lines().count(), rows, "{observer}");
        assert!(csv.lines().all(|l| l.split(',').count() == 9) && !csv.contains("NaN") && !csv.contains("inf"));
        let svg = dir.read("speed.svg");
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.len() < 60_000 && !svg.contains("NaN"));
    }
}

/// The demo's recording as another laboratory would write it: other names, mA, rpm, semicolons; `keep` says which rows are there.
fn foreign(dir: &Folder, columns: usize, keep: impl Fn(usize) -> bool) -> String {
    let text = fs::read_to_string(demo("train1.csv")).unwrap();
    let mut out =
        String::from("time;ua;ub;ia (mA);ib (mA);n (rpm)").split(';').take(columns).collect::<Vec<_>>().join(";") + "\n";
    for (_, line) in text.lines().filter(|l| !l.starts_with('#')).skip(1).enumerate().filter(|(k, _)| keep(*k)) {
        let x: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        let row = [x[0], x[1], x[2], 1e3 * x[3], 1e3 * x[4], x[5] * 30.0 / std::f64::consts::PI];
        out += &(row[..columns].iter().map(f64::to_string).collect::<Vec<_>>().join(";") + "\n");
    }
    dir.file("run.csv", &out)
}

const MAPPING: &str = "[text]\nseparator = \";\"\n[time]\ncolumn = \"time\"\ngaps = \"leave_out\"\n[voltage]\nalpha = \"ua\"\nbeta = \"ub\"\n\
                       [current]\nalpha = \"ia (mA)\"\nbeta = \"ib (mA)\"\n";
const SPEED: &str = "[speed]\ncolumn = \"n (rpm)\"\n";

fn summary(observer: &str, data: &str, rest: &[&str]) -> serde_json::Value {
    let motor = demo("motor.toml");
    let args = [&["observe", "--observer", observer, "--motor", &motor, "--data", data, "--json"], rest].concat();
    json(&args)
}

#[test]
fn a_file_in_foreign_columns_gives_what_the_canonical_one_gives() {
    let dir = Folder::new("foreign");
    let data = foreign(&dir, 6, |_| true);
    dir.file("run.recording.toml", &format!("{MAPPING}{SPEED}"));
    let [a, b] = [summary("kubota", &data, &[]), summary("kubota", &demo("train1.csv"), &[])];
    for key in ["valid_share", "first_valid_s"] {
        assert_eq!(a[key], b[key], "{key}");
    }
    let rms = |s: &serde_json::Value| s["speed_error_valid_rad_s"]["rms"].as_f64().unwrap();
    // Units were turned there and back.
    assert!((rms(&a) - rms(&b)).abs() < 1e-6 * rms(&b), "{a} {b}");
}

#[test]
fn rows_that_are_missing_are_lost_samples_and_reported() {
    let dir = Folder::new("gaps");
    let data = foreign(&dir, 6, |k| !(3000..3005).contains(&k) && !(6000..6003).contains(&k));
    dir.file("run.recording.toml", &format!("{MAPPING}{SPEED}"));
    let out = dir.path("");
    let s = summary("kubota", &data, &["--out", &out]);
    assert_eq!(s["lost_rows"], 8);
    assert!(s["data_quality"].as_array().unwrap().iter().any(|f| f["kind"] == "gap"), "{s}");
    let csv = dir.read("estimate.csv");
    assert!(csv.contains("current lost") && !csv.contains("NaN"));
}

#[test]
fn without_a_speed_the_observers_run_and_the_current_model_says_what_it_needs() {
    let dir = Folder::new("speedless");
    let data = foreign(&dir, 5, |_| true);
    dir.file("run.recording.toml", MAPPING);
    let s = summary("utkin", &data, &["--out", &dir.path("")]);
    assert!(s["speed_error_valid_rad_s"].is_null() && s["final_speed_rad_s"]["recorded"].is_null(), "{s}");
    assert!(s["valid_share"].as_f64().unwrap() > 0.2);
    let csv = dir.read("estimate.csv");
    assert!(csv.lines().nth(1).unwrap().split(',').nth(2) == Some("") && !csv.contains("NaN"));
    let message = refused(&["observe", "--observer", "current-model", "--motor", &demo("motor.toml"), "--data", &data]);
    assert!(message.contains("needs a measured speed"), "{message}");
}

#[test]
fn a_file_that_nobody_has_described_gets_a_draft() {
    let dir = Folder::new("draft");
    let data = foreign(&dir, 6, |_| true);
    let o = im(&["observe", "--observer", "kubota", "--motor", &demo("motor.toml"), "--data", &data]);
    assert!(dir.has("run.recording.toml"), "{}{}", text(&o.stdout), text(&o.stderr));
    let said = text(if o.status.success() { &o.stdout } else { &o.stderr });
    assert!(said.contains("run.recording.toml"), "{said}");
}

/// The file with its proof goes from one command into the other; altered, or proven for another period, it does not.
#[test]
fn what_im_design_writes_is_observed_with() {
    let dir = Folder::new("designed");
    let (motor, data, region, gains) = (demo("motor.toml"), demo("train1.csv"), dir.path("region.toml"), dir.path("gains.toml"));
    let made = |kind: &str, more: &[&str]| {
        fs::write(&region, done(&["design", "example-region", kind]).replace("# rate_per_s", "rate_per_s")).unwrap();
        done(&[&["design", kind, "--motor", &motor, "--region", &region, "-o", &gains], more].concat());
    };
    let observe =
        |observer: &'static str| ["observe", "--observer", observer, "--motor", &motor, "--data", &data, "--gains", &gains];
    for (kind, observer) in [("kubota", "kubota"), ("thau-box", "thau"), ("derdiyok", "derdiyok"), ("utkin", "utkin")] {
        made(kind, &[]);
        assert!(done(&observe(observer)).contains("valid"), "{kind}");
    }
    // The Rust source and the program make the same of what a certificate leaves open, and both say what it is.
    let rust = dir.path("gains.rs");
    made("derdiyok", &["--rust", &rust]);
    let said = done(&observe("derdiyok")).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains("taken as the usual ones: filter_rad_s = 200, anchor_per_s = 10; the proof"), "{said}");
    assert_eq!(json(&[&observe("derdiyok")[..], &["--json"]].concat())["gains_not_in_file"]["anchor_per_s"], 10.0);
    let source = dir.read("gains.rs");
    assert!(source.contains("gains(im_observers::DerdiyokGains::USUAL_FILTER_RAD_S, im_observers::DerdiyokGains::USUAL_ANCHOR"));
    made("utkin", &["--rust", &rust]);
    assert!(done(&observe("utkin")).contains("filter_rad_s = 100; the proof"));
    assert!(dir.read("gains.rs").contains("gains(im_observers::UtkinGains::USUAL_FILTER_RAD_S)"));
    made("kubota", &[]);
    let said = done(&observe("kubota"));
    assert!(said.contains("proportional = ") && said.contains("is without the speed law") && !said.contains("fade_a"), "{said}");
    made("thau-box", &["--period", "2e-4"]);
    assert!(done(&observe("thau")).contains("valid"));
    fs::write(&gains, dir.read("gains.toml").replacen("period_s = 0.0002", "period_s = 0.0003", 1)).unwrap();
    assert!(refused(&observe("thau")).contains("refused: altered"));
    made("thau-box", &["--period", "2e-5"]);
    assert!(refused(&observe("thau")).contains("--period 0.0002"));
}

/// Gains that are proven for another machine run, and that is said: on stderr, and in the JSON.
#[cfg(feature = "design")]
#[test]
fn gains_of_another_machine_are_said_to_be() {
    let dir = Folder::new("other-machine");
    let (motor, data, region, gains) = (demo("motor.toml"), demo("train1.csv"), dir.path("region.toml"), dir.path("gains.toml"));
    fs::write(&region, done(&["design", "example-region", "derdiyok"])).unwrap();
    done(&["design", "derdiyok", "--motor", &motor, "--region", &region, "-o", &gains]);
    let observe =
        |motor: &str| im(&["observe", "--observer", "derdiyok", "--motor", motor, "--data", &data, "--gains", &gains, "--json"]);
    let own = observe(&motor);
    assert!(own.status.success() && own.stderr.is_empty(), "{}", text(&own.stderr));
    let known = fs::read_to_string(&motor).unwrap();
    let line = known.lines().find(|l| l.starts_with("rotor_resistance_ohm")).unwrap();
    let warm = dir.file("warm.toml", &known.replace(line, "rotor_resistance_ohm = 1.23"));
    let other = observe(&warm);
    let (said, report) = (text(&other.stderr), serde_json::from_slice::<serde_json::Value>(&other.stdout).unwrap());
    let words = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        other.status.success() && words.contains("about another machine than") && words.contains("rotor_resistance_ohm"),
        "{said}"
    );
    assert!(report["gains_of_another_machine"].as_str().is_some_and(|s| s.contains("1.23 here")), "{report}");
    let message = refused(&["design", "check", &gains, "--motor", &warm]);
    assert!(message.contains("true and unaltered, but about another machine"), "{message}");
}

#[test]
fn bad_gains_are_refused_with_one_message() {
    let dir = Folder::new("gains");
    let refused = |observer: &str, gains: &str| {
        refused(&[
            "observe",
            "--observer",
            observer,
            "--motor",
            &demo("motor.toml"),
            "--data",
            &demo("train1.csv"),
            "--gains",
            gains,
        ])
    };
    let matrix = "[[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]";
    let fast = format!("[kubota_loop]\ngain = {matrix}\ngain_per_speed = {matrix}\nproportional = 1e6\nintegral = 1.0\n");
    let other = format!("[kubota_loop]\ngain = {matrix}\ngain_per_speed = {matrix}\nproportional = \"much\"\nintegral = 1.0\n");
    let skewed = fast.replace("gain = [[0.0, 0.0]", "gain = [[5.0, 0.0]").replace("1e6", "0.01");
    for (observer, content, expected) in [
        ("kubota", fast.as_str(), "gains.toml:1: the proportional path of the speed law"),
        ("kubota", other.as_str(), "proportional is \"much\", expected a finite number"),
        ("kubota", skewed.as_str(), "gains.toml:2: gain: rows"),
        ("kubota", "[utkin]\nomega0_rad_s = 300.0\n", "is missing; the file has utkin"),
        ("utkin", "[utkin]\n", "gains.toml:1: omega0_rad_s is missing in [utkin]"),
        ("utkin", "[utkin]\n\nomega0_rad_s = -3.0\n", "gains.toml:3: omega0_rad_s = -3 must be "),
        ("utkin", "omega0", ""),
        ("current-model", "[utkin]\n", "has no gains"),
    ] {
        let message = refused(observer, &dir.file("gains.toml", content));
        assert!(message.contains("gains.toml") && message.contains(expected), "{message}");
    }
    assert!(refused("kubota", &dir.path("absent.toml")).contains("absent.toml"));
}
