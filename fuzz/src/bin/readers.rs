//! Runs every reader on mutated inputs: cargo run --release --manifest-path fuzz/Cargo.toml --bin readers -- RUNS [SEED [READER]]
//!
//! The same inputs at every run of a seed, however fast the machine. Prints runs, panics and the slowest read by reader; what makes one panic is
//! kept in `fuzz/artifacts`, and read again first the next time. Status 1 where any did.

use std::panic::catch_unwind;
use std::path::Path;
use std::time::{Duration, Instant};

use im_fuzz::TARGETS;
use im_fuzz::mutate::{Dice, mutated_bytes};

fn main() {
    let argument = |k: usize, otherwise: u64| std::env::args().nth(k).and_then(|x| x.parse().ok()).unwrap_or(otherwise);
    let (runs, seed, only) = (argument(1, 10_000), argument(2, 1), std::env::args().nth(3));
    std::panic::set_hook(Box::new(|_| ()));
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/artifacts"));
    let mut failed = false;
    for target in TARGETS.iter().filter(|t| only.as_deref().is_none_or(|o| o == t.name)) {
        let mut dice = Dice(seed);
        let mut pool = (target.seeds)();
        let kept = pool.len();
        let of_reader = |f: &Path| f.file_name().is_some_and(|n| n.to_string_lossy().starts_with(target.name));
        let files = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|f| f.path()).filter(|f| of_reader(f));
        let before: Vec<Vec<u8>> = files.filter_map(|f| std::fs::read(f).ok()).collect();
        let still = before.iter().filter(|data| catch_unwind(|| (target.read)(data)).is_err()).count();
        if !before.is_empty() {
            println!("{:<12} {still} of {} kept files still make it panic", target.name, before.len());
        }
        let (mut panics, mut slowest) = (still, Duration::ZERO);
        for run in 0..runs {
            let from = dice.below(pool.len());
            let data = mutated_bytes(&pool[from], &mut dice);
            let started = Instant::now();
            let fine = catch_unwind(|| (target.read)(&data)).is_ok();
            slowest = slowest.max(started.elapsed());
            if !fine {
                panics += 1;
                let file = folder.join(format!("{}-{seed}-{run}.bin", target.name));
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
