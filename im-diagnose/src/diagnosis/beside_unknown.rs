//! Effects that are there beside a cause that the library does not hold.
//!
//! How much an unknown cause leaves says nothing of an effect that acts elsewhere. What is left where the effect acts does: one that is there explains
//! what there is to see, one that only imitates has another form than the cause and leaves part of it. With the residual $r_k$ of row k, in σ, and
//! $r_k^\circ$ without the effect, all else refitted, of $n_k$ readings, the part that is left is
//!
//! $$ \frac{\sum_k |r_k^\circ - r_k|^2\,(|r_k|^2 - n_k)}{\sum_k |r_k^\circ - r_k|^2\,(|r_k^\circ|^2 - n_k)}. $$

use im_identify::offline::{ChannelKind, Experiment, FitOptions, residuals};
use im_model::EffectId;
use rayon::prelude::*;

use crate::residuals::{all_residuals, mean_square};
use crate::search::{Model, Refinement, UNEXPLAINED};

/// Those effects of a model that leave less, where they act, than what counts as unexplained: in training, and held out.
pub(super) fn there(loop_: &Refinement, model: &Model) -> Vec<EffectId> {
    let left = |e: &&EffectId| left_where_it_acts(loop_, model, **e).is_some_and(|left| left < UNEXPLAINED);
    model.effects.par_iter().filter(left).copied().collect()
}

/// The larger of training and held-out recordings; nothing where no fit without the effect is to be had.
fn left_where_it_acts(loop_: &Refinement, model: &Model, effect: EffectId) -> Option<f64> {
    let others: Vec<EffectId> = model.effects.iter().copied().filter(|&e| e != effect).collect();
    let machine = model.fit.machine.without([effect]).ok()?;
    let without = loop_.model(&machine, &model.fit.starts, &others, &FitOptions::quick()).ok()?;
    let seen = loop_.nudged();
    let of = |m: &Model| all_residuals(&m.fit.machine, &m.fit.starts, seen);
    let in_training = left_of(seen, &of(&without), &of(model));
    let Some(h) = loop_.held_out() else { return Some(in_training) };
    let after = residuals(&model.fit.machine, h, &model.holdout_start?);
    let held_out = left_of(std::slice::from_ref(h), &[without_effect(loop_, h, &without)?], &[after]);
    Some(in_training.max(held_out))
}

/// What is left of the held-out recording without the effect. A refit can lose it, and to bring it back explains nothing: no more than the motor as
/// given leaves.
fn without_effect(loop_: &Refinement, h: &Experiment, without: &Model) -> Option<Vec<Vec<f64>>> {
    let given = &loop_.case().motor.machine;
    let start = loop_.starts(given, std::slice::from_ref(h))[0];
    let (machine, x) = (&without.fit.machine, without.holdout_start?);
    let is_lost = mean_square(given, h, &start) < mean_square(machine, h, &x);
    Some(if is_lost { residuals(given, h, &start) } else { residuals(machine, h, &x) })
}

/// The part that is left of recordings, from their residuals without and with the effect; infinite where it explains nothing.
fn left_of(experiments: &[Experiment], without: &[Vec<Vec<f64>>], with: &[Vec<Vec<f64>>]) -> f64 {
    let (mut before, mut after) = (0.0, 0.0);
    for ((e, without), with) in experiments.iter().zip(without).zip(with) {
        // The currents count together: where their vector points to is no matter.
        for speed in [true, false] {
            let of_kind = |c: &usize| (e.channels[*c].kind == ChannelKind::Speed) == speed;
            let channels: Vec<usize> = (0..e.channels.len()).filter(of_kind).collect();
            for k in 0..e.len() {
                let valid = || channels.iter().copied().filter(|&c| e.channels[c].is_valid(k));
                let change: f64 = valid().map(|c| (without[c][k] - with[c][k]).powi(2)).sum();
                before += change * valid().map(|c| without[c][k].powi(2) - 1.0).sum::<f64>();
                after += change * valid().map(|c| with[c][k].powi(2) - 1.0).sum::<f64>();
            }
        }
    }
    if before > 0.0 { after / before } else { f64::INFINITY }
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
            let left = left_of(std::slice::from_ref(&e), &channels(size), &channels(part * size));
            prop_assert!((left - part * part).abs() < 1e-3, "{left}");
        }
    }

    #[test]
    fn what_explains_nothing_leaves_everything() {
        let e = experiment(4);
        let same = vec![vec![vec![3.0; 4]; e.channels.len()]];
        assert!(left_of(std::slice::from_ref(&e), &same, &same).is_infinite());
    }
}
