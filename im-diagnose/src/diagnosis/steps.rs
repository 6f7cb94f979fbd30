//! The models of the course as a user's own simulation will run them, and their errors.

use im_identify::offline::{Experiment, FitOptions};
use im_model::{EffectId, Machine, State};
use rayon::prelude::*;

use crate::residual_tests::{Dependence, dependences};
use crate::residuals::{Errors, UNSTABLE, errors, judged, mean_square, nudged};
use crate::search::{Course, Model, Refinement};

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

impl Step {
    /// The larger of training and held-out error, χ²/N.
    pub(crate) fn error(&self) -> f64 {
        self.holdout.as_ref().map_or(0.0, |e| e.chi2_per_sample).max(self.train.chi2_per_sample)
    }
}

/// The recordings as steps are judged on them ([`judged`]): the same for all steps.
#[derive(Clone)]
pub(super) struct Judged {
    pub train: Vec<Experiment>,
    pub holdout: Option<Experiment>,
}

impl Judged {
    /// By a machine from its starts; where it is not known how the held-out recording starts, that is found.
    fn new(
        loop_: &Refinement,
        machine: &Machine<f64>,
        starts: &[State<f64>],
        holdout_start: Option<State<f64>>,
        factor: f64,
    ) -> Self {
        let case = loop_.case();
        let seen = || case.train.par_iter().zip(starts).map(|(e, x)| judged(e, machine, x, factor)).collect();
        let unseen = |h: &Experiment| {
            let found = || loop_.starts(machine, &nudged(std::slice::from_ref(h)))[0];
            judged(h, machine, &holdout_start.unwrap_or_else(found), factor)
        };
        let (train, holdout) = rayon::join(seen, || case.holdout.as_ref().map(unseen));
        Self { train, holdout }
    }
}

/// A model fitted once more as a user's own simulation will run it: the machine and the starts of the training recordings.
fn refitted(loop_: &Refinement, model: &Model, refit: &Judged) -> (Machine<f64>, Vec<State<f64>>) {
    let options = FitOptions { iterations: 12, tolerance: 1e-6, horizons: Vec::new() };
    match loop_.fit_to(&refit.train, &model.fit.machine, &model.fit.starts, &model.effects, &options) {
        // Where the simulation without nudging falls out of step on the way, its minimum means nothing.
        Ok(f) if mean_square_all(&f.machine, loop_.nudged(), &f.starts) < 1.2 * model.train() => (f.machine, f.starts),
        _ => (model.fit.machine, model.fit.starts.clone()),
    }
}

/// The errors of a refitted model.
fn step(loop_: &Refinement, model: &Model, (machine, starts): (Machine<f64>, Vec<State<f64>>), judged: &Judged) -> Step {
    let held = judged.holdout.as_slice();
    let unseen = || {
        let starts = loop_.starts(&machine, held);
        starts.first().map(|x| (errors(&machine, held, &starts), *x))
    };
    let (train, unseen) = rayon::join(|| errors(&machine, &judged.train, &starts), unseen);
    let (holdout, holdout_start) = unseen.unzip();
    Step { effects: model.effects.clone(), train, holdout, holdout_start, machine, starts }
}

/// The steps of a course, and the recordings as they are judged on them.
pub(super) fn steps(loop_: &Refinement, course: &Course) -> (Vec<Step>, Judged) {
    let last = &course.last().model;
    // A first, generous look: what the final model can be fitted on without nudging; then the strict one, with that fit.
    let refit = Judged::new(loop_, &last.fit.machine, &last.fit.starts, last.holdout_start, 100.0);
    let fits: Vec<_> = course.stages.par_iter().map(|s| refitted(loop_, &s.model, &refit)).collect();
    let (machine, starts) = &fits[fits.len() - 1];
    let judged = Judged::new(loop_, machine, starts, None, UNSTABLE);
    let steps = course.stages.par_iter().zip(fits).map(|(s, fit)| step(loop_, &s.model, fit, &judged)).collect();
    (steps, judged)
}

/// A course as it is judged.
pub(super) struct Found {
    /// Its steps.
    pub steps: Vec<Step>,
    /// The recordings as they are judged on them.
    pub judged: Judged,
    /// What the residual of the last step depends on.
    pub dependences: Vec<Dependence>,
}

impl Found {
    pub(super) fn new(loop_: &Refinement, course: &Course) -> Self {
        let (steps, judged) = steps(loop_, course);
        let Step { machine, starts, .. } = &steps[steps.len() - 1];
        let dependences = dependences(machine, starts, &judged.train);
        Self { steps, judged, dependences }
    }

    /// The last step.
    pub(super) fn last(&self) -> &Step {
        &self.steps[self.steps.len() - 1]
    }
}

fn mean_square_all(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> f64 {
    let n: usize = experiments.iter().map(Experiment::count).sum();
    experiments.iter().zip(starts).map(|(e, x)| mean_square(machine, e, x) * e.count() as f64).sum::<f64>() / n as f64
}
