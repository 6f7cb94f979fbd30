//! Effects that are there beside a cause that the library does not hold.
//!
//! How much an unknown cause leaves says nothing of an effect that acts elsewhere. What is left where the effect acts does: one that is there explains
//! what there is to see, one that only imitates has another form than the cause and leaves part of it. With the residual $r_k$ of row k, in σ, and
//! $r_k^\circ$ without the effect, all else refitted, of $n_k$ readings, the part that is left is
//!
//! $$ \frac{\sum_k |r_k^\circ - r_k|^2\,(|r_k|^2 - n_k)}{\sum_k |r_k^\circ - r_k|^2\,(|r_k^\circ|^2 - n_k)}. $$

use std::ops::Range;

use im_identify::offline::{ChannelKind, Experiment, FitOptions, Residuals, residuals};
use im_model::{EffectId, Machine, State};
use rayon::prelude::*;

use crate::form_error::bent;
use crate::residuals::all_residuals;
use crate::search::{COMPARABLE, Model, Refinement, UNEXPLAINED, without};

/// Those effects of a model that leave less, where they act, than what counts as unexplained: in training, and held out. Where its `form` may be all that
/// is wrong, what errors of form may make does not count, with the effect and without: these explain what a small effect beside a large one imitates.
/// Elsewhere an effect may be a part of a cause that leaves as much as it explains.
pub(super) fn there(loop_: &Refinement, model: &Model, form: bool) -> Vec<EffectId> {
    let recordings: Vec<Experiment> = loop_.nudged().iter().chain(loop_.held_out()).cloned().collect();
    let (machine, starts) = (&model.fit.machine, starts(model));
    let with = Missed::of(loop_, machine, &starts, &model.effects, &recordings, form);
    let given = &loop_.case().motor.machine;
    let as_given = loop_.held_out().map(|h| residuals(given, h, &loop_.starts(given, std::slice::from_ref(h))[0]));
    let after = After { recordings, with, as_given, form };
    let explains = |l: &PartLeft| l.where_it_acts < UNEXPLAINED && (form || l.altogether < COMPARABLE * (1.0 - l.altogether));
    let is_there = |e: &&EffectId| after.left_by(loop_, model, **e).is_some_and(|parts| parts.iter().all(explains));
    model.effects.par_iter().filter(is_there).copied().collect()
}

/// The training recordings, then the held-out one, and what a model leaves of them.
struct After {
    recordings: Vec<Experiment>,
    with: Missed,
    /// What the motor as given leaves of the held-out one.
    as_given: Option<Vec<Vec<f64>>>,
    /// Whether its form may be all that is wrong.
    form: bool,
}

/// What a machine leaves.
struct Missed {
    /// The residuals.
    plain: Residuals,
    /// Those of them that count.
    counts: Residuals,
}

impl Missed {
    fn of(
        loop_: &Refinement,
        machine: &Machine<f64>,
        starts: &[State<f64>],
        effects: &[EffectId],
        recordings: &[Experiment],
        form: bool,
    ) -> Self {
        let plain = all_residuals(machine, starts, recordings);
        let bent_curves = || {
            let free = loop_.free(machine, effects, recordings);
            bent(machine, starts, recordings, &free, loop_.case().motor.leakage_ratio_std())
        };
        Self { counts: if form { bent_curves() } else { plain.clone() }, plain }
    }
}

impl After {
    /// Of the training recordings, and of the held-out one if there is one; nothing where no fit without the effect is to be had.
    fn left_by(&self, loop_: &Refinement, model: &Model, effect: EffectId) -> Option<Vec<PartLeft>> {
        let others = without(&model.effects, effect);
        let machine = model.fit.machine.without([effect]).ok()?;
        let before = loop_.model(&machine, &model.fit.starts, &others, &FitOptions::quick()).ok()?;
        let mut before = Missed::of(loop_, &before.fit.machine, &starts(&before), &others, &self.recordings, self.form);
        let seen = loop_.nudged().len();
        for lost in [&mut before.plain, &mut before.counts] {
            if let (Some(lost), Some(as_given)) = (lost.get_mut(seen), &self.as_given) {
                // A refit can lose the held-out recording, and to bring it back explains nothing: no more than the motor as given leaves.
                let size = |left: &[Vec<f64>]| left.iter().flatten().map(|r| r * r).sum::<f64>();
                if size(as_given) < size(lost) {
                    lost.clone_from(as_given);
                }
            }
        }
        let kinds = [0..seen, seen..self.recordings.len()].into_iter().filter(|k| !k.is_empty());
        Some(kinds.map(|k| part_left(&self.recordings, k, &before, &self.with)).collect())
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

/// Of some of the recordings, from what is missed without and with the effect.
fn part_left(recordings: &[Experiment], of: Range<usize>, without: &Missed, with: &Missed) -> PartLeft {
    // By how much it changes a row, and all rows alike.
    let (mut before, mut after) = ([0.0; 2], [0.0; 2]);
    for n in of {
        let e = &recordings[n];
        // The currents count together: where their vector points to is no matter.
        for speed in [true, false] {
            let of_kind = |c: &usize| (e.channels[*c].kind == ChannelKind::Speed) == speed;
            let channels: Vec<usize> = (0..e.channels.len()).filter(of_kind).collect();
            for k in 0..e.len() {
                let valid = || channels.iter().copied().filter(|&c| e.channels[c].is_valid(k));
                let change: f64 = valid().map(|c| (without.plain[n][c][k] - with.plain[n][c][k]).powi(2)).sum();
                let excess = |m: &Missed| valid().map(|c| m.counts[n][c][k].powi(2) - 1.0).sum::<f64>();
                for (kind, weight) in [change, 1.0].into_iter().enumerate() {
                    before[kind] += weight * excess(without);
                    after[kind] += weight * excess(with);
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

    fn of(plain: Residuals) -> Missed {
        Missed { counts: plain.clone(), plain }
    }

    proptest! {
        /// An effect of the first half that leaves a part of itself there leaves the square of that part, whatever is left of the second half.
        #[test]
        fn what_is_left_elsewhere_says_nothing(part in 0.0..0.9f64, size in 50.0..500.0f64, elsewhere in -1e3..1e3f64) {
            let e = experiment(20);
            let half = |first: f64| (0..20).map(|k| if k < 10 { first } else { elsewhere }).collect::<Vec<f64>>();
            let missed = |first: f64| of(vec![e.channels.iter().map(|_| half(first)).collect::<Vec<_>>()]);
            let left = part_left(std::slice::from_ref(&e), 0..1, &missed(size), &missed(part * size));
            prop_assert!((left.where_it_acts - part * part).abs() < 1e-3, "{left:?}");
        }
    }

    #[test]
    fn what_explains_nothing_leaves_everything() {
        let e = experiment(4);
        let same = of(vec![vec![vec![3.0; 4]; e.channels.len()]]);
        assert!(part_left(std::slice::from_ref(&e), 0..1, &same, &same).where_it_acts.is_infinite());
    }
}
