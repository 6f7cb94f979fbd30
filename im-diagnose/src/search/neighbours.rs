//! The neighbours of a set: from where they are fitted, and which of the fits are kept.

use im_identify::offline::{FitOptions, Target, Transform};
use im_model::effects::Role;
use im_model::{Bound, EffectId, Machine, ParameterId, State};
use rayon::prelude::*;

use super::Model;
use super::score::{Instead, Score, free_order};
use super::sets::{COMPARABLE, Known, Search, Set, WINDOW, sorted, with, without};
use crate::shaft_lines::same_order;

/// A refit may gain more than slopes predict: where they predict this part of what it must gain to be the likeliest, it is tried.
const PREDICTED: f64 = 0.25;

/// Candidates refitted at once, before it is asked which of the others may still be likelier.
const AT_ONCE: usize = 2;

/// Part of the predicted size of an effect that is little.
const LITTLE: f64 = 0.1;

/// From where to fit a set.
struct Proposal {
    effects: Vec<EffectId>,
    starts: Vec<(Machine<f64>, Vec<State<f64>>)>,
}

impl Proposal {
    /// On from where a fit ended.
    fn from_end_of(model: &Model) -> Self {
        Self { effects: model.effects.clone(), starts: vec![(model.fit.machine, model.fit.starts.clone())] }
    }
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

impl Search<'_> {
    /// Far from the data slopes lead nowhere, scores name the wrong effects, and the base model's parameters may have run off: each effect of
    /// the library is fitted beside nothing, from a usual size. A step takes one that explains nothing back to nothing; the others go on.
    pub(super) fn try_each(&mut self) {
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
        let mut proposals: Vec<Proposal> = begun.iter().filter(explains).map(Proposal::from_end_of).collect();
        // From the parameters as given, too, where a step does not lead as far.
        if let Some(given) = self.brought_back(self.base()) {
            proposals.extend(of_library().filter_map(|&e| usual(&given, e)));
        }
        self.spent += begun.iter().map(|m| m.fit.work).sum::<f64>();
        self.fit(&proposals);
        self.each_tried = true;
    }

    /// Scores what could be added to a set, and fits its neighbours: one effect less, one exchanged, one more; where it has been expanded
    /// before, more of the candidates that it was not expanded with.
    pub(super) fn expand(&mut self, set: &Set) {
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
            let may = |s: &&&Score| self.may_be_likeliest(set, s);
            let additions: Vec<Proposal> = leading.iter().filter(may).filter_map(|s| self.addition(&model, s, 1.0)).collect();
            self.fit(&additions);
            // An effect more never explains less: what ended so is fitted again from a size that changes little, where it may still be likeliest.
            let ended = |s: &&Score| self.known.get(&sorted(&with(set, s.effect))).is_some_and(|k| self.is_lost(&model, k));
            let lost = leading.iter().copied().filter(|s| ended(s) && self.may_be_likeliest(set, s));
            let again: Vec<Proposal> = lost.filter_map(|s| self.addition(&model, s, LITTLE)).collect();
            self.fit(&again);
        }
        if let Some(known) = self.known.get_mut(set) {
            (known.scores, known.expanded) = (scores, self.loop_.candidates.len());
        }
    }

    /// Fits each set with one effect less than one that is known.
    pub(super) fn fit_without_each(&mut self, set: &Set) {
        let removals = self.known.get(set).map(|k| self.removals(&k.model));
        self.fit(&removals.unwrap_or_default());
    }

    /// Fits sets quickly, and keeps what is new or better. One that has not arrived where a part of it is better is fitted on.
    fn fit(&mut self, proposals: &[Proposal]) {
        let fitted: Vec<Model> = proposals.par_iter().filter_map(|p| self.fitted(p, &FitOptions::quick())).collect();
        let (lost, rest): (Vec<Model>, Vec<Model>) = fitted.into_iter().partition(|m| !m.fit.converged && self.is_behind(m));
        let on = |m: &Model| self.fitted(&Proposal::from_end_of(m), &FitOptions::quick());
        let on: Vec<Model> = lost.par_iter().filter_map(on).collect();
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

    /// A model with an effect more, from a part of the size predicted, and from elsewhere: what is right beside one effect less may be wrong beside it.
    fn addition(&self, model: &Model, score: &Score, part: f64) -> Option<Proposal> {
        let machines = std::iter::once(model.fit.machine).chain(self.elsewhere(model));
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

    /// The same set from other shapes of those of its effects that have many minima, and from elsewhere: each may lead to another.
    fn restarts(&self, model: &Model) -> Vec<Proposal> {
        let others = self.elsewhere(model).map(|m| (m, model.fit.starts.clone())).collect::<Vec<_>>();
        let others = (!others.is_empty()).then(|| Proposal { effects: model.effects.clone(), starts: others });
        let many_minima = model.effects.iter().filter(|e| e.about().resonant || free_order(**e).is_some());
        many_minima
            .filter_map(|&e| {
                let machine = self.loop_.without(&model.fit.machine, e)?;
                let score = self.loop_.score_beside(&machine, &model.fit.starts, &without(&model.effects, e), e)?;
                let order = |k| model.fit.machine.get(ParameterId::Effect(e, k));
                let there = free_order(e).is_some_and(|k| score.shape.iter().any(|s| s.0 == k && same_order(s.1, order(k))));
                if there { None } else { self.proposal(model, [machine], model.effects.clone(), &score) }
            })
            .chain(others)
            .collect()
    }

    /// Where no descent leads: a model with other whole numbers of its effects, or with the base parameters as given.
    fn elsewhere(&self, model: &Model) -> impl Iterator<Item = Machine<f64>> {
        with_other_numbers(model).into_iter().chain(self.brought_back(model))
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
}
