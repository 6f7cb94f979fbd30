//! The hidden-effect campaign of the main job, for `im verify --all`.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use im_trials::campaign::{Planned, plan, run_all, table};
use im_verify::Shard;

use crate::terminal::Progress;

/// What came out.
pub struct Trials {
    pub number: usize,
    pub seconds: f64,
    /// In Markdown.
    pub table: String,
    /// Trials that the tool refused, and why.
    pub refused: Vec<String>,
}

/// Runs a shard's trials.
pub fn run(shard: Shard, seeds: u64) -> Trials {
    let all = plan(seeds).into_iter().enumerate();
    let planned: Vec<Planned> = all.filter(|(k, _)| shard.has(*k as u64)).map(|(_, p)| p).collect();
    let begun = Instant::now();
    let progress = Mutex::new(Progress::new("hidden effects"));
    let refused = Mutex::new(Vec::new());
    let done = AtomicUsize::new(0);
    let outcomes = run_all(&planned, |p, outcome, _| {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Ok(mut progress) = progress.lock() {
            progress.tell(done, planned.len());
        }
        if let (Err(e), Ok(mut refused)) = (outcome, refused.lock()) {
            refused.push(format!("{}: {e}", p.name));
        }
    });
    if let Ok(progress) = progress.lock() {
        progress.finish();
    }
    let table = table(&outcomes);
    drop(outcomes);
    let refused = refused.into_inner().unwrap_or_default();
    Trials { number: planned.len(), seconds: begun.elapsed().as_secs_f64(), table, refused }
}
