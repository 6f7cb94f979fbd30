//! `im observe` from outside.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn demo(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/demo").join(name).display().to_string()
}

fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("im-observe-{name}-{}", std::process::id()));
    fs::create_dir_all(&path).unwrap();
    path
}

fn observe(observer: &str, rest: &[&str]) -> Output {
    let (motor, data) = (demo("motor.toml"), demo("train1.csv"));
    let args = [&["observe", "--observer", observer, "--motor", &motor, "--data", &data], rest].concat();
    Command::new(env!("CARGO_BIN_EXE_im")).args(args).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn every_observer_follows_the_recording_and_writes_what_it_saw() {
    let rows = fs::read_to_string(demo("train1.csv")).unwrap().lines().filter(|l| !l.starts_with('#')).count();
    for observer in ["kubota", "derdiyok", "utkin", "thau", "current-model"] {
        let dir = folder(observer);
        let o = observe(observer, &["--out", &dir.display().to_string(), "--json"]);
        assert_eq!(o.status.code(), Some(0), "{observer}: {}", text(&o.stderr));
        let summary: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
        assert!(summary["valid_share"].as_f64().unwrap() > 0.2, "{observer}: {summary}");
        // The demo's motor.toml is wrong by design, and misses an effect: the speed, up to 130 rad/s, is found within 15 %.
        let rms = summary["speed_error_valid_rad_s"]["rms"].as_f64().unwrap();
        assert!(rms < 20.0, "{observer}: {summary}");
        let csv = fs::read_to_string(dir.join("estimate.csv")).unwrap();
        assert_eq!(csv.lines().count(), rows, "{observer}");
        assert!(csv.lines().all(|l| l.split(',').count() == 9) && !csv.contains("NaN") && !csv.contains("inf"));
        let svg = fs::read_to_string(dir.join("speed.svg")).unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.len() < 60_000 && !svg.contains("NaN"));
        fs::remove_dir_all(dir).unwrap();
    }
}

/// The demo's recording as another laboratory would write it: other names, mA, rpm, semicolons; `keep` says which rows are there.
fn foreign(dir: &Path, columns: usize, keep: impl Fn(usize) -> bool) -> String {
    let text = fs::read_to_string(demo("train1.csv")).unwrap();
    let mut out =
        String::from("time;ua;ub;ia (mA);ib (mA);n (rpm)").split(';').take(columns).collect::<Vec<_>>().join(";") + "\n";
    for (_, line) in text.lines().filter(|l| !l.starts_with('#')).skip(1).enumerate().filter(|(k, _)| keep(*k)) {
        let x: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        let row = [x[0], x[1], x[2], 1e3 * x[3], 1e3 * x[4], x[5] * 30.0 / std::f64::consts::PI];
        out += &(row[..columns].iter().map(f64::to_string).collect::<Vec<_>>().join(";") + "\n");
    }
    let path = dir.join("run.csv");
    fs::write(&path, out).unwrap();
    path.display().to_string()
}

const MAPPING: &str = "[text]\nseparator = \";\"\n[time]\ncolumn = \"time\"\ngaps = \"leave_out\"\n[voltage]\nalpha = \"ua\"\nbeta = \"ub\"\n\
                       [current]\nalpha = \"ia (mA)\"\nbeta = \"ib (mA)\"\n";
const SPEED: &str = "[speed]\ncolumn = \"n (rpm)\"\n";

fn summary(observer: &str, data: &str, rest: &[&str]) -> serde_json::Value {
    let motor = demo("motor.toml");
    let args = [&["observe", "--observer", observer, "--motor", &motor, "--data", data, "--json"], rest].concat();
    let o = Command::new(env!("CARGO_BIN_EXE_im")).args(args).output().unwrap();
    assert_eq!(o.status.code(), Some(0), "{}", text(&o.stderr));
    serde_json::from_slice(&o.stdout).unwrap()
}

#[test]
fn a_file_in_foreign_columns_gives_what_the_canonical_one_gives() {
    let dir = folder("foreign");
    let data = foreign(&dir, 6, |_| true);
    fs::write(dir.join("run.recording.toml"), format!("{MAPPING}{SPEED}")).unwrap();
    let [a, b] = [summary("kubota", &data, &[]), summary("kubota", &demo("train1.csv"), &[])];
    for key in ["valid_share", "first_valid_s"] {
        assert_eq!(a[key], b[key], "{key}");
    }
    let rms = |s: &serde_json::Value| s["speed_error_valid_rad_s"]["rms"].as_f64().unwrap();
    // Units were turned there and back.
    assert!((rms(&a) - rms(&b)).abs() < 1e-6 * rms(&b), "{a} {b}");
    fs::remove_dir_all(dir).unwrap();
}

#[test]
fn rows_that_are_missing_are_lost_samples_and_told() {
    let dir = folder("gaps");
    let data = foreign(&dir, 6, |k| !(3000..3005).contains(&k) && !(6000..6003).contains(&k));
    fs::write(dir.join("run.recording.toml"), format!("{MAPPING}{SPEED}")).unwrap();
    let out = dir.display().to_string();
    let s = summary("kubota", &data, &["--out", &out]);
    assert_eq!(s["lost_rows"], 8);
    assert!(s["data_quality"].as_array().unwrap().iter().any(|f| f["kind"] == "gap"), "{s}");
    let csv = fs::read_to_string(dir.join("estimate.csv")).unwrap();
    assert!(csv.contains("current lost") && !csv.contains("NaN"));
    fs::remove_dir_all(dir).unwrap();
}

#[test]
fn without_a_speed_the_observers_run_and_the_current_model_says_what_it_needs() {
    let dir = folder("speedless");
    let data = foreign(&dir, 5, |_| true);
    fs::write(dir.join("run.recording.toml"), MAPPING).unwrap();
    let s = summary("utkin", &data, &["--out", &dir.display().to_string()]);
    assert!(s["speed_error_valid_rad_s"].is_null() && s["final_speed_rad_s"]["recorded"].is_null(), "{s}");
    assert!(s["valid_share"].as_f64().unwrap() > 0.2);
    let csv = fs::read_to_string(dir.join("estimate.csv")).unwrap();
    assert!(csv.lines().nth(1).unwrap().split(',').nth(2) == Some("") && !csv.contains("NaN"));
    let o = Command::new(env!("CARGO_BIN_EXE_im"))
        .args(["observe", "--observer", "current-model", "--motor", &demo("motor.toml"), "--data", &data])
        .output()
        .unwrap();
    assert!(o.status.code() == Some(1) && text(&o.stderr).contains("needs a measured speed"), "{}", text(&o.stderr));
    fs::remove_dir_all(dir).unwrap();
}

#[test]
fn a_file_that_nobody_has_described_gets_a_draft() {
    let dir = folder("draft");
    let data = foreign(&dir, 6, |_| true);
    let o = Command::new(env!("CARGO_BIN_EXE_im"))
        .args(["observe", "--observer", "kubota", "--motor", &demo("motor.toml"), "--data", &data])
        .output()
        .unwrap();
    assert!(dir.join("run.recording.toml").is_file(), "{}{}", text(&o.stdout), text(&o.stderr));
    let said = text(if o.status.success() { &o.stdout } else { &o.stderr });
    assert!(said.contains("run.recording.toml"), "{said}");
    fs::remove_dir_all(dir).unwrap();
}

#[test]
fn bad_gains_are_refused_with_one_message() {
    let dir = folder("gains");
    let file = |name: &str, content: &str| {
        let path = dir.join(name);
        fs::write(&path, content).unwrap();
        path.display().to_string()
    };
    let matrix = "[[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]";
    let fast = format!("[kubota_loop]\ngain = {matrix}\ngain_per_speed = {matrix}\nproportional = 1e6\nintegral = 1.0\n");
    let other = format!("[kubota_loop]\ngain = {matrix}\ngain_per_speed = {matrix}\nproportional = \"much\"\nintegral = 1.0\n");
    let skewed = fast.replace("gain = [[0.0, 0.0]", "gain = [[5.0, 0.0]").replace("1e6", "0.01");
    for (observer, content, told) in [
        ("kubota", fast.as_str(), "may be at most"),
        ("kubota", other.as_str(), "proportional of [kubota_loop] must be a number"),
        ("kubota", skewed.as_str(), "form [x, -y; y, x]"),
        ("kubota", "[utkin]\nomega0_rad_per_s = 300.0\n", "is missing; the file has utkin"),
        ("utkin", "[utkin]\n", "must be given"),
        ("utkin", "[utkin]\nomega0_rad_per_s = -3.0\n", "omega0_rad_per_s = -3 must be positive"),
        ("utkin", "omega0", ""),
        ("current-model", "[utkin]\n", "has no gains"),
    ] {
        let o = observe(observer, &["--gains", &file("gains.toml", content)]);
        let message = text(&o.stderr);
        assert_eq!(o.status.code(), Some(1), "{message}");
        assert!(message.starts_with("error: ") && message.contains("gains.toml") && message.contains(told), "{message}");
        assert_eq!(text(&o.stdout), "");
    }
    let o = observe("kubota", &["--gains", &dir.join("absent.toml").display().to_string()]);
    assert!(o.status.code() == Some(1) && text(&o.stderr).contains("absent.toml"), "{}", text(&o.stderr));
    fs::remove_dir_all(dir).unwrap();
}
