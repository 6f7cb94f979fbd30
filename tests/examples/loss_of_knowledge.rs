//! What it costs not to have measured something: trials diagnosed with everything known, without the load torque, the speed, or both.
//!
//! `loss_of_knowledge [SEEDS] [EFFECT…] [known=WORDS]` prints a line per trial, and the table of docs/background/diagnosis.md.
//! SEEDS is a number of them from 0, or `FIRST..END`. Hidden are single effects of medium
//! strength that act on the electrical side, in a sensor or in the inverter, and nothing at all. `WHY=1` prints the course of each loop.

use im_model::EffectId;
use im_model::effects::Place;
use im_tests::campaign::{Knowledge, Outcome, run_knowing, seeds};
use im_tests::hidden::{CatalogueMachine, EffectKind, Strength, TrialCase};
use rayon::prelude::*;

const KNOWN: [(Knowledge, &str); 4] = [
    (Knowledge::Whole, "everything known"),
    (Knowledge::WithoutLoad, "without the load torque"),
    (Knowledge::WithoutSpeed, "without the speed"),
    (Knowledge::WithoutSpeedAndLoad, "without speed and load torque"),
];

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let chosen = args.iter().find_map(|a| seeds(a)).unwrap_or(0..1);
    let wanted: Vec<&String> = args.iter().filter(|a| seeds(a).is_none()).collect();
    let mechanical = |k: &EffectKind| EffectId::from_name(k.name()).is_some_and(|e| e.about().place == Place::Mechanics);
    let electrical = EffectKind::ALL.iter().filter(|k| k.in_library() && !mechanical(k));
    let (known, wanted): (Vec<&String>, Vec<&String>) = wanted.into_iter().partition(|w| w.starts_with("known="));
    let taken = |words: &str| known.is_empty() || known.iter().any(|k| k["known=".len()..] == *words);
    let named = |name: &str| wanted.is_empty() || wanted.iter().any(|w| *w == name);
    let mut cases = Vec::new();
    for seed in chosen {
        for (k, kind) in electrical.clone().enumerate().filter(|(_, kind)| named(kind.name())) {
            let machine = (5 * k + 3 * seed as usize) % CatalogueMachine::COUNT;
            cases.push(TrialCase::new(machine, &[(*kind, Strength::Medium)], 2000 + seed));
        }
        for machine in (0..CatalogueMachine::COUNT).filter(|_| named("nothing")) {
            cases.push(TrialCase::new(machine, &[], 2100 + seed));
        }
    }
    println!(
        "| | trials | refused | exact | named among others | nothing named | false effect | clean | clean with a false effect |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (knowledge, words) in KNOWN.into_iter().filter(|(_, words)| taken(words)) {
        let all: Vec<(bool, Result<Outcome, String>)> = cases
            .par_iter()
            .with_max_len(1)
            .map(|case| {
                let found = run_knowing(case, knowledge);
                line(words, case, &found.as_ref().map(|f| &f.0));
                if let (Ok((_, d)), true) = (&found, std::env::var("WHY").is_ok()) {
                    im_tests::course::why(d);
                }
                (case.effects.is_empty(), found.map(|f| f.0))
            })
            .collect();
        let of = |clean: bool| all.iter().filter(move |(c, _)| *c == clean).map(|(_, o)| o);
        let count = |clean: bool, f: &dyn Fn(&Outcome) -> bool| of(clean).filter(|o| o.as_ref().is_ok_and(f)).count();
        println!(
            "| {words} | {} | {} | {} | {} | {} | {} | {} | {} |",
            of(false).count(),
            all.iter().filter(|(_, o)| o.is_err()).count(),
            count(false, &Outcome::exact),
            count(false, &|o| !o.exact() && o.first_right()),
            count(false, &|o| o.named.is_empty()),
            count(false, &|o| o.false_additions() > 0),
            of(true).count(),
            count(true, &|o| o.false_additions() > 0),
        );
    }
}

fn line(words: &str, case: &TrialCase, found: &Result<&Outcome, &String>) {
    let hidden: Vec<&str> = case.effects.iter().map(|(k, _)| k.name()).collect();
    match found {
        Err(e) => eprintln!("ERR {words}, {hidden:?}: {e}"),
        Ok(o) => eprintln!(
            "{} {words}, m{} {hidden:?}: {} {:?} {:?} held out {:.3} -> {:.3}",
            if o.exact() {
                "ok "
            } else if o.false_additions() > 0 {
                "BAD"
            } else {
                "-- "
            },
            case.machine,
            o.verdict.name(),
            o.named,
            o.alternatives,
            o.holdout.0,
            o.holdout.1
        ),
    }
}
