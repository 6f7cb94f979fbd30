//! Every candidate, and what follows for it.

use crate::format::short_effect_name;
use im_model::EffectId;

use crate::search::score::{Score, strengths};
use crate::search::{Course, Refinement, Refusal};
use crate::statistics::{cosine, threshold};

/// How the conclusion begins on an effect that may be missing beside what was found.
pub(crate) const SUSPECTED: &str = "may be missing, too";
/// How the conclusion begins on an effect that the recordings cannot show.
pub(crate) const NOT_EXCITED: &str = "not excited";

/// How a candidate stands after the first round.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The effect.
    pub effect: EffectId,
    /// Its score and the threshold for it.
    pub score: f64,
    /// Above it the effect is significant among all candidates.
    pub threshold: f64,
    /// Size predicted, in the unit of the leading strength.
    pub predicted_size: f64,
    /// What of it a refit cannot imitate, 0 to 1.
    pub explained_share: f64,
    /// Smallest size that would be found, in the same unit.
    pub detectable_size: f64,
    /// Largest usual size, in the same unit.
    pub usual_size: f64,
    /// Whether the recordings could show it at a usual size.
    pub excited: bool,
    /// Unit.
    pub unit: &'static str,
    /// What follows.
    pub conclusion: String,
    /// The effect whose signature is most alike, and the cosine between the two.
    pub most_alike: Option<(EffectId, f64)>,
}

/// Every candidate; `suspect` would explain part of what is left.
pub(super) fn ranking(loop_: &Refinement, course: &Course, significance: f64, suspect: Option<EffectId>) -> Vec<Candidate> {
    let first = &course.first().round;
    let m = first.scores.len().max(1);
    let last = &course.last().model;
    first
        .scores
        .iter()
        .map(|s| {
            let lead = strengths(s.effect)
                .into_iter()
                .zip(&s.predicted)
                .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
                .map_or((0, 0.0), |(k, x)| (k, *x));
            let info = &s.effect.parameters()[lead.0];
            let usual = info.typical.1 * loop_.unit_of(info.scale);
            let threshold = threshold(s.freedom, significance / m as f64);
            let alike = first
                .scores
                .iter()
                .filter(|o| o.effect != s.effect && o.signature.len() == s.signature.len())
                .map(|o| (o.effect, cosine(&s.signature, &o.signature)))
                .max_by(|a, b| a.1.total_cmp(&b.1));
            let conclusion = if let Some(k) = last.effects.iter().position(|e| *e == s.effect) {
                let rivals: Vec<String> = course.stages[k + 1].rivals.iter().map(|e| short_effect_name(*e)).collect();
                if rivals.is_empty() { "added".into() } else { format!("added; confounded with {}", rivals.join(", ")) }
            } else if course.stages.iter().flat_map(|s| &s.rivals).any(|e| *e == s.effect) {
                "explains the data as well as an effect added".into()
            } else if suspect == Some(s.effect) {
                format!("{SUSPECTED}: explains part of what is left, but is not confirmed")
            } else if !shown(s, usual, threshold) {
                format!("{NOT_EXCITED}: these recordings cannot show it at any usual size")
            } else if !first.significant.contains(&s.effect) {
                "not needed".into()
            } else if !loop_.possible(s.effect, &s.predicted) {
                "would need an impossible sign: a symptom of something else".into()
            } else if last.effects.is_empty() {
                let refusal = first.trials.iter().find(|t| t.effect == s.effect).map(|t| t.refusal);
                match refusal {
                    Some(Some(Refusal::NotLikelier)) => "significant by its score, but its refit gains no more than chance",
                    Some(Some(Refusal::WithinFormError)) => "significant, but takes too little off the error to be named",
                    Some(Some(Refusal::NotOnHoldout)) => "significant, but the held-out recording does not confirm it",
                    Some(None) => "explains part of the error, not enough to be named",
                    None => "significant, but too small to be worth a refit",
                }
                .into()
            } else {
                "explained by what was added".into()
            };
            Candidate {
                effect: s.effect,
                score: s.score,
                threshold,
                predicted_size: lead.1,
                explained_share: s.explained_share,
                detectable_size: s.detectable,
                usual_size: usual,
                excited: shown(s, usual, threshold),
                unit: info.unit,
                conclusion,
                most_alike: alike,
            }
        })
        .collect()
}

/// Whether the recordings show an effect, or would at its largest usual size.
fn shown(s: &Score, usual: f64, threshold: f64) -> bool {
    s.is_excited() && (s.score > threshold || s.detectable <= usual)
}
