//! How sure the data are of the sets of effects that were tried.

use im_model::EffectId;
use serde_json::{Value, json};

/// A set of effects and its probability.
#[derive(Clone, Debug)]
pub struct Weighed {
    /// The effects, sorted.
    pub effects: Vec<EffectId>,
    /// Its probability among all sets tried.
    pub probability: f64,
    /// Minus twice its log-likelihood, less that of the base model.
    pub deviance: f64,
    /// Its parameters beyond those of the base model.
    pub parameters: usize,
}

/// How sure the data are of the sets of effects that were tried.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// All sets tried, likeliest first.
    pub sets: Vec<Weighed>,
    /// Effects that some of them have, with the probability that the machine has it, likeliest first.
    pub inclusion: Vec<(EffectId, f64)>,
    /// λ: by how much a sample counts less than an independent one.
    pub dispersion: f64,
}

impl Posterior {
    /// As it stands in `diagnosis.json`: sets of at least a thousandth.
    pub fn to_json(&self) -> Value {
        let names = |v: &[EffectId]| v.iter().map(|e| e.name()).collect::<Vec<_>>();
        let sets = self.sets.iter().filter(|s| s.probability >= 1e-3);
        json!({
            "sets": sets.map(|s| json!({"effects": names(&s.effects), "probability": s.probability})).collect::<Vec<_>>(),
            "inclusion": self.inclusion.iter().map(|(e, p)| (e.name().to_owned(), json!(p))).collect::<serde_json::Map<_, _>>(),
            "dispersion": self.dispersion,
        })
    }

    /// The probability that the machine has an effect, 0 for one that no set has.
    pub fn of(&self, effect: EffectId) -> f64 {
        self.inclusion.iter().find(|(e, _)| *e == effect).map_or(0.0, |(_, p)| *p)
    }
}
