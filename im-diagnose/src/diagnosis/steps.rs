//! The models of the course as a user's own simulation will run them, and their errors.

use std::collections::BTreeMap;

use im_identify::offline::{Experiment, FitOptions, residuals};
use im_model::{EffectId, Machine, State};
use rayon::prelude::*;

use crate::refine::{Course, Model, Refinement, UNSTABLE, judged, mean_square, pulled};

/// Error of a model on a set of recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors {
    /// Mean squared residual in σ²: 1.0 is the noise floor.
    pub chi2_per_sample: f64,
    /// Root mean square per channel, in its unit.
    pub rmse: BTreeMap<String, f64>,
    /// Fit percent per channel: 100 (1 − ‖e‖/‖y − mean y‖).
    pub fit_percent: BTreeMap<String, f64>,
}

/// One step of the refinement.
#[derive(Clone, Debug)]
pub struct Step {
    /// Effects in the model.
    pub effects: Vec<EffectId>,
    /// The fitted machine.
    pub machine: Machine<f64>,
    /// Initial states of the training recordings.
    pub starts: Vec<State<f64>>,
    /// Initial state of the held-out recording.
    pub holdout_start: Option<State<f64>>,
    /// Error on the training recordings.
    pub train: Errors,
    /// Error on the held-out recording.
    pub holdout: Option<Errors>,
}

/// Errors of a machine on experiments.
pub fn errors(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> Errors {
    let r: Vec<_> = experiments.par_iter().zip(starts).map(|(e, x)| residuals(machine, e, x)).collect();
    let mut sums: BTreeMap<String, [f64; 5]> = BTreeMap::new();
    for (e, r) in experiments.iter().zip(&r) {
        for (c, r) in e.channels.iter().zip(r) {
            let s = sums.entry(c.name.clone()).or_default();
            for (k, x) in r.iter().enumerate().filter(|(k, _)| c.is_valid(*k)) {
                let y = c.values[k];
                s[0] += 1.0;
                s[1] += x * x;
                s[2] += x * x * c.sigma * c.sigma;
                s[3] += y;
                s[4] += y * y;
            }
        }
    }
    let n: f64 = sums.values().map(|s| s[0]).sum();
    Errors {
        chi2_per_sample: sums.values().map(|s| s[1]).sum::<f64>() / n,
        rmse: sums.iter().map(|(k, s)| (k.clone(), (s[2] / s[0]).sqrt())).collect(),
        fit_percent: sums
            .iter()
            .map(|(k, s)| {
                let spread = (s[4] - s[3] * s[3] / s[0]).max(1e-300);
                (k.clone(), 100.0 * (1.0 - (s[2] / spread).sqrt()))
            })
            .collect(),
    }
}

/// The recordings as steps are judged on them ([`judged`]): the same for all steps.
struct Judged {
    train: Vec<Experiment>,
    holdout: Option<Experiment>,
}

impl Judged {
    fn new(loop_: &Refinement, machine: &Machine<f64>, starts: &[State<f64>], factor: f64) -> Self {
        let case = loop_.case();
        Self {
            train: case.train.par_iter().zip(starts).map(|(e, x)| judged(e, machine, x, factor)).collect(),
            holdout: case.holdout.as_ref().map(|h| {
                let aided = pulled(std::slice::from_ref(h));
                judged(h, machine, &loop_.starts(machine, &aided)[0], factor)
            }),
        }
    }
}

/// A model fitted once more as a user's own simulation will run it: the machine and the starts of the training recordings.
fn refitted(loop_: &Refinement, model: &Model, refit: &Judged) -> (Machine<f64>, Vec<State<f64>>) {
    let options = FitOptions { iterations: 12, tolerance: 1e-5, horizons: Vec::new() };
    match loop_.fit_to(&refit.train, &model.fit.machine, &model.fit.starts, &model.effects, &options) {
        // Where the unaided simulation falls out of step on the way, its minimum means nothing.
        Ok(f) if mean_square_all(&f.machine, loop_.pulled(), &f.starts) < 1.2 * model.train() => (f.machine, f.starts),
        _ => (model.fit.machine, model.fit.starts.clone()),
    }
}

/// The errors of a refitted model.
fn step(loop_: &Refinement, model: &Model, (machine, starts): (Machine<f64>, Vec<State<f64>>), judged: &Judged) -> Step {
    let held = judged.holdout.as_slice();
    let held_starts = loop_.starts(&machine, held);
    Step {
        effects: model.effects.clone(),
        train: errors(&machine, &judged.train, &starts),
        holdout: (!held.is_empty()).then(|| errors(&machine, held, &held_starts)),
        holdout_start: held_starts.first().copied(),
        machine,
        starts,
    }
}

pub(super) fn steps(loop_: &Refinement, course: &Course) -> Vec<Step> {
    let last = &course.models[course.models.len() - 1];
    // A first, generous look: what the final model can be fitted on unaided; then the strict one, with that fit.
    let refit = Judged::new(loop_, &last.fit.machine, &last.fit.starts, 100.0);
    let fits: Vec<_> = course.models.par_iter().map(|m| refitted(loop_, m, &refit)).collect();
    let (machine, starts) = &fits[fits.len() - 1];
    let judged = Judged::new(loop_, machine, starts, UNSTABLE);
    course.models.par_iter().zip(fits).map(|(m, fit)| step(loop_, m, fit, &judged)).collect()
}

/// Drops the last effects again where a simulation on its own feet does not gain by them: drawing the speed towards a noisy
/// measurement can make an effect look useful.
pub(super) fn keep_confirmed(course: &mut Course, steps: &[Step], least_gain: f64) {
    while course.models.len() > 1 {
        let (before, after) = (&steps[course.models.len() - 2], &steps[course.models.len() - 1]);
        let gain = before.train.chi2_per_sample - after.train.chi2_per_sample;
        if gain > least_gain * after.train.chi2_per_sample {
            return;
        }
        course.models.pop();
        course.alternatives.pop();
    }
}

fn mean_square_all(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> f64 {
    let n: usize = experiments.iter().map(Experiment::count).sum();
    experiments.iter().zip(starts).map(|(e, x)| mean_square(machine, e, x) * e.count() as f64).sum::<f64>() / n as f64
}
