//! Effects that are there beside a cause that the library does not hold.
//!
//! How much an unknown cause leaves says nothing of an effect that acts elsewhere. What is left where the effect acts does: one that is there explains
//! what there is to see, one that only imitates has another form than the cause and leaves part of it. With the residual $r_k$ of row k, in σ, and
//! $r_k^\circ$ without the effect, all else refitted, of $n_k$ readings, the part that is left is
//!
//! $$ \frac{\sum_k |r_k^\circ - r_k|^2\,(|r_k|^2 - n_k)}{\sum_k |r_k^\circ - r_k|^2\,(|r_k^\circ|^2 - n_k)}. $$

use std::ops::Range;

use im_identify::offline::{ChannelKind, Experiment, FitOptions, Residuals, residuals};
use im_model::{EffectId, State};
use rayon::prelude::*;

use crate::form_error::bent;
use crate::residuals::all_residuals;
use crate::search::{COMPARABLE, Model, Refinement, UNEXPLAINED, without};

/// Those effects of a model that leave less, where they act, than what counts as unexplained: in training, and held out. Where its `form` may be all that
/// is wrong, what errors of form may have made does not count; elsewhere an effect may be a part of a cause that leaves as much as it explains.
pub(super) fn there(loop_: &Refinement, model: &Model, form: bool) -> Vec<EffectId> {
    let recordings: Vec<Experiment> = loop_.nudged().iter().chain(loop_.held_out()).cloned().collect();
    let (machine, starts) = (&model.fit.machine, starts(model));
    let with = all_residuals(machine, &starts, &recordings);
    let left = if form {
        let free = loop_.free(machine, &model.effects, &recordings);
        bent(machine, &starts, &recordings, &free, loop_.case().motor.leakage_ratio_std())
    } else {
        with.clone()
    };
    let given = &loop_.case().motor.machine;
    let as_given = loop_.held_out().map(|h| residuals(given, h, &loop_.starts(given, std::slice::from_ref(h))[0]));
    let after = After { recordings, with, left, as_given };
    let explains = |l: &PartLeft| l.where_it_acts < UNEXPLAINED && (form || l.altogether < COMPARABLE * (1.0 - l.altogether));
    let is_there = |e: &&EffectId| after.left_by(loop_, model, **e).is_some_and(|parts| parts.iter().all(explains));
    model.effects.par_iter().filter(is_there).copied().collect()
}

/// The training recordings, then the held-out one, and what a model leaves of them.
struct After {
    recordings: Vec<Experiment>,
    /// The residuals.
    with: Residuals,
    /// Those of them that count.
    left: Residuals,
    /// What the motor as given leaves of the held-out one.
    as_given: Option<Vec<Vec<f64>>>,
}

impl After {
    /// Of the training recordings, and of the held-out one if there is one; nothing where no fit without the effect is to be had.
    fn left_by(&self, loop_: &Refinement, model: &Model, effect: EffectId) -> Option<Vec<PartLeft>> {
        let others = without(&model.effects, effect);
        let machine = model.fit.machine.without([effect]).ok()?;
        let before = loop_.model(&machine, &model.fit.starts, &others, &FitOptions::quick()).ok()?;
        let mut before = all_residuals(&before.fit.machine, &starts(&before), &self.recordings);
        let seen = loop_.nudged().len();
        if let (Some(lost), Some(as_given)) = (before.get_mut(seen), &self.as_given) {
            // A refit can lose the held-out recording, and to bring it back explains nothing: no more than the motor as given leaves.
            let size = |left: &[Vec<f64>]| left.iter().flatten().map(|r| r * r).sum::<f64>();
            if size(as_given) < size(lost) {
                lost.clone_from(as_given);
            }
        }
        let of =
            |k: Range<usize>| part_left(&self.recordings[k.clone()], &before[k.clone()], &self.with[k.clone()], &self.left[k]);
        let kinds = [0..seen, seen..before.len()];
        Some(kinds.into_iter().filter(|k| !k.is_empty()).map(of).collect())
    }
}

fn starts(model: &Model) -> Vec<State<f64>> {
    model.fit.starts.iter().copied().chain(model.holdout_start).collect()
}

/// The part of recordings that an effect leaves; infinite where it explains nothing.
#[derive(Debug)]
struct PartLeft {
    where_it_acts: f64,
    altogether: f64,
}

/// From residuals without and with the effect, and those that count.
fn part_left(experiments: &[Experiment], without: &[Vec<Vec<f64>>], with: &[Vec<Vec<f64>>], left: &[Vec<Vec<f64>>]) -> PartLeft {
    // By how much it changes a row, and all rows alike.
    let (mut before, mut after) = ([0.0; 2], [0.0; 2]);
    for (e, ((without, with), left)) in experiments.iter().zip(without.iter().zip(with).zip(left)) {
        // The currents count together: where their vector points to is no matter.
        for speed in [true, false] {
            let of_kind = |c: &usize| (e.channels[*c].kind == ChannelKind::Speed) == speed;
            let channels: Vec<usize> = (0..e.channels.len()).filter(of_kind).collect();
            for k in 0..e.len() {
                let valid = || channels.iter().copied().filter(|&c| e.channels[c].is_valid(k));
                let change: f64 = valid().map(|c| (without[c][k] - with[c][k]).powi(2)).sum();
                let excess = |r: &[Vec<f64>]| valid().map(|c| r[c][k].powi(2) - 1.0).sum::<f64>();
                for (kind, weight) in [change, 1.0].into_iter().enumerate() {
                    before[kind] += weight * excess(without);
                    after[kind] += weight * excess(left);
                }
            }
        }
    }
    let part = |kind: usize| if before[kind] > 0.0 { after[kind] / before[kind] } else { f64::INFINITY };
    PartLeft { where_it_acts: part(0), altogether: part(1) }
}

#[cfg(test)]
mod tests {
    use im_model::{Complex, Recording};
    use proptest::prelude::*;

    use super::*;

    fn experiment(rows: usize) -> Experiment {
        let recording = Recording {
            name: "run".into(),
            start_s: 0.0,
            sample_time_s: 1e-3,
            u_s: vec![Complex::new(0.0, 0.0); rows],
            i_s: vec![Complex::new(0.0, 0.0); rows],
            omega_m: vec![0.0; rows],
            tau_load: None,
        };
        Experiment::from_recording(&recording, [1.0; 2], 1.0)
    }

    proptest! {
        /// An effect of the first half that leaves a part of itself there leaves the square of that part, whatever is left of the second half.
        #[test]
        fn what_is_left_elsewhere_says_nothing(part in 0.0..0.9f64, size in 50.0..500.0f64, elsewhere in -1e3..1e3f64) {
            let e = experiment(20);
            let half = |first: f64| (0..20).map(|k| if k < 10 { first } else { elsewhere }).collect::<Vec<f64>>();
            let channels = |first: f64| vec![e.channels.iter().map(|_| half(first)).collect::<Vec<_>>()];
            let with = channels(part * size);
            let left = part_left(std::slice::from_ref(&e), &channels(size), &with, &with);
            prop_assert!((left.where_it_acts - part * part).abs() < 1e-3, "{left:?}");
        }
    }

    #[test]
    fn what_explains_nothing_leaves_everything() {
        let e = experiment(4);
        let same = vec![vec![vec![3.0; 4]; e.channels.len()]];
        assert!(part_left(std::slice::from_ref(&e), &same, &same, &same).where_it_acts.is_infinite());
    }
}
