//! The hidden-effect campaign: `campaign [SEEDS] [FILTER…]` prints one line per trial, and a table. SEEDS is a number of them from 0, or
//! `FIRST..END`.
//!
//! Filters are words of a trial's group (strong, medium, weak, clean, coloured, pairs, triples, outside, ramp, steady, poor, beside), effect names, or a
//! machine (`m7`); a trial runs when it has them all, and none with a minus before it (`-outside`). `WHY=1` prints the course of each loop.
//! `ALONE=1` asks the electrical side alone where nothing explains a trial. `AGAIN=1` gives each refined motor back to the loop with the same
//! recordings, and prints what is then found.

use std::convert::Infallible;

use im_tests::campaign::{Finished, Outcome, Planned, plan, run_all, seeds, table};
use im_tests::course::{again, why};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let chosen = args.iter().find_map(|a| seeds(a)).unwrap_or(0..1);
    let filters: Vec<&String> = args.iter().filter(|a| seeds(a).is_none()).collect();
    let planned: Vec<Planned> = plan(chosen)
        .into_iter()
        .filter(|p| filters.iter().all(|f| f.strip_prefix('-').map_or_else(|| p.is(f), |f| !p.is(f))))
        .collect();
    println!("{} trials", planned.len());
    let mut all: Vec<Finished> = Vec::new();
    let Ok(()) = run_all(&planned, |p, finished, answer| {
        all.push(finished.clone());
        match &finished.outcome {
            Err(e) => println!("ERR {}: {e}", p.name),
            Ok(outcome) => {
                let cut = if answer.is_some_and(|a| a.course.cut_short) { ", cut short" } else { "" };
                println!("{:>4} {}{cut}", all.len(), line(p, outcome, finished.took_s));
            }
        }
        if let Some(answer) = answer.filter(|_| std::env::var("WHY").is_ok()) {
            why(answer);
        }
        if let Some(e) = answer.filter(|_| std::env::var("ALONE").is_ok()).and_then(|d| d.electrical_side.as_ref()) {
            println!("      electrical side: {} {:?} {:?} {:?}", e.verdict.name(), e.effects, e.error, e.torque_column);
        }
        if let Some(answer) = answer.filter(|_| std::env::var("AGAIN").is_ok()) {
            match again(&p.case, answer) {
                Ok(d) => println!("      again: {} {:?}", d.verdict.name(), d.named()),
                Err(e) => println!("      again: {e}"),
            }
        }
        Ok::<(), Infallible>(())
    });
    println!("\n{}", table(&all));
}

fn line(p: &Planned, o: &Outcome, seconds: f64) -> String {
    let mark = match (o.exact(), o.false_additions() > 0) {
        (true, _) => "ok ",
        (_, true) => "BAD",
        _ => "-- ",
    };
    format!(
        "{mark} {:<8} {:<50} m{:<2} change {:>6.2} {:<15} {:?} {:?} held out {:.3} -> {:.3}, visible {:?}, {seconds:.1} s",
        p.group,
        p.name,
        p.case.machine,
        o.change,
        o.verdict.name(),
        o.named,
        o.alternatives,
        o.holdout.0,
        o.holdout.1,
        o.visible,
    )
}
