//! Ctrl-C and a request to end: over at once, with whole files or none.

use std::fs;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::common::{Folder, demo, example, text};

fn begun(args: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_im"));
    command.args(args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Sends a signal; the status and what was printed on stdout and stderr. A second is asked for; ten leave room on a busy machine.
fn interrupted(child: Child, signal: &str) -> (ExitStatus, String, String) {
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    let asked = Instant::now();
    let o = child.wait_with_output().unwrap();
    assert!(asked.elapsed() < Duration::from_secs(10));
    (o.status, text(&o.stdout), text(&o.stderr))
}

fn files(dir: &str) -> Vec<String> {
    let Ok(all) = fs::read_dir(dir) else { return Vec::new() };
    all.flatten().map(|f| f.file_name().into_string().unwrap()).collect()
}

/// In the middle of a fit: nothing of the answer is there, not even a temporary file.
#[test]
fn an_interrupted_diagnosis_leaves_nothing() {
    for signal in ["-INT", "-TERM"] {
        let dir = Folder::new(&format!("interrupted{signal}"));
        let out = dir.path("out");
        let mut child = begun(&["diagnose", "--motor", &demo("motor.toml"), "--train", &demo("train1.csv"), "--out", &out]);
        sleep(Duration::from_millis(300));
        assert!(child.try_wait().unwrap().is_none(), "the diagnosis is still at work");
        let (status, stdout, stderr) = interrupted(child, signal);
        assert_eq!((status.code(), stdout.as_str(), stderr.trim()), (Some(130), "", "interrupted"));
        assert_eq!(files(&out), [""; 0]);
    }
}

/// While a file is written: the old one is as it was, and what was half written is gone.
#[test]
fn an_interrupted_write_leaves_the_old_file() {
    let dir = Folder::new("interrupted-write");
    let (motor, run) = (example("motor.toml"), dir.file("run.csv", "old"));
    let scenario = fs::read_to_string(example("scenario_dol.toml")).unwrap();
    let long: String = scenario
        .lines()
        .map(|l| if l.starts_with("duration_s") { "duration_s = 40.0\n".into() } else { l.to_owned() + "\n" })
        .collect();
    let scenario = dir.file("long.toml", &long);
    let mut child = begun(&["simulate", "--motor", &motor, "--scenario", &scenario, "-o", &run]);
    // The check before the work leaves an empty file for a moment; one with rows in it is the output.
    let half_written = || {
        let rows =
            |f: &fs::DirEntry| f.metadata().is_ok_and(|m| m.len() > 1000) && f.file_name().to_string_lossy().ends_with(".tmp");
        fs::read_dir(dir.path("")).unwrap().flatten().any(|f| rows(&f))
    };
    while !half_written() {
        assert!(child.try_wait().unwrap().is_none(), "the simulation ended first");
        sleep(Duration::from_millis(1));
    }
    let (status, ..) = interrupted(child, "-INT");
    let mut left = files(&dir.path(""));
    left.sort();
    assert_eq!(left, ["long.toml", "run.csv"]);
    let whole = fs::read_to_string(&run).unwrap();
    // The last row may have been written in the moment between; then the file is the new one, whole.
    match status.code() {
        Some(130) => assert!(whole == "old" || whole.ends_with('\n'), "{} bytes", whole.len()),
        code => assert!(code == Some(0) && whole.ends_with('\n'), "{status}"),
    }
}

/// A campaign of claims goes on where it was interrupted, to the same result.
#[cfg(feature = "verify")]
#[test]
fn an_interrupted_campaign_goes_on() {
    let dir = Folder::new("interrupted-campaign");
    let out = dir.path("out");
    let args = ["verify", "--claim", "1", "--cases", "200000", "--out", &out];
    let mut child = begun(&args);
    while fs::metadata(dir.path("out/results.jsonl")).map_or(0, |m| m.len()) == 0 {
        assert!(child.try_wait().unwrap().is_none(), "the campaign ended first");
        sleep(Duration::from_millis(1));
    }
    let (status, ..) = interrupted(child, "-INT");
    assert!(matches!(status.code(), Some(130 | 0)), "{status}");
    let before = fs::read_to_string(dir.path("out/results.jsonl")).unwrap();
    let o = begun(&args).wait_with_output().unwrap();
    assert_eq!(o.status.code(), Some(0), "{}", text(&o.stderr));
    let after = fs::read_to_string(dir.path("out/results.jsonl")).unwrap();
    let whole = &before[..before.rfind('\n').map_or(0, |end| end + 1)];
    assert!(after.starts_with(whole) && after.lines().all(|l| l.starts_with('{') && l.ends_with('}')));
}
