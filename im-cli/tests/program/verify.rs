//! `im verify`: choice, resuming, shards, replay, exit status, bad input.

use std::fs;
use std::process::Output;

use crate::common::{Folder, example, im, text};

fn verify(arguments: &[&str]) -> Output {
    im(&[&["verify"], arguments].concat())
}

fn of(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", text(&output.stderr)))
}

#[test]
fn a_claim_that_fails_comes_out_as_stated_by_its_counterexample() {
    let out = Folder::new("fails");
    let run = verify(&["--claim", "3", "--cases", "10000", "--out", &out.path("")]);
    assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
    assert!(text(&run.stdout).contains("1 of 1 claims came out as docs/background/claims.md states them"));
    let cases: Vec<_> = fs::read_dir(out.path("cases")).unwrap().map(|f| f.unwrap().path().display().to_string()).collect();
    assert_eq!(cases.len(), 3);
    for case in &cases {
        let replay = verify(&["--replay", case, "--json"]);
        assert_eq!(replay.status.code(), Some(0), "the claim is stated to fail: {}", text(&replay.stderr));
        assert_eq!((of(&replay)["verdict"].as_str(), of(&replay)["found"].as_str()), (Some("violated"), Some("fails")));
        assert!(text(&verify(&["--replay", case]).stdout).contains("the counterexample is reproduced"));
    }
    // Too few cases to find one: an outcome of its own, and no failure.
    let few = verify(&["--claim", "3", "--cases", "1", "--seed", "2"]);
    assert_eq!(few.status.code(), Some(0));
    assert!(text(&few.stdout).contains("too few cases to tell") && text(&few.stdout).contains("Too few cases to tell of 1"));
}

#[test]
fn a_counterexample_on_a_motor_of_ones_own_replays_by_itself() {
    let out = Folder::new("own-motor");
    let run =
        verify(&["--claim", "26", "--cases", "5", "--keep", "1", "--motor", &example("motor.toml"), "--out", &out.path("")]);
    assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
    let case = fs::read_dir(out.path("cases")).unwrap().next().unwrap().unwrap().path().display().to_string();
    let alone = verify(&["--replay", &case, "--json"]);
    assert_eq!(of(&alone)["verdict"], "violated", "{}", text(&alone.stderr));
    assert_eq!(of(&alone), of(&verify(&["--replay", &case, "--json", "--motor", &example("motor.toml")])));
}

#[test]
fn a_claim_that_fails_elsewhere_need_not_fail_on_a_given_machine() {
    // Jadot's machine has the inertia to be slow enough: claim 48 needs accelerations of 5.8 times the rated torque.
    let run = verify(&["--claim", "48", "--machine", "jadot_table_i", "--cases", "5000", "--json"]);
    assert_eq!((run.status.code(), of(&run)["claims"][0]["outcome"].as_str()), (Some(0), Some("not on this machine")));
}

#[test]
fn an_interrupted_run_goes_on_and_shards_make_up_the_whole() {
    let [whole, parts] = ["whole", "parts"].map(Folder::new);
    let choice = ["--claim", "3", "--claim", "32", "--cases", "23456", "--json"];
    let run = |extra: &[&str]| verify(&[&choice, extra].concat());
    let at_once = run(&["--out", &whole.path("")]);
    // The same file, torn in its middle, is filled up to the same sums.
    let lines = whole.read("results.jsonl");
    whole.file("results.jsonl", &lines[..lines.len() / 2]);
    let resumed = run(&["--out", &whole.path("")]);
    assert_eq!(of(&at_once), of(&resumed));
    let sorted = |s: &str| {
        let mut l: Vec<String> = s.lines().map(str::to_owned).collect();
        l.sort();
        l
    };
    assert_eq!(sorted(&whole.read("results.jsonl")), sorted(&lines));
    // Shards into one file.
    for part in ["1/3", "2/3", "3/3"] {
        run(&["--shard", part, "--out", &parts.path("")]);
    }
    assert_eq!(sorted(&parts.read("results.jsonl")), sorted(&lines));
    assert_eq!(of(&run(&["--out", &parts.path("")])), of(&at_once));
}

/// The hidden-effect campaign keeps its trials as the claims keep their cases: nothing is done twice, shards make up the whole.
#[test]
fn the_hidden_effect_campaign_goes_on_and_is_shared_out() {
    let [parts, whole] = ["trial-parts", "trials"].map(Folder::new);
    // Two trials of the plan on one machine without hidden effects, white noise and coloured: neighbours, so that each shard has one.
    let run = |extra: &[&str]| {
        verify(
            &[&["--all", "--cases", "1", "--keep", "0", "--trials", "clean,m3", "--trials", "coloured,m3", "--json"], extra]
                .concat(),
        )
    };
    for part in ["1/2", "2/2"] {
        let shard = run(&["--shard", part, "--out", &parts.path("")]);
        // One case finds few counterexamples: too few to tell is no failure.
        assert_eq!(shard.status.code(), Some(0), "{}", text(&shard.stderr));
        assert!(!text(&shard.stderr).contains("trials were refused"));
    }
    let kept = parts.read("trials.jsonl");
    assert_eq!(kept.lines().count(), 2, "{kept}");
    // What stands in the file is not run again: a changed time comes back.
    let first: serde_json::Value = serde_json::from_str(kept.lines().next().unwrap()).unwrap();
    let marked = kept.replacen(&format!("\"took_s\":{}", first["took_s"]), "\"took_s\":12345.5", 1);
    whole.file("trials.jsonl", &marked);
    let trials = of(&run(&["--out", &whole.path("")]))["trials"].clone();
    assert_eq!(trials["number"], 2);
    assert!(trials["finished"].as_array().unwrap().iter().any(|f| f["took_s"] == 12345.5), "{trials}");
    assert_eq!(whole.read("trials.jsonl"), marked);
    let table = trials["table"].as_str().unwrap();
    assert!(table.contains("| clean | 1 | 0 |") && table.contains("| coloured | 1 | 0 |"), "{table}");
}

#[test]
fn a_motor_of_ones_own_is_tried_without_its_effects() {
    let run = verify(&["--paper", "kenne", "--cases", "20", "--motor", &example("motor.toml"), "--json"]);
    let all = of(&run);
    assert!(all["machines"].as_str().unwrap() != "random");
    let claim = |name: &str| all["claims"].as_array().unwrap().iter().find(|c| c["name"] == name).unwrap().clone();
    assert_eq!(claim("kenne_9_and_10")["violated"], 0);
    assert_eq!(claim("kenne_8_as_printed")["violated"], 20);
}

#[test]
fn claims_are_listed() {
    let list = of(&verify(&["--list", "--json"]));
    assert!(list["claims"].as_array().unwrap().len() >= 40);
    let jadot = text(&verify(&["--list", "--paper", "jadot"]).stdout);
    // What the brackets mean stands before them, and numbers ascend.
    assert!(jadot.find("[holds if]: none violates it under an assumption") < jadot.find("Jadot") && jadot.contains("Jadot"));
    let number = |l: &str| l.ends_with(']').then(|| l.split_whitespace().next()?.parse::<u32>().ok()).flatten();
    let numbers: Vec<u32> = jadot.lines().filter_map(number).collect();
    assert!(numbers.len() > 5 && numbers.is_sorted(), "{numbers:?}");
}

#[test]
fn bad_input_is_one_message_that_helps() {
    let folder = Folder::new("bad");
    let case = folder.file(
        "case.toml",
        "claim = \"kenne_9_and_10\"\nseed = 1\nindex = 2\nsubject = \"my motor\"\n[values]\nflux_share = 1.0\n",
    );
    folder.file("results.jsonl", "{\"claim\": 1}\n{}\n");
    for (arguments, says) in [
        (vec!["--claim", "999"], "im verify --list"),
        (vec!["--claim", "kubota_v_fals_for_any_error"], "Near it: kubota_v_falls_for_any_error"),
        (vec!["--claim", "collinearity"], "Near it: "),
        (vec!["--machine", "nonsense"], "expected random or one of kwon_table_iv"),
        (vec!["--motor", "/nonexistent.toml"], "/nonexistent.toml"),
        (vec!["--replay", "/nonexistent.toml"], "/nonexistent.toml: cannot read it"),
        (vec!["--replay", &case], "[values] flux_angle_rad: is missing"),
        (vec!["--all", "--trials", "strong,m99"], "--trials strong,m99: there is no such trial; expected groups (strong, "),
        (vec!["--claim", "32", "--cases", "10", "--out", &folder.path("")], "results.jsonl:1: not a result of im verify"),
    ] {
        let run = verify(&arguments);
        assert_eq!(run.status.code(), Some(1), "{arguments:?}");
        let error = text(&run.stderr);
        assert!(error.contains(says) && error.lines().count() == 1, "{error}");
        assert!(run.stdout.is_empty());
    }
    // What is in the way of an output is said before anything is tried.
    let taken = folder.file("taken", "");
    fs::create_dir_all(folder.path("full/results.jsonl")).unwrap();
    for (out, says) in [(&taken, "taken"), (&folder.path("full"), "results.jsonl: cannot write it: it is a folder")] {
        let run = verify(&["--claim", "32", "--cases", "10", "--out", out]);
        let error = text(&run.stderr);
        assert!(run.status.code() == Some(1) && error.contains(says) && run.stdout.is_empty(), "{error}");
    }
    // A number that no machine has.
    let motor = fs::read_to_string(example("motor.toml")).unwrap();
    for subnormal in ["5e-324", "1e-310", "inf", "nan"] {
        let tiny = motor.replace("magnetizing_inductance_h = 0.156", &format!("magnetizing_inductance_h = {subnormal}"));
        assert_ne!(tiny, motor);
        let run = verify(&["--claim", "1", "--cases", "10", "--motor", &folder.file("tiny.toml", &tiny)]);
        let error = text(&run.stderr);
        assert!(run.status.code() == Some(1) && error.contains("magnetizing_inductance_h"), "{error}");
    }
    for usage in [
        vec!["--shard", "5/4"],
        vec!["--cases", "0"],
        vec!["--all", "--claim", "1"],
        vec!["--trials", "clean"],
        vec!["--json", "--markdown"],
    ] {
        assert_eq!(verify(&usage).status.code(), Some(2), "{usage:?}");
    }
}
