//! The answer: verdict, effects, rivals, errors before and after, and the files that carry it.

mod beside_unknown;
mod electrical_side;
mod json;
mod ranking;
pub(crate) mod remarks;
mod steps;
mod verdict;

use std::collections::BTreeMap;

use im_identify::offline::{Experiment, FitError, Free, Target, predict};
use im_model::{EffectId, MotorFile, ParameterId, Prediction};

use crate::case::Case;
use crate::held_ratio::{HELD, held_std, is_held};
use crate::learn::{Curve, Depth, contest, with_curves};
use crate::left_error::{self, prediction, unseen};
use crate::loads::Loads;
use crate::losses::{ModelPoint, by_model};
use crate::residual_tests::Dependence;
use crate::search::{Course, Learning, Model, Options, Refinement, Sets};
use crate::steady_curve::RatedSupply;
use crate::uncertainty::{Estimates, MachineQuantity, is_open, is_unknown};
pub use electrical_side::{AskedLoad, ElectricalSide};
pub use ranking::Candidate;
use ranking::ranking;
pub(crate) use ranking::{NOT_EXCITED, SUSPECTED};
pub use steps::Step;
use steps::{Found, steps};
pub use verdict::{Doubt, ResidualCause, Verdict};
use verdict::{Left, caused, is_contested, residual_cause, verdict};

/// A parameter before and after.
#[derive(Clone, Debug)]
pub struct ParameterChange {
    /// Which.
    pub quantity: MachineQuantity,
    /// As given.
    pub before: f64,
    /// As refined.
    pub after: f64,
    /// Standard deviation.
    pub std: f64,
    /// Whether it follows from the inverse-Γ circuit with the ratio of the leakages as given, which is known to a fifth.
    pub ratio_held: bool,
}

impl ParameterChange {
    /// Whether the recordings leave it open.
    pub fn is_open(&self) -> bool {
        !self.ratio_held && is_open(self.after, self.std)
    }

    /// Whether they say nothing of it, so that its change means nothing.
    pub fn is_unknown(&self) -> bool {
        is_unknown(self.after, self.std)
    }

    /// Whether it is one of the coefficients of a learned curve: the curve's band says how well that is known.
    pub fn is_of_a_curve(&self) -> bool {
        self.quantity.is_of_a_curve()
    }
}

/// The whole answer.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// The verdict.
    pub verdict: Verdict,
    /// Why the recordings cannot decide, where the verdict is `inconclusive`.
    pub doubts: Vec<Doubt>,
    /// Effects of the refined model, in order of addition; under `unexplained` they may stand in for something else ([`Self::named`]).
    pub effects: Vec<EffectId>,
    /// For each, those that explain the data as well.
    pub alternatives: Vec<Vec<EffectId>>,
    /// Under `unexplained`, those that are there beside the unknown cause.
    pub beside_unknown: Vec<EffectId>,
    /// All candidates, best first.
    pub ranking: Vec<Candidate>,
    /// The refitted base model, then one step per effect.
    pub steps: Vec<Step>,
    /// Parameters before and after: what the recordings determine first, then the rest of the T circuit.
    pub parameters: Vec<ParameterChange>,
    /// What the recordings determine, with its covariance.
    pub estimates: Estimates,
    /// The motor with the effects added and everything refitted.
    pub refined: MotorFile,
    /// The band of prediction that the training recordings alone give, for the held-out one to be held against.
    pub by_training: Option<Prediction>,
    /// What the last model's residual still depends on.
    pub dependences: Vec<Dependence>,
    /// Curves of no known form with which the recordings are likelier than with the effects alone: where nothing is named, they count for
    /// more than some of them; else for less than each. The refined motor is without them.
    pub curves: Vec<EffectId>,
    /// Loads that no column holds, as the last model finds them, and the effects that are not determined without them.
    pub loads: Loads,
    /// What the electrical side alone says, where everything together is not explained.
    pub electrical_side: Option<ElectricalSide>,
    /// More than noise that is left beside effects that were found: less than a tenth, or the verdict is `unexplained`.
    pub residual_cause: Option<ResidualCause>,
    /// What the motor does on its rated supply, as given and as refined.
    pub rated: [RatedSupply; 2],
    /// Losses of the refined motor in the rows of tables.
    pub losses: Vec<ModelPoint>,
    /// Curves among the effects that no formula of the library gives.
    pub learned: Vec<Curve>,
    /// Noise per channel, in its unit.
    pub noise: BTreeMap<String, f64>,
    /// The case as analysed, with the noise as estimated.
    pub case: Case,
    /// The course of the loop, for those who want every number.
    pub course: Course,
}

impl Diagnosis {
    /// The effects that the machine is said to have: where what is left shows that the library does not hold the cause, those that explain what there is
    /// to see where they act, as the others may only imitate it.
    pub fn named(&self) -> &[EffectId] {
        if self.verdict == Verdict::Unexplained { &self.beside_unknown } else { &self.effects }
    }

    /// Effects that explain the data as well in the place of one of the refined model.
    pub fn rivals(&self, effect: EffectId) -> &[EffectId] {
        self.effects.iter().zip(&self.alternatives).find(|(e, _)| **e == effect).map_or(&[], |(_, rivals)| rivals)
    }
}

/// Runs the whole loop on a case and decides.
pub fn diagnose(case: Case, options: Options) -> Result<Diagnosis, FitError> {
    let (loop_, base) = Refinement::new(case, options)?;
    diagnose_from(loop_, base)
}

/// The same from a base model that is fitted already.
pub fn diagnose_from(loop_: Refinement, base: Model) -> Result<Diagnosis, FitError> {
    let again = (loop_.clone(), base.clone());
    let found = decide(loop_, base, None)?;
    let (loop_, base) = again;
    let Some(alone) = electrical_side::alone(&found, loop_.options()) else { return Ok(found) };
    let suggested = suggested(&loop_, &base, &found, &alone);
    let found = if suggested.is_some() { decide(loop_, base, suggested)? } else { found };
    let unexplained = found.verdict == Verdict::Unexplained;
    let electrical_side = unexplained.then(|| ElectricalSide::of(&found, &alone)).flatten();
    Ok(Diagnosis { electrical_side, ..found })
}

/// The effects that explain the electrical side `alone`, fitted to everything together, where that is likelier than what was `found`: a search follows
/// slopes, which may lead elsewhere from where the balance of torques is wrong.
fn suggested(loop_: &Refinement, base: &Model, found: &Diagnosis, alone: &Diagnosis) -> Option<Model> {
    let last = alone.steps.last().filter(|_| alone.verdict != Verdict::Unexplained)?;
    let model = loop_.model_by_currents(base, &last.machine, &last.starts, &last.effects)?;
    (model.deviance < found.course.last().model.deviance).then_some(model)
}

/// Times that speeds are found anew by what a search found.
const TURNS: usize = 3;

/// The sets that a search has fitted. A speed that nobody measured was found by a machine without the effects, and what that did to it looks like
/// effects: it is found anew by the likeliest single one before the search, and by what the search finds, until that stays the same or the search
/// comes to no end.
fn searched(loop_: &mut Refinement, base: Model, suggested: Option<Model>) -> Result<Sets, FitError> {
    loop_.weigh_given(&base);
    let sets = Sets::with(base.clone(), suggested);
    if !loop_.finds_speeds() {
        return loop_.search(sets);
    }
    let (mut found, mut sets) = loop_.likeliest(loop_.expanded(sets, &[]))?;
    let mut by = Vec::new();
    for _ in 0..TURNS {
        if !same(&found.effects, &by) {
            by = found.effects.clone();
            let found = loop_.on_its_own_speeds(found)?;
            let base = loop_.base_again(&base)?;
            loop_.weigh_given(&base);
            sets = Sets::with(base, Some(found));
        }
        (found, sets) = loop_.likeliest(loop_.search(sets)?)?;
        if same(&found.effects, &by) || sets.is_cut_short() {
            break;
        }
    }
    Ok(sets)
}

/// Whether two sets are the same, in whatever order.
fn same(a: &[EffectId], b: &[EffectId]) -> bool {
    a.len() == b.len() && a.iter().all(|e| b.contains(e))
}

/// One search, which knows a `suggested` model beforehand, and what follows from it.
fn decide(mut loop_: Refinement, base: Model, suggested: Option<Model>) -> Result<Diagnosis, FitError> {
    let Options { significance, learning, .. } = *loop_.options();
    let before = loop_.case().motor.clone();
    let sets = searched(&mut loop_, base, suggested)?;
    let (mut course, sets) = loop_.course(sets)?;
    let mut found = Found::new(&loop_, &course);
    let mut left = Left::new(&loop_, &course, &found);
    let mut likelier = None;
    let contested = is_contested(&course, &left);
    if learning == Learning::Always || (learning == Learning::Unexplained && contested) {
        if let Some(with) = with_curves(&mut loop_, &course, sets)? {
            course = with;
            found = Found::new(&loop_, &course);
            left = Left::new(&loop_, &course, &found);
        }
        left = left.bent(&loop_, &found);
    } else if contested {
        left = left.bent(&loop_, &found);
        // Where the form of what was found may be all that is wrong, a curve is that form, and replaces nothing.
        let decided = left.is_unexplained(1.0) || left.is_form();
        let depth = if decided { Depth::Beside } else { Depth::Whole };
        likelier = contest(&mut loop_, &course, sets, depth)?;
        if let Some(likelier) = &likelier {
            let curves: Vec<EffectId> = likelier.effects.iter().copied().filter(|e| e.free_form().is_some()).collect();
            let found = &course.last().model.effects;
            let gives_way = |e| !likelier.effects.contains(e) || likelier.imitators.contains(e);
            let replaced = found.is_empty() || found.iter().any(gives_way);
            let replace = !curves.is_empty() && replaced && !left.is_form();
            left = left.contested(curves, replace);
        }
    }
    let last = &course.last().model;
    let mut there = Vec::new();
    // A table is too short to tell errors of form from noise.
    if contested && !loop_.nudged().iter().all(Experiment::is_table) {
        let form = left.is_form();
        there = beside_unknown::there(&loop_, last, form);
        there.retain(|e| form || likelier.as_ref().is_none_or(|l| l.effects.contains(e)));
        left = left.beside_unknown(&there, &last.effects);
    }
    // Coloured noise is rougher than white noise of the same size is taken to be: where nothing in the residual has a cause, it is the noise.
    let floor = if caused(&course, &left) { 1.0 } else { found.last().train.chi2_per_sample.max(1.0) };
    let (steps, judged) = if floor > 1.05 {
        loop_.set_noise(&found.last().train.rmse);
        steps(&loop_, &course)
    } else {
        (found.steps.clone(), found.judged.clone())
    };
    let residual_cause = residual_cause(&course, &left);
    let ranking = ranking(&loop_, &course, significance.get(), residual_cause.as_ref().and_then(|r| r.suspect));
    let (verdict, doubts) = verdict(&course, &ranking, &left, floor);
    let alternatives = course.alternatives();
    let alone = last.effects.iter().zip(&alternatives).filter(|(_, rivals)| verdict == Verdict::Unexplained && rivals.is_empty());
    let beside_unknown = alone.map(|(e, _)| *e).filter(|e| e.free_form().is_none() && there.contains(e)).collect();
    let last_step = &steps[steps.len() - 1];
    let Step { machine, starts, holdout_start, effects, .. } = last_step;
    let case = loop_.case();
    let loads = Loads::of(machine, &case.train, starts).with_holdout(machine, case.holdout.as_slice(), holdout_start.as_slice());
    let free = loop_.free(machine, effects, &judged.train);
    let estimates = Estimates::new(&before, machine, starts, &judged.train, &free);
    let mut left_error = unseen(&loop_, machine, &estimates);
    let by_training = prediction(&left_error);
    left_error.extend(judged.holdout.iter().zip(holdout_start).map(|(e, x)| left_error::Left::of(e, &predict(machine, e, x))));
    let refined = MotorFile { machine: *machine, prediction: prediction(&left_error), ..before.clone() };
    let parameters = changes(&before, &refined, &free, &estimates);
    let rated = [&before, &refined].map(RatedSupply::of);
    let losses = by_model::points(&estimates, machine, &case.train);
    let case = loop_.case().clone();
    let noise = noise_of(&case);
    let with_rivals = last.effects.iter().zip(course.alternatives());
    let price = price_of_a_number(&course);
    let learned = with_rivals.filter_map(|(&e, rivals)| Curve::new(e, machine, &estimates, rivals, price)).collect();
    Ok(Diagnosis {
        verdict,
        doubts,
        effects: last.effects.clone(),
        alternatives,
        beside_unknown,
        ranking,
        steps,
        parameters,
        estimates,
        refined,
        by_training,
        curves: left.curves.clone(),
        dependences: found.dependences,
        loads,
        electrical_side: None,
        residual_cause,
        rated,
        losses,
        learned,
        noise,
        case,
        course,
    })
}

/// The noise of each channel, root mean square over the rows of the training recordings: instruments of several tables have several.
fn noise_of(case: &Case) -> BTreeMap<String, f64> {
    let mut sums: BTreeMap<String, [f64; 2]> = BTreeMap::new();
    for c in case.train.iter().flat_map(|e| &e.channels) {
        let rows = c.count() as f64;
        let [all, squares] = sums.entry(c.name.clone()).or_default();
        (*all, *squares) = (*all + rows, *squares + rows * c.sigma * c.sigma);
    }
    sums.into_iter().map(|(name, [rows, squares])| (name, (squares / rows.max(1.0)).sqrt())).collect()
}

/// ln(N/λ): by how much the cost of a formula must fall for one number more. The search asks λ times that of D; the covariance of a curve, which the
/// cost is measured by, has the noise as it is, colour and form error included, and λ with it.
fn price_of_a_number(course: &Course) -> f64 {
    (course.first().model.fit.count as f64 / course.posterior.dispersion).ln().max(0.0)
}

fn changes(before: &MotorFile, after: &MotorFile, free: &[Free], estimates: &Estimates) -> Vec<ParameterChange> {
    let (given, fitted) = (&before.machine, &after.machine);
    let determined = estimates.list.iter().map(|e| (e.quantity, e.std, false));
    let moved = free.iter().filter_map(|f| match &f.target {
        Target::Machine(ids) => Some(ids),
        Target::Initial { .. } => None,
    });
    let stds = held_std(estimates, after);
    let std =
        |id: ParameterId| HELD.into_iter().zip(stds).find(|(p, _)| ParameterId::Base(*p) == id).map_or(f64::NAN, |(_, std)| std);
    let held = moved.flatten().filter(|id| is_held(**id)).map(|&id| (MachineQuantity::Parameter(id), std(id), true));
    determined
        .chain(held)
        .map(|(quantity, std, ratio_held)| {
            let (before, after) = (quantity.of(given), quantity.of(fitted));
            ParameterChange { quantity, before, after, std, ratio_held }
        })
        .collect()
}
