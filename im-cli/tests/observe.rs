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
