//! The loop: fit, score, refit the leading candidates, add, drop, swap, validate, decide.

use im_identify::offline::{
    ChannelKind, Experiment, Fit, FitError, FitOptions, Free, angle_on, base_parameters_in, effect_parameters, fit_from,
    residuals, start_on, start_parameters,
};
use im_model::{EffectId, Machine, MotorFile, ParameterId, Rating, State};
use rayon::prelude::*;

use crate::case::Case;
use crate::score::{Score, ScoreContext, cosine, strengths, threshold, whiteners};

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

/// By how much −2 log L must speak for a model in place of another: one in a hundred and fifty.
const LIKELIER: f64 = 10.0;

/// Parameters that a held effect counts for: all that any of the library has.
const HELD: usize = 4;

/// Up to this cosine between their signatures, effects are of different kinds: one does not pass for a correction of the other's form.
const UNLIKE: f64 = 0.4;

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

/// How a candidate fared in a round.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The effect tried.
    pub effect: EffectId,
    /// The model with it.
    pub model: Model,
}

/// One round of the loop.
#[derive(Clone, Debug)]
pub struct Round {
    /// Scores of all candidates, best first.
    pub scores: Vec<Score>,
    /// Effects whose score is significant.
    pub significant: Vec<EffectId>,
    /// Refits of the leading candidates, best first.
    pub trials: Vec<Trial>,
}

/// The course of the loop.
#[derive(Clone, Debug)]
pub struct Course {
    /// The refitted base model and the models after each addition that was kept.
    pub models: Vec<Model>,
    /// The rounds.
    pub rounds: Vec<Round>,
    /// For every effect of the final model, those that explain the data as well in its place.
    pub alternatives: Vec<Vec<EffectId>>,
}

/// Runs the loop on a case.
pub struct Refinement {
    case: Case,
    /// The training recordings with the speed drawn towards the measured one: what is fitted and scored while the model may be wrong.
    pulled: Vec<Experiment>,
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
        // Iron diffuses no faster than the sampling can follow.
        let sampled = case.train.iter().filter(|e| !e.is_table());
        let longest = sampled.map(|e| e.sample_time_s).fold(0.0, f64::max);
        if !effects.is_on(EffectId::IronLoss) {
            effects.iron_loss.diffusion_time_s = effects.iron_loss.diffusion_time_s.max(0.5 * longest);
        }
        let candidates = if options.candidates.is_empty() { effects.ids().collect() } else { options.candidates.clone() };
        let base = machine.with_effects(effects)?;
        case.estimate_noise();
        let mut me = Self { pulled: pulled(&case.train), case, options, rating, base, candidates };
        let starts = me.starts(&me.base, &me.pulled);
        let first = me.model(&me.base, &starts, &[], &FitOptions { tolerance: 1e-5, ..FitOptions::default() })?;
        // The voltage's own roughness shows in the currents: only in the residual is the roughness all noise.
        me.case.set_noise_from(&me.pulled, &first.fit.residuals);
        me.pulled = pulled(&me.case.train);
        let model = me.model(&first.fit.machine, &first.fit.starts, &[], &FitOptions::near())?;
        Ok((me, model))
    }

    /// The states from which `machine` follows experiments best: those known, or fitted to the first second.
    pub fn starts(&self, machine: &Machine<f64>, experiments: &[Experiment]) -> Vec<State<f64>> {
        experiments.par_iter().map(|e| start_on(machine, e, &self.rating)).collect()
    }

    /// Takes the root mean square of a model's residuals as the noise of each channel: right when nothing in them has a cause.
    pub fn set_noise_to_residual(&mut self, fit: &Fit) {
        let sums = crate::diagnosis::errors(&fit.machine, &self.pulled, &fit.starts).rmse;
        let all = self.case.train.iter_mut().chain(&mut self.case.holdout).chain(&mut self.pulled);
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

    /// The training recordings with the speed drawn towards the measured one.
    pub fn pulled(&self) -> &[Experiment] {
        &self.pulled
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

    fn free(&self, machine: &Machine<f64>, effects: &[EffectId], experiments: &[Experiment]) -> Vec<Free> {
        let mut free = base_parameters_in(machine, experiments);
        let own: Vec<EffectId> = self.base.effects().active().collect();
        for &e in own.iter().chain(effects) {
            free.extend(effect_parameters(e, machine, &self.rating));
        }
        let fixed_to_shaft = own.iter().chain(effects).any(|e| e.is_fixed_to_shaft());
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
        let fit = self.fit_to(&self.pulled, machine, starts, effects, options)?;
        let evidence = evidence(&self.pulled, &fit.residuals);
        let holdout = self.case.holdout.as_ref().map(|h| {
            let h = &pulled(std::slice::from_ref(h))[0];
            mean_square(&fit.machine, h, &start_on(&fit.machine, h, &self.rating))
        });
        Ok(Model { effects: effects.to_vec(), fit, evidence, holdout })
    }

    /// Scores of all candidates not yet in the model, best first; those of the round before, if any, save looking for sizes.
    pub fn scores(&self, model: &Model, before: &[Score]) -> Vec<Score> {
        let fit = &model.fit;
        let context = ScoreContext::new(&fit.machine, &fit.starts, &self.pulled, &self.rating, &fit.free);
        let open: Vec<EffectId> = self.candidates.iter().copied().filter(|&e| !fit.machine.effects().is_on(e)).collect();
        let mut scores: Vec<Score> =
            open.par_iter().filter_map(|&e| context.score(e, before.iter().find(|s| s.effect == e))).collect();
        scores.sort_by(|a, b| b.log_p.total_cmp(&a.log_p).then(b.score.total_cmp(&a.score)));
        scores
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
        Some(Trial { effect: score.effect, model: tried })
    }

    /// The model with one more effect held at the size that its score predicts, of the leading ones that for which the residual speaks most.
    ///
    /// Beside another effect that is missing, the least squares of the raw residual can drive an effect to nothing, while the residual as
    /// coloured noise, which is what the scores weigh, is far likelier with it.
    /// What looks like an effect that is there would mend the difference between the form of that and the library's: it is not held.
    fn held(&self, model: &Model, leading: &[&Score], first: &[Score]) -> Option<Model> {
        let rough = FitOptions { iterations: 10, tolerance: 1e-3, horizons: Vec::new() };
        let with = |s: &&Score| {
            let (machine, starts) = self.seeded(&model.fit.machine, &model.fit.starts, s)?;
            let mut held = self.model(&machine, &starts, &model.effects, &rough).ok()?;
            held.effects.push(s.effect);
            Some(held)
        };
        let unlike: Vec<&Score> =
            leading.iter().copied().filter(|s| alike(s.effect, &model.effects, first) < UNLIKE).take(3).collect();
        let all: Vec<Model> = unlike.par_iter().filter_map(with).collect();
        let likelier = all.into_iter().filter(|m| m.evidence < model.evidence - penalty(model, HELD, self.candidates.len()));
        likelier.min_by(|a, b| a.evidence.total_cmp(&b.evidence))
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
        let first_fixed = e.is_fixed_to_shaft() && !machine.effects().any_fixed_to_shaft();
        let starts = if first_fixed { self.pulled.iter().zip(starts).map(turned).collect() } else { starts.to_vec() };
        Some((with, starts))
    }

    /// Whether every strength that the score predicts has a sign that the effect can have.
    pub fn possible(&self, score: &Score) -> bool {
        strengths(score.effect)
            .iter()
            .zip(&score.predicted)
            .all(|(&k, x)| *x >= 0.0 || score.effect.parameters()[k].bound.check("", *x).is_ok())
    }

    /// Whether the training recordings speak for the newest effect of `after`.
    fn worthwhile(&self, base: &Model, before: &Model, after: &Model, first: &[Score]) -> bool {
        let alike = after.effects.last().map_or(0.0, |&newest| alike(newest, &before.effects, first));
        let (left, taken) = (after.train() - 1.0, before.train() - after.train());
        // What takes a good part off a good deal that is left is more than a correction to the form of another effect …
        let ample = before.train() - 1.0 > NEGLIGIBLE && taken > self.options.ample_cut * (before.train() - 1.0);
        let own_share = if ample { 0.0 } else { self.options.least_share };
        // … unless it looks like that effect.
        let share = own_share + self.options.alike_share * (alike.powi(4) - UNLIKE.powi(4)).max(0.0);
        let least = (self.options.least_gain * after.train())
            .max(self.options.least_cut * left)
            .max(share * (base.train() - after.train()));
        likelier(before, after, self.candidates.len()) && taken > least
    }

    /// Whether the held-out recording gains a fair part of what the training recordings gained, absolutely or, where it missed less to
    /// begin with, in proportion.
    fn validated(&self, before: &Model, after: &Model) -> bool {
        let (Some(b), Some(a)) = (before.holdout, after.holdout) else { return true };
        let scale = ((b - 1.0) / (before.train() - 1.0).max(1e-9)).clamp(0.0, 1.0);
        b - a > 0.2 * scale * (before.train() - after.train()).max(0.0)
    }

    /// The whole course from the base model.
    ///
    /// Where several effects are missing, one of them can hide on the held-out recording what another one gains there: an effect that only
    /// the training recordings speak for stays on probation for one round, and is kept if with the next one both are validated.
    pub fn run(&self, base: Model) -> Result<Course, FitError> {
        let mut models = vec![base];
        let mut rounds: Vec<Round> = Vec::new();
        let mut validated = 0;
        // Whether the newest effect is held at a predicted size.
        let mut holding = false;
        loop {
            let here = &models[models.len() - 1];
            let scores = self.scores(here, rounds.last().map_or(&[], |r| &r.scores));
            let significant = self.significant(&scores);
            let leading: Vec<&Score> = scores
                .iter()
                .filter(|s| significant.contains(&s.effect) && self.possible(s))
                .take(self.options.leading)
                .collect();
            let mut trials: Vec<Trial> = leading.par_iter().filter_map(|s| self.trial(here, s)).collect();
            trials.sort_by(|a, b| a.model.fit.cost.total_cmp(&b.model.fit.cost));
            let first = rounds.first().map_or(&scores, |r| &r.scores);
            let mut worthwhile = trials.iter().filter(|t| self.worthwhile(&models[0], here, &t.model, first)).map(|t| &t.model);
            let good = |m: &&Model| self.validated(&models[validated], m) && (!holding || most_of_it(&models[validated], m));
            let confirmed = worthwhile.clone().find(good);
            let sure = confirmed.is_some();
            let alone = validated + 1 == models.len();
            let chosen = confirmed.or_else(|| worthwhile.next().filter(|_| alone)).cloned();
            holding = chosen.is_none();
            let next = match chosen {
                _ if models.len() > self.options.most_effects => None,
                Some(m) => Some(self.model(&m.fit.machine, &m.fit.starts, &m.effects, &FitOptions::near())?),
                None if alone && here.train() - 1.0 > NEGLIGIBLE => self.held(here, &leading, first),
                None => None,
            };
            rounds.push(Round { scores, significant, trials });
            let Some(next) = next else { break };
            models.push(next);
            if sure {
                validated = models.len() - 1;
            }
        }
        models.truncate(validated + 1);
        rounds.truncate(validated + 1);
        let mut rivals = self.rivals(&models, &rounds);
        if let Some((place, better)) = self.better(&models[models.len() - 1], &rivals) {
            models = self.exchanged(&models, place, better)?;
            rivals = self.rivals(&models, &rounds);
        }
        let alternatives = rivals.iter().enumerate().map(|(k, all)| all.iter().map(|m| m.effects[k]).collect()).collect();
        Ok(Course { models, rounds, alternatives })
    }

    /// For every effect of the final model: the models with another in its place that leave nearly the same error.
    fn rivals(&self, models: &[Model], rounds: &[Round]) -> Vec<Vec<Model>> {
        let last = &models[models.len() - 1];
        (0..last.effects.len())
            .map(|k| {
                let own = last.effects[k];
                let explained = (models[k].train() - models[k + 1].train()).max(0.0);
                // By itself a rival can lag, where its place also imitates an effect that was added later.
                let near = |t: &&Trial| {
                    t.effect != own
                        && !last.effects.contains(&t.effect)
                        && t.model.train() - models[k + 1].train() < 0.5 * explained
                };
                let rivals: Vec<&Trial> = rounds[k].trials.iter().filter(near).collect();
                let in_its_place = |t: &&Trial| {
                    let score = rounds[k].scores.iter().find(|s| s.effect == t.effect)?;
                    let without = self.without(&last.fit.machine, own)?;
                    let (seeded, starts) = self.seeded(&without, &last.fit.starts, score)?;
                    let set: Vec<EffectId> = last.effects.iter().map(|&e| if e == own { t.effect } else { e }).collect();
                    let options = FitOptions { iterations: 20, tolerance: 1e-4, horizons: Vec::new() };
                    let m = self.model(&seeded, &starts, &set, &options).ok()?;
                    let worse = m.train() - last.train();
                    (worse < (0.03 * explained).max(12.0 / last.fit.count as f64)).then_some(m)
                };
                rivals.par_iter().filter_map(in_its_place).collect()
            })
            .collect()
    }

    /// The rival that is likelier than the final model, if one is: it leaves less, or as little with fewer parameters, and the held-out
    /// recording does not speak against it.
    fn better(&self, last: &Model, rivals: &[Vec<Model>]) -> Option<(usize, Model)> {
        let n = last.fit.count as f64;
        let information = |m: &Model| n * m.train().ln() + penalty(m, m.fit.free.len(), self.candidates.len());
        let unseen = |m: &Model| m.holdout.unwrap_or(0.0);
        let all = rivals.iter().enumerate().flat_map(|(k, of)| of.iter().map(move |m| (k, m)));
        all.filter(|(_, m)| information(m) < information(last) - LIKELIER && unseen(m) < 1.01 * unseen(last).max(1e-9))
            .min_by(|a, b| information(a.1).total_cmp(&information(b.1)))
            .map(|(k, m)| (k, m.clone()))
    }

    /// The course with the final model exchanged for one with another effect at `place`, and the models on the way to it fitted anew.
    fn exchanged(&self, models: &[Model], place: usize, last: Model) -> Result<Vec<Model>, FitError> {
        let mut out = models[..=place].to_vec();
        for k in place + 1..models.len() - 1 {
            let mut machine = last.fit.machine;
            for &later in &last.effects[k..] {
                machine = self.without(&machine, later).unwrap_or(machine);
            }
            out.push(self.model(&machine, &last.fit.starts, &last.effects[..k], &FitOptions::near())?);
        }
        out.push(self.model(&last.fit.machine, &last.fit.starts, &last.effects, &FitOptions::near())?);
        Ok(out)
    }

    /// The machine with an effect switched off.
    fn without(&self, machine: &Machine<f64>, effect: EffectId) -> Option<Machine<f64>> {
        let mut effects = *machine.effects();
        effects.switch_off(effect);
        effects.rescale(&self.rating, machine.parameters(), machine.pole_pairs());
        machine.with_effects(effects).ok()
    }
}

/// What the evidence of a model must gain for so many parameters more, one of all candidates having been chosen.
fn penalty(model: &Model, parameters: usize, candidates: usize) -> f64 {
    parameters as f64 * (model.fit.count as f64).ln() + 2.0 * (candidates as f64).ln()
}

/// Whether a model with one more effect is likelier than chance would make one of `candidates`.
pub(crate) fn likelier(before: &Model, after: &Model, candidates: usize) -> bool {
    let more = after.fit.free.len().saturating_sub(before.fit.free.len());
    before.evidence - after.evidence > penalty(after, more, candidates)
}

/// Whether a model explains nearly all that one before it left, on the training recordings and on the held-out one.
fn most_of_it(before: &Model, after: &Model) -> bool {
    let excess = |m: &Model| m.train().max(m.holdout.unwrap_or(0.0)) - 1.0;
    excess(after) < 0.25 * excess(before)
}

/// Largest cosine between what an effect and one of `others` explained before anything was added.
fn alike(effect: EffectId, others: &[EffectId], first: &[Score]) -> f64 {
    let signature = |e: EffectId| first.iter().find(|s| s.effect == e).map(|s| s.signature.as_slice());
    others.iter().filter_map(|&e| Some(cosine(signature(e)?, signature(effect)?))).fold(0.0, f64::max)
}

/// Rate at which the speed is drawn to the measured one, 1/s: slower than the electrical transients, faster than pulling out.
const PULL_PER_S: f64 = 30.0;

/// Copies of experiments with the speed drawn towards the measured one, where it is measured.
pub fn pulled(experiments: &[Experiment]) -> Vec<Experiment> {
    experiments
        .iter()
        .map(|e| {
            let speed = e.channels.iter().find(|c| c.kind == ChannelKind::Speed && c.valid.is_none());
            let speed = speed.filter(|_| !e.is_table());
            Experiment { speed_pull: speed.map(|c| (c.values.clone(), PULL_PER_S)), ..e.clone() }
        })
        .collect()
}

/// How much worse a machine may be without help before a recording counts as unstable.
pub const UNSTABLE: f64 = 1.2;

/// A recording as models are judged on it. Voltage replayed without the drive that made it can be unstable (a slow, loaded machine falls
/// out of step on the slightest difference): there, the speed is drawn towards the measured one. Recordings that `machine` can follow
/// unaided, to within `factor` of its aided error, stay unaided.
pub fn judged(e: &Experiment, machine: &Machine<f64>, start: &State<f64>, factor: f64) -> Experiment {
    let aided = pulled(std::slice::from_ref(e)).remove(0);
    let stable = aided.speed_pull.is_none() || mean_square(machine, e, start) <= factor * mean_square(machine, &aided, start);
    if stable { e.clone() } else { aided }
}

/// −2 log L of residuals under an autoregressive noise model per channel, up to a constant.
pub fn evidence(experiments: &[Experiment], residuals: &[Vec<Vec<f64>>]) -> f64 {
    let w = whiteners(experiments, residuals);
    experiments.iter().zip(&w).flat_map(|(e, w)| e.channels.iter().zip(w).map(|(c, w)| c.count() as f64 * w.variance.ln())).sum()
}

/// Mean squared residual of one experiment, in σ².
pub fn mean_square(machine: &Machine<f64>, e: &Experiment, start: &State<f64>) -> f64 {
    residuals(machine, e, start).iter().flatten().map(|r| r * r).sum::<f64>() / e.count() as f64
}

/// The score that is significant for a single candidate among `m`.
pub fn score_threshold(freedom: usize, significance: f64, m: usize) -> f64 {
    threshold(freedom, significance / m as f64)
}
