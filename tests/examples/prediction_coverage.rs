//! Whether a simulation from a refined motor says how far off it is: `prediction_coverage [SEEDS] [FILTER…]` prints one line per trial, and a table.
//!
//! A trial hides an effect outside the library, strong or medium, and is diagnosed twice: without learning, so that something stays unexplained,
//! and with. The band is made from the training recordings alone; the part of the held-out readings inside is counted. Of the sixteen kinds
//! every other one is tried, or those of the filters: the name of a hidden effect, a group, a machine (`m7`); `all` tries every one.

use std::sync::Mutex;

use im_diagnose::diagnosis::Diagnosis;
use im_diagnose::left_error::Left;
use im_diagnose::residuals::{UNSTABLE, judged};
use im_diagnose::search::Learning;
use im_identify::offline::predict;
use im_tests::campaign::seeds;
use im_tests::learning::{Planned, plan, run};
use rayon::prelude::*;

/// Without learning, and with.
const WAYS: [(&str, Learning); 2] = [("not learned", Learning::Never), ("learned", Learning::Unexplained)];

/// Of the current and of the speed.
type Pair = [Option<f64>; 2];

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let chosen = args.iter().find_map(|a| seeds(a)).unwrap_or(0..1);
    let filters: Vec<&String> = args.iter().filter(|a| seeds(a).is_none() && *a != "all").collect();
    let every = if args.iter().any(|a| a == "all") || !filters.is_empty() { 1 } else { 2 };
    let is = |p: &Planned, word: &str| {
        p.group == word || p.kind.is_some_and(|k| k.name() == word) || format!("m{}", p.case.machine) == word
    };
    let mut kinds = Vec::new();
    let mut planned: Vec<Planned> = plan(chosen).into_iter().filter(|p| ["strong", "medium"].contains(&p.group)).collect();
    planned.retain(|p| {
        if !kinds.contains(&p.kind) {
            kinds.push(p.kind);
        }
        (kinds.len() - 1) % every == 0 && filters.iter().all(|f| is(p, f))
    });
    println!("{} trials", planned.len());
    let done: Mutex<Vec<(usize, Pair)>> = Mutex::new(Vec::new());
    let jobs: Vec<(usize, &Planned)> = planned.iter().flat_map(|p| (0..WAYS.len()).map(move |w| (w, p))).collect();
    jobs.par_iter().with_max_len(1).for_each(|&(way, p)| {
        let name =
            format!("{:<7} {:<26} m{:<2} {:<11}", p.group, p.kind.map_or("nothing", |k| k.name()), p.case.machine, WAYS[way].0);
        match run(&p.case, WAYS[way].1).map(|(o, d)| (o, covered(&d))) {
            Ok((o, Some((inside, wider)))) => {
                let words = |x: Pair| x.map(|x| x.map_or("–".into(), |x| format!("{x:.3}"))).join(" ");
                let held_out = o.holdout.1.sqrt();
                println!(
                    "{name} {:<15} {held_out:>6.2} σ: inside {}, factor {}, {:.0} s",
                    o.verdict.name(),
                    words(inside),
                    words(wider),
                    o.took_s
                );
                done.lock().expect("no trial panics while it tells").push((way, inside));
            }
            Ok((_, None)) => println!("{name}: no band"),
            Err(e) => println!("ERR {name}: {e}"),
        }
    });
    let done = done.into_inner().expect("no trial panics while it tells");
    println!("\n| held-out readings inside | | trials | median | least | 0.90 and more | 0.95 and more |");
    println!("|---|---|---|---|---|---|---|");
    for (way, (name, _)) in WAYS.iter().enumerate() {
        for (k, quantity) in ["current", "speed"].iter().enumerate() {
            let mut shares: Vec<f64> = done.iter().filter(|d| d.0 == way).filter_map(|d| d.1[k]).collect();
            shares.sort_by(f64::total_cmp);
            let Some(least) = shares.first() else { continue };
            let from = |share: f64| shares.iter().filter(|x| **x >= share).count();
            let median = shares[shares.len() / 2];
            println!("| {name} | {quantity} | {} | {median:.3} | {least:.3} | {} | {} |", shares.len(), from(0.9), from(0.95));
        }
    }
}

/// The part of the held-out readings in the band of the training recordings, and the factor on it that would hold 95 % of them.
fn covered(d: &Diagnosis) -> Option<(Pair, Pair)> {
    let last = &d.steps[d.steps.len() - 1];
    let (e, start) = (d.case.holdout.as_ref()?, last.holdout_start.as_ref()?);
    let e = judged(e, &last.machine, start, UNSTABLE);
    let held_out = Left::of(&e, &predict(&last.machine, &e, start));
    let band = d.by_training?;
    let share = |(inside, all): (usize, usize)| (all > 0).then(|| inside as f64 / all as f64);
    Some((held_out.inside(&band).map(share), held_out.widening(&band)))
}
