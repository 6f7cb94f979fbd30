//! The campaign of learning: `learning [SEEDS] [FILTER…]` prints one line per trial, and a table. SEEDS is a number of
//! them from 0, or `FIRST..END`.
//!
//! Filters are a group (strong, medium, weak, library, clean), the name of a hidden effect, or a machine (`m7`); a trial runs when it has them
//! all. `ALWAYS=1` learns even where the library explains everything, `WHY=1` prints the course of each loop.

use std::sync::Mutex;

use im_diagnose::search::Learning;
use im_tests::campaign::seeds;
use im_tests::course::why;
use im_tests::learning::{GROUPS, Outcome, Planned, plan, run};
use rayon::prelude::*;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let chosen = args.iter().find_map(|a| seeds(a)).unwrap_or(0..1);
    let filters: Vec<&String> = args.iter().filter(|a| seeds(a).is_none()).collect();
    let is = |p: &Planned, word: &str| {
        p.group == word || p.kind.is_some_and(|k| k.name() == word) || format!("m{}", p.case.machine) == word
    };
    let planned: Vec<Planned> = plan(chosen).into_iter().filter(|p| filters.iter().all(|f| is(p, f))).collect();
    let learning = if std::env::var("ALWAYS").is_ok() { Learning::Always } else { Learning::Unexplained };
    println!("{} trials", planned.len());
    let done: Mutex<Vec<(Planned, Outcome)>> = Mutex::new(Vec::new());
    planned.par_iter().with_max_len(1).for_each(|p| {
        let name = p.kind.map_or("nothing", |k| k.name());
        let result = run(&p.case, learning);
        let mut done = done.lock().expect("no trial panics while it tells");
        match result {
            Err(e) => println!("ERR {name} m{}: {e}", p.case.machine),
            Ok((o, d)) => {
                println!("{:>3} {}", done.len() + 1, line(p, name, &o));
                if std::env::var("WHY").is_ok() {
                    why(&d);
                }
                done.push((p.clone(), o));
            }
        }
    });
    let done = done.into_inner().expect("no trial panics while it tells");
    println!(
        "\n| trials of | number | place right | excess falls by 90 % | curve learned | unexplained | named as it is | median left | mean time, s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for group in GROUPS {
        let of: Vec<&(Planned, Outcome)> = done.iter().filter(|(p, _)| p.group == group).collect();
        if of.is_empty() {
            continue;
        }
        let count = |f: &dyn Fn(&Planned, &Outcome) -> bool| of.iter().filter(|(p, o)| f(p, o)).count();
        let mut left: Vec<f64> = of.iter().map(|(_, o)| o.left()).collect();
        left.sort_by(f64::total_cmp);
        println!(
            "| {group} | {} | {} | {} | {} | {} | {} | {:.3} | {:.0} |",
            of.len(),
            count(&|p, o| p.kind.is_some_and(|k| o.right(k))),
            count(&|_, o| o.left() <= 0.1),
            count(&|_, o| o.learned()),
            count(&|_, o| o.verdict.name() == "unexplained"),
            count(&|p, o| p.kind.map_or(o.effects.is_empty(), |k| o.names(k)) && !o.learned()),
            left[left.len() / 2],
            of.iter().map(|(_, o)| o.took_s).sum::<f64>() / of.len() as f64,
        );
    }
}

fn line(p: &Planned, name: &str, o: &Outcome) -> String {
    let right = match p.group {
        "clean" => o.effects.is_empty(),
        "library" => p.kind.is_some_and(|k| o.names(k)) && !o.learned(),
        _ => p.kind.is_some_and(|k| o.right(k)) && o.left() <= 0.1,
    };
    let effects: Vec<String> = o
        .effects
        .iter()
        .map(|(e, rivals)| {
            let rivals: Vec<&str> = rivals.iter().map(|r| r.name()).collect();
            if rivals.is_empty() { e.to_string() } else { format!("{e} (or {})", rivals.join(", ")) }
        })
        .collect();
    format!(
        "{} {:<7} {name:<26} m{:<2} {:<15} held out {:.3} -> {:.3}, left {:.3}, {:.0} s: {}",
        if right { "ok " } else { "-- " },
        p.group,
        p.case.machine,
        o.verdict.name(),
        o.holdout.0,
        o.holdout.1,
        o.left(),
        o.took_s,
        effects.join("; "),
    )
}
