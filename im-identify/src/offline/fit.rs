//! Levenberg-Marquardt over all experiments at once.

use im_model::{EffectId, Machine, ModelError, Plant, State};
use nalgebra::{DMatrix, DVector, DVectorView};
use rayon::prelude::*;
use thiserror::Error;

use super::experiment::{Experiment, ExperimentError};
use super::free::{Free, Target, change_component, component};
use super::knowledge::{prior_cost, prior_terms};
use super::simulate::{Residuals, linearize_to, residuals_to};
use super::smoothness::{effective_parameters, likely_spreads, smoothness};
use super::thinned::Thinned;

/// Why a fit could not be made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FitError {
    /// An experiment does not fit together.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// The machine left its physical range.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The simulation of the starting parameters is not finite.
    #[error("{experiment}: the simulation with the starting parameters diverges; check units, pole pairs and the sampling time")]
    Diverges {
        /// Which experiment.
        experiment: String,
    },
}

/// A fit that stops when the cost falls by less than this is rough: slopes in longer steps are enough.
const ROUGH: f64 = 1e-3;

/// How hard to try.
#[derive(Clone, Debug)]
pub struct FitOptions {
    /// Largest number of accepted steps.
    pub iterations: usize,
    /// Stop when the cost falls by less than this fraction.
    pub tolerance: f64,
    /// Fractions of the recordings to fit first: short horizons keep poor starts from getting lost.
    pub horizons: Vec<f64>,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { iterations: 40, tolerance: 1e-8, horizons: vec![0.08, 0.3] }
    }
}

impl FitOptions {
    /// For a start that is already near: no short horizons.
    pub fn near() -> Self {
        Self { horizons: Vec::new(), tolerance: 1e-6, ..Self::default() }
    }

    /// From a start that is already near, only as far as models are compared by.
    pub fn quick() -> Self {
        Self { horizons: Vec::new(), tolerance: 1e-3, iterations: 10 }
    }
}

/// The result of a fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The fitted machine.
    pub machine: Machine<f64>,
    /// Initial states, one per experiment.
    pub starts: Vec<State<f64>>,
    /// What was free.
    pub free: Vec<Free>,
    /// Sum of squared residuals in units of σ², what is known beforehand left out.
    pub cost: f64,
    /// The same of what is known beforehand: one residual for each prior.
    pub prior_cost: f64,
    /// Number of residuals.
    pub count: usize,
    /// Covariance of the search variables for unit noise: (JᵀJ)⁻¹, P×P, what is known beforehand included.
    pub covariance: DMatrix<f64>,
    /// What is left, in σ: per experiment and channel, zero where a sample is not valid.
    pub residuals: Vec<Vec<Vec<f64>>>,
    /// Accepted steps.
    pub iterations: usize,
    /// How much work it was, in simulations of the start; slopes count as one more than there are parameters, over the steps they are taken in.
    pub work: f64,
    /// Whether the last step was below the tolerance.
    pub converged: bool,
}

impl Fit {
    /// χ²/N: mean squared residual in units of σ²; 1 is the noise of the sensors.
    pub fn chi2_per_sample(&self) -> f64 {
        self.cost / self.count as f64
    }

    /// The values of the free parameters.
    pub fn values(&self) -> Vec<f64> {
        self.free.iter().map(|f| current(f, &self.machine, &self.starts)).collect()
    }

    /// Standard deviations of the free parameters, inflated by the residual where that is above the noise.
    pub fn standard_deviations(&self) -> Vec<f64> {
        let inflation = self.chi2_per_sample().max(1.0).sqrt();
        self.free
            .iter()
            .enumerate()
            .map(|(k, f)| {
                f.slope(current(f, &self.machine, &self.starts)).abs() * self.covariance[(k, k)].max(0.0).sqrt() * inflation
            })
            .collect()
    }

    /// How many of the free parameters the data determine: of a learned curve fewer than it has coefficients.
    pub fn effective_parameters(&self) -> f64 {
        effective_parameters(&self.machine, &self.free, &self.covariance)
    }

    /// The same fit with the spread of each learned curve as the likelihood has it, at least that of `least`.
    ///
    /// # Errors
    /// None in practice: a spread is positive.
    pub fn with_likely_spreads(mut self, least: impl Fn(EffectId) -> f64) -> Result<Self, ModelError> {
        let spreads = likely_spreads(&self.machine, &self.free, &self.covariance, least);
        if !spreads.is_empty() {
            self.machine = self.machine.with(&spreads)?;
        }
        Ok(self)
    }

    /// Correlation of two free parameters; `None` where one has no variance.
    pub fn correlation(&self, a: usize, b: usize) -> Option<f64> {
        let c = &self.covariance;
        Some(c[(a, b)] / (c[(a, a)] * c[(b, b)]).sqrt()).filter(|c| c.is_finite())
    }

    /// Free parameters that the data do not determine: standard deviation beyond `limit` of the value (log) or of the scale.
    pub fn undetermined(&self, limit: f64) -> Vec<usize> {
        let inflation = self.chi2_per_sample().max(1.0).sqrt();
        (0..self.free.len())
            .filter(|&k| {
                let sd = self.covariance[(k, k)].sqrt() * inflation;
                sd.is_nan() || sd > limit
            })
            .collect()
    }
}

fn current(f: &Free, machine: &Machine<f64>, starts: &[State<f64>]) -> f64 {
    match &f.target {
        Target::Machine(ids) => machine.get(ids[0]),
        Target::Initial { experiment, component: k } => component(&starts[*experiment], *k),
    }
}

/// The machine and the starts after a step `v` of the search variables.
fn moved(
    machine: &Machine<f64>,
    starts: &[State<f64>],
    free: &[Free],
    v: &DVector<f64>,
) -> Result<(Machine<f64>, Vec<State<f64>>), ModelError> {
    let mut changes = Vec::with_capacity(free.len() + 1);
    let mut starts = starts.to_vec();
    for (f, &v) in free.iter().zip(v.iter()) {
        match &f.target {
            Target::Machine(ids) => changes.extend(ids.iter().map(|&id| (id, f.value(machine.get(id), v)))),
            Target::Initial { experiment, component: k } => {
                let x = &mut starts[*experiment];
                let p = f.value(component(x, *k), v);
                change_component(x, *k, |q| *q = p);
            }
        }
    }
    Ok((machine.with(&changes)?, starts))
}

/// Sum of squared residuals of a machine over the experiments, in units of σ².
pub fn cost(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> f64 {
    sum_of_squares(&simulated(machine, experiments, starts, 1.0))
}

fn rows(e: &Experiment, fraction: f64) -> usize {
    if e.is_table() {
        return e.len();
    }
    ((e.len() as f64 * fraction) as usize).clamp(e.len().min(2), e.len())
}

fn simulated(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>], fraction: f64) -> Residuals {
    experiments.par_iter().zip(starts).map(|(e, x)| residuals_to(machine, e, x, rows(e, fraction))).collect()
}

/// What is known before the data, of parameters and of learned curves, as part of the cost.
fn known_cost(machine: &Machine<f64>, free: &[Free]) -> f64 {
    prior_cost(machine, free) + smoothness(machine, free).map_or(0.0, |s| s.cost)
}

fn sum_of_squares(residuals: &Residuals) -> f64 {
    residuals.iter().map(|run| dot(run, run)).sum()
}

/// JᵀJ of the slopes; those of each run, in the steps of [`Thinned`], kept for later products with new residuals.
struct Slopes {
    per_run: Vec<Vec<Vec<Vec<f64>>>>,
    normal: DMatrix<f64>,
    /// The way gone since they were taken: the largest change of a search variable, summed over the steps.
    way: f64,
}

fn dot(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let of = |(x, y): (&Vec<f64>, &Vec<f64>)| {
        // A horizon may end within a step.
        let rows = x.len().min(y.len());
        DVectorView::from_slice(x, rows).dot(&DVectorView::from_slice(y, rows))
    };
    a.iter().zip(b).map(of).sum()
}

impl Slopes {
    fn at(here: &Point, taken: &Thinned, free: &[Free], fraction: f64) -> Self {
        let p = free.len();
        let of = |(k, run): (usize, &Experiment)| {
            let slopes = linearize_to(&here.machine, run, &here.starts[k], k, free, rows(run, fraction)).slopes;
            let lower = DMatrix::from_fn(p, p, |a, b| if b <= a { dot(&slopes[a], &slopes[b]) } else { 0.0 });
            (slopes, lower)
        };
        let runs: Vec<_> = taken.runs().par_iter().enumerate().map(of).collect();
        let (per_run, lower): (Vec<_>, Vec<_>) = runs.into_iter().unzip();
        let mut normal = lower.into_iter().fold(DMatrix::zeros(p, p), |sum, l| sum + l);
        normal.fill_upper_triangle_with_lower_triangle();
        Self { per_run, normal, way: 0.0 }
    }

    fn gradient(&self, taken: &Thinned, residuals: &Residuals) -> DVector<f64> {
        let shared = taken.shared(residuals);
        let of = |(s, r): (&Vec<Vec<Vec<f64>>>, &Vec<Vec<f64>>)| DVector::from_fn(s.len(), |k, _| dot(&s[k], r));
        let runs: Vec<DVector<f64>> = self.per_run.par_iter().zip(shared.par_iter()).map(of).collect();
        runs.into_iter().fold(DVector::zeros(self.normal.nrows()), |sum, g| sum + g)
    }

    /// The gradient, as of a step, for the bend of the way along a step: half the second derivative of the residuals, from the gradients here and
    /// after [`PROBE`] of the step. Geodesic acceleration: Transtrum and Sethna, "Improvements to the Levenberg-Marquardt algorithm for nonlinear
    /// least-squares minimization", 2012.
    fn turn(&self, step: &DVector<f64>, here: &DVector<f64>, near: &DVector<f64>) -> DVector<f64> {
        ((near - here) / PROBE + &self.normal * step) / PROBE
    }
}

/// Part of what slopes promise, below which a step shows that they do not hold.
const FAIR: f64 = 0.5;

/// Part of a step that tells how the way down bends, and largest bend, over the step, that can be trusted: 2‖a‖ ≤ 0.75 ‖v‖ for an acceleration of
/// a, twice the bend (Transtrum and Sethna).
const PROBE: f64 = 0.1;
const MOST_BEND: f64 = 0.375;

/// Fits the free parameters to all experiments, starting from `machine` and the experiments' own starts.
pub fn fit(machine: &Machine<f64>, experiments: &[Experiment], free: &[Free], options: &FitOptions) -> Result<Fit, FitError> {
    fit_from(machine, experiments.iter().map(Experiment::start_state).collect(), experiments, free, options)
}

/// The same from other `starts`, one per experiment.
pub fn fit_from(
    machine: &Machine<f64>,
    starts: Vec<State<f64>>,
    experiments: &[Experiment],
    free: &[Free],
    options: &FitOptions,
) -> Result<Fit, FitError> {
    for e in experiments {
        e.validate()?;
    }
    let mut given = Point::new(machine, starts);
    let mut room = Room::of(machine, experiments, free)?;
    let mut here = given.clone();
    // The rows of a table stand each on its own: no horizon is shorter.
    let horizons = if experiments.iter().any(|e| !e.is_table()) { &options.horizons[..] } else { &[] };
    let thinned = Thinned::of(experiments);
    for &fraction in horizons {
        // A rough answer is enough to start the next horizon from.
        let rough = Effort { iterations: options.iterations.min(12), tolerance: ROUGH, every_row: EveryRow::WhereMisled };
        descend(&mut here, &mut room, &thinned, free, fraction, &rough)?;
    }
    let FitOptions { iterations, tolerance, .. } = *options;
    let every_row = if tolerance < ROUGH { EveryRow::AtLast } else { EveryRow::WhereMisled };
    let effort = Effort { iterations, tolerance, every_row };
    let descent = |here: &mut Point, room: &mut Room| descend(here, room, &thinned, free, 1.0, &effort);
    let mut end = descent(&mut here, &mut room)?;
    // Short horizons can lead away, where a recording begins in motion for example: never worse than from the values given.
    let as_given = || sum_of_squares(&simulated(machine, experiments, &given.starts, 1.0)) + known_cost(machine, free);
    if !horizons.is_empty() && as_given() < here.cost {
        end = descent(&mut given, &mut room)?;
        here = given;
    }
    // Slopes from a short step before the minimum are those of the minimum, for the covariance.
    let mut normal = end.normal.unwrap_or_else(|| Slopes::at(&here, &thinned, free, 1.0).normal);
    for (k, [_, _, information]) in prior_terms(&here.machine, free).into_iter().enumerate() {
        normal[(k, k)] += information;
    }
    let smooth = smoothness(&here.machine, free);
    if let Some(s) = &smooth {
        normal += &s.information;
    }
    let prior_cost = prior_cost(&here.machine, free);
    Ok(Fit {
        covariance: inverse_of_normal(&normal),
        machine: here.machine,
        starts: here.starts,
        free: free.to_vec(),
        cost: here.cost - prior_cost - smooth.map_or(0.0, |s| s.cost),
        prior_cost,
        residuals: here.residuals,
        count: experiments.iter().map(Experiment::count).sum(),
        iterations: end.accepted,
        work: room.spent,
        converged: end.converged,
    })
}

/// How a descent ended; `normal` is JᵀJ where it was taken within a short step of the end.
pub(super) struct End {
    accepted: usize,
    converged: bool,
    normal: Option<DMatrix<f64>>,
}

/// Where a descent stands.
#[derive(Clone)]
pub(super) struct Point {
    machine: Machine<f64>,
    pub(super) starts: Vec<State<f64>>,
    residuals: Residuals,
    cost: f64,
}

/// How much work a fit may become: a step towards a machine that needs many times the steps of the start is not taken, and the whole ends,
/// wherever it is, after so many simulations of the start.
pub(super) struct Room {
    sample_time_s: f64,
    rate_per_s: f64,
    /// Simulations of the start, taken and at most.
    spent: f64,
    most: f64,
}

/// Times the steps of the start, and steps that cost nothing to speak of.
const MORE_STEPS: f64 = 5.0;
const FEW_STEPS: f64 = 10.0;

/// Slopes of all parameters that a fit may take; a healthy one takes two to ten.
const MOST_SLOPES: f64 = 20.0;

impl Room {
    /// Around a start, which must be one that can be followed.
    pub(super) fn of(machine: &Machine<f64>, experiments: &[Experiment], free: &[Free]) -> Result<Self, ModelError> {
        let runs = experiments.iter().filter(|e| !e.is_table());
        let sample_time_s = runs.map(|e| e.sample_time_s).fold(0.0, f64::max);
        let plant = Plant::new(machine);
        plant.followed(sample_time_s)?;
        let most = MOST_SLOPES * (free.len() + 1) as f64;
        Ok(Self { sample_time_s, rate_per_s: plant.fastest_rate(), spent: 0.0, most })
    }

    /// Counts so many simulations of a machine.
    fn spend(&mut self, machine: &Machine<f64>, simulations: f64) {
        let steps = |rate: f64| (self.sample_time_s * rate).max(1.0);
        self.spent += simulations * steps(Plant::new(machine).fastest_rate()) / steps(self.rate_per_s);
    }

    fn is_spent(&self) -> bool {
        self.spent >= self.most
    }

    fn holds(&self, machine: &Machine<f64>) -> bool {
        let rate = Plant::new(machine).fastest_rate();
        rate <= MORE_STEPS * self.rate_per_s || self.sample_time_s * rate <= FEW_STEPS
    }
}

impl Point {
    /// Not yet simulated.
    pub(super) fn new(machine: &Machine<f64>, starts: Vec<State<f64>>) -> Self {
        Self { machine: *machine, starts, residuals: Vec::new(), cost: f64::INFINITY }
    }

    fn simulated(
        machine: Machine<f64>,
        starts: Vec<State<f64>>,
        experiments: &[Experiment],
        free: &[Free],
        fraction: f64,
    ) -> Self {
        let residuals = simulated(&machine, experiments, &starts, fraction);
        // What is known beforehand weighs in a short horizon as in the whole.
        Self { cost: sum_of_squares(&residuals) + known_cost(&machine, free), machine, starts, residuals }
    }

    /// The cost, infinite where the simulation has run away.
    fn cost_or_infinite(&self) -> f64 {
        if self.cost.is_finite() { self.cost } else { f64::INFINITY }
    }

    /// Refuses a point whose simulation has run away, by the name of the experiment.
    fn check(&self, experiments: &[Experiment]) -> Result<(), FitError> {
        if self.cost.is_finite() {
            return Ok(());
        }
        let bad = experiments.iter().zip(&self.residuals).find(|(_, r)| r.iter().flatten().any(|r| !r.is_finite()));
        Err(FitError::Diverges { experiment: bad.map_or_else(String::new, |(e, _)| e.name.clone()) })
    }
}

/// A step that promises less than this part of what ends a descent is not worth a simulation.
const NOTHING: f64 = 0.01;

/// A way of the search variables over which old slopes still lead down well.
const NEAR: f64 = 0.1;
/// A way over which slopes hardly change: JᵀJ stands for the covariance.
const SHORT: f64 = 0.03;

/// How hard a descent tries.
pub(super) struct Effort {
    /// Accepted steps at most.
    pub iterations: usize,
    /// It ends when the cost falls by less than this fraction.
    pub tolerance: f64,
    /// When slopes are taken at every row.
    pub every_row: EveryRow,
}

/// When a descent goes on from slopes in longer steps to those of every row.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum EveryRow {
    /// Not at all: for a few parameters that are far from alike.
    Never,
    /// Where the others lead nowhere.
    WhereMisled,
    /// For the end, unless white noise is left: with that, all slopes that differ by less than itself lead to the same end.
    AtLast,
}

/// Levenberg-Marquardt from `here` over the first `fraction` of every recording. Fewer rows lead near the minimum, all of them into it:
/// where parameters are nearly alike, their small differences decide.
pub(super) fn descend(
    here: &mut Point,
    room: &mut Room,
    thinned: &Thinned,
    free: &[Free],
    fraction: f64,
    effort: &Effort,
) -> Result<End, FitError> {
    let experiments = thinned.recordings();
    let &Effort { iterations, tolerance, every_row } = effort;
    if free.is_empty() || iterations == 0 {
        *here = Point::simulated(here.machine, std::mem::take(&mut here.starts), experiments, free, fraction);
        return here.check(experiments).map(|()| End { accepted: 0, converged: free.is_empty(), normal: None });
    }
    let whole = Thinned::whole(experiments);
    let mut taken = thinned;
    *here = Point::simulated(here.machine, std::mem::take(&mut here.starts), experiments, free, fraction);
    here.check(experiments)?;
    let (mut damping, little) = (1e-3, tolerance.sqrt().min(ROUGH));
    let mut kept: Option<Slopes> = None;
    let mut accepted = 0;
    // A first step is always taken, for the residuals at this length.
    while accepted < iterations && (accepted == 0 || !room.is_spent()) {
        // Slopes are kept while steps are small: then the residuals of the last step are all that is new.
        let fresh = kept.is_none();
        let mut s = match kept.take() {
            Some(s) => s,
            None => {
                room.spend(&here.machine, fraction * (free.len() + 1) as f64 / taken.stride() as f64);
                Slopes::at(here, taken, free, fraction)
            }
        };
        let of_residuals = s.gradient(taken, &here.residuals);
        let mut gradient = of_residuals.clone();
        // The priors are known exactly at every step; only the slopes of the residuals are kept.
        let mut normal = s.normal.clone();
        for (k, [_, downhill, information]) in prior_terms(&here.machine, free).into_iter().enumerate() {
            gradient[k] += downhill;
            normal[(k, k)] += information;
        }
        if let Some(s) = smoothness(&here.machine, free) {
            gradient += s.downhill;
            normal += s.information;
        }
        // At a limit that the descent would cross, a parameter stays; the others find the minimum on that limit.
        let at = |f: &Free| current(f, &here.machine, &here.starts);
        let stopped: Vec<bool> = free.iter().zip(gradient.iter()).map(|(f, g)| f.stops(at(f), *g)).collect();
        let (mut gained, mut misled, mut promised, cost) = (None, false, f64::INFINITY, here.cost);
        let is_nothing = |promise: f64| promise <= NOTHING * tolerance * cost;
        for attempt in 0..14 {
            let Some((step, promise)) = damped_step(&normal, &gradient, &stopped, damping) else {
                damping *= 10.0;
                continue;
            };
            // After a step that missed, a shorter one is worth a simulation as long as it promises what counts, or new slopes would be the same.
            if attempt == 0 {
                promised = promise;
                if is_nothing(promise) {
                    break;
                }
            } else if promise <= tolerance * here.cost && (!fresh || promised <= little * here.cost) {
                break;
            }
            let mut after = |step: &DVector<f64>| {
                let there = moved(&here.machine, &here.starts, free, step).ok().filter(|(machine, _)| room.holds(machine));
                there.map(|(machine, starts)| {
                    room.spend(&machine, fraction);
                    Point::simulated(machine, starts, experiments, free, fraction)
                })
            };
            let Some(mut there) = after(&step) else {
                damping *= 10.0;
                continue;
            };
            // Where the way down bends, straight steps leave it or must be short.
            let falls_short = here.cost - there.cost_or_infinite() < FAIR * promise;
            if fresh && taken.stride() == 1 && falls_short {
                let turn = after(&(&step * PROBE)).map(|near| s.turn(&step, &of_residuals, &s.gradient(taken, &near.residuals)));
                let bend = turn.and_then(|turn| damped_step(&normal, &turn, &stopped, damping));
                let bend = bend.map(|(bend, _)| bend).filter(|bend| bend.norm() <= MOST_BEND * step.norm());
                if let Some(bent) =
                    bend.and_then(|bend| after(&(&step + bend))).filter(|bent| bent.cost_or_infinite() < there.cost_or_infinite())
                {
                    there = bent;
                }
            }
            if there.cost.is_finite() && there.cost < here.cost {
                let gain = (here.cost - there.cost) / here.cost;
                *here = there;
                damping = (damping * 0.1).max(1e-12);
                gained = Some((gain, step.amax()));
                break;
            }
            // Slopes in longer steps are a little off, and near the end lead across a narrow valley.
            misled = fresh && taken.stride() > 1 && (tolerance * cost..=ROUGH.sqrt() * cost).contains(&promised);
            // No better point along a direction this short: the minimum, to rounding.
            if misled || step.amax() < 1e-9 || damping > 1e10 {
                break;
            }
            damping *= 10.0;
        }
        // A shorter step that gains nothing is no arrival where the whole one promised much.
        let near = promised <= little * cost;
        let arrived = match gained {
            Some((gain, size)) => {
                accepted += 1;
                s.way += size;
                gain < tolerance && near
            }
            None => fresh || is_nothing(promised),
        };
        match (arrived, gained.is_some()) {
            (true, _)
                if (misled && every_row != EveryRow::Never)
                    || (every_row == EveryRow::AtLast && taken.stride() > 1 && !taken.leave_noise(&here.residuals)) =>
            {
                taken = &whole;
                damping = 1e-3;
            }
            (true, moved) => {
                let of_here = !moved || s.way < SHORT;
                return Ok(End { accepted, converged: near, normal: of_here.then_some(s.normal) });
            }
            (false, true) => kept = (s.way < NEAR).then_some(s),
            // Old slopes no longer lead down: new ones.
            (false, false) => damping = 1e-3,
        }
    }
    Ok(End { accepted, converged: false, normal: None })
}

/// (A + λ diag A) d = g, scaled, over the parameters that are not `stopped`; steps are limited to a factor e. With it gᵀd of the whole step: so much,
/// at least, the cost would fall if the slopes held.
fn damped_step(normal: &DMatrix<f64>, gradient: &DVector<f64>, stopped: &[bool], damping: f64) -> Option<(DVector<f64>, f64)> {
    let p = gradient.len();
    let d: Vec<f64> = (0..p).map(|k| normal[(k, k)].sqrt().max(1e-150)).collect();
    let scaled = DMatrix::from_fn(p, p, |a, b| match (a == b, stopped[a] || stopped[b]) {
        (true, true) => 1.0,
        (false, true) => 0.0,
        (same, false) => normal[(a, b)] / (d[a] * d[b]) + if same { damping } else { 0.0 },
    });
    let rhs = DVector::from_fn(p, |k, _| if stopped[k] { 0.0 } else { gradient[k] / d[k] });
    let x = scaled.cholesky()?.solve(&rhs);
    let promise = rhs.dot(&x);
    let step = DVector::from_fn(p, |k, _| (x[k] / d[k]).clamp(-1.0, 1.0));
    step.iter().all(|x| x.is_finite()).then_some((step, promise))
}

/// Inverse of a scaled positive semidefinite matrix; directions without information get a huge variance, and parameters without any a variance of
/// [`NOT_SEEN`] that goes with nothing.
pub fn inverse_of_normal(normal: &DMatrix<f64>) -> DMatrix<f64> {
    let p = normal.nrows();
    let d: Vec<f64> = (0..p).map(|k| normal[(k, k)].sqrt()).collect();
    let seen: Vec<usize> = (0..p).filter(|&k| d[k] > 0.0).collect();
    let mut inverse = DMatrix::from_diagonal_element(p, p, NOT_SEEN);
    if seen.is_empty() {
        return inverse;
    }
    let scaled = DMatrix::from_fn(seen.len(), seen.len(), |a, b| normal[(seen[a], seen[b])] / (d[seen[a]] * d[seen[b]]));
    let eigen = scaled.symmetric_eigen();
    let inv = eigen.eigenvalues.map(|l| 1.0 / l.max(1e-14));
    let m = &eigen.eigenvectors * DMatrix::from_diagonal(&inv) * eigen.eigenvectors.transpose();
    for (a, &i) in seen.iter().enumerate() {
        for (b, &j) in seen.iter().enumerate() {
            inverse[(i, j)] = m[(a, b)] / (d[i] * d[j]);
        }
    }
    inverse
}

/// Variance of a parameter that the data do not show.
pub const NOT_SEEN: f64 = 1e120;

#[cfg(test)]
mod tests;
