//! The course: which effect is added, held, exchanged, or a rival.

use im_identify::offline::{FitError, FitOptions};
use im_model::EffectId;
use rayon::prelude::*;

use super::score::Score;
use super::{Model, NEGLIGIBLE, Refinement};
use crate::statistics::cosine;

/// By how much −2 log L must speak for a model in place of another: one in a hundred and fifty.
const LIKELIER: f64 = 10.0;

/// Parameters that a held effect counts for: all that any of the library has.
const HELD: usize = 4;

/// A model that leaves less than this share of the excess explains nearly all of it.
const NEARLY_ALL: f64 = 0.25;

/// Up to this cosine between their signatures, effects are of different kinds: one does not pass for a correction of the other's form.
const UNLIKE: f64 = 0.4;

/// Why a candidate is not added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The likelihood gains less than chance over the candidates would.
    NotLikelier,
    /// It takes too little off the error: it may only correct the form of another effect.
    GainsTooLittle,
    /// The held-out recording gains much less than the training recordings.
    NotOnHoldout,
}

/// How a candidate fared in a round.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The effect tried.
    pub effect: EffectId,
    /// The model with it.
    pub model: Model,
    /// Why it could not be added; `None` where it could.
    pub refusal: Option<Refusal>,
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

/// A model of the course, and what was tried beyond it.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The model: the refitted base model, or one with an effect more than the stage before.
    pub model: Model,
    /// The round that began with it.
    pub round: Round,
    /// Effects that explain the data as well in the place of its newest one.
    pub rivals: Vec<EffectId>,
}

/// The course of the loop: never empty.
#[derive(Clone, Debug)]
pub struct Course {
    /// The base model, and a stage for each addition that was kept.
    pub stages: Vec<Stage>,
}

impl Course {
    /// The stage of the base model.
    pub fn first(&self) -> &Stage {
        &self.stages[0]
    }

    /// The stage of the final model.
    pub fn last(&self) -> &Stage {
        &self.stages[self.stages.len() - 1]
    }

    /// For every effect of the final model, its rivals.
    pub fn alternatives(&self) -> Vec<Vec<EffectId>> {
        self.stages[1..].iter().map(|s| s.rivals.clone()).collect()
    }
}

impl Refinement {
    /// Why the training recordings do not speak for the newest effect of `after`, if they do not.
    fn refusal(&self, base: &Model, before: &Model, after: &Model, first: &[Score]) -> Option<Refusal> {
        let alike = after.effects.last().map_or(0.0, |&newest| alike(newest, &before.effects, first));
        let (left, taken) = (after.train() - 1.0, before.train() - after.train());
        // What takes a good part off a good deal that is left is more than a correction to the form of another effect …
        let ample = before.train() - 1.0 > NEGLIGIBLE && taken > self.options.ample_cut * (before.train() - 1.0);
        let own_share = if ample { 0.0 } else { self.options.least_share };
        // … unless it looks like that effect, and leaves more than noise.
        let likeness = if down_to_noise(before, after) { 0.0 } else { (alike.powi(4) - UNLIKE.powi(4)).max(0.0) };
        let share = own_share + self.options.alike_share * likeness;
        let least = (self.options.least_gain * after.train())
            .max(self.options.least_cut * left)
            .max(share * (base.train() - after.train()));
        if !likelier(before, after, self.candidates.len()) {
            return Some(Refusal::NotLikelier);
        }
        (taken <= least).then_some(Refusal::GainsTooLittle)
    }

    /// Whether the held-out recording gains a fair part of what the training recordings gained, absolutely or, where it missed less to
    /// begin with, in proportion.
    fn validated(&self, before: &Model, after: &Model) -> bool {
        let (Some(b), Some(a)) = (before.holdout, after.holdout) else { return true };
        let scale = ((b - 1.0) / (before.train() - 1.0).max(1e-9)).clamp(0.0, 1.0);
        b - a > 0.2 * scale * (before.train() - after.train()).max(0.0)
    }

    /// The whole course from the base model.
    pub fn run(&self, base: Model) -> Result<Course, FitError> {
        let (mut models, mut rounds) = self.grown(vec![base], Vec::new(), None)?;
        if let Some((place, other)) = self.look_alike(&models, &rounds) {
            let mut start = models[..=place].to_vec();
            start.push(self.model(&other.fit.machine, &other.fit.starts, &other.effects, &FitOptions::near())?);
            let (instead, its_rounds) =
                self.grown(start, rounds[..=place].to_vec(), models[place + 1].effects.last().copied())?;
            let (last, new) = (&models[models.len() - 1], &instead[instead.len() - 1]);
            if left(last, new) < 0.5 && self.information(new) < self.information(last) - LIKELIER {
                (models, rounds) = (instead, its_rounds);
            }
        }
        while let Some(place) = self.not_wanted(&models, &rounds) {
            models = self.dropped(&models, place)?;
            rounds.remove(place + 1);
        }
        let mut rivals = self.rivals(&models, &rounds);
        if let Some((place, better)) = self.better(&models[models.len() - 1], &rivals) {
            models = self.exchanged(&models, place, better)?;
            rivals = self.rivals(&models, &rounds);
        }
        let names = rivals.iter().enumerate().map(|(k, all)| all.iter().map(|m| m.effects[k]).collect());
        let of_newest = std::iter::once(Vec::new()).chain(names);
        let stage = |((model, round), rivals)| Stage { model, round, rivals };
        Ok(Course { stages: models.into_iter().zip(rounds).zip(of_newest).map(stage).collect() })
    }

    /// Adds effects, but not the one left out, while they are worth it: the models, and a round for each.
    ///
    /// Where several effects are missing, one of them can hide on the held-out recording what another one gains there: an effect that only
    /// the training recordings speak for stays on probation for one round, and is kept if with the next one both are validated.
    fn grown(
        &self,
        mut models: Vec<Model>,
        mut rounds: Vec<Round>,
        left_out: Option<EffectId>,
    ) -> Result<(Vec<Model>, Vec<Round>), FitError> {
        let mut validated = models.len() - 1;
        // Whether the newest effect is held at a predicted size.
        let mut holding = false;
        loop {
            let here = &models[models.len() - 1];
            let scores = self.scores(here, rounds.last().map_or(&[], |r| &r.scores));
            let significant = self.significant(&scores);
            let leading: Vec<&Score> = scores
                .iter()
                .filter(|s| significant.contains(&s.effect) && self.possible(s) && Some(s.effect) != left_out)
                .take(self.options.leading)
                .collect();
            let mut trials: Vec<Trial> = leading.par_iter().filter_map(|s| self.trial(here, s)).collect();
            trials.sort_by(|a, b| a.model.fit.cost.total_cmp(&b.model.fit.cost));
            let first = rounds.first().map_or(&scores, |r| &r.scores);
            for t in &mut trials {
                let on_holdout = self.validated(&models[validated], &t.model);
                t.refusal =
                    self.refusal(&models[0], here, &t.model, first).or_else(|| (!on_holdout).then_some(Refusal::NotOnHoldout));
            }
            let wanted = |t: &&Trial| matches!(t.refusal, None | Some(Refusal::NotOnHoldout));
            let mut worthwhile = trials.iter().filter(wanted).map(|t| &t.model);
            let good =
                |m: &&Model| self.validated(&models[validated], m) && (!holding || left(&models[validated], m) < NEARLY_ALL);
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
        Ok((models, rounds))
    }

    /// The place of an effect that the final model does as well without: what others explain once they are there would not be added last.
    fn not_wanted(&self, models: &[Model], rounds: &[Round]) -> Option<usize> {
        let (base, last, first) = (models.first()?, models.last()?, &rounds.first()?.scores);
        let wanted = |place: &usize| {
            let effect = last.effects[*place];
            let others: Vec<EffectId> = last.effects.iter().copied().filter(|&e| e != effect).collect();
            let Some(machine) = self.without(&last.fit.machine, effect) else { return true };
            let Ok(without) = self.model(&machine, &last.fit.starts, &others, &FitOptions::near()) else { return true };
            let with = Model { effects: others.into_iter().chain([effect]).collect(), ..last.clone() };
            self.refusal(base, &without, &with, first).is_none()
        };
        // The newest has just been added by the same rule.
        let earlier: Vec<usize> = (0..last.effects.len().saturating_sub(1)).collect();
        earlier.into_par_iter().find_first(|place| !wanted(place))
    }

    /// The models without the effect at `place`, those after it fitted anew.
    fn dropped(&self, models: &[Model], place: usize) -> Result<Vec<Model>, FitError> {
        let mut out = models[..=place].to_vec();
        for m in &models[place + 2..] {
            let effect = m.effects[place];
            let machine = self.without(&m.fit.machine, effect).unwrap_or(m.fit.machine);
            let others: Vec<EffectId> = m.effects.iter().copied().filter(|&e| e != effect).collect();
            out.push(self.model(&machine, &m.fit.starts, &others, &FitOptions::near())?);
        }
        Ok(out)
    }

    /// The refit, at the place of an effect of the final model, of another that looks like it and would explain nearly all that is left.
    ///
    /// Of two missing effects, a third can be the best stand-in that a single one makes, and then keep out what looks like it.
    fn look_alike(&self, models: &[Model], rounds: &[Round]) -> Option<(usize, Model)> {
        let (last, round, first) = (models.last()?, rounds.last()?, &rounds.first()?.scores);
        let explains = |t: &&Trial| {
            left(last, &t.model) < NEARLY_ALL
                && likelier(last, &t.model, self.candidates.len())
                && last.train() - 1.0 > NEGLIGIBLE
        };
        let suspect = round.trials.iter().find(explains)?.effect;
        let likeness = |place: &usize| alike(suspect, &last.effects[*place..=*place], first);
        let place = (0..last.effects.len()).max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
        let there = rounds[place].trials.iter().find(|t| t.effect == suspect)?;
        (likeness(&place) > UNLIKE).then(|| (place, there.model.clone()))
    }

    /// For every effect of the final model: the models with another in its place that leave nearly the same error.
    fn rivals(&self, models: &[Model], rounds: &[Round]) -> Vec<Vec<Model>> {
        let last = &models[models.len() - 1];
        (0..last.effects.len())
            .map(|k| {
                let own = last.effects[k];
                let explained = (models[k].train() - models[k + 1].train()).max(0.0);
                // By itself a rival can lag, the more where what stands in its place also imitates an effect that was added later.
                let lag = if k + 1 < last.effects.len() { 0.8 } else { 0.5 };
                let near = |t: &&Trial| {
                    t.effect != own
                        && !last.effects.contains(&t.effect)
                        && t.model.train() - models[k + 1].train() < lag * explained
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

    /// The Bayesian information criterion of a model, extended for the choice among candidates.
    fn information(&self, m: &Model) -> f64 {
        m.fit.count as f64 * m.train().ln() + penalty(m, m.fit.free.len(), self.candidates.len())
    }

    /// The rival that is likelier than the final model, if one is: it leaves less, or as little with fewer parameters, and the held-out
    /// recording does not speak against it.
    fn better(&self, last: &Model, rivals: &[Vec<Model>]) -> Option<(usize, Model)> {
        let information = |m: &Model| self.information(m);
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

/// What a model leaves of the excess over the noise floor that one before it left, on the training recordings or the held-out one.
fn left(before: &Model, after: &Model) -> f64 {
    let excess = |m: &Model| (m.train().max(m.holdout.unwrap_or(0.0)) - 1.0).max(0.0);
    excess(after) / excess(before).max(1e-9)
}

/// Whether a model leaves nothing but noise where one before it left a good deal, on the training recordings and on a held-out one. The
/// difference between two forms of an effect has a form of its own, and what looks like the effect does not mend it so far.
fn down_to_noise(before: &Model, after: &Model) -> bool {
    let down = |b: f64, a: f64| b - 1.0 > 2.0 * NEGLIGIBLE && a - 1.0 < 0.3 * NEGLIGIBLE;
    let unseen = before.holdout.zip(after.holdout);
    down(before.train(), after.train()) && unseen.is_some_and(|(b, a)| down(b, a))
}

/// Largest cosine between what an effect and one of `others` explained before anything was added.
fn alike(effect: EffectId, others: &[EffectId], first: &[Score]) -> f64 {
    let signature = |e: EffectId| first.iter().find(|s| s.effect == e).map(|s| s.signature.as_slice());
    others.iter().filter_map(|&e| Some(cosine(signature(e)?, signature(effect)?))).fold(0.0, f64::max)
}
