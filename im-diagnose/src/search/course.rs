//! The course: from the refitted base model to the likeliest set of effects, one effect a stage, with what was tried beside it.

use im_identify::offline::FitError;
use im_model::EffectId;

use super::posterior::Posterior;
use super::score::Score;
use super::sets::{Search, Set, Sets, sorted, with, without};
use super::{Model, Refinement};

/// Why a candidate is not in the answer beside the effects of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The likelihood gains less than chance over the candidates would.
    NotLikelier,
    /// It gains no more than the form error of the effects that are there may.
    WithinFormError,
    /// The training recordings speak for it, the held-out one against it.
    NotOnHoldout,
}

/// How a candidate fared beside the effects of a model.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The effect tried.
    pub effect: EffectId,
    /// The model with it.
    pub model: Model,
    /// Why it is not wanted there; `None` where it is.
    pub refusal: Option<Refusal>,
}

/// What was tried beyond a model.
#[derive(Clone, Debug)]
pub struct Round {
    /// Scores of all candidates, best first.
    pub scores: Vec<Score>,
    /// Effects whose score is significant.
    pub significant: Vec<EffectId>,
    /// Refits with one effect more, likeliest first.
    pub trials: Vec<Trial>,
}

/// A model of the course, and what was tried beyond it.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The model: the refitted base model, or one with an effect more than the stage before.
    pub model: Model,
    /// What was tried beyond it.
    pub round: Round,
    /// Effects that explain the data as well in the place of its newest one.
    pub rivals: Vec<EffectId>,
}

/// The course of the loop: never empty.
#[derive(Clone, Debug)]
pub struct Course {
    /// The base model, and a stage for each effect of the likeliest set.
    pub stages: Vec<Stage>,
    /// How sure the data are.
    pub posterior: Posterior,
    /// The search ended at its bound of work, or where the library leads no further: sets that it did not come to may be likelier.
    pub cut_short: bool,
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
    /// The way from the base model to the likeliest set of a search, and the sets with what was fitted on it.
    pub fn course(&self, sets: Sets) -> Result<(Course, Sets), FitError> {
        let mut search = self.over(sets);
        Ok((search.course()?, search.into()))
    }
}

impl Search<'_> {
    /// The likeliest set, and the way to it: from behind, the effect is last whose loss costs least.
    pub(super) fn course(&mut self) -> Result<Course, FitError> {
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
            self.fit_without_each(&set);
            let rest = set.iter().map(|&e| without(&set, e)).filter(|s| self.known.contains_key(s));
            let before = rest.min_by(|a, b| self.deviance(a).total_cmp(&self.deviance(b)));
            let before = before.unwrap_or_default();
            self.polish(&before)?;
            way.push(before);
        }
        way.reverse();
        Ok(way)
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
