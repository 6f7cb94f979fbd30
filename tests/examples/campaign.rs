//! The hidden-effect campaign: `campaign [SEEDS] [FILTER…]` prints one line per trial and a table.
//!
//! Filters: names of effects, `clean`, `pairs`, `poor`, `coloured`, `weak`, `medium`, `strong`, `outside`.

use std::time::Instant;

use im_tests::campaign::{Outcome, run};
use im_tests::hidden::{Case, EffectKind, Excitation, Machine, Noise, Strength};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let seeds: u64 = args.first().and_then(|a| a.parse().ok()).unwrap_or(1);
    let filters: Vec<&str> = args.iter().map(String::as_str).filter(|a| a.parse::<u64>().is_err()).collect();
    let wants = |words: &[&str]| filters.iter().all(|f| words.contains(f));
    let mut cases: Vec<(String, Case)> = Vec::new();
    for seed in 0..seeds {
        for (k, kind) in EffectKind::ALL.iter().enumerate() {
            for (s, strength) in [("strong", Strength::Strong), ("medium", Strength::Medium), ("weak", Strength::Weak)] {
                let machine = (k * 5 + seed as usize * 3 + s.len()) % Machine::COUNT;
                let outside = if kind.in_library() { "inside" } else { "outside" };
                if wants(&[kind.name(), s, outside, "single"]) {
                    cases.push((format!("{} {s}", kind.name()), Case::new(machine, &[(*kind, strength)], 100 + seed)));
                }
                if wants(&[kind.name(), s, outside, "poor"]) && filters.contains(&"poor") {
                    let mut c = Case::new(machine, &[(*kind, strength)], 200 + seed);
                    c.excitation = Excitation::Poor;
                    cases.push((format!("poor {} {s}", kind.name()), c));
                }
            }
        }
        for machine in (0..Machine::COUNT).filter(|m| std::env::var("MACHINE").map_or(true, |v| v == m.to_string())) {
            if wants(&["clean", "white"]) {
                cases.push(("clean".into(), Case::new(machine, &[], 300 + seed)));
            }
            if wants(&["clean", "coloured"]) {
                let mut c = Case::new(machine, &[], 400 + seed);
                c.noise = Noise::coloured(0.9);
                cases.push(("clean coloured".into(), c));
            }
        }
        if wants(&["pairs"]) {
            let lib: Vec<EffectKind> = EffectKind::ALL.iter().copied().filter(|k| k.in_library() && !k.is_thermal()).collect();
            for k in 0..lib.len() {
                let other = lib[(k + 3 + seed as usize) % lib.len()];
                cases.push((
                    format!("{} + {}", lib[k].name(), other.name()),
                    Case::new((k * 7) % Machine::COUNT, &[(lib[k], Strength::Strong), (other, Strength::Medium)], 500 + seed),
                ));
            }
        }
    }
    println!("{} trials", cases.len());
    let mut outcomes: Vec<(String, Outcome)> = Vec::new();
    for (name, case) in cases {
        let t = Instant::now();
        match run(&case) {
            Ok(o) => {
                let mark = if o.exact() {
                    "ok "
                } else if o.hidden.is_empty() || o.false_additions() > 0 {
                    "BAD"
                } else {
                    "-- "
                };
                println!(
                    "{mark} {name:<42} m{:<2} change {:>6.2} {:<15} {:?} {:?} holdout {:.3} -> {:.3} visible {:?} {:.1} s",
                    case.machine,
                    o.change,
                    o.verdict.name(),
                    o.named,
                    o.alternatives,
                    o.holdout.0,
                    o.holdout.1,
                    o.visible,
                    t.elapsed().as_secs_f64()
                );
                if std::env::var("WHY").is_ok() {
                    for (m, r) in o.diagnosis.course.models.iter().zip(&o.diagnosis.course.rounds) {
                        println!("      {:?} train {:.4} holdout {:.4}", m.effects, m.train(), m.holdout.unwrap_or(0.0));
                        for s in r.scores.iter().take(5) {
                            println!(
                                "         {:<26} score {:>9.1} keep {:.3} {:?} det {:.2e}",
                                s.effect.name(),
                                s.score,
                                s.keep,
                                s.predicted,
                                s.detectable
                            );
                        }
                        for t in &r.trials {
                            println!(
                                "           try {:<26} train {:.4} holdout {:.4}",
                                t.effect.name(),
                                t.model.train(),
                                t.model.holdout.unwrap_or(0.0)
                            );
                        }
                    }
                    for l in o.diagnosis.leftover.iter().take(3) {
                        println!("         leftover {:?} of {:?} log p {:.1} size {:.4}", l.variable, l.part, l.log_p, l.size);
                    }
                }
                outcomes.push((name, o));
            }
            Err(e) => println!("ERR {name}: {e}"),
        }
    }
    let n = outcomes.len();
    let count = |f: &dyn Fn(&Outcome) -> bool| outcomes.iter().filter(|(_, o)| f(o)).count();
    println!(
        "exact {}/{n}, first right {}, with false additions {}",
        count(&|o| o.exact()),
        count(&|o| o.first_right()),
        count(&|o| o.false_additions() > 0)
    );
}
