//! The search over sets of effects: best first, with every set fitted once, and the probability of each.
//!
//! A set S of k parameters beyond the base model's is judged by
//!
//!   J(S) = (D(S) − D(∅))/λ + k ln(N/λ) + 2 ln C(m, |S|),   p(S) ∝ exp(−J(S)/2)
//!
//! D = −2 log L with coloured noise, over all N samples, the held-out recording's too; m candidates. λ is what a sample counts less for because
//! the forms of the library are never exactly the machine's: see [`Search::dispersion`].

use std::collections::BTreeMap;

use im_identify::offline::{Experiment, FitError, FitOptions};
use im_model::EffectId;
use statrs::function::gamma::ln_gamma;

use super::score::Score;
use super::{Model, NO_DOUBT, Refinement, UNEXPLAINED};
use crate::statistics::threshold;

/// Form error that [`form_error`](crate::form_error) does not describe: 10 % of what the effects explain, spread over twenty directions. Its
/// square by their number.
const FORM_ERROR: f64 = 0.1 * 0.1 / 20.0;

/// Excess of χ²/N that is explained at least: no machine is exactly the base model.
const LEAST_EXCESS: f64 = 0.1;

/// Sets whose J is larger than the least by more than this are no answer: one in 150.
pub(super) const WINDOW: f64 = 10.0;

/// Odds at which an effect is named.
const ODDS: f64 = 10.0;

/// How many sets are expanded in vain while the best one leaves what a candidate would explain.
const PATIENCE: usize = 3;

/// In the place of an effect, another may stand that explains at least this part of what it does beside the same others.
pub(super) const COMPARABLE: f64 = 0.5;

/// D is taken anew where λ has changed by more than this part.
const SETTLED: f64 = 0.1;

/// The effects of a set, sorted.
pub(super) type Set = Vec<EffectId>;

/// A set that has been fitted.
pub(super) struct Known {
    pub(super) model: Model,
    /// Of a close fit.
    pub(super) settled: Option<Settled>,
    /// Scores at the model, of those candidates that have been scored there.
    pub(super) scores: Vec<Score>,
    /// With how many of the candidates the set has been expanded.
    pub(super) expanded: usize,
}

/// D with the errors of form as unknowns.
#[derive(Clone, Copy)]
pub(super) struct Settled {
    deviance: f64,
    /// When D was taken.
    lambda: f64,
}

impl Known {
    pub(super) fn new(model: Model) -> Self {
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
    /// The base model, and another that is known beforehand.
    pub fn with(base: Model, suggested: Option<Model>) -> Self {
        let known = [base].into_iter().chain(suggested).map(|m| (sorted(&m.effects), Known::new(m)));
        Self { known: known.collect(), each_tried: false, cut_short: false }
    }

    /// Whether the search ended before it was through.
    pub fn is_cut_short(&self) -> bool {
        self.cut_short
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

/// The search.
pub(super) struct Search<'a> {
    pub(super) loop_: &'a Refinement,
    pub(super) known: BTreeMap<Set, Known>,
    /// Whether each effect has been fitted beside nothing.
    pub(super) each_tried: bool,
    /// Simulations of all recordings that its fits have taken.
    pub(super) spent: f64,
    /// It ended before it was through.
    pub(super) cut_short: bool,
    /// Nothing is left to be explained: [`Refinement::is_below_noise`].
    below_noise: bool,
}

pub(super) fn sorted(effects: &[EffectId]) -> Set {
    let mut set = effects.to_vec();
    set.sort_unstable();
    set
}

pub(crate) fn without(effects: &[EffectId], one: EffectId) -> Vec<EffectId> {
    effects.iter().copied().filter(|&e| e != one).collect()
}

pub(super) fn with(effects: &[EffectId], one: EffectId) -> Vec<EffectId> {
    effects.iter().copied().chain([one]).collect()
}

/// λ where nothing is explained, for so many samples: the least there is.
pub(super) fn least_dispersion(samples: f64) -> f64 {
    dispersion(samples, 0.0)
}

/// λ, where effects explain so much of χ²/N.
fn dispersion(samples: f64, explained: f64) -> f64 {
    1.0 + samples * FORM_ERROR * (explained + LEAST_EXCESS)
}

/// χ² that an effect has to explain of so many samples for the search to tell it from another that can do all of that but this part, the sine
/// squared of the angle between the two: what is left of it, over λ, is beyond the window. Infinite where errors of form may be as large.
pub(crate) fn needed_to_tell_apart(part: f64, samples: f64) -> f64 {
    let beyond_form = part - WINDOW * FORM_ERROR;
    if beyond_form > 0.0 { WINDOW * least_dispersion(samples) / beyond_form } else { f64::INFINITY }
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

    /// The likeliest model of a search.
    pub fn likeliest(&self, sets: Sets) -> Result<(Model, Sets), FitError> {
        let mut search = self.over(sets);
        search.polish_answer(|_, _| Vec::new())?;
        let model = search.known[&search.answer()].model.clone();
        Ok((model, search.into()))
    }

    /// The likeliest set of a search.
    pub fn answer(&self, sets: Sets) -> Result<Answer, FitError> {
        let mut search = self.over(sets);
        search.polish_answer(|_, _| Vec::new())?;
        let effects = search.answer();
        Ok(Answer { imitators: search.imitators(&effects), effects })
    }

    pub(super) fn over(&self, sets: Sets) -> Search<'_> {
        let below_noise = sets.known.get(&Set::new()).is_some_and(|k| self.is_below_noise(&k.model));
        Search { loop_: self, below_noise, known: sets.known, each_tried: sets.each_tried, spent: 0.0, cut_short: sets.cut_short }
    }
}

impl From<Search<'_>> for Sets {
    fn from(search: Search<'_>) -> Self {
        Self { known: search.known, each_tried: search.each_tried, cut_short: search.cut_short }
    }
}

impl Search<'_> {
    /// Expands the likeliest sets, until no other comes near. Where the library explains little, what it adds to that only imitates: the search
    /// ends, as it does at its bound of work.
    fn run(&mut self) -> Result<(), FitError> {
        let mut in_vain = 0;
        let mut best = self.best();
        while let Some(next) = self.next(in_vain) {
            if self.spent > self.loop_.options.most_work || (in_vain >= PATIENCE && self.is_far(&best)) {
                self.cut_short = true;
                break;
            }
            if self.polish(&self.best())? || self.polish(&next)? {
                continue;
            }
            let before = self.least_excess();
            self.expand(&next);
            let now = self.best();
            let led_on = if self.is_far(&now) { self.least_excess() < (1.0 - UNEXPLAINED) * before } else { now != best };
            in_vain = if led_on { 0 } else { in_vain + 1 };
            best = now;
        }
        Ok(())
    }

    /// What the set that leaves least leaves.
    fn least_excess(&self) -> f64 {
        self.known.keys().map(|s| self.excess(s)).fold(f64::INFINITY, f64::min)
    }

    /// Whether the likeliest set leaves more than a fair part of the base model's excess, and than noise: beyond doubt, the mark of some effect is in it.
    fn leaves_much(&self) -> bool {
        let best = self.best();
        self.is_far(&best) && self.known[&best].scores.iter().any(|s| s.log_p > NO_DOUBT)
    }

    /// What a set leaves of χ²/N above noise, the larger of training and held-out recordings.
    fn excess(&self, set: &Set) -> f64 {
        self.known[set].model.error() - 1.0
    }

    /// Whether a set leaves more than a fair part of the base model's excess.
    fn is_far(&self, set: &Set) -> bool {
        let before = self.loop_.error_before(self.base().error()) - 1.0;
        self.excess(set) > UNEXPLAINED * before.max(1.0)
    }

    /// The base model.
    fn nothing(&self) -> &Known {
        &self.known[&Set::new()]
    }

    pub(super) fn base(&self) -> &Model {
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
    pub(super) fn dispersion(&self) -> f64 {
        let n = self.samples();
        let least = self.known.values().map(|k| k.model.deviance).fold(f64::INFINITY, f64::min);
        let most = self.loop_.bare.iter().map(|m| m.deviance).fold(self.base().deviance, f64::max);
        let dispersion = dispersion(n, ((most - least) / n).exp_m1());
        // The few rows of tables would count for less than one sample.
        let of_tables = self.loop_.nudged().iter().all(Experiment::is_table);
        if of_tables { dispersion.min((n * (-2f64).exp()).max(1.0)) } else { dispersion }
    }

    /// k ln(N/λ) + 2 ln C(m, |S|), where no parameter costs less than Akaike's two.
    pub(super) fn price(&self, model: &Model, dispersion: f64) -> f64 {
        self.price_of(self.more(model), model.effects.len(), dispersion)
    }

    pub(super) fn price_of(&self, parameters: f64, effects: usize, dispersion: f64) -> f64 {
        parameters * (self.samples() / dispersion).ln().max(2.0) + 2.0 * ln_choose(self.loop_.candidates.len(), effects)
    }

    /// Parameters beyond those of the base model; of a learned curve as many as the data determine.
    pub(super) fn more(&self, model: &Model) -> f64 {
        (model.fit.effective_parameters() - self.base().fit.effective_parameters()).max(0.0)
    }

    fn criterion(&self, set: &Set, dispersion: f64) -> f64 {
        self.beyond_nothing(set) / dispersion + self.price(&self.known[set].model, dispersion)
    }

    /// D of a set; until it is fitted closely, as low as errors of form may make it: by what they take of a set that shares effects with it and
    /// has at most one that it has not.
    pub(super) fn deviance(&self, set: &Set) -> f64 {
        let known = &self.known[set];
        let alike = |s: &Set| {
            let shared = s.iter().filter(|e| set.contains(e)).count();
            s.is_empty() || (shared > 0 && s.len() - shared <= 1)
        };
        let taken = || self.known.iter().filter(|(s, _)| alike(s)).filter_map(|(_, k)| k.taken()).fold(0.0, f64::max);
        known.settled.map_or_else(|| known.model.deviance - taken(), |s| s.deviance)
    }

    /// D(S) − D(∅).
    pub(super) fn beyond_nothing(&self, set: &Set) -> f64 {
        self.deviance(set) - self.deviance(&Set::new())
    }

    /// All sets that may be the answer, likeliest first. Of one effect more than that it is still known what they would explain.
    pub(super) fn ranked(&self) -> Vec<(&Set, f64)> {
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
    pub(super) fn answer(&self) -> Set {
        if self.below_noise {
            return Set::new();
        }
        let ranked = self.ranked();
        let (best, least) = ranked[0];
        let part = |s: &Set| s.iter().all(|e| best.contains(e));
        let near = ranked.iter().filter(|(s, j)| *j < least + 2.0 * ODDS.ln() && part(s));
        near.min_by_key(|(s, _)| s.len()).map_or_else(Set::new, |(s, _)| (*s).clone())
    }

    /// The set to expand next: the likeliest that has not been, if it may be the answer, or if the best leaves what others would explain.
    fn next(&self, in_vain: usize) -> Option<Set> {
        if self.below_noise {
            return (!self.is_expanded(&Set::new())).then(Set::new);
        }
        let ranked = self.ranked();
        let (best, least) = ranked[0];
        // The likelihood takes what is slow for noise. Far from the data that does not lead: a set that leaves much less comes first.
        let open = ranked.iter().map(|(s, _)| *s).filter(|s| !self.is_expanded(s));
        if self.is_far(best)
            && let Some(closest) = open.min_by(|a, b| self.excess(a).total_cmp(&self.excess(b)))
            && self.excess(closest) < COMPARABLE * self.excess(best)
        {
            return Some(closest.clone());
        }
        let (set, j) = ranked.iter().find(|(s, _)| !self.is_expanded(s))?;
        let near = *j < least + WINDOW;
        (near || (in_vain < PATIENCE && !self.complete(best))).then(|| (*set).clone())
    }

    /// Whether a set has been expanded with all candidates.
    pub(super) fn is_expanded(&self, set: &Set) -> bool {
        self.known[set].expanded == self.loop_.candidates.len()
    }

    /// Whether no candidate could explain what a set leaves, form errors aside.
    fn complete(&self, set: &Set) -> bool {
        let dispersion = self.dispersion();
        let explains = |s: &Score| s.score / dispersion >= threshold(s.freedom, self.loop_.level());
        self.is_expanded(set) && !self.known[set].scores.iter().any(explains)
    }

    /// The scores of all candidates at the model of a set, best first.
    pub(super) fn scores(&self, set: &Set) -> Vec<Score> {
        let known = &self.known[set];
        if self.is_expanded(set) { known.scores.clone() } else { self.loop_.scores(&known.model, &known.scores, self.hints()) }
    }

    /// Fits a set closely, and takes D with λ as it is now; whether that was new.
    pub(super) fn polish(&mut self, set: &Set) -> Result<bool, FitError> {
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

    /// Effects of a set in whose place a curve of the set explains a comparable part of what they do, the rest being the same.
    fn imitators(&mut self, set: &Set) -> Vec<EffectId> {
        let (curves, effects): (Vec<EffectId>, Vec<EffectId>) = set.iter().partition(|e| e.free_form().is_some());
        let mut found: Vec<EffectId> = Vec::new();
        for &curve in &curves {
            self.fit_without_each(&without(set, curve));
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
    pub(super) fn polish_answer(&mut self, beside: impl Fn(&Self, &Set) -> Vec<Set>) -> Result<(), FitError> {
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
    pub(super) fn rivals(&self, best: &Set) -> Vec<Set> {
        let (d, dispersion) = (self.deviance(best), self.dispersion());
        let exchanged = |s: &Set| s.len() == best.len() && s.iter().filter(|e| !best.contains(e)).count() == 1;
        let near = self.known.keys().filter(|s| exchanged(s) && self.deviance(s) < d + WINDOW * dispersion);
        near.cloned().collect()
    }
}
