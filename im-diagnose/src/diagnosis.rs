//! The answer: verdict, effects, rivals, errors before and after, and the files that carry it.

use std::collections::BTreeMap;

use im_identify::offline::{Experiment, Fit, FitError, FitOptions, residuals};
use im_model::{BaseParameter, EffectId, Machine, MotorFile, ParameterId, State};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::case::Case;
use crate::leftover::{Dependence, dependences};
use crate::refine::{Course, Model, NEGLIGIBLE, Options, Refinement, UNSTABLE, judged, mean_square, pulled};
use crate::score::{LEAST_KEEP, Score, cosine, strengths, threshold};

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

/// Error of a model on a set of recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors {
    /// Mean squared residual in σ²: 1.0 is the noise floor.
    pub chi2_per_sample: f64,
    /// Root mean square per channel, in its unit.
    pub rmse: BTreeMap<String, f64>,
    /// Fit percent per channel: 100 (1 − ‖e‖/‖y − mean y‖).
    pub fit_percent: BTreeMap<String, f64>,
}

/// One step of the refinement.
#[derive(Clone, Debug)]
pub struct Step {
    /// Effects in the model.
    pub effects: Vec<EffectId>,
    /// The fitted machine.
    pub machine: Machine<f64>,
    /// Initial states of the training recordings.
    pub starts: Vec<State<f64>>,
    /// Initial state of the held-out recording.
    pub holdout_start: Option<State<f64>>,
    /// Error on the training recordings.
    pub train: Errors,
    /// Error on the held-out recording.
    pub holdout: Option<Errors>,
}

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
    pub keep: f64,
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

/// A parameter before and after.
#[derive(Clone, Debug)]
pub struct ParameterChange {
    /// Which.
    pub id: ParameterId,
    /// As given.
    pub before: f64,
    /// As refined.
    pub after: f64,
    /// Standard deviation.
    pub std: f64,
}

/// The whole answer.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// The verdict.
    pub verdict: Verdict,
    /// Effects, in order of addition.
    pub effects: Vec<EffectId>,
    /// For each, those that explain the data as well.
    pub alternatives: Vec<Vec<EffectId>>,
    /// All candidates, best first.
    pub ranking: Vec<Candidate>,
    /// The refitted base model, then one step per effect.
    pub steps: Vec<Step>,
    /// Parameters before and after.
    pub parameters: Vec<ParameterChange>,
    /// The motor with the effects added and everything refitted.
    pub refined: MotorFile,
    /// What the last model's residual still depends on.
    pub leftover: Vec<Dependence>,
    /// More than noise that is left beside effects that were found: less than a tenth, or the verdict is `unexplained`.
    pub remainder: Option<Remainder>,
    /// Noise per channel, in its unit.
    pub noise: BTreeMap<String, f64>,
    /// The case as analysed, with the noise as estimated.
    pub case: Case,
    /// The course of the loop, for those who want every number.
    pub course: Course,
}

/// Errors of a machine on experiments.
pub fn errors(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> Errors {
    let r: Vec<_> = experiments.par_iter().zip(starts).map(|(e, x)| residuals(machine, e, x)).collect();
    let mut sums: BTreeMap<String, [f64; 5]> = BTreeMap::new();
    for (e, r) in experiments.iter().zip(&r) {
        for (c, r) in e.channels.iter().zip(r) {
            let s = sums.entry(c.name.clone()).or_default();
            for (k, x) in r.iter().enumerate().filter(|(k, _)| c.is_valid(*k)) {
                let y = c.values[k];
                s[0] += 1.0;
                s[1] += x * x;
                s[2] += x * x * c.sigma * c.sigma;
                s[3] += y;
                s[4] += y * y;
            }
        }
    }
    let n: f64 = sums.values().map(|s| s[0]).sum();
    Errors {
        chi2_per_sample: sums.values().map(|s| s[1]).sum::<f64>() / n,
        rmse: sums.iter().map(|(k, s)| (k.clone(), (s[2] / s[0]).sqrt())).collect(),
        fit_percent: sums
            .iter()
            .map(|(k, s)| {
                let spread = (s[4] - s[3] * s[3] / s[0]).max(1e-300);
                (k.clone(), 100.0 * (1.0 - (s[2] / spread).sqrt()))
            })
            .collect(),
    }
}

/// Least part of the base model's excess that effects must explain to be reported beside a verdict of `unexplained`.
const PARTIAL: f64 = 0.5;

/// Runs the whole loop on a case and decides.
pub fn diagnose(case: Case, options: Options) -> Result<Diagnosis, FitError> {
    let (significance, least_gain) = (options.significance, options.least_gain);
    let before = case.motor.clone();
    let (mut loop_, base) = Refinement::new(case, options)?;
    let mut course = loop_.run(base)?;
    let steps_as_found = steps(&loop_, &course);
    keep_confirmed(&mut course, &steps_as_found, least_gain);
    let mut leftover = leftover_of(&loop_, &course);
    if verdict_of(&course, &leftover, 1.0) == Some(Verdict::Unexplained) && explained(&course) < PARTIAL {
        // Stand-ins for something else: their names would mislead.
        course.models.truncate(1);
        course.alternatives.clear();
        leftover = leftover_of(&loop_, &course);
    }
    let last = &course.models[course.models.len() - 1];
    // Coloured noise is rougher than white noise of the same size is taken to be: where nothing in the residual has a cause, it is the noise.
    let floor = if structured(&leftover) { 1.0 } else { last.train().max(1.0) };
    let steps = if floor > 1.05 {
        loop_.set_noise_to_residual(&last.fit);
        steps(&loop_, &course)
    } else {
        steps_as_found[..course.models.len()].to_vec()
    };
    let remainder = remainder(&course, &leftover);
    let ranking = ranking(&loop_, &course, significance, remainder.as_ref());
    let verdict = verdict(&course, &ranking, &leftover, floor);
    let machine = steps[steps.len() - 1].machine;
    let refined = MotorFile { machine, ..before.clone() };
    let parameters = changes(&before, &refined, last);
    let case = loop_.case().clone();
    let noise = case.train.iter().flat_map(|e| &e.channels).map(|c| (c.name.clone(), c.sigma)).collect();
    Ok(Diagnosis {
        verdict,
        effects: last.effects.clone(),
        alternatives: course.alternatives.clone(),
        ranking,
        steps,
        parameters,
        refined,
        leftover,
        remainder,
        noise,
        case,
        course,
    })
}

/// The recordings as steps are judged on them ([`judged`]): the same for all steps.
struct Judged {
    train: Vec<Experiment>,
    holdout: Option<Experiment>,
}

impl Judged {
    fn new(loop_: &Refinement, machine: &Machine<f64>, starts: &[State<f64>], factor: f64) -> Self {
        let case = loop_.case();
        Self {
            train: case.train.par_iter().zip(starts).map(|(e, x)| judged(e, machine, x, factor)).collect(),
            holdout: case.holdout.as_ref().map(|h| {
                let aided = pulled(std::slice::from_ref(h));
                judged(h, machine, &loop_.starts(machine, &aided)[0], factor)
            }),
        }
    }
}

/// A model fitted once more as a user's own simulation will run it: the machine and the starts of the training recordings.
fn refitted(loop_: &Refinement, model: &Model, refit: &Judged) -> (Machine<f64>, Vec<State<f64>>) {
    let options = FitOptions { iterations: 12, tolerance: 1e-5, horizons: Vec::new() };
    match loop_.fit_to(&refit.train, &model.fit.machine, &model.fit.starts, &model.effects, &options) {
        // Where the unaided simulation falls out of step on the way, its minimum means nothing.
        Ok(f) if mean_square_all(&f.machine, loop_.pulled(), &f.starts) < 1.2 * model.train() => (f.machine, f.starts),
        _ => (model.fit.machine, model.fit.starts.clone()),
    }
}

/// The errors of a refitted model.
fn step(loop_: &Refinement, model: &Model, (machine, starts): (Machine<f64>, Vec<State<f64>>), judged: &Judged) -> Step {
    let held = judged.holdout.as_slice();
    let held_starts = loop_.starts(&machine, held);
    Step {
        effects: model.effects.clone(),
        train: errors(&machine, &judged.train, &starts),
        holdout: (!held.is_empty()).then(|| errors(&machine, held, &held_starts)),
        holdout_start: held_starts.first().copied(),
        machine,
        starts,
    }
}

fn steps(loop_: &Refinement, course: &Course) -> Vec<Step> {
    let last = &course.models[course.models.len() - 1];
    // A first, generous look: what the final model can be fitted on unaided; then the strict one, with that fit.
    let refit = Judged::new(loop_, &last.fit.machine, &last.fit.starts, 100.0);
    let fits: Vec<_> = course.models.par_iter().map(|m| refitted(loop_, m, &refit)).collect();
    let (machine, starts) = &fits[fits.len() - 1];
    let judged = Judged::new(loop_, machine, starts, UNSTABLE);
    course.models.par_iter().zip(fits).map(|(m, fit)| step(loop_, m, fit, &judged)).collect()
}

/// Drops the last effects again where a simulation on its own feet does not gain by them: drawing the speed towards a noisy
/// measurement can make an effect look useful.
fn keep_confirmed(course: &mut Course, steps: &[Step], least_gain: f64) {
    while course.models.len() > 1 {
        let (before, after) = (&steps[course.models.len() - 2], &steps[course.models.len() - 1]);
        let gain = before.train.chi2_per_sample - after.train.chi2_per_sample;
        if gain > least_gain * after.train.chi2_per_sample {
            return;
        }
        course.models.pop();
        course.alternatives.pop();
    }
}

fn mean_square_all(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> f64 {
    let n: usize = experiments.iter().map(Experiment::count).sum();
    experiments.iter().zip(starts).map(|(e, x)| mean_square(machine, e, x) * e.count() as f64).sum::<f64>() / n as f64
}

fn ranking(loop_: &Refinement, course: &Course, significance: f64, remainder: Option<&Remainder>) -> Vec<Candidate> {
    let Some(first) = course.rounds.first() else { return Vec::new() };
    let m = first.scores.len().max(1);
    let last = &course.models[course.models.len() - 1];
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
                let rivals: Vec<&str> = course.alternatives[k].iter().map(|e| e.name()).collect();
                if rivals.is_empty() { "added".into() } else { format!("added; cannot be told from {}", rivals.join(", ")) }
            } else if course.alternatives.iter().flatten().any(|e| *e == s.effect) {
                "explains the data as well as an effect added".into()
            } else if remainder.is_some_and(|r| r.suspect == Some(s.effect)) {
                "may be missing, too: explains part of what is left, but is not confirmed".into()
            } else if !shown(s, usual, threshold) {
                "not excited: these recordings cannot show it at any usual size".into()
            } else if !first.significant.contains(&s.effect) {
                "not needed".into()
            } else if !loop_.possible(s) {
                "would need an impossible sign: a symptom of something else".into()
            } else if last.effects.is_empty() {
                "significant, but the held-out recording does not confirm it".into()
            } else {
                "explained by what was added".into()
            };
            Candidate {
                effect: s.effect,
                score: s.score,
                threshold,
                predicted_size: lead.1,
                keep: s.keep,
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
    s.score > threshold || (s.detectable <= usual && s.keep >= LEAST_KEEP)
}

/// What the effects added leave, where it is more than noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Remainder {
    /// The effect that would explain most of it on the held-out recording, if one does: tried, but not confirmed.
    pub suspect: Option<EffectId>,
    /// The training error with it, in noise floors.
    pub with_suspect: f64,
}

fn remainder(course: &Course, leftover: &[Dependence]) -> Option<Remainder> {
    let last = &course.models[course.models.len() - 1];
    let found = matches!(verdict_of(course, leftover, 1.0), Some(Verdict::MissingEffects | Verdict::Confounded));
    if !found || error(last, 1.0) - 1.0 <= NEGLIGIBLE || !structured(leftover) {
        return None;
    }
    let round = course.rounds.get(course.models.len() - 1)?;
    // The recording that no fit has seen judges best between those that none confirms.
    let unseen = |m: &Model| m.holdout.unwrap_or_else(|| m.train());
    let likely = round.trials.iter().filter(|t| likelier(last, &t.model, round.scores.len()));
    let suspect = likely.min_by(|a, b| unseen(&a.model).total_cmp(&unseen(&b.model)));
    Some(Remainder { suspect: suspect.map(|t| t.effect), with_suspect: suspect.map_or(last.train(), |t| t.model.train()) })
}

/// Largest relative standard deviation of a resistance or an inductance that counts as known.
const KNOWN: f64 = 0.05;

/// Whether the recordings determine the resistances and inductances of the machine.
fn determined(fit: &Fit) -> bool {
    use BaseParameter as P;
    let electrical = [P::StatorResistance, P::RotorResistance, P::StatorLeakageInductance, P::MagnetizingInductance];
    let (values, std) = (fit.values(), fit.standard_deviations());
    let of = |p: P| fit.free.iter().position(|f| f.id() == Some(ParameterId::Base(p)));
    electrical.into_iter().filter_map(of).all(|k| std[k] <= KNOWN * values[k])
}

/// Least gain, in noise floors, of a candidate that hints at an effect too small to be confirmed.
const HINT: f64 = 0.003;

/// Whether the residual depends on something beyond doubt.
fn structured(leftover: &[Dependence]) -> bool {
    leftover.first().is_some_and(|d| d.log_p > 10.0)
}

/// The larger of training and held-out error, in noise floors.
fn error(m: &Model, floor: f64) -> f64 {
    m.holdout.unwrap_or(0.0).max(m.train()) / floor
}

/// The part of the base model's excess over the noise that the effects explain.
fn explained(course: &Course) -> f64 {
    let (first, last) = (&course.models[0], &course.models[course.models.len() - 1]);
    1.0 - (error(last, 1.0) - 1.0) / (error(first, 1.0) - 1.0).max(1e-9)
}

fn leftover_of(loop_: &Refinement, course: &Course) -> Vec<Dependence> {
    let last = &course.models[course.models.len() - 1];
    dependences(&last.fit.machine, &last.fit.starts, loop_.pulled())
}

/// Whether a model with one more effect is likelier than chance would make one of `candidates`.
fn likelier(before: &Model, after: &Model, candidates: usize) -> bool {
    let n = after.fit.count as f64;
    let k = after.fit.free.len().saturating_sub(before.fit.free.len()) as f64;
    before.evidence - after.evidence > k * n.ln() + 2.0 * (candidates as f64).ln()
}

/// The verdict as far as effects and leftover decide it.
fn verdict_of(course: &Course, leftover: &[Dependence], floor: f64) -> Option<Verdict> {
    let (first, last) = (&course.models[0], &course.models[course.models.len() - 1]);
    let (before, after) = (error(first, floor) - 1.0, error(last, floor) - 1.0);
    let share_left = if last.effects.is_empty() { 1.0 } else { after / before.max(1e-9) };
    if after > NEGLIGIBLE && share_left > 0.1 && structured(leftover) {
        Some(Verdict::Unexplained)
    } else if last.effects.is_empty() {
        None
    } else if course.alternatives.iter().any(|a| !a.is_empty()) {
        Some(Verdict::Confounded)
    } else {
        Some(Verdict::MissingEffects)
    }
}

fn verdict(course: &Course, ranking: &[Candidate], leftover: &[Dependence], floor: f64) -> Verdict {
    if let Some(v) = verdict_of(course, leftover, floor) {
        return v;
    }
    let unexcited = ranking.iter().filter(|c| !c.excited).count();
    // A candidate that fits better than chance allows, yet gains too little to be confirmed.
    let first = &course.models[0];
    let gains = |m: &Model| first.train() - m.train() > HINT && likelier(first, m, ranking.len());
    let hinted = course.rounds.iter().flat_map(|r| &r.trials).any(|t| gains(&t.model));
    if 3 * unexcited > ranking.len() || hinted || !determined(&first.fit) { Verdict::Inconclusive } else { Verdict::Adequate }
}

fn changes(before: &MotorFile, after: &MotorFile, last: &Model) -> Vec<ParameterChange> {
    let values = last.fit.values();
    let std = last.fit.standard_deviations();
    let mut out = Vec::new();
    for (k, f) in last.fit.free.iter().enumerate() {
        if let im_identify::offline::Target::Machine(ids) = &f.target {
            let relative = std[k] / values[k].abs().max(1e-300);
            for &id in ids {
                let (b, a) = (before.machine.get(id), after.machine.get(id));
                let sd = if ids.len() > 1 { relative * a.abs() } else { std[k] };
                out.push(ParameterChange { id, before: b, after: a, std: sd });
            }
        }
    }
    out
}

impl Diagnosis {
    /// `diagnosis.json`, in the shape that others read.
    pub fn to_json(&self) -> Value {
        let finite = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
        let errors =
            |e: &Errors| json!({"chi2_per_sample": finite(e.chi2_per_sample), "rmse": e.rmse, "fit_percent": e.fit_percent});
        let names = |v: &[EffectId]| v.iter().map(|e| e.name()).collect::<Vec<_>>();
        let alternatives: BTreeMap<&str, Vec<&str>> =
            self.effects.iter().zip(&self.alternatives).map(|(e, a)| (e.name(), names(a))).collect();
        json!({
            "schema": 1,
            "verdict": self.verdict.name(),
            "effects": names(&self.effects),
            "alternatives": alternatives,
            "ranking": self.ranking.iter().map(|c| json!({
                "effect": c.effect.name(),
                "score": finite(c.score),
                "threshold": finite(c.threshold),
                "predicted_size": finite(c.predicted_size),
                "keep": finite(c.keep),
                "detectable_size": finite(c.detectable_size),
                "unit": c.unit,
                "conclusion": c.conclusion,
            })).collect::<Vec<_>>(),
            "steps": self.steps.iter().map(|s| json!({
                "effects": names(&s.effects),
                "train": errors(&s.train),
                "holdout": s.holdout.as_ref().map(errors),
            })).collect::<Vec<_>>(),
            "parameters": self.parameters.iter().map(|p| (p.id.to_string(), json!({
                "before": finite(p.before), "after": finite(p.after), "std": finite(p.std), "unit": p.id.unit(),
            }))).collect::<serde_json::Map<_, _>>(),
            "leftover": self.leftover.iter().take(6).map(|d| json!({
                "depends_on": d.variable.label(), "part": d.part.label(), "log10_p": -d.log_p, "size": d.size, "curve": d.curve,
            })).collect::<Vec<_>>(),
            "noise": self.noise,
        })
    }
}
