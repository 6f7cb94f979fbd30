//! The rules of the verdict.

use im_identify::offline::{Experiment, Fit, residuals};
use im_model::{BaseParameter, EffectId, ParameterId};
use serde::{Deserialize, Serialize};

use super::Candidate;
use super::steps::{Found, Step};
use crate::form_error::{SIZE_IN_SEARCH, bent};
use crate::residual_tests::{Dependence, held_out_log_p};
use crate::residuals::errors;
use crate::search::{Course, Model, NO_DOUBT, Refinement, Refusal, Round, Trial, UNEXPLAINED};
use crate::statistics::log_p;

/// Excess of χ²/N over that of the noise below which a model is as good as its sensors.
const NEGLIGIBLE: f64 = 0.1;

/// What the data say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The base model explains the recordings.
    Adequate,
    /// Effects of the library are missing, and named.
    MissingEffects,
    /// Something is missing, but two or more effects explain it alike.
    Confounded,
    /// The recordings do not excite what would have to be seen.
    Inconclusive,
    /// Something is missing that the library does not hold.
    Unexplained,
}

impl Verdict {
    /// The word in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Adequate => "adequate",
            Self::MissingEffects => "missing_effects",
            Self::Confounded => "confounded",
            Self::Inconclusive => "inconclusive",
            Self::Unexplained => "unexplained",
        }
    }
}

/// What the effects added leave, where it is more than noise.
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualCause {
    /// The effect that would explain most of it on the held-out recording, if one does: tried, but not confirmed.
    pub suspect: Option<EffectId>,
    /// The training error with it, χ²/N.
    pub with_suspect: f64,
}

pub(super) fn residual_cause(course: &Course, left: &Left<'_>) -> Option<ResidualCause> {
    let last = &course.last().model;
    let found = matches!(verdict_of(course, left, 1.0), Some(Verdict::MissingEffects | Verdict::Confounded));
    if !found || !left.is_more_than_noise() || !caused(course, left) {
        return None;
    }
    let round = &course.last().round;
    // The recording that no fit has seen judges best between those that none confirms.
    let unseen = |m: &Model| m.holdout.unwrap_or_else(|| m.train());
    let likely = round.trials.iter().filter(|t| gains(t));
    let suspect = likely.min_by(|a, b| unseen(&a.model).total_cmp(&unseen(&b.model)));
    Some(ResidualCause { suspect: suspect.map(|t| t.effect), with_suspect: suspect.map_or(last.train(), |t| t.model.train()) })
}

/// Largest relative standard deviation of a resistance or an inductance that counts as known.
const KNOWN: f64 = 0.05;

/// Why recordings that show nothing to be missing do not show that nothing is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doubt {
    /// The training recordings are explained, the held-out one is not: it shows something that they do not.
    HeldOutMissed,
    /// More than a third of the effects would not show at any usual size.
    NotExcited,
    /// This one fits better than chance allows, yet gains too little to be confirmed.
    Hint(EffectId),
    /// They do not determine this resistance or inductance.
    Undetermined(BaseParameter),
}

impl Doubt {
    /// The word in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::HeldOutMissed => "held_out_missed",
            Self::NotExcited => "not_excited",
            Self::Hint(_) => "hint",
            Self::Undetermined(_) => "undetermined",
        }
    }
}

/// Resistances and inductances of the machine that the recordings do not determine.
fn undetermined(fit: &Fit) -> impl Iterator<Item = BaseParameter> {
    use BaseParameter as P;
    let electrical = [P::StatorResistance, P::RotorResistance, P::StatorLeakageInductance, P::MagnetizingInductance];
    let (values, std) = (fit.values(), fit.standard_deviations());
    electrical.into_iter().filter(move |&p| {
        let of = fit.free.iter().position(|f| f.id() == Some(ParameterId::Base(p)));
        of.is_some_and(|k| std[k].is_nan() || std[k] > KNOWN * values[k])
    })
}

/// Least gain, in χ²/N of the noise, of a candidate that hints at an effect too small to be confirmed.
const HINT: f64 = 0.003;

/// What the last model leaves.
pub(super) struct Left<'a> {
    /// The larger of training and held-out error, χ²/N: what there was to explain, and of the last model.
    error: [f64; 2],
    /// Of the last, with the curves of its effects bent by two standard deviations of their form at most; until [`Left::bent`], as they are.
    bent: f64,
    /// Whether it has effects that the motor had not.
    named: bool,
    /// Whether the last leaves more of the held-out recording than the noise of the training recordings can.
    held_out_missed: bool,
    /// On what it depends.
    dependences: &'a [Dependence],
    /// −log₁₀ of the probability that instruments of their class show so much in tables of steady states.
    of_tables: f64,
    /// Curves of no known form with which the recordings are likelier than with the effects of the library alone.
    pub(super) curves: Vec<EffectId>,
    /// Whether these count for more than some effect that was found, or none was; or one leaves too much where it acts.
    imitated: bool,
}

impl<'a> Left<'a> {
    pub(super) fn new(loop_: &Refinement, course: &Course, found: &'a Found) -> Self {
        let fit = &course.last().model.fit;
        let tables = || loop_.nudged().iter().zip(&fit.starts).filter(|(e, _)| e.is_table());
        let cost: f64 = tables().flat_map(|(e, x)| residuals(&fit.machine, e, x)).flatten().map(|r| r * r).sum();
        let count: usize = tables().map(|(e, _)| e.count()).sum();
        let freedom = count.saturating_sub(fit.free.len());
        let error = [loop_.error_before(to_explain(loop_, found)), found.last().error()];
        Self {
            error,
            bent: error[1],
            named: !course.last().model.effects.is_empty(),
            held_out_missed: held_out_missed(found),
            dependences: &found.dependences,
            of_tables: if freedom == 0 { 0.0 } else { log_p(cost, freedom) },
            curves: Vec::new(),
            imitated: false,
        }
    }

    /// The same where the curves of the effects may be wrong.
    pub(super) fn bent(self, loop_: &Refinement, found: &Found) -> Self {
        let doubtful = self.is_more_than_noise();
        Self { bent: if doubtful { bent_error(loop_, found) } else { self.bent }, ..self }
    }

    /// The same where curves of no known form make the recordings likelier.
    pub(super) fn contested(self, curves: Vec<EffectId>, replace: bool) -> Self {
        Self { curves, imitated: replace, ..self }
    }

    /// The same where only some of the effects found are known to be no imitation of an unknown cause.
    pub(super) fn beside_unknown(self, there: &[EffectId], found: &[EffectId]) -> Self {
        let imitates = |e: &EffectId| e.free_form().is_none() && !there.contains(e);
        Self { imitated: self.imitated || found.iter().any(imitates), ..self }
    }

    /// Whether the last model is not as good as the sensors. Small effects are named only where what they leave is no more than noise, or than their
    /// forms may err by.
    fn is_more_than_noise(&self) -> bool {
        self.error[1] - 1.0 > NEGLIGIBLE || (self.named && !self.is_within_form(self.error[1], 1.0) && self.is_structured())
    }

    /// Whether so much of χ²/N is no more than the forms of effects err by, within some standard deviations, that explain the rest.
    fn is_within_form(&self, left: f64, deviations: f64) -> bool {
        left - 1.0 <= (deviations * SIZE_IN_SEARCH).powi(2) * (self.error[0] - 1.0)
    }

    /// Whether the form of the effects that were found may be all that is wrong: what is left is no larger than errors of form are, and looks like one.
    pub(super) fn is_form(&self) -> bool {
        self.named && self.is_within_form(self.error[1], 2.0) && self.is_within_form(self.bent, 1.0)
    }

    /// Whether the effects explain too little, whatever curves of no known form would.
    pub(super) fn is_unexplained(&self, floor: f64) -> bool {
        let excess = |error: f64| error / floor - 1.0;
        let (before, bent) = (excess(self.error[0]), excess(self.bent));
        bent > if self.named { UNEXPLAINED * before } else { NEGLIGIBLE } && self.is_structured()
    }

    /// Whether it is no noise, beyond doubt: it depends on something, no instruments err so much, or what was found does not hold on the
    /// held-out recording. (Where nothing was found, that is a doubt, [`Doubt::HeldOutMissed`].)
    fn is_structured(&self) -> bool {
        let depends = self.dependences.first().is_some_and(|d| d.log_p > NO_DOUBT);
        depends || self.of_tables > NO_DOUBT || (self.named && self.held_out_missed)
    }
}

/// The larger of the training and held-out error of the refitted base model, χ²/N. A refit can lose the held-out recording, and to bring it back
/// part of the way explains nothing: of that recording, no more is to be explained than the motor as given leaves.
fn to_explain(loop_: &Refinement, found: &Found) -> f64 {
    let (refitted, held) = (&found.steps[0], found.judged.holdout.as_slice());
    let Some(unseen) = &refitted.holdout else { return refitted.error() };
    let given = &loop_.case().motor.machine;
    let as_given = errors(given, held, &loop_.starts(given, held));
    unseen.chi2_per_sample.min(as_given.chi2_per_sample).max(refitted.train.chi2_per_sample)
}

/// [`Left::held_out_missed`], by more than what counts.
fn held_out_missed(found: &Found) -> bool {
    let (last, judged) = (found.last(), &found.judged);
    let (Some(unseen), Some(start), Some(error)) = (&judged.holdout, &last.holdout_start, &last.holdout) else {
        return false;
    };
    !unseen.is_table()
        && error.chi2_per_sample > (1.0 + NEGLIGIBLE) * last.train.chi2_per_sample.max(1.0)
        && held_out_log_p(&last.machine, (&judged.train, &last.starts), (unseen, start)) > NO_DOUBT
}

/// [`Left::bent`].
fn bent_error(loop_: &Refinement, found: &Found) -> f64 {
    let Step { machine, starts, holdout_start, effects, .. } = found.last();
    // Those that the motor had before are of the library's forms as well.
    if machine.effects().active().next().is_none() {
        return found.last().error();
    }
    let train = &found.judged.train;
    let all: Vec<Experiment> = train.iter().chain(&found.judged.holdout).cloned().collect();
    let starts: Vec<_> = starts.iter().chain(holdout_start).copied().collect();
    let ratio_std = loop_.case().motor.leakage_ratio_std();
    let each = bent(machine, &starts, &all, &loop_.free(machine, effects, &all), ratio_std);
    let (seen, unseen) = each.split_at(train.len());
    let mean_square = |left: &[Vec<Vec<f64>>], of: &[Experiment]| {
        let count: usize = of.iter().map(Experiment::count).sum();
        left.iter().flatten().flatten().map(|r| r * r).sum::<f64>() / count.max(1) as f64
    };
    mean_square(seen, train).max(mean_square(unseen, found.judged.holdout.as_slice()))
}

/// Part of the excess that an effect which is not added takes off, from which on what is left is no noise.
const CAUSED: f64 = 0.03;

/// Whether what the last model leaves has a cause: it depends on something, or an effect that was tried explains part of it.
pub(super) fn caused(course: &Course, left: &Left<'_>) -> bool {
    let last = &course.last().model;
    let takes = |m: &Model| last.train() - m.train() > CAUSED * (last.train() - 1.0).max(NEGLIGIBLE);
    let explains = |r: &Round| r.trials.iter().any(|t| takes(&t.model) && gains(t));
    left.is_structured() || explains(&course.last().round)
}

/// Whether an effect more gains more than chance, form errors aside.
fn gains(t: &Trial) -> bool {
    t.refusal != Some(Refusal::NotLikelier)
}

/// Whether more than noise is left, so that curves of no known form must show what they explain of it.
pub(super) fn is_contested(course: &Course, left: &Left<'_>) -> bool {
    left.is_more_than_noise() && caused(course, left)
}

/// The verdict as far as effects and residual tests decide it.
fn verdict_of(course: &Course, left: &Left<'_>, floor: f64) -> Option<Verdict> {
    let last = &course.last().model;
    // A search that had to end while more was left than forms err by has no answer: sets that it did not come to may be likelier.
    let unfinished = course.cut_short && !last.effects.is_empty() && left.is_more_than_noise() && !left.is_form();
    if left.is_unexplained(floor) || left.imitated || unfinished {
        Some(Verdict::Unexplained)
    } else if last.effects.is_empty() {
        None
    } else if course.stages.iter().any(|s| !s.rivals.is_empty()) {
        Some(Verdict::Confounded)
    } else {
        Some(Verdict::MissingEffects)
    }
}

/// The verdict, and where it is `inconclusive`, why.
pub(super) fn verdict(course: &Course, ranking: &[Candidate], left: &Left<'_>, floor: f64) -> (Verdict, Vec<Doubt>) {
    if let Some(v) = verdict_of(course, left, floor) {
        return (v, Vec::new());
    }
    let doubts = doubts(course, ranking, left);
    (if doubts.is_empty() { Verdict::Adequate } else { Verdict::Inconclusive }, doubts)
}

/// Why nothing seen to be missing does not mean that nothing is.
fn doubts(course: &Course, ranking: &[Candidate], left: &Left<'_>) -> Vec<Doubt> {
    let first = &course.first().model;
    let missed = left.held_out_missed.then_some(Doubt::HeldOutMissed);
    let unexcited = ranking.iter().filter(|c| !c.excited).count();
    let unexcited = (3 * unexcited > ranking.len()).then_some(Doubt::NotExcited);
    let hints = |t: &&Trial| first.train() - t.model.train() > HINT && gains(t);
    let hinted = course.first().round.trials.iter().filter(hints);
    let hinted = hinted.min_by(|a, b| a.model.train().total_cmp(&b.model.train())).map(|t| Doubt::Hint(t.effect));
    missed.into_iter().chain(unexcited).chain(hinted).chain(undetermined(&first.fit).map(Doubt::Undetermined)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What effects leave is their form where it is as small as errors of form are and looks like one; a weak unknown cause is larger against what
    /// there was, and of a strong one the bends leave more.
    #[test]
    fn an_error_of_form_is_small_and_looks_like_one() {
        let left = |error, bent| Left {
            error,
            bent,
            named: true,
            held_out_missed: false,
            dependences: &[],
            of_tables: 0.0,
            curves: Vec::new(),
            imitated: false,
        };
        assert!(left([97.3, 2.91], 1.43).is_form());
        assert!(!left([2.62, 1.29], 1.01).is_form());
        assert!(!left([97.3, 2.91], 2.25).is_form());
    }
}
