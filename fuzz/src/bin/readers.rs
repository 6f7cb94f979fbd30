//! Runs every reader on mutated inputs for a while: cargo run --release --manifest-path fuzz/Cargo.toml --bin readers -- SECONDS [SEED]
//!
//! Prints runs, panics and the slowest read by reader; what makes one panic is kept in `fuzz/artifacts`. Status 1 where any did.

use std::panic::catch_unwind;
use std::time::{Duration, Instant};

use im_fuzz::TARGETS;
use im_fuzz::mutate::{Dice, mutated_bytes};

fn main() {
    let argument = |k: usize, otherwise: u64| std::env::args().nth(k).and_then(|x| x.parse().ok()).unwrap_or(otherwise);
    let (seconds, mut dice) = (argument(1, 60), Dice(argument(2, 1)));
    std::panic::set_hook(Box::new(|_| ()));
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/artifacts");
    let mut failed = false;
    for target in &TARGETS {
        let mut pool = (target.seeds)();
        let kept = pool.len();
        let (begun, mut runs, mut panics, mut slowest) = (Instant::now(), 0u64, 0u64, Duration::ZERO);
        while begun.elapsed() < Duration::from_millis(1000 * seconds / TARGETS.len() as u64) {
            let from = dice.below(pool.len());
            let data = mutated_bytes(&pool[from], &mut dice);
            let started = Instant::now();
            let fine = catch_unwind(|| (target.read)(&data)).is_ok();
            slowest = slowest.max(started.elapsed());
            runs += 1;
            if !fine {
                panics += 1;
                let file = format!("{folder}/{}-{runs}.txt", target.name);
                let _ = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(file, &data));
            }
            // Mutants of mutants, now and then.
            if dice.below(20) == 0 && data.len() < 200_000 {
                if pool.len() < kept + 50 { pool.push(data) } else { pool[kept + dice.below(50)] = data }
            }
        }
        failed |= panics > 0;
        println!("{:<12} {runs:>8} runs, {panics} panics, slowest {:.3} s", target.name, slowest.as_secs_f64());
    }
    std::process::exit(i32::from(failed));
}
