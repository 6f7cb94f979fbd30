//! The search over sets of effects: best first, with every set fitted once, and the probability of each.
//!
//! A set S of k parameters beyond the base model's is judged by
//!
//!   J(S) = (D(S) − D(∅))/λ + k ln(N/λ) + 2 ln C(m, |S|),   p(S) ∝ exp(−J(S)/2)
//!
//! D = −2 log L with coloured noise, over all N samples, the held-out recording's too; m candidates. λ is what a sample counts less for because
//! the forms of the library are never exactly the machine's: see [`Search::dispersion`].

use std::collections::BTreeMap;

use im_identify::offline::{Experiment, FitError, FitOptions, Target, Transform};
use im_model::effects::Role;
use im_model::{Bound, EffectId, Machine, ParameterId, State};
use rayon::prelude::*;
use statrs::function::gamma::ln_gamma;

use super::course::{Course, Refusal, Round, Stage, Trial};
use super::posterior::{Posterior, Weighed};
use super::score::{Instead, Score};
use super::{Model, NO_DOUBT, Refinement, UNEXPLAINED};
use crate::statistics::threshold;

/// Form error that [`form_error`](crate::form_error) does not describe: 10 % of what the effects explain, spread over twenty directions. Its
/// square by their number.
const FORM_ERROR: f64 = 0.1 * 0.1 / 20.0;

/// Excess of χ²/N that is explained at least: no machine is exactly the base model.
const LEAST_EXCESS: f64 = 0.1;

/// Sets whose J is larger than the least by more than this are no answer: one in 150.
const WINDOW: f64 = 10.0;

/// Odds at which an effect is named.
const ODDS: f64 = 10.0;

/// How many sets are expanded in vain while the best one leaves what a candidate would explain.
const PATIENCE: usize = 3;

/// In the place of an effect, another may stand that explains at least this part of what it does beside the same others.
const COMPARABLE: f64 = 0.5;

/// A refit may gain more than slopes predict: where they predict this part of what it must gain to be the likeliest, it is tried.
const PREDICTED: f64 = 0.25;

/// Candidates refitted at once, before it is asked which of the others may still be likelier.
const AT_ONCE: usize = 2;

/// Simulations of all recordings that the fits of a search may take; where effects of the library explain what is there, they take 50 to 1500.
const MOST_WORK: f64 = 3000.0;

/// Part of the predicted size of an effect that is little.
const LITTLE: f64 = 0.1;

/// D is taken anew where λ has changed by more than this part.
const SETTLED: f64 = 0.1;

/// The effects of a set, sorted.
type Set = Vec<EffectId>;

/// A set that has been fitted.
struct Known {
    model: Model,
    /// Of a close fit.
    settled: Option<Settled>,
    /// Scores at the model, of those candidates that have been scored there.
    scores: Vec<Score>,
    /// With how many of the candidates the set has been expanded.
    expanded: usize,
}

/// D with the errors of form as unknowns.
#[derive(Clone, Copy)]
struct Settled {
    deviance: f64,
    /// When D was taken.
    lambda: f64,
}

impl Known {
    fn new(model: Model) -> Self {
        Self { model, settled: None, scores: Vec::new(), expanded: 0 }
    }

    /// What errors of form take of D, if that is known.
    fn taken(&self) -> Option<f64> {
        self.settled.map(|s| self.model.deviance - s.deviance)
    }
}

/// The sets that a search has fitted: with more candidates it goes on from there.
pub struct Sets {
    known: BTreeMap<Set, Known>,
    each_tried: bool,
    cut_short: bool,
}

impl Sets {
    /// The base model alone.
    pub fn of(base: Model) -> Self {
        let known = Known::new(base.clone());
        Self { known: BTreeMap::from([(Set::new(), known)]), each_tried: false, cut_short: false }
    }

    /// The model with such effects, if it has been fitted.
    pub fn model(&self, effects: &[EffectId]) -> Option<&Model> {
        self.known.get(&sorted(effects)).map(|k| &k.model)
    }

    /// Takes more scores at the model with such effects.
    pub fn add_scores(&mut self, effects: &[EffectId], scores: impl IntoIterator<Item = Score>) {
        if let Some(known) = self.known.get_mut(&sorted(effects)) {
            known.scores.extend(scores);
        }
    }
}

/// What a search answers.
pub struct Answer {
    /// The likeliest set.
    pub effects: Vec<EffectId>,
    /// Those in whose place one of its curves of no known form explains at least half as much.
    pub imitators: Vec<EffectId>,
}

/// From where to fit a set.
struct Proposal {
    effects: Vec<EffectId>,
    starts: Vec<(Machine<f64>, Vec<State<f64>>)>,
}

/// The search.
struct Search<'a> {
    loop_: &'a Refinement,
    known: BTreeMap<Set, Known>,
    /// Whether each effect has been fitted beside nothing.
    each_tried: bool,
    /// Simulations of all recordings that its fits have taken.
    spent: f64,
    /// It ended at its bound of work.
    cut_short: bool,
}

fn sorted(effects: &[EffectId]) -> Set {
    let mut set = effects.to_vec();
    set.sort_unstable();
    set
}

fn without(effects: &[EffectId], one: EffectId) -> Vec<EffectId> {
    effects.iter().copied().filter(|&e| e != one).collect()
}

fn with(effects: &[EffectId], one: EffectId) -> Vec<EffectId> {
    effects.iter().copied().chain([one]).collect()
}

/// λ of a model that explains nothing, for so many samples: a sample never counts for more.
pub(super) fn least_dispersion(samples: f64) -> f64 {
    dispersion(samples, 0.0)
}

/// λ, where effects explain so much of χ²/N.
fn dispersion(samples: f64, explained: f64) -> f64 {
    1.0 + samples * FORM_ERROR * (explained + LEAST_EXCESS)
}

/// The machine of a model with each other whole number of its effects, such as the phase without a sensor.
fn with_other_numbers(model: &Model) -> Vec<Machine<f64>> {
    let machine = &model.fit.machine;
    let of = |&e: &EffectId| e.parameters().iter().enumerate().map(move |(k, info)| (ParameterId::Effect(e, k), info));
    let numbers = model.effects.iter().flat_map(of).flat_map(|(id, info)| match (info.role, info.bound) {
        (Role::Order, Bound::Whole(least, most)) => (least..=most).map(|n| (id, f64::from(n))).collect(),
        _ => Vec::new(),
    });
    numbers.filter(|&(id, n)| machine.get(id) != n).filter_map(|change| machine.with(&[change]).ok()).collect()
}

/// ln C(n, k).
fn ln_choose(n: usize, k: usize) -> f64 {
    let ln_factorial = |n: usize| ln_gamma(n as f64 + 1.0);
    ln_factorial(n) - ln_factorial(k) - ln_factorial(n - k)
}

impl Refinement {
    /// Searches on from what is known, with the candidates as they are now.
    pub fn search(&self, sets: Sets) -> Result<Sets, FitError> {
        let mut search = Search { cut_short: false, ..self.over(sets) };
        if search.nothing().settled.is_none() {
            search.settle(&Set::new());
        }
        search.run()?;
        if search.leaves_much() && !search.each_tried {
            search.try_each();
            search.run()?;
        }
        Ok(search.into())
    }

    /// The same, but beside one of the sets only.
    pub fn expanded(&self, sets: Sets, effects: &[EffectId]) -> Sets {
        let mut search = self.over(sets);
        search.expand(&sorted(effects));
        search.into()
    }

    /// The way from the base model to the likeliest set of a search, and the sets with what was fitted on it.
    pub fn course(&self, sets: Sets) -> Result<(Course, Sets), FitError> {
        let mut search = self.over(sets);
        Ok((search.course()?, search.into()))
    }

    /// The likeliest set of a search.
    pub fn answer(&self, sets: Sets) -> Result<Answer, FitError> {
        let mut search = self.over(sets);
        search.polish_answer(|_, _| Vec::new())?;
        let effects = search.answer();
        Ok(Answer { imitators: search.imitators(&effects), effects })
    }

    fn over(&self, sets: Sets) -> Search<'_> {
        Search { loop_: self, known: sets.known, each_tried: sets.each_tried, spent: 0.0, cut_short: sets.cut_short }
    }
}

impl From<Search<'_>> for Sets {
    fn from(search: Search<'_>) -> Self {
        Self { known: search.known, each_tried: search.each_tried, cut_short: search.cut_short }
    }
}

impl Search<'_> {
    /// Expands the likeliest sets, until no other comes near.
    fn run(&mut self) -> Result<(), FitError> {
        let mut in_vain = 0;
        let mut best = self.best();
        while let Some(next) = self.next(in_vain) {
            if self.spent > MOST_WORK {
                self.cut_short = true;
                break;
            }
            if self.polish(&self.best())? || self.polish(&next)? {
                continue;
            }
            self.expand(&next);
            let now = self.best();
            in_vain = if now == best { in_vain + 1 } else { 0 };
            best = now;
        }
        Ok(())
    }

    /// Whether the likeliest set leaves more than a fair part of the base model's excess, and than noise: beyond doubt, the mark of some effect is in it.
    fn leaves_much(&self) -> bool {
        let best = self.best();
        let excess = |error: f64| error - 1.0;
        let before = self.loop_.error_before(self.base().error());
        let much = excess(self.known[&best].model.error()) > UNEXPLAINED * excess(before).max(1.0);
        much && self.known[&best].scores.iter().any(|s| s.log_p > NO_DOUBT)
    }

    /// Far from the data slopes lead nowhere, scores name the wrong effects, and the base model's parameters may have run off: each effect of
    /// the library is fitted beside nothing, from a usual size. A step takes one that explains nothing back to nothing; the others go on.
    fn try_each(&mut self) {
        let base = &self.base().fit;
        let usual = |m: &Machine<f64>, e: EffectId| {
            let start = self.loop_.usual(m, &base.starts, e)?;
            Some(Proposal { effects: vec![e], starts: vec![start] })
        };
        let of_library = || self.loop_.candidates.iter().filter(|e| e.free_form().is_none());
        let step = FitOptions { iterations: 1, ..FitOptions::quick() };
        let begun: Vec<Proposal> = of_library().filter_map(|&e| usual(&base.machine, e)).collect();
        let begun: Vec<Model> = begun.par_iter().filter_map(|p| self.fitted(p, &step)).collect();
        let explains = |m: &&Model| m.deviance < self.base().deviance;
        let led = |m: &Model| Proposal { effects: m.effects.clone(), starts: vec![(m.fit.machine, m.fit.starts.clone())] };
        let mut proposals: Vec<Proposal> = begun.iter().filter(explains).map(led).collect();
        // From the parameters as given, too, where a step does not lead as far.
        if let Some(given) = self.brought_back(self.base()) {
            proposals.extend(of_library().filter_map(|&e| usual(&given, e)));
        }
        self.spent += begun.iter().map(|m| m.fit.work).sum::<f64>();
        self.fit(&proposals);
        self.each_tried = true;
    }

    /// The base model.
    fn nothing(&self) -> &Known {
        &self.known[&Set::new()]
    }

    fn base(&self) -> &Model {
        &self.nothing().model
    }

    /// Scores beside nothing: they save looking for sizes.
    fn hints(&self) -> &[Score] {
        &self.nothing().scores
    }

    /// Samples of all recordings.
    fn samples(&self) -> f64 {
        (self.base().fit.count + self.loop_.held_out.as_ref().map_or(0, |h| h.count())) as f64
    }

    /// λ: the χ² per direction that other errors of form cause, with what the effects of the likeliest model explain, those of the motor file too.
    fn dispersion(&self) -> f64 {
        let n = self.samples();
        let least = self.known.values().map(|k| k.model.deviance).fold(f64::INFINITY, f64::min);
        let most = self.loop_.bare.iter().map(|m| m.deviance).fold(self.base().deviance, f64::max);
        let dispersion = dispersion(n, ((most - least) / n).exp_m1());
        // The few rows of tables would count for less than one sample.
        let of_tables = self.loop_.nudged().iter().all(Experiment::is_table);
        if of_tables { dispersion.min((n * (-2f64).exp()).max(1.0)) } else { dispersion }
    }

    /// k ln(N/λ) + 2 ln C(m, |S|), where no parameter costs less than Akaike's two.
    fn price(&self, model: &Model, dispersion: f64) -> f64 {
        self.price_of(self.more(model), model.effects.len(), dispersion)
    }

    fn price_of(&self, parameters: f64, effects: usize, dispersion: f64) -> f64 {
        parameters * (self.samples() / dispersion).ln().max(2.0) + 2.0 * ln_choose(self.loop_.candidates.len(), effects)
    }

    /// Parameters beyond those of the base model; of a learned curve as many as the data determine.
    fn more(&self, model: &Model) -> f64 {
        (model.fit.effective_parameters() - self.base().fit.effective_parameters()).max(0.0)
    }

    fn criterion(&self, set: &Set, dispersion: f64) -> f64 {
        self.beyond_nothing(set) / dispersion + self.price(&self.known[set].model, dispersion)
    }

    /// D of a set; until it is fitted closely, as low as errors of form may make it: by what they take of a set that shares effects with it and
    /// has at most one that it has not.
    fn deviance(&self, set: &Set) -> f64 {
        let known = &self.known[set];
        let alike = |s: &Set| {
            let shared = s.iter().filter(|e| set.contains(e)).count();
            s.is_empty() || (shared > 0 && s.len() - shared <= 1)
        };
        let taken = || self.known.iter().filter(|(s, _)| alike(s)).filter_map(|(_, k)| k.taken()).fold(0.0, f64::max);
        known.settled.map_or_else(|| known.model.deviance - taken(), |s| s.deviance)
    }

    /// D(S) − D(∅).
    fn beyond_nothing(&self, set: &Set) -> f64 {
        self.deviance(set) - self.deviance(&Set::new())
    }

    /// All sets that may be the answer, likeliest first. Of one effect more than that it is still known what they would explain.
    fn ranked(&self) -> Vec<(&Set, f64)> {
        let dispersion = self.dispersion();
        let small = self.known.keys().filter(|s| s.len() <= self.loop_.options.most_effects);
        let mut all: Vec<(&Set, f64)> = small.map(|s| (s, self.criterion(s, dispersion))).collect();
        all.sort_by(|a, b| a.1.total_cmp(&b.1));
        all
    }

    fn best(&self) -> Set {
        self.ranked()[0].0.clone()
    }

    /// The likeliest set, without effects whose loss leaves a tenth of its probability: an effect is named if the odds are ten to one.
    fn answer(&self) -> Set {
        let ranked = self.ranked();
        let (best, least) = ranked[0];
        let part = |s: &Set| s.iter().all(|e| best.contains(e));
        let near = ranked.iter().filter(|(s, j)| *j < least + 2.0 * ODDS.ln() && part(s));
        near.min_by_key(|(s, _)| s.len()).map_or_else(Set::new, |(s, _)| (*s).clone())
    }

    /// The set to expand next: the likeliest that has not been, if it may be the answer, or if the best leaves what others would explain.
    fn next(&self, in_vain: usize) -> Option<Set> {
        let ranked = self.ranked();
        let (best, least) = ranked[0];
        let (set, j) = ranked.iter().find(|(s, _)| !self.is_expanded(s))?;
        let near = *j < least + WINDOW;
        (near || (in_vain < PATIENCE && !self.complete(best))).then(|| (*set).clone())
    }

    /// Whether a set has been expanded with all candidates.
    fn is_expanded(&self, set: &Set) -> bool {
        self.known[set].expanded == self.loop_.candidates.len()
    }

    /// Whether no candidate could explain what a set leaves, form errors aside.
    fn complete(&self, set: &Set) -> bool {
        let dispersion = self.dispersion();
        let explains = |s: &Score| s.score / dispersion >= threshold(s.freedom, self.loop_.level());
        self.is_expanded(set) && !self.known[set].scores.iter().any(explains)
    }

    /// The scores of all candidates at the model of a set, best first.
    fn scores(&self, set: &Set) -> Vec<Score> {
        let known = &self.known[set];
        if self.is_expanded(set) { known.scores.clone() } else { self.loop_.scores(&known.model, &known.scores, self.hints()) }
    }

    /// Fits a set closely, and takes D with λ as it is now; whether that was new.
    fn polish(&mut self, set: &Set) -> Result<bool, FitError> {
        let known = &self.known[set];
        match known.settled {
            Some(then) if (self.dispersion() / then.lambda).ln().abs() < SETTLED => return Ok(false),
            Some(_) => {}
            None => {
                let m = &known.model;
                let model = self.loop_.model(&m.fit.machine, &m.fit.starts, &m.effects, &FitOptions::near())?;
                self.spent += model.fit.work;
                if model.deviance <= m.deviance
                    && let Some(known) = self.known.get_mut(set)
                {
                    known.model = model;
                }
            }
        }
        self.settle(set);
        Ok(true)
    }

    /// Takes D of a closely fitted set with the errors of its form as unknowns.
    fn settle(&mut self, set: &Set) {
        let lambda = self.dispersion();
        let deviance = self.loop_.marginal(&self.known[set].model, lambda);
        if let Some(k) = self.known.get_mut(set) {
            k.settled = Some(Settled { deviance, lambda });
        }
    }

    /// Scores what could be added to a set, and fits its neighbours: one effect less, one exchanged, one more; where it has been expanded
    /// before, more of the candidates that it was not expanded with.
    fn expand(&mut self, set: &Set) {
        let model = self.known[set].model.clone();
        let before = self.known[set].expanded;
        let scores = self.scores(set);
        let mut others = self.removals(&model);
        others.extend(self.exchanges(&model, &scores));
        if before == 0 {
            others.extend(self.restarts(&model));
        }
        self.fit(&others);
        for leading in self.leading(&model, &scores, before).chunks(AT_ONCE) {
            let still = leading.iter().filter(|s| self.may_be_likeliest(set, s));
            let additions: Vec<Proposal> = still.filter_map(|s| self.addition(&model, s, 1.0)).collect();
            self.fit(&additions);
            // An effect more never explains less: what ended so is fitted again from a size that changes little.
            let lost =
                leading.iter().filter(|s| self.known.get(&sorted(&with(set, s.effect))).is_some_and(|k| self.is_lost(&model, k)));
            let again: Vec<Proposal> = lost.filter_map(|s| self.addition(&model, s, LITTLE)).collect();
            self.fit(&again);
        }
        if let Some(known) = self.known.get_mut(set) {
            (known.scores, known.expanded) = (scores, self.loop_.candidates.len());
        }
    }

    /// Fits sets quickly, and keeps what is new or better. One that has not arrived where a part of it is better is fitted on.
    fn fit(&mut self, proposals: &[Proposal]) {
        let fitted: Vec<Model> = proposals.par_iter().filter_map(|p| self.fitted(p, &FitOptions::quick())).collect();
        let (lost, rest): (Vec<Model>, Vec<Model>) = fitted.into_iter().partition(|m| !m.fit.converged && self.is_behind(m));
        let on = |m: &Model| Proposal { effects: m.effects.clone(), starts: vec![(m.fit.machine, m.fit.starts.clone())] };
        let on: Vec<Model> = lost.par_iter().filter_map(|m| self.fitted(&on(m), &FitOptions::quick())).collect();
        lost.into_iter().chain(rest).chain(on).for_each(|m| self.keep(m));
    }

    /// Whether the set without one of its effects explains more.
    fn is_behind(&self, model: &Model) -> bool {
        let parts = model.effects.iter().filter_map(|&e| self.known.get(&sorted(&without(&model.effects, e))));
        parts.into_iter().any(|part| part.model.train_deviance < model.train_deviance)
    }

    /// Keeps a fit that is the first of its set, or the best.
    fn keep(&mut self, model: Model) {
        self.spent += model.fit.work;
        let set = sorted(&model.effects);
        if self.known.get(&set).is_none_or(|k| model.deviance < k.model.deviance - WINDOW) {
            self.known.insert(set, Known::new(model));
        }
    }

    fn unknown(&self, effects: &[EffectId]) -> bool {
        !self.known.contains_key(&sorted(effects))
    }

    /// Whether a set of one effect more than a model has not been fitted, or ended where the model without that effect is better: another minimum
    /// must be near the model.
    fn unsettled(&self, part: &Model, effects: &[EffectId]) -> bool {
        self.known.get(&sorted(effects)).is_none_or(|k| self.is_lost(part, k))
    }

    /// Whether a set ended in a minimum where one of its parts is better.
    fn is_lost(&self, part: &Model, set: &Known) -> bool {
        set.model.train_deviance > part.train_deviance
    }

    /// The candidates with the largest gains, as the slopes predict them, but for the first few.
    fn leading<'s>(&self, model: &Model, scores: &'s [Score], but: usize) -> Vec<&'s Score> {
        let candidates = &self.loop_.candidates[but..];
        let open = |s: &&Score| candidates.contains(&s.effect) && s.is_excited() && self.loop_.possible(s.effect, &s.predicted);
        let new = |s: &&Score| open(s) && self.unsettled(model, &with(&model.effects, s.effect));
        let mut leading: Vec<&Score> = scores.iter().filter(new).collect();
        leading.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        leading.truncate(self.loop_.options.leading);
        leading
    }

    /// Whether a set with one effect more may become the likeliest, if a refit gains more than the slopes predict.
    fn may_be_likeliest(&self, set: &Set, score: &Score) -> bool {
        let dispersion = self.dispersion();
        let known = &self.known[set];
        let price = self.price_of(self.more(&known.model) + score.freedom as f64, set.len() + 1, dispersion);
        let deviance = self.beyond_nothing(set) - score.gain / PREDICTED;
        deviance / dispersion + price < self.ranked()[0].1
    }

    /// A model with an effect more, from a part of the size predicted. No descent moves a whole number, and what is right beside one effect less may
    /// be wrong beside it: all are tried.
    fn addition(&self, model: &Model, score: &Score, part: f64) -> Option<Proposal> {
        let machines = std::iter::once(model.fit.machine).chain(with_other_numbers(model));
        self.proposal(model, machines, with(&model.effects, score.effect), &score.smaller(part))
    }

    fn proposal(
        &self,
        model: &Model,
        machines: impl IntoIterator<Item = Machine<f64>>,
        effects: Vec<EffectId>,
        score: &Score,
    ) -> Option<Proposal> {
        let seeded = |m| self.loop_.seeded(&m, &model.fit.starts, score);
        let starts: Vec<_> = machines.into_iter().flat_map(seeded).collect();
        (!starts.is_empty()).then_some(Proposal { effects, starts })
    }

    fn removals(&self, model: &Model) -> Vec<Proposal> {
        let rest = model.effects.iter().map(|&e| (e, without(&model.effects, e)));
        let rest = rest.filter(|(_, effects)| self.unknown(effects));
        rest.filter_map(|(e, effects)| {
            let machine = self.loop_.without(&model.fit.machine, e)?;
            Some(Proposal { effects, starts: vec![(machine, model.fit.starts.clone())] })
        })
        .collect()
    }

    /// Others that would explain a comparable part of what one of the model's effects does.
    fn exchanges(&self, model: &Model, scores: &[Score]) -> Vec<Proposal> {
        let exchange = |s: &Score, i: &Instead| {
            let effects = with(&without(&model.effects, i.of), s.effect);
            let wanted = i.part > COMPARABLE && self.unknown(&effects) && self.loop_.possible(s.effect, &i.seed.predicted);
            let rest = self.loop_.without(&model.fit.machine, i.of).filter(|_| wanted)?;
            let start = self.loop_.seeded_at(&rest, &model.fit.starts, s.effect, &i.seed)?;
            Some(Proposal { effects, starts: vec![start] })
        };
        scores.iter().flat_map(|s| s.instead.iter().filter_map(move |i| exchange(s, i))).collect()
    }

    /// The same set from other shapes of its resonances, from other whole numbers, and where its base parameters have run off, from those given:
    /// each may lead to another minimum.
    fn restarts(&self, model: &Model) -> Vec<Proposal> {
        let others = with_other_numbers(model).into_iter().chain(self.brought_back(model));
        let others = others.map(|m| (m, model.fit.starts.clone())).collect::<Vec<_>>();
        let others = (!others.is_empty()).then(|| Proposal { effects: model.effects.clone(), starts: others });
        let resonant = model.effects.iter().filter(|e| e.about().resonant);
        resonant
            .filter_map(|&e| {
                let machine = self.loop_.without(&model.fit.machine, e)?;
                let score = self.loop_.score_beside(&machine, &model.fit.starts, &without(&model.effects, e), e)?;
                self.proposal(model, [machine], model.effects.clone(), &score)
            })
            .chain(others)
            .collect()
    }

    /// The machine of a model with the base parameters as given, where they have run off to where slopes lead nowhere.
    fn brought_back(&self, model: &Model) -> Option<Machine<f64>> {
        let (machine, given) = (&model.fit.machine, self.loop_.given());
        let by_factors = model.fit.free.iter().filter(|f| f.transform == Transform::Log);
        let ids = by_factors.flat_map(|f| match &f.target {
            Target::Machine(ids) => ids.as_slice(),
            Target::Initial { .. } => &[],
        });
        let ids: Vec<ParameterId> = ids.copied().filter(|id| matches!(id, ParameterId::Base(_))).collect();
        let far = |id: &ParameterId| (machine.get(*id) / given.get(*id)).ln().abs() > 1.0;
        let back: Vec<(ParameterId, f64)> = ids.iter().map(|id| (*id, given.get(*id))).collect();
        ids.iter().any(far).then(|| machine.with(&back).ok()).flatten()
    }

    /// The fit of a set, the best from all its starts, with the work of all.
    fn fitted(&self, p: &Proposal, options: &FitOptions) -> Option<Model> {
        let fits = p.starts.iter().filter_map(|(machine, starts)| self.loop_.model(machine, starts, &p.effects, options).ok());
        let fits: Vec<Model> = fits.collect();
        let work = fits.iter().map(|m| m.fit.work).sum();
        let mut best = fits.into_iter().min_by(|a, b| a.deviance.total_cmp(&b.deviance))?;
        best.fit.work = work;
        Some(best)
    }

    fn posterior(&self) -> Posterior {
        let ranked = self.ranked();
        let least = ranked[0].1;
        let weights: Vec<f64> = ranked.iter().map(|(_, j)| (-0.5 * (j - least)).exp()).collect();
        let total: f64 = weights.iter().sum();
        let sets: Vec<Weighed> = ranked
            .iter()
            .zip(&weights)
            .map(|((s, _), w)| {
                let model = &self.known[*s].model;
                let deviance = self.beyond_nothing(s);
                Weighed { effects: (*s).clone(), probability: w / total, deviance, parameters: self.more(model) }
            })
            .collect();
        let mut inclusion: BTreeMap<EffectId, f64> = BTreeMap::new();
        for w in &sets {
            for &e in &w.effects {
                *inclusion.entry(e).or_default() += w.probability;
            }
        }
        let mut inclusion: Vec<(EffectId, f64)> = inclusion.into_iter().collect();
        inclusion.sort_by(|a, b| b.1.total_cmp(&a.1));
        Posterior { sets, inclusion, dispersion: self.dispersion() }
    }

    /// The likeliest set, and the way to it: from behind, the effect is last whose loss costs least.
    fn course(&mut self) -> Result<Course, FitError> {
        // On the way back a set may be fitted better, and be the answer itself.
        let way = loop {
            let way = self.way()?;
            if way.last() == Some(&self.answer()) {
                break way;
            }
        };
        let stages = (0..way.len()).map(|k| self.stage(&way, k)).collect();
        Ok(Course { stages, posterior: self.posterior(), cut_short: self.cut_short })
    }

    /// From nothing to the likeliest set, one effect more each time.
    fn way(&mut self) -> Result<Vec<Set>, FitError> {
        self.polish_answer(Self::rivals)?;
        let mut way = vec![self.answer()];
        while let Some(set) = way.last().filter(|s| !s.is_empty()).cloned() {
            self.fit(&self.removals(&self.known[&set].model));
            let rest = set.iter().map(|&e| without(&set, e)).filter(|s| self.known.contains_key(s));
            let before = rest.min_by(|a, b| self.deviance(a).total_cmp(&self.deviance(b)));
            let before = before.unwrap_or_default();
            self.polish(&before)?;
            way.push(before);
        }
        way.reverse();
        Ok(way)
    }

    /// Effects of a set in whose place a curve of the set explains a comparable part of what they do, the rest being the same.
    fn imitators(&mut self, set: &Set) -> Vec<EffectId> {
        let (curves, effects): (Vec<EffectId>, Vec<EffectId>) = set.iter().partition(|e| e.free_form().is_some());
        let mut found: Vec<EffectId> = Vec::new();
        for &curve in &curves {
            let Some(plain) = self.known.get(&without(set, curve)) else { continue };
            self.fit(&self.removals(&plain.model));
            let comparable = |&e: &EffectId| {
                let rest = without(&without(set, curve), e);
                let d = |set: &[EffectId]| self.known.get(&sorted(set)).map(|k| k.model.deviance);
                let gain = |x| Some(d(&rest)? - d(&with(&rest, x))?);
                gain(e).zip(gain(curve)).is_some_and(|(of_effect, of_curve)| of_curve > COMPARABLE * of_effect)
            };
            let imitators: Vec<EffectId> = effects.iter().copied().filter(comparable).collect();
            found.extend(imitators);
        }
        found
    }

    /// Fits closely the likeliest set, the answer and what is asked for beside it, until these are the same: before that D of a set is an
    /// estimate, and no answer.
    fn polish_answer(&mut self, beside: impl Fn(&Self, &Set) -> Vec<Set>) -> Result<(), FitError> {
        loop {
            let (ranked, answer) = (self.ranked(), self.answer());
            let near = ranked.iter().filter(|(_, j)| *j < ranked[0].1 + WINDOW);
            let near: Vec<Set> = near.map(|(s, _)| (*s).clone()).collect();
            let mut new = false;
            for set in beside(self, &answer).into_iter().chain(near).chain([answer]) {
                new |= self.polish(&set)?;
            }
            if !new {
                return Ok(());
            }
        }
    }

    /// Sets that explain the data as well as `best`, their price aside, with another effect in the place of one.
    fn rivals(&self, best: &Set) -> Vec<Set> {
        let (d, dispersion) = (self.deviance(best), self.dispersion());
        let exchanged = |s: &Set| s.len() == best.len() && s.iter().filter(|e| !best.contains(e)).count() == 1;
        let near = self.known.keys().filter(|s| exchanged(s) && self.deviance(s) < d + WINDOW * dispersion);
        near.cloned().collect()
    }

    fn stage(&self, way: &[Set], k: usize) -> Stage {
        let set = &way[k];
        let known = &self.known[set];
        let mut model = known.model.clone();
        let newest = |n: usize| way[n].iter().copied().find(|e| !way[n - 1].contains(e));
        model.effects = (1..=k).filter_map(newest).collect();
        let scores = self.scores(set);
        let tried = scores.iter().filter_map(|s| {
            let with_it = sorted(&with(set, s.effect));
            let tried = self.known.get(&with_it)?;
            Some(Trial { effect: s.effect, model: tried.model.clone(), refusal: self.refusal(set, &with_it) })
        });
        let mut trials: Vec<Trial> = tried.collect();
        trials.sort_by(|a, b| a.model.deviance.total_cmp(&b.model.deviance));
        let best = &way[way.len() - 1];
        let exchanged = |e: EffectId| -> Vec<EffectId> {
            let rest = without(best, e);
            let sets = self.rivals(best).into_iter().filter(|s| rest.iter().all(|x| s.contains(x)));
            sets.filter_map(|s| s.into_iter().find(|x| !best.contains(x))).collect()
        };
        let rivals = (k > 0).then(|| newest(k)).flatten().map(exchanged).unwrap_or_default();
        Stage { model, round: Round { significant: self.loop_.significant(&scores), scores, trials }, rivals }
    }

    /// Why an effect more is not wanted, if it is not.
    fn refusal(&self, before: &Set, after: &Set) -> Option<Refusal> {
        let dispersion = self.dispersion();
        let gain = self.deviance(before) - self.deviance(after);
        let (b, a) = (&self.known[before].model, &self.known[after].model);
        let price = |d| self.price(a, d) - self.price(b, d);
        if gain / dispersion > price(dispersion) {
            None
        } else if (b.train_deviance - a.train_deviance) / dispersion > price(dispersion) && a.unseen() > b.unseen() {
            Some(Refusal::NotOnHoldout)
        } else if b.deviance - a.deviance > price(1.0) {
            Some(Refusal::WithinFormError)
        } else {
            Some(Refusal::NotLikelier)
        }
    }
}
