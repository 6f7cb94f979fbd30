//! `im fleet`: one table, whoever makes it and however often it is begun.

use std::fs;

use crate::common::{Folder, demo, done, im, json, refused, text};

const TABLES: [&str; 4] = ["verdicts.csv", "parameters.csv", "fleet.json", "fleet.html"];

#[test]
fn a_bad_file_is_a_row_and_shards_make_the_same_table() {
    let f = Folder::new("fleet");
    let copied = |unit: &str| {
        fs::create_dir_all(f.path(&format!("plant/{unit}"))).unwrap();
        for (from, to) in [("motor.toml", "motor.toml"), ("train1.csv", "run.csv")] {
            fs::copy(demo(from), f.path(&format!("plant/{unit}/{to}"))).unwrap();
        }
    };
    ["a", "b", "c"].into_iter().for_each(copied);
    let torn = fs::read_to_string(demo("train1.csv")).unwrap();
    fs::write(f.path("plant/b/run.csv"), &torn[..torn.len() / 2]).unwrap();
    fs::write(f.path("plant/c/motor.toml"), "[machine]\n").unwrap();
    let plant = f.path("plant");
    let fleet = |out: &str, more: &[&str]| {
        let out = f.path(out);
        json(&[&["fleet", &plant, "--out", &out, "--no-reports", "--json"], more].concat())
    };
    let whole = fleet("whole", &[]);
    assert_eq!((&whole["rows"], &whole["diagnosed"], &whole["failed"]), (&3.into(), &1.into(), &2.into()), "{whole}");
    let table = f.read("whole/verdicts.csv");
    let rows: Vec<&str> = table.lines().collect();
    assert!(rows[1].contains(",a,") && rows[1].contains("diagnosed,missing_effects,"), "{table}");
    assert!(rows[2].contains("failed") && rows[2].contains("run.csv:"), "{table}");
    assert!(rows[3].contains("failed") && rows[3].contains("motor.toml:"), "{table}");

    let made = |report: &serde_json::Value| report["work"]["made"].as_u64().unwrap();
    let (first, second) = (fleet("shards", &["--shard", "1/2"]), fleet("shards", &["--shard", "2/2"]));
    assert_eq!((made(&first) + made(&second), &second["work"]["open"]), (3, &0.into()), "{first} {second}");
    for name in TABLES {
        // How they were made is another matter.
        let made = |folder: &str| f.read(&format!("{folder}/{name}")).split("<section id=\"run\">").next().unwrap().to_owned();
        assert!(made("shards") == made("whole"), "{name}");
    }
    // What is done is not done again; what changed is.
    assert_eq!(made(&fleet("whole", &[])), 0);
    fs::write(f.path("plant/b/run.csv"), "").unwrap();
    assert_eq!(made(&fleet("whole", &[])), 1);
    assert!(done(&["fleet", &plant, "--out", &f.path("whole"), "--no-reports"]).contains("0 rows made, 3 were there"));

    for shard in ["3/2", "half"] {
        let wrong = im(&["fleet", &plant, "--out", &f.path("x"), "--shard", shard]);
        assert!(wrong.status.code() == Some(2) && text(&wrong.stderr).contains("k from 1 to N"), "{wrong:?}");
    }
    assert!(refused(&["fleet", &f.path("whole"), "--out", &f.path("x")]).contains("no motors with recordings"));
}
