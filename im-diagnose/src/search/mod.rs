//! The loop: fit, score, refit the leading candidates, add, drop, swap, validate, decide.
//!
//! Here: fits of a model with given effects, and the scores of others. `course`: which are added. `score`: which nominate.

mod course;
pub mod score;

use im_identify::offline::{
    Experiment, Fit, FitError, FitOptions, Free, angle_on, base_parameters_in, effect_parameters, fit_from, start_on,
    start_parameters,
};
use im_model::{EffectId, Machine, MotorFile, ParameterId, Rating, State};
use rayon::prelude::*;

use crate::case::Case;
use crate::residuals::{errors, evidence, mean_square, nudged};
use score::{Score, ScoreContext, strengths};

pub(crate) use course::likelier;
pub use course::{Course, Refusal, Round, Stage, Trial};

/// What the loop may do.
#[derive(Clone, Debug)]
pub struct Options {
    /// Family-wise error rate of the score tests.
    pub significance: f64,
    /// How many leading candidates are refitted per round.
    pub leading: usize,
    /// Most effects added.
    pub most_effects: usize,
    /// Least improvement worth an effect, as a fraction of the error that remains: not to add what nobody would miss.
    pub least_gain: f64,
    /// Least improvement worth an effect, as a fraction of the excess over the noise floor that remains. Where most stays unexplained (the
    /// noise of a laboratory's sensors is rarely all that a model misses), an effect that takes a little off is mending something else.
    pub least_cut: f64,
    /// Least improvement worth an effect, as a fraction of the base model's excess over the noise floor: below it, the effect may only
    /// be mending the form of a stronger one.
    pub least_share: f64,
    /// Added to that share, times the fourth power of the cosine between the signatures of the effect and of one already added: what looks
    /// like an effect that is there must explain much to be believed beside it. Effects of different kinds owe nothing.
    pub alike_share: f64,
    /// An effect that takes this fraction off the excess over the noise floor that remains, where that is not negligible, needs no such
    /// least share.
    pub ample_cut: f64,
    /// Effects considered; all of the library and the motor's own when empty.
    pub candidates: Vec<EffectId>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            significance: 0.01,
            leading: 5,
            most_effects: 4,
            least_gain: 0.01,
            least_cut: 0.1,
            least_share: 3e-3,
            alike_share: 1.0,
            ample_cut: 0.25,
            candidates: Vec::new(),
        }
    }
}

/// Excess over the noise floor below which a model is as good as its sensors.
pub const NEGLIGIBLE: f64 = 0.1;

/// A fitted model in the course of the loop.
#[derive(Clone, Debug)]
pub struct Model {
    /// Effects added, in order.
    pub effects: Vec<EffectId>,
    /// The fit on the training recordings.
    pub fit: Fit,
    /// Minus twice the log-likelihood with coloured noise, up to a constant.
    pub evidence: f64,
    /// Mean squared residual of the held-out recording in σ².
    pub holdout: Option<f64>,
}

impl Model {
    /// Mean squared training residual in σ².
    pub fn train(&self) -> f64 {
        self.fit.chi2_per_sample()
    }
}

/// Runs the loop on a case.
pub struct Refinement {
    case: Case,
    /// The training recordings with the speed nudged towards the measured one: what is fitted and scored while the model may be wrong.
    nudged: Vec<Experiment>,
    options: Options,
    rating: Rating,
    base: Machine<f64>,
    candidates: Vec<EffectId>,
}

impl Refinement {
    /// Prepares the loop: fits the base model, and takes the noise of the sensors from what is rough in its residuals.
    pub fn new(mut case: Case, options: Options) -> Result<(Self, Model), FitError> {
        let MotorFile { machine, rating, .. } = case.motor.clone();
        let mut effects = *machine.effects();
        effects.rescale(&rating, machine.parameters(), machine.pole_pairs());
        let sampled = case.train.iter().filter(|e| !e.is_table());
        let longest = sampled.map(|e| e.sample_time_s).fold(0.0, f64::max);
        effects.suit_sampling(longest);
        let candidates = if options.candidates.is_empty() { effects.ids().collect() } else { options.candidates.clone() };
        let base = machine.with_effects(effects)?;
        case.estimate_noise();
        let mut me = Self { nudged: nudged(&case.train), case, options, rating, base, candidates };
        let starts = me.starts(&me.base, &me.nudged);
        let first = me.model(&me.base, &starts, &[], &FitOptions { tolerance: 1e-5, ..FitOptions::default() })?;
        // The voltage's own roughness shows in the currents: only in the residual is the roughness all noise.
        me.case.set_noise_from(&me.nudged, &first.fit.residuals);
        me.nudged = nudged(&me.case.train);
        let model = me.model(&first.fit.machine, &first.fit.starts, &[], &FitOptions::near())?;
        Ok((me, model))
    }

    /// The states from which `machine` follows experiments best: those known, or fitted to the first second.
    pub fn starts(&self, machine: &Machine<f64>, experiments: &[Experiment]) -> Vec<State<f64>> {
        experiments.par_iter().map(|e| start_on(machine, e, &self.rating)).collect()
    }

    /// Takes the root mean square of a model's residuals as the noise of each channel: right when nothing in them has a cause.
    pub fn set_noise_to_residual(&mut self, fit: &Fit) {
        let sums = errors(&fit.machine, &self.nudged, &fit.starts).rmse;
        let all = self.case.train.iter_mut().chain(&mut self.case.holdout).chain(&mut self.nudged);
        for c in all.flat_map(|e| &mut e.channels) {
            if let Some(s) = sums.get(&c.name) {
                c.sigma = *s;
            }
        }
    }

    /// The case, with the noise as estimated.
    pub fn case(&self) -> &Case {
        &self.case
    }

    /// The training recordings with the speed nudged towards the measured one.
    pub fn nudged(&self) -> &[Experiment] {
        &self.nudged
    }

    /// The machine's own measure of a scale.
    pub fn unit_of(&self, scale: im_model::effects::ScaleOf) -> f64 {
        self.rating.unit_of(scale, self.base.parameters(), self.base.pole_pairs())
    }

    /// Fits effects to other views of the training recordings, from `machine` and `starts`.
    pub fn fit_to(
        &self,
        experiments: &[Experiment],
        machine: &Machine<f64>,
        starts: &[State<f64>],
        effects: &[EffectId],
        options: &FitOptions,
    ) -> Result<Fit, FitError> {
        fit_from(machine, starts.to_vec(), experiments, &self.free(machine, effects, experiments), options)
    }

    /// What is fitted of a machine with such effects to such recordings.
    pub(crate) fn free(&self, machine: &Machine<f64>, effects: &[EffectId], experiments: &[Experiment]) -> Vec<Free> {
        // Limits are around the motor as given, however far the model has come.
        let mut free = base_parameters_in(&self.base, experiments);
        let own: Vec<EffectId> = self.base.effects().active().collect();
        for &e in own.iter().chain(effects) {
            free.extend(effect_parameters(e, machine, &self.rating));
        }
        let fixed_to_shaft = own.iter().chain(effects).any(|e| e.about().fixed_to_shaft);
        free.extend(start_parameters(experiments, &self.rating, fixed_to_shaft));
        free
    }

    /// Fits `effects` from `machine` and the training recordings' `starts`.
    pub fn model(
        &self,
        machine: &Machine<f64>,
        starts: &[State<f64>],
        effects: &[EffectId],
        options: &FitOptions,
    ) -> Result<Model, FitError> {
        let fit = self.fit_to(&self.nudged, machine, starts, effects, options)?;
        let evidence = evidence(&self.nudged, &fit.residuals);
        let holdout = self.case.holdout.as_ref().map(|h| {
            let h = &nudged(std::slice::from_ref(h))[0];
            mean_square(&fit.machine, h, &start_on(&fit.machine, h, &self.rating))
        });
        Ok(Model { effects: effects.to_vec(), fit, evidence, holdout })
    }

    /// Scores of all candidates not yet in the model, best first; those of the round before, if any, save looking for sizes.
    pub fn scores(&self, model: &Model, before: &[Score]) -> Vec<Score> {
        let fit = &model.fit;
        let context = ScoreContext::new(&fit.machine, &fit.starts, &self.nudged, &self.rating, &fit.free, self.level());
        let open: Vec<EffectId> = self.candidates.iter().copied().filter(|&e| !fit.machine.effects().is_on(e)).collect();
        let mut scores: Vec<Score> =
            open.par_iter().filter_map(|&e| context.score(e, before.iter().find(|s| s.effect == e))).collect();
        scores.sort_by(|a, b| b.log_p.total_cmp(&a.log_p).then(b.score.total_cmp(&a.score)));
        scores
    }

    /// Chance of a false alarm per candidate.
    fn level(&self) -> f64 {
        self.options.significance / self.candidates.len().max(1) as f64
    }

    /// Holm: effects whose null hypothesis falls, with `scores` sorted best first.
    pub fn significant(&self, scores: &[Score]) -> Vec<EffectId> {
        let m = scores.len();
        scores
            .iter()
            .enumerate()
            .take_while(|(k, s)| s.log_p > -(self.options.significance / (m - k) as f64).log10())
            .map(|(_, s)| s.effect)
            .collect()
    }

    /// Refits with one more effect, from what its score predicts.
    pub fn trial(&self, model: &Model, score: &Score) -> Option<Trial> {
        let (machine, starts) = self.seeded(&model.fit.machine, &model.fit.starts, score)?;
        let mut effects = model.effects.clone();
        effects.push(score.effect);
        // Far above the noise floor it is enough to see which way an effect goes: a step that gains less of the excess is the last.
        let excess = 1.0 - 1.0 / model.train().max(1.0);
        let quick = FitOptions { iterations: 10, tolerance: (5e-3 * excess).max(1e-3), horizons: Vec::new() };
        let mut tried = self.model(&machine, &starts, &effects, &quick).ok()?;
        if tried.train() > model.train() {
            // Without the effect it does better: this is not yet the minimum.
            tried = self.model(&tried.fit.machine, &tried.fit.starts, &effects, &FitOptions::near()).ok()?;
        }
        Some(Trial { effect: score.effect, model: tried, refusal: None })
    }

    /// The machine with the effect at the size predicted, within reason, and how the training recordings start with it.
    fn seeded(&self, machine: &Machine<f64>, starts: &[State<f64>], score: &Score) -> Option<(Machine<f64>, Vec<State<f64>>)> {
        let e = score.effect;
        let unit = |k: usize| self.rating.unit_of(e.parameters()[k].scale, machine.parameters(), machine.pole_pairs());
        let mut set: Vec<(ParameterId, f64)> = score.shape.iter().map(|&(k, v)| (ParameterId::Effect(e, k), v)).collect();
        let mut largest: f64 = 0.0;
        for (&k, &size) in strengths(e).iter().zip(&score.predicted) {
            let (lo, hi) = e.parameters()[k].typical;
            let reach = 1.5 * hi * unit(k);
            let mut x = size.clamp(-reach, reach);
            if e.parameters()[k].bound.check("", x).is_err() {
                x = 0.3 * lo * unit(k);
            }
            largest = largest.max(x.abs());
            set.push((ParameterId::Effect(e, k), x));
        }
        let with = if largest > 0.0 { machine.with(&set).ok()? } else { return None };
        let turned = |(e, x): (&Experiment, &State<f64>)| State { theta_m: angle_on(&with, e, x), ..*x };
        let first_fixed = e.about().fixed_to_shaft && !machine.effects().any_fixed_to_shaft();
        let starts = if first_fixed { self.nudged.iter().zip(starts).map(turned).collect() } else { starts.to_vec() };
        Some((with, starts))
    }

    /// Whether every strength that the score predicts has a sign that the effect can have.
    pub fn possible(&self, score: &Score) -> bool {
        strengths(score.effect)
            .iter()
            .zip(&score.predicted)
            .all(|(&k, x)| *x >= 0.0 || score.effect.parameters()[k].bound.check("", *x).is_ok())
    }

    /// The machine with an effect switched off.
    fn without(&self, machine: &Machine<f64>, effect: EffectId) -> Option<Machine<f64>> {
        let mut effects = *machine.effects();
        effects.switch_off(effect);
        effects.rescale(&self.rating, machine.parameters(), machine.pole_pairs());
        machine.with_effects(effects).ok()
    }
}
