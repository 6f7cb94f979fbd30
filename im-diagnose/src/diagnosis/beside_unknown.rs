//! Effects that are there beside a cause that the library does not hold.
//!
//! What an unknown cause leaves elsewhere, or of another kind, says nothing of an effect. What it leaves in the place of what the effect changes does: one
//! that is there changes everything by as much as is missing; one that only imitates has the size that a cause of another form asks for on average, too small
//! here and too large there. With the residual $r$, in σ, and $r^\circ$ without the effect, all else refitted, $d = r^\circ - r$ and the periods w of the rated
//! supply, the part that is left is
//!
//! $$ \frac{\sum_w (d_w \cdot r_w)^2 / |d_w|^2 - 1}{\sum_w (d_w \cdot r_w^\circ)^2 / |d_w|^2 - 1}. $$
//!
//! Where the form of what was found may be all that is wrong, what errors of form may make of $r$ and $r^\circ$ is taken out of them: these explain what a
//! small effect beside a large one imitates.

use std::ops::Range;

use im_identify::offline::{Experiment, FitOptions, Residuals, residuals};
use im_model::{EffectId, Machine, State};
use rayon::prelude::*;

use crate::form_error::{SIZE_IN_SEARCH, bent};
use crate::residuals::all_residuals;
use crate::search::{Model, Refinement, UNEXPLAINED, without};

/// Those effects of a model that leave no more of what they change than two standard deviations of errors of form, in training and held out. Where its
/// `form` may be all that is wrong, no other cause is known to be there, and it is less than what counts as unexplained.
pub(super) fn there(loop_: &Refinement, model: &Model, form: bool) -> Vec<EffectId> {
    let recordings: Vec<Experiment> = loop_.nudged().iter().chain(loop_.held_out()).cloned().collect();
    let with = Missed::of(loop_, &model.fit.machine, &starts(model), &model.effects, &recordings, form);
    let motor = &loop_.case().motor;
    let as_given =
        loop_.held_out().map(|h| residuals(&motor.machine, h, &loop_.starts(&motor.machine, std::slice::from_ref(h))[0]));
    let after = After { recordings, with, as_given, period_s: 1.0 / motor.rating.electrical_frequency_hz, form };
    let most = if form { UNEXPLAINED } else { (2.0 * SIZE_IN_SEARCH).powi(2) };
    let is_there = |e: &&EffectId| after.left_by(loop_, model, **e).is_some_and(|parts| parts.iter().all(|&p| p < most));
    model.effects.par_iter().filter(is_there).copied().collect()
}

/// The training recordings, then the held-out one, and what a model leaves of them.
struct After {
    recordings: Vec<Experiment>,
    with: Missed,
    /// What the motor as given leaves of the held-out one.
    as_given: Option<Vec<Vec<f64>>>,
    /// A period of the rated supply, s.
    period_s: f64,
    /// Whether the form of what was found may be all that is wrong.
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
    fn left_by(&self, loop_: &Refinement, model: &Model, effect: EffectId) -> Option<Vec<f64>> {
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
        Some(kinds.map(|k| part_left(&self.recordings, k, &before, &self.with, self.period_s)).collect())
    }
}

fn starts(model: &Model) -> Vec<State<f64>> {
    model.fit.starts.iter().copied().chain(model.holdout_start).collect()
}

/// The part of what an effect changes in some of the recordings that it leaves; infinite where it explains nothing.
fn part_left(recordings: &[Experiment], of: Range<usize>, without: &Missed, with: &Missed, period_s: f64) -> f64 {
    let (mut before, mut after) = (0.0, 0.0);
    for n in of {
        let e = &recordings[n];
        let rows = ((period_s / e.sample_time_s).round() as usize).clamp(1, e.len().max(1));
        for first in (0..e.len()).step_by(rows) {
            let window = first..(first + rows).min(e.len());
            // What the effect changes is one thing, in currents and speed.
            let readings = || {
                (0..e.channels.len())
                    .flat_map(|c| window.clone().map(move |k| (c, k)))
                    .filter(|&(c, k)| e.channels[c].is_valid(k))
            };
            let change = |c: usize, k: usize| without.plain[n][c][k] - with.plain[n][c][k];
            let changed: f64 = readings().map(|(c, k)| change(c, k).powi(2)).sum();
            if changed > 0.0 {
                let left = |m: &Missed| readings().map(|(c, k)| change(c, k) * m.counts[n][c][k]).sum::<f64>();
                let excess = |m: &Missed| left(m).powi(2) / changed - 1.0;
                before += excess(without);
                after += excess(with);
            }
        }
    }
    if before > 0.0 { after / before } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

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

    /// The same of every channel.
    fn of_channels(e: &Experiment, rows: Vec<f64>) -> Missed {
        let plain: Residuals = vec![e.channels.iter().map(|_| rows.clone()).collect()];
        Missed { counts: plain.clone(), plain }
    }

    proptest! {
        /// An effect of the first half that leaves a part of itself there leaves the square of that part, whatever is left of the second half.
        #[test]
        fn what_is_left_elsewhere_says_nothing(part in 0.0..0.9f64, size in 50.0..500.0f64, elsewhere in -1e3..1e3f64) {
            let e = experiment(20);
            let half = |first: f64| (0..20).map(|k| if k < 10 { first } else { elsewhere }).collect::<Vec<f64>>();
            let missed = |first: f64| of_channels(&e, half(first));
            let left = part_left(std::slice::from_ref(&e), 0..1, &missed(size), &missed(part * size), 5e-3);
            prop_assert!((left - part * part).abs() < 1e-3, "{left}");
        }

        /// In periods of 20 rows an effect changes the fundamental by as much, or by `wrong` too much and too little in turn. A harmonic beside it is
        /// another matter.
        #[test]
        fn within_a_period_only_what_the_effect_changes_counts(wrong in 0.0..0.9f64, size in 50.0..500.0f64, harmonic in 0.0..1e3f64) {
            let e = experiment(80);
            let wave = |order: f64, k: usize| (order * TAU * k as f64 / 20.0).cos();
            let rows = |of: &dyn Fn(usize) -> f64| of_channels(&e, (0..80).map(|k| of(k) + harmonic * wave(5.0, k)).collect());
            let off = |k: usize| if (k / 20).is_multiple_of(2) { wrong } else { -wrong };
            let without = rows(&|k| size * (1.0 + off(k)) * wave(1.0, k));
            let with = rows(&|k| size * off(k) * wave(1.0, k));
            let left = part_left(std::slice::from_ref(&e), 0..1, &without, &with, 0.02);
            prop_assert!((left - wrong * wrong / (1.0 + wrong * wrong)).abs() < 1e-3, "{left}");
        }
    }

    #[test]
    fn what_explains_nothing_leaves_everything() {
        let e = experiment(4);
        let same = of_channels(&e, vec![3.0; 4]);
        assert!(part_left(std::slice::from_ref(&e), 0..1, &same, &same, 2e-3).is_infinite());
    }
}
