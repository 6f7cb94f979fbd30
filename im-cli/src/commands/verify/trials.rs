//! The hidden-effect campaign of the main job, for `im verify --all`.

use std::path::Path;

use im_model::Shard;
use im_trials::campaign::{Finished, GROUPS, Planned, plan, run_all};
use im_trials::hidden::CatalogueMachine;

use super::kept;
use crate::failure::Failure;
use crate::terminal::Progress;

/// The trials that are asked for: those that match all words of a wish, for any of the wishes; all trials if there are no wishes.
pub fn chosen(seeds: u64, wishes: &[String]) -> Result<Vec<Planned>, Failure> {
    let all = plan(0..seeds);
    let fits = |p: &Planned, wish: &str| wish.split(',').all(|word| p.is(word.trim()));
    if let Some(nothing) = wishes.iter().find(|w| !all.iter().any(|p| fits(p, w))) {
        return Err(Failure::Input(format!(
            "--trials {nothing}: there is no such trial; expected groups ({}), effects (im effects lists them) or machines (m0 to m{}), \
             commas between words that must all apply",
            GROUPS.join(", "),
            CatalogueMachine::COUNT - 1
        )));
    }
    Ok(all.into_iter().filter(|p| wishes.is_empty() || wishes.iter().any(|w| fits(p, w))).collect())
}

/// Runs what is left of a shard's trials; gives all that are finished, of this shard or another, in the order of the plan.
pub fn tried(planned: &[Planned], shard: Shard, out: Option<&Path>) -> Result<Vec<Finished>, Failure> {
    let (mut journal, done) = kept::<Finished>(out, "trials.jsonl")?;
    // Files put together may hold a trial twice.
    let mut finished: Vec<Finished> = planned.iter().filter_map(|p| done.iter().find(|f| f.is_of(p))).cloned().collect();
    let is_left = |p: &&Planned| shard.has(p.index as u64) && !finished.iter().any(|f| f.is_of(p));
    let left: Vec<Planned> = planned.iter().filter(is_left).cloned().collect();
    let mut progress = Progress::new("hidden effects");
    let mut now = 0;
    run_all(&left, |_, f, _| {
        now += 1;
        progress.show(now, left.len());
        if let Some(journal) = &mut journal {
            journal.append(f).map_err(|e| Failure::Input(e.to_string()))?;
        }
        finished.push(f.clone());
        Ok::<(), Failure>(())
    })?;
    progress.finish();
    finished.sort_by_key(|f| f.trial);
    Ok(finished)
}
