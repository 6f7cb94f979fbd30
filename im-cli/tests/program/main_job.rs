//! The main job: compare, fit, diagnose, add, validate, next test, on the data of the demo.

use std::fs;

use crate::common::{Folder, demo, done, im, json, refused, text};

/// The fields of every row from 1 on, changed.
fn changed(csv: &str, change: impl Fn(usize, &mut Vec<String>)) -> String {
    let row = |(k, line): (usize, &str)| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if k > 0 {
            change(k, &mut fields);
        }
        fields.join(",") + "\n"
    };
    csv.lines().enumerate().map(row).collect()
}

#[test]
fn the_whole_loop_runs_on_files() {
    let f = Folder::new("loop");
    let story = done(&["demo", "--out", &f.path("out"), "--save-data", &f.path("data")]);
    assert!(story.contains("Main-flux saturation") || story.contains("main-flux saturation"), "{story}");
    let found: serde_json::Value = serde_json::from_str(&f.read("out/diagnosis.json")).unwrap();
    assert_eq!(found["verdict"], "missing_effects");
    let effect = found["effects"][0].as_str().unwrap().to_owned();

    // By hand: add the effect to the motor as it was, fit, and see on the held-out recording that the error has fallen.
    let motor = f.path("data/motor.toml");
    let added = json(&["add", "--motor", &motor, "--effect", &effect, "-o", &f.path("added.toml"), "--json"]);
    assert!(f.read("added.toml").contains(&effect) && added["train_chi2_per_sample"].is_null(), "{added}");
    let refined = f.path("out/motor.refined.toml");
    let holdout = f.path("data/holdout.csv");
    let judged = json(&["validate", "--before", &motor, "--after", &refined, "--data", &holdout, "--json"]);
    let of = |which: &str| judged["not_nudged"][which]["chi2_per_sample"].as_f64().unwrap();
    assert!(of("after") < 1.2 && of("before") > 10.0 * of("after"), "{judged}");

    assert!(f.read("out/motor.refined.toml").contains("\n[prediction]\ncurrent_a = "));

    let found = f.path("out/diagnosis.json");
    let none = json(&["next-test", "--motor", &refined, "--diagnosis", &found, "--json"]);
    assert_eq!(none["test"], serde_json::Value::Null, "a clear answer leaves nothing open");
    let next = json(&["next-test", "--motor", &refined, "--effect", "iron_loss", "-o", &f.path("next.toml"), "--json"]);
    assert_eq!(next["test"]["scenario_toml"].as_str().unwrap(), f.read("next.toml"));
    assert!(next["test"]["detectable_over_usual"]["iron_loss"].as_f64().unwrap() > 0.0, "{next}");

    done(&["report", &f.path("out"), &f.path("out/diagnosis.json"), "-o", &f.path("both.html")]);
    assert!(f.read("both.html").contains("</html>"));
}

#[test]
fn bad_recordings_are_refused_with_their_place_and_nothing_is_written() {
    let f = Folder::new("bad");
    let (motor, good) = (demo("motor.toml"), fs::read_to_string(demo("train1.csv")).unwrap());
    let at = |row: usize, column: usize, value: &'static str| {
        changed(&good, move |k, fields| {
            if k == row {
                fields[column] = value.to_owned();
            }
        })
    };
    let torn: String = good[..good.len() / 2].to_owned();
    let torn = torn.rsplit_once(',').unwrap().0.to_owned();
    let cases = [
        ("text", at(99, 3, "overload"), vec!["text.csv:100", "i_alpha_A", "overload"]),
        ("nan", at(99, 5, "NaN"), vec!["nan.csv:100", "omega_m_rad_s"]),
        ("empty", String::new(), vec!["empty.csv", "empty"]),
        ("header", good.lines().next().unwrap().to_owned(), vec!["header.csv", "row"]),
        ("torn", torn, vec!["torn.csv:"]),
        ("back", at(500, 0, "0.001"), vec!["back.csv:501", "t_s"]),
        ("short", good.lines().take(60).map(|l| format!("{l}\n")).collect(), vec!["short.csv", "200"]),
    ];
    for (name, content, expected) in cases {
        let data = f.file(&format!("{name}.csv"), &content);
        for message in [
            refused(&["diagnose", "--motor", &motor, "--train", &data]),
            refused(&["fit", "--motor", &motor, "--train", &data, "-o", &f.path("fitted.toml")]),
            refused(&["compare", "--motor", &motor, "--data", &data]),
        ] {
            assert!(expected.iter().all(|e| message.contains(e)), "{name}: {message}");
        }
    }
    assert!(!f.has("fitted.toml"));
}

#[test]
fn an_output_that_cannot_be_made_is_refused_before_the_work() {
    let f = Folder::new("out");
    let (motor, train) = (demo("motor.toml"), demo("train1.csv"));
    let in_the_way = f.file("file", "");
    let inside = format!("{in_the_way}/out");
    for message in [
        refused(&["diagnose", "--motor", &motor, "--train", &train, "--out", &inside]),
        refused(&["compare", "--motor", &motor, "--data", &train, "--out", &inside]),
        refused(&["demo", "--out", &inside]),
        refused(&["fit", "--motor", &motor, "--train", &train, "-o", &f.path("no/folder/m.toml")]),
    ] {
        assert!(message.contains(&inside) || message.contains("m.toml"), "{message}");
    }
}

/// Twice the current at the same voltage and speed, against more than twice the load: a machine of more than twice the size.
#[test]
fn recordings_of_two_machines_are_distinguished() {
    let f = Folder::new("two");
    let train = fs::read_to_string(demo("train2.csv")).unwrap();
    let names: Vec<&str> = train.lines().next().unwrap().split(',').collect();
    let scaled: Vec<usize> = (0..names.len()).filter(|&k| names[k].starts_with("i_") || names[k] == "tau_load_Nm").collect();
    let larger = changed(&train, |_, fields| {
        for &k in &scaled {
            fields[k] = format!("{:?}", 2.3 * fields[k].parse::<f64>().unwrap());
        }
    });
    let other = f.file("other.csv", &larger);
    let differ = |second: &str| {
        let o = im(&["compare", "--motor", &demo("motor.toml"), "--data", &demo("train1.csv"), "--data", second]);
        assert!(o.status.success(), "{}", text(&o.stderr));
        text(&o.stdout).contains("different machines")
    };
    assert!(differ(&other));
    assert!(!differ(&demo("train2.csv")));
}
