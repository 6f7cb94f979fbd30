//! The course: from the refitted base model to the likeliest set of effects, one effect a stage, with what was tried beside it.

use im_model::EffectId;

use super::Model;
use super::posterior::Posterior;
use super::score::Score;

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
    /// The search ended at its bound of work: sets that it did not come to may be likelier.
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
