//! Makes a fleet of simulated motors, and judges what `im fleet` said of it.
//!
//! `fleet_trial make COUNT FOLDER [SEED]`, then `im fleet FOLDER --out OUT`, then `fleet_trial score FOLDER OUT`.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fs;
use std::path::Path;

use im_trials::fleet::{units, write};
use serde_json::Value;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["make", count, folder, ref seed @ ..] => {
            let seed = seed.first().map_or(Ok(1), |s| s.parse())?;
            Ok(write(Path::new(folder), &units(count.parse()?, seed))?)
        }
        ["score", folder, out] => score(Path::new(folder), Path::new(out)),
        _ => Err("usage: fleet_trial make COUNT FOLDER [SEED] | fleet_trial score FOLDER OUT".into()),
    }
}

fn table(path: &Path) -> Result<Vec<BTreeMap<String, String>>, Box<dyn Error>> {
    let text = fs::read_to_string(path)?;
    let mut lines = text.lines().map(|l| im_model::fields_of(l, b','));
    let head = lines.next().ok_or("an empty table")?;
    Ok(lines.map(|l| head.iter().cloned().zip(l).collect()).collect())
}

fn score(folder: &Path, out: &Path) -> Result<(), Box<dyn Error>> {
    let truth: BTreeMap<String, BTreeMap<String, String>> =
        table(&folder.join("truth.csv"))?.into_iter().map(|r| (r["unit"].clone(), r)).collect();
    let rows = table(&out.join("verdicts.csv"))?;
    let summary: Value = serde_json::from_str(&fs::read_to_string(out.join("fleet.json"))?)?;
    let odd: BTreeSet<&str> = summary["odd"].as_array().into_iter().flatten().filter_map(|o| o["of"]["unit"].as_str()).collect();
    let (mut defects, mut seen, mut named, mut healthy, mut alarms, mut broken, mut failed) = (0, 0, 0, 0, 0, 0, 0);
    let mut diagnosed = 0;
    for row in &rows {
        let of = |key: &str| row[key].as_str();
        let true_ = &truth[of("unit")];
        let flagged = ["missing_effects", "confounded", "unexplained"].contains(&of("verdict")) || odd.contains(of("unit"));
        diagnosed += usize::from(of("status") == "diagnosed");
        let defect = true_["defect"].as_str();
        if !true_["broken"].is_empty() {
            broken += 1;
            failed += usize::from(of("status") == "failed" && !of("error").is_empty());
        } else if defect.is_empty() {
            healthy += 1;
            alarms += usize::from(flagged);
            if flagged {
                println!("false alarm: {} {} {} {}", of("unit"), of("verdict"), of("effects"), of("suspicion"));
            }
        } else {
            defects += 1;
            seen += usize::from(flagged);
            let right = of("effects").split(';').chain(of("rivals").split([';', '|'])).any(|e| e == defect);
            named += usize::from(right);
            if !right {
                println!("{defect}: {} {} {} {}", of("unit"), of("verdict"), of("effects"), of("suspicion"));
            }
        }
    }
    let share = |a: usize, b: usize| format!("{a} of {b} ({:.1} %)", 100.0 * a as f64 / b.max(1) as f64);
    println!("rows                     {} of {} motors, {diagnosed} diagnosed", rows.len(), truth.len());
    println!("defects found            {}", share(seen, defects));
    println!("defects named            {}", share(named, defects));
    println!("false alarms             {}", share(alarms, healthy));
    println!("broken files with a row  {}", share(failed, broken));
    Ok(())
}
