//! How sure the data are of the sets of effects that were tried.

use std::collections::BTreeMap;

use im_model::EffectId;
use serde_json::{Value, json};

use super::sets::Search;

/// A set of effects and its probability.
#[derive(Clone, Debug)]
pub struct Weighed {
    /// The effects, sorted.
    pub effects: Vec<EffectId>,
    /// Its probability among all sets tried.
    pub probability: f64,
    /// Minus twice its log-likelihood, less that of the base model.
    pub deviance: f64,
    /// Its parameters beyond those of the base model; of a learned curve as many as the data determine.
    pub parameters: f64,
}

/// Sets less likely than this are not worth a word.
const LEAST: f64 = 1e-3;

impl Weighed {
    /// Whether it holds these effects, in any order.
    pub fn is(&self, effects: &[EffectId]) -> bool {
        self.effects.len() == effects.len() && effects.iter().all(|e| self.effects.contains(e))
    }
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

impl Search<'_> {
    pub(super) fn posterior(&self) -> Posterior {
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
}

impl Posterior {
    /// Sets that are worth a word.
    pub fn likely(&self) -> impl Iterator<Item = &Weighed> {
        self.sets.iter().filter(|s| s.probability >= LEAST)
    }

    /// A set among those tried, its effects in any order.
    pub fn set(&self, effects: &[EffectId]) -> Option<&Weighed> {
        self.sets.iter().find(|s| s.is(effects))
    }

    /// As it stands in `diagnosis.json`.
    pub fn to_json(&self) -> Value {
        let names = |v: &[EffectId]| v.iter().map(|e| e.name()).collect::<Vec<_>>();
        json!({
            "sets": self.likely().map(|s| json!({"effects": names(&s.effects), "probability": s.probability})).collect::<Vec<_>>(),
            "inclusion": self.inclusion.iter().map(|(e, p)| (e.name().to_owned(), json!(p))).collect::<serde_json::Map<_, _>>(),
            "dispersion": self.dispersion,
        })
    }

    /// The probability that the machine has an effect, 0 for one that no set has.
    pub fn of(&self, effect: EffectId) -> f64 {
        self.inclusion.iter().find(|(e, _)| *e == effect).map_or(0.0, |(_, p)| *p)
    }
}
