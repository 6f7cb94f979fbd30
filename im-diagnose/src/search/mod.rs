//! The loop: fit, score, refit the leading candidates, add, drop, swap, validate, decide.
//!
//! Here: fits of a model with given effects, and the scores of others. `score`: which effects are nominated. `sets`: which sets of effects
//! are likely, and which is looked at next. `neighbours`: from where the sets around it are fitted. `posterior`: how sure the data are.
//! `course`: the way from the base model to the likeliest set, step by step for the report.

mod course;
mod neighbours;
mod posterior;
pub mod score;
mod sets;
mod significance;

use std::collections::BTreeMap;

use im_identify::offline::{
    Channel, Experiment, Fit, FitError, FitOptions, Free, Load, Residuals, angle_on, base_parameters_in, effect_parameters_in,
    expecting, fit_from, knowing, residuals, start_on, start_parameters,
};
use im_model::{BaseParameter, EffectId, Machine, MotorFile, ParameterId, Rating, State};
use rayon::prelude::*;

use crate::case::Case;
use crate::form_error::marginal;
use crate::input_noise::nudge_noise;
use crate::residuals::{all_residuals, deviance, nudged};
use score::{Score, ScoreContext, Seed, strengths};

pub use course::{Course, Refusal, Round, Stage, Trial};
pub use posterior::{Posterior, Weighed};
use sets::least_dispersion;
pub use sets::{Answer, Sets};
pub(crate) use sets::{needed_to_tell_apart, without};
pub use significance::Significance;

/// What the loop may do.
#[derive(Clone, Debug)]
pub struct Options {
    /// Family-wise error rate of the score tests.
    pub significance: Significance,
    /// How many leading candidates are refitted per round.
    pub leading: usize,
    /// Most effects added.
    pub most_effects: usize,
    /// Simulations of all recordings that the fits of a search may take; where effects of the library explain what is there, they take 50 to 1500.
    pub most_work: f64,
    /// Effects considered; all of the library and the motor's own when empty.
    pub candidates: Vec<EffectId>,
    /// When curves that no formula gives are considered beside them.
    pub learning: Learning,
}

/// When an effect that the library does not hold becomes part of the answer, as a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Learning {
    /// Never: where a curve of no known form is likelier than what the library holds, the answer is `unexplained`.
    #[default]
    Never,
    /// Where such a curve is likelier than what the library holds.
    Unexplained,
    /// The same, and curves are tried where the library leaves nothing but noise, too.
    Always,
}

impl Default for Options {
    fn default() -> Self {
        let (significance, learning) = (Significance::default(), Learning::Never);
        Self { significance, leading: 5, most_effects: 6, most_work: 3000.0, candidates: Vec::new(), learning }
    }
}

/// Of effects that are considered later, so many are tried.
const NOMINATED: usize = 6;

/// Times that an unmeasured speed is found anew by the fitted machine at most, and the change of its parameters, in standard deviations, that ends them.
const SPEED_ROUNDS: usize = 20;
const SPEED_SETTLED: f64 = 0.3;

/// Mean square that the noise of a speed may make of the currents of a machine that is nudged towards it, σ²: it falls at least as the rate does.
const NUDGE_UNSEEN: f64 = 0.1;

/// Part of the base model's excess of χ²/N that effects may leave: with more, they do not explain it.
pub const UNEXPLAINED: f64 = 0.1;

/// From here on, −log₁₀ of a probability, there is no doubt.
pub const NO_DOUBT: f64 = 10.0;

/// Standard deviations beyond which a sum of squares is no chance.
const CHANCE: f64 = 3.0;

/// Largest residual that counts, in σ.
const RAN_AWAY: f64 = 1e6;

/// A fitted model in the course of the loop.
#[derive(Clone, Debug)]
pub struct Model {
    /// Effects added, in order.
    pub effects: Vec<EffectId>,
    /// The fit on the training recordings; its residuals are not kept.
    pub fit: Fit,
    /// Minus twice the log-likelihood of all recordings, the held-out one too, with coloured noise, up to a constant.
    pub deviance: f64,
    /// The part of the training recordings.
    pub train_deviance: f64,
    /// Mean squared residual of the held-out recording in σ².
    pub holdout: Option<f64>,
    /// The state in which the held-out recording begins.
    pub holdout_start: Option<State<f64>>,
}

impl Model {
    /// Mean squared training residual in σ².
    pub fn train(&self) -> f64 {
        self.fit.chi2_per_sample()
    }

    /// The larger of training and held-out error, χ²/N.
    fn error(&self) -> f64 {
        self.holdout.map_or(self.train(), |h| h.max(self.train()))
    }

    /// The part of the held-out recording in D.
    fn unseen(&self) -> f64 {
        self.deviance - self.train_deviance
    }
}

/// Runs the loop on a case.
#[derive(Clone)]
pub struct Refinement {
    case: Case,
    /// The training recordings with the speed nudged towards the measured one: what is fitted and scored while the model may be wrong.
    nudged: Vec<Experiment>,
    /// The held-out recording, nudged alike.
    held_out: Option<Experiment>,
    options: Options,
    rating: Rating,
    base: Machine<f64>,
    candidates: Vec<EffectId>,
    /// Candidates that are counted, but not tried any more.
    set_aside: Vec<EffectId>,
    /// The machine without any effect, where the motor file gives some: the forms of these are the library's, too.
    bare: Option<Model>,
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
        let mut me = Self {
            nudged: Vec::new(),
            held_out: None,
            case,
            options,
            rating,
            base,
            candidates,
            set_aside: Vec::new(),
            bare: None,
        };
        me.nudge();
        let starts = me.starts(&me.base, &me.nudged);
        let first = me.model(&me.base, &starts, &[], &FitOptions { tolerance: 1e-5, ..FitOptions::default() })?;
        // The voltage's own roughness shows in the currents: only in the residual is the roughness all noise.
        let left = me.left_by(&first.fit);
        me.case.set_noise_from(&me.nudged, &left);
        me.case.settle_voltages(&first.fit.machine, (&me.nudged, &first.fit.starts), &left);
        me.smooth_speeds_by(&first.fit);
        let case = &me.case;
        me.candidates.retain(|e| !case.rules_out(*e));
        me.nudge();
        me.nudge_quietly(&first.fit);
        let model = me.base_again(&first)?;
        let model = me.on_its_own_speeds(model)?;
        Ok((me, model))
    }

    /// Whether the speed of a recording was found from its currents.
    pub fn finds_speeds(&self) -> bool {
        self.case.train.iter().any(|e| matches!(e.load, Load::Unseen(_)))
    }

    /// Speeds that nobody measured move with the machine that they are found by: they, and the noise beside them, are found by a model which is
    /// then fitted on them, until neither changes. Where all speeds are measured, it is the model as it was.
    pub fn on_its_own_speeds(&mut self, mut model: Model) -> Result<Model, FitError> {
        let rounds = if self.finds_speeds() { SPEED_ROUNDS } else { 0 };
        for _ in 0..rounds {
            let before = model.fit;
            self.case.set_noise_from(&self.nudged, &self.left_by(&before));
            self.smooth_speeds_by(&before);
            self.nudge();
            model = self.model(&before.machine, &before.starts, &model.effects, &FitOptions::near())?;
            let moved = before.values().into_iter().zip(model.fit.values()).map(|(x, y)| (y - x).abs());
            if moved.zip(model.fit.standard_deviations()).all(|(moved, std)| moved <= SPEED_SETTLED * std) {
                break;
            }
        }
        Ok(model)
    }

    /// The base model on the recordings as they are now.
    pub fn base_again(&self, base: &Model) -> Result<Model, FitError> {
        self.model(&base.fit.machine, &base.fit.starts, &[], &FitOptions::near())
    }

    /// Takes in what the effects of the motor file explain: before a search.
    pub fn weigh_given(&mut self, base: &Model) {
        self.bare = self.without_any(&base.fit);
    }

    /// The machine of a fit with every effect switched off, fitted again; nothing where it has none.
    fn without_any(&self, fit: &Fit) -> Option<Model> {
        fit.machine.effects().active().next()?;
        let machine = fit.machine.without(fit.machine.effects().active()).and_then(|m| m.rescaled(&self.rating)).ok()?;
        let free = self.expected(self.free_of(&machine, &[], &self.nudged));
        let fit = fit_from(&machine, fit.starts.clone(), &self.nudged, &free, &FitOptions::quick()).ok()?;
        Some(self.weighed(fit, &[]))
    }

    /// The error that effects have to explain, χ²/N: that of the base model, or of a machine without the effects of the motor file.
    pub fn error_before(&self, base: f64) -> f64 {
        self.bare.iter().map(Model::error).fold(base, f64::max)
    }

    /// Takes the recordings anew from the case.
    fn nudge(&mut self) {
        self.nudged = nudged(&self.case.train);
        self.held_out = nudged(self.case.holdout.as_slice()).pop();
    }

    /// Nudges less where the noise of the measured speed would be seen in the currents: what it makes of them would look like anything but noise.
    fn nudge_quietly(&mut self, fit: &Fit) {
        let seen = nudge_noise(&fit.machine, &self.nudged, &fit.starts);
        if seen > NUDGE_UNSEEN {
            for e in self.case.train.iter_mut().chain(&mut self.case.holdout) {
                e.nudge_part *= NUDGE_UNSEEN / seen;
            }
            self.nudge();
        }
    }

    /// Where the load is unknown, the torque of the fitted base model helps to tell the speed from the noise of its sensor; where the speed
    /// is, it is found by that model.
    fn smooth_speeds_by(&mut self, fit: &Fit) {
        let train = std::mem::take(&mut self.case.train);
        self.case.train = train.into_par_iter().zip(&fit.starts).map(|(e, x)| e.with_inputs_by(&fit.machine, x)).collect();
        self.case.holdout = self.case.holdout.take().map(|h| {
            let start = start_on(&fit.machine, &h, &self.rating);
            h.with_inputs_by(&fit.machine, &start)
        });
    }

    /// The states from which `machine` follows experiments best: those known, or fitted to the first second.
    pub fn starts(&self, machine: &Machine<f64>, experiments: &[Experiment]) -> Vec<State<f64>> {
        experiments.par_iter().map(|e| start_on(machine, e, &self.rating)).collect()
    }

    /// Takes root mean squares of residuals as the noise of their channels: right when nothing in them has a cause.
    pub fn set_noise(&mut self, rms: &BTreeMap<String, f64>) {
        let all = self.case.train.iter_mut().chain(&mut self.case.holdout).chain(&mut self.nudged);
        for c in all.flat_map(|e| &mut e.channels) {
            if let Some(s) = rms.get(&c.name) {
                c.sigma = *s;
            }
        }
    }

    /// The case, with the noise as estimated.
    pub fn case(&self) -> &Case {
        &self.case
    }

    /// What the loop may do.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The training recordings with the speed nudged towards the measured one.
    pub fn nudged(&self) -> &[Experiment] {
        &self.nudged
    }

    /// The held-out recording, nudged alike.
    pub fn held_out(&self) -> Option<&Experiment> {
        self.held_out.as_ref()
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
        fit_from(machine, starts.to_vec(), experiments, &self.expected(self.free(machine, effects, experiments)), options)
    }

    /// What a fit moves, near the motor as given: data that hardly tell a parameter must not lead it away by errors of form.
    fn expected(&self, free: Vec<Free>) -> Vec<Free> {
        let all = self.case.all();
        expecting(free, least_dispersion(all.map(Experiment::count).sum::<usize>() as f64))
    }

    /// What a fitted machine leaves of the training recordings, in σ.
    fn left_by(&self, fit: &Fit) -> Residuals {
        all_residuals(&fit.machine, &fit.starts, &self.nudged)
    }

    /// Whether a model leaves less than the noise of the sensors, beyond chance, and no sensor more than its own: what effects would then take off is in
    /// how large the noise was taken.
    fn is_below_noise(&self, model: &Model) -> bool {
        if model.train() >= 1.0 && model.holdout.is_none_or(|unseen| unseen >= 1.0) {
            return false;
        }
        let seen = self.nudged.iter().zip(&model.fit.starts);
        let unseen = self.held_out.iter().zip(&model.holdout_start);
        let machine = &model.fit.machine;
        let mut channels = seen.chain(unseen).flat_map(|(e, x)| {
            let left = residuals(machine, e, x);
            let of = |(c, r): (&Channel, &Vec<f64>)| (c.count() as f64, r.iter().map(|r| r * r).sum::<f64>());
            e.channels.iter().zip(&left).map(of).collect::<Vec<_>>()
        });
        let off = |count: f64, chi2: f64| (chi2 - count) / (2.0 * count).sqrt();
        let sum = |(n, all, within): (f64, f64, bool), (count, chi2): (f64, f64)| {
            (n + count, all + chi2, within && (count == 0.0 || off(count, chi2) < CHANCE))
        };
        let (count, chi2, within) = channels.by_ref().fold((0.0, 0.0, true), sum);
        within && count > 0.0 && off(count, chi2) < -CHANCE
    }

    /// What is fitted of a machine with such effects to such recordings.
    pub(crate) fn free(&self, machine: &Machine<f64>, effects: &[EffectId], experiments: &[Experiment]) -> Vec<Free> {
        let all: Vec<EffectId> = self.base.effects().active().chain(effects.iter().copied()).collect();
        self.free_of(machine, &all, experiments)
    }

    /// The same, where these are all effects that it has.
    fn free_of(&self, machine: &Machine<f64>, effects: &[EffectId], experiments: &[Experiment]) -> Vec<Free> {
        // Limits are around the motor as given, however far the model has come.
        let mut free = base_parameters_in(&self.base, experiments);
        for &e in effects {
            free.extend(effect_parameters_in(e, machine, &self.rating, experiments));
        }
        let fixed_to_shaft = effects.iter().any(|e| e.about().fixed_to_shaft);
        free.extend(start_parameters(experiments, &self.rating, fixed_to_shaft));
        knowing(free, &self.case.motor.known)
    }

    /// Fits `effects` from `machine` and the training recordings' `starts`.
    pub fn model(
        &self,
        machine: &Machine<f64>,
        starts: &[State<f64>],
        effects: &[EffectId],
        options: &FitOptions,
    ) -> Result<Model, FitError> {
        let fit = self.fit_to(&self.nudged, machine, starts, effects, options)?.with_likely_spreads(|e| self.least_spread(e))?;
        Ok(self.weighed(fit, effects))
    }

    /// Fits effects from where they explain the currents on the measured speed, with what is known of the shaft from the base model.
    pub fn model_by_currents(
        &self,
        base: &Model,
        machine: &Machine<f64>,
        starts: &[State<f64>],
        effects: &[EffectId],
    ) -> Option<Model> {
        let of_shaft = [BaseParameter::Inertia, BaseParameter::ViscousFriction].map(ParameterId::Base);
        let machine = machine.with(&of_shaft.map(|id| (id, base.fit.machine.get(id)))).ok()?;
        let turned = |(x, by): (&State<f64>, &State<f64>)| State { theta_m: by.theta_m, ..*x };
        let starts: Vec<State<f64>> = base.fit.starts.iter().zip(starts).map(turned).collect();
        self.model(&machine, &starts, effects, &FitOptions::near()).ok()
    }

    /// The likelihood of a fit, and what it makes of the held-out recording.
    fn weighed(&self, mut fit: Fit, effects: &[EffectId]) -> Model {
        // A search keeps models by the hundred; what one leaves can be had again.
        let left = std::mem::take(&mut fit.residuals);
        let by_training = || deviance(&self.nudged, &left) + fit.prior_cost;
        let effects = effects.to_vec();
        let Some(h) = &self.held_out else {
            let train_deviance = by_training();
            return Model { effects, deviance: train_deviance, train_deviance, fit, holdout: None, holdout_start: None };
        };
        let of_held_out = || {
            let start = start_on(&fit.machine, h, &self.rating);
            (residuals(&fit.machine, h, &start), start)
        };
        let (train_deviance, (mut unseen, start)) = rayon::join(by_training, of_held_out);
        // A model may run away on what it was not fitted to: that is a large error, and no infinite one.
        unseen.iter_mut().flatten().for_each(|r| *r = if r.is_nan() { RAN_AWAY } else { r.clamp(-RAN_AWAY, RAN_AWAY) });
        let holdout = Some(unseen.iter().flatten().map(|r| r * r).sum::<f64>() / h.count() as f64);
        let all: Vec<&Experiment> = self.nudged.iter().chain([h]).collect();
        let both: Vec<&Vec<Vec<f64>>> = left.iter().chain([&unseen]).collect();
        // What is known beforehand is part of both.
        let deviance = deviance(&all, &both) + fit.prior_cost;
        Model { effects, deviance, train_deviance, fit, holdout, holdout_start: Some(start) }
    }

    /// A learned curve is not taken to be smaller before the data than the least usual size.
    fn least_spread(&self, e: EffectId) -> f64 {
        let info = &e.parameters()[0];
        0.1 * info.typical.0 * self.unit_of(info.scale)
    }

    /// More effects to consider: of `more`, those few that promise most beside the effects of any of some sets are tried.
    pub fn consider(&mut self, more: &[EffectId], sets: &mut Sets, beside: &[&[EffectId]]) {
        self.candidates.extend(more);
        let scores_at = |effects: &&[EffectId]| {
            let fit = &sets.model(effects)?.fit;
            let context = ScoreContext::new(&fit.machine, &fit.starts, &self.nudged, &self.rating, &fit.free, self.level());
            Some(more.par_iter().filter_map(|&e| context.score(e, None)).collect())
        };
        let scores: Vec<Vec<Score>> = beside.iter().map(|effects| scores_at(effects).unwrap_or_default()).collect();
        let promise = |e: &EffectId| scores.iter().flatten().filter(|s| s.effect == *e).map(|s| s.gain).fold(0.0, f64::max);
        let mut ranked = more.to_vec();
        ranked.sort_by(|a, b| promise(b).total_cmp(&promise(a)));
        let (tried, set_aside) = ranked.split_at(NOMINATED.min(ranked.len()));
        for (effects, scores) in beside.iter().zip(scores) {
            sets.add_scores(effects, scores.into_iter().filter(|s| tried.contains(&s.effect)));
        }
        self.set_aside.extend(set_aside);
    }

    /// Considers some effects no longer.
    pub fn forget(&mut self, some: &[EffectId]) {
        self.candidates.retain(|e| !some.contains(e));
        self.set_aside.retain(|e| !some.contains(e));
    }

    /// The likelihood of a model with the errors of its form as unknowns, where a sample counts 1/λ.
    fn marginal(&self, model: &Model, lambda: f64) -> f64 {
        let fit = &model.fit;
        let all: Vec<Experiment> = self.nudged.iter().chain(&self.held_out).cloned().collect();
        let starts: Vec<State<f64>> = fit.starts.iter().chain(&model.holdout_start).copied().collect();
        let free = self.free(&fit.machine, &model.effects, &all);
        marginal(&fit.machine, &starts, &all, &free, self.case.motor.leakage_ratio_std(), lambda)
    }

    /// Scores of all candidates not yet in the model, best first: those that are known at it, and the others; scores elsewhere save these
    /// looking for sizes.
    fn scores(&self, model: &Model, known: &[Score], elsewhere: &[Score]) -> Vec<Score> {
        let fit = &model.fit;
        let is_known = |e: &EffectId| known.iter().any(|s| s.effect == *e);
        let there = |e: &EffectId| model.effects.contains(e) || fit.machine.effects().is_on(*e);
        let open = |e: &&EffectId| !there(e) && !self.set_aside.contains(e) && !is_known(e);
        let open: Vec<EffectId> = self.candidates.iter().filter(open).copied().collect();
        let mut scores = known.to_vec();
        if !open.is_empty() {
            let context = ScoreContext::new(&fit.machine, &fit.starts, &self.nudged, &self.rating, &fit.free, self.level());
            let context = context.replacing(&model.effects, &fit.free);
            let score = |e: EffectId| context.score(e, elsewhere.iter().find(|s| s.effect == e));
            scores.extend(open.into_par_iter().filter_map(score).collect::<Vec<_>>());
        }
        scores.sort_by(|a, b| b.log_p.total_cmp(&a.log_p).then(b.score.total_cmp(&a.score)));
        scores
    }

    /// The score of an effect at a machine with others, which need not be fitted.
    fn score_beside(
        &self,
        machine: &Machine<f64>,
        starts: &[State<f64>],
        others: &[EffectId],
        effect: EffectId,
    ) -> Option<Score> {
        let free = self.free(machine, others, &self.nudged);
        ScoreContext::new(machine, starts, &self.nudged, &self.rating, &free, self.level()).score(effect, None)
    }

    /// Chance of a false alarm per candidate.
    fn level(&self) -> f64 {
        self.options.significance.get() / self.candidates.len().max(1) as f64
    }

    /// Holm: effects whose null hypothesis falls, with `scores` sorted best first.
    pub fn significant(&self, scores: &[Score]) -> Vec<EffectId> {
        let m = scores.len();
        scores
            .iter()
            .enumerate()
            .take_while(|(k, s)| s.log_p > -(self.options.significance.get() / (m - k) as f64).log10())
            .map(|(_, s)| s.effect)
            .collect()
    }

    /// Machines with the effect at the size predicted, within reason, at each shape that is worth a start; and how the training recordings
    /// start with it.
    fn seeded(&self, machine: &Machine<f64>, starts: &[State<f64>], score: &Score) -> Vec<(Machine<f64>, Vec<State<f64>>)> {
        score.seeds.iter().filter_map(|seed| self.seeded_at(machine, starts, score.effect, seed)).collect()
    }

    fn seeded_at(
        &self,
        machine: &Machine<f64>,
        starts: &[State<f64>],
        e: EffectId,
        seed: &Seed,
    ) -> Option<(Machine<f64>, Vec<State<f64>>)> {
        let unit = |k: usize| self.rating.unit_of(e.parameters()[k].scale, machine.parameters(), machine.pole_pairs());
        let mut set: Vec<(ParameterId, f64)> = seed.shape.iter().map(|&(k, v)| (ParameterId::Effect(e, k), v)).collect();
        let mut largest: f64 = 0.0;
        for (&k, &size) in strengths(e).iter().zip(&seed.predicted) {
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
        Some(self.turned(machine, with, starts, e))
    }

    /// The machine of the motor file.
    fn given(&self) -> &Machine<f64> {
        &self.case.motor.machine
    }

    /// From where to fit a machine with an effect of usual size more.
    fn usual(&self, machine: &Machine<f64>, starts: &[State<f64>], e: EffectId) -> Option<(Machine<f64>, Vec<State<f64>>)> {
        let motor = MotorFile { machine: *machine, ..self.case.motor.clone() };
        Some(self.turned(machine, motor.with_usual(e).ok()?.machine, starts, e))
    }

    /// A machine with one effect more, the shaft at its likeliest angles.
    fn turned(
        &self,
        before: &Machine<f64>,
        with: Machine<f64>,
        starts: &[State<f64>],
        e: EffectId,
    ) -> (Machine<f64>, Vec<State<f64>>) {
        let turned = |(e, x): (&Experiment, &State<f64>)| State { theta_m: angle_on(&with, e, x), ..*x };
        let first_fixed = e.about().fixed_to_shaft && !before.effects().any_fixed_to_shaft();
        let starts = if first_fixed { self.nudged.iter().zip(starts).map(turned).collect() } else { starts.to_vec() };
        (with, starts)
    }

    /// Whether every strength that the score predicts has a sign that the effect can have.
    pub fn possible(&self, effect: EffectId, predicted: &[f64]) -> bool {
        // How large it is predicted is another matter: slopes may lead too far.
        let may_be_negative = |k: usize| {
            let info = &effect.parameters()[k];
            info.bound.check("", -0.1 * info.typical.0 * self.unit_of(info.scale)).is_ok()
        };
        strengths(effect).iter().zip(predicted).all(|(&k, x)| *x >= 0.0 || may_be_negative(k))
    }

    /// The machine with an effect switched off.
    fn without(&self, machine: &Machine<f64>, effect: EffectId) -> Option<Machine<f64>> {
        machine.without([effect]).and_then(|m| m.rescaled(&self.rating)).ok()
    }
}
