//! Prints how much each effect changes the recordings, in standard deviations of the noise, and how long a trial takes.
//!
//! `effect_sizes [SEEDS]`: for each effect and strength, the rms change of current and speed over machines and seeds.

use im_tests::hidden::{CatalogueMachine, EffectKind, Part, Strength, TrialCase};
use rayon::prelude::*;
use std::time::Instant;

fn main() {
    let seeds: u64 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(1);
    println!(
        "{:26} {:8} {:>24} {:>24} {:>9}",
        "effect", "strength", "current: min median max", "speed: min median max", "s/trial"
    );
    for &kind in EffectKind::ALL {
        for (name, strength) in [("weak", Strength::Weak), ("medium", Strength::Medium), ("strong", Strength::Strong)] {
            let start = Instant::now();
            let cases: Vec<TrialCase> = (0..CatalogueMachine::COUNT)
                .flat_map(|machine| (0..seeds).map(move |seed| TrialCase::new(machine, &[(kind, strength)], seed)))
                .collect();
            let parts = cases.iter().flat_map(|case| [Part::Train1, Part::Train2].map(|part| (case, part)));
            let changes: Vec<_> = parts.collect::<Vec<_>>().into_par_iter().map(|(case, part)| case.change(part)).collect();
            let spread = |mut values: Vec<f64>| {
                values.sort_by(f64::total_cmp);
                format!("{:7.2} {:7.2} {:8.2}", values[0], values[values.len() / 2], values[values.len() - 1])
            };
            // Four runs per case here, three in a trial.
            let each_s = start.elapsed().as_secs_f64() * rayon::current_num_threads() as f64 / cases.len() as f64 * 0.75;
            println!(
                "{:26} {:8} {} {} {:9.3}",
                kind.name(),
                name,
                spread(changes.iter().map(|c| c.current).collect()),
                spread(changes.iter().map(|c| c.speed).collect()),
                each_s
            );
        }
    }
}
