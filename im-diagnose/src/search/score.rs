//! Projected score tests: what each effect of the library could explain of the residual that no refit of the present parameters can.
//!
//! r whitened residual, J whitened slopes of the present parameters, G the effect's signature (one column per strength),
//! P = I − J(JᵀJ)⁻¹Jᵀ:   S = (GᵀPr)ᵀ (GᵀPG)⁻¹ (GᵀPr) ~ χ²_k when the effect is absent.
//!
//! Signatures are secants: the change of the outputs at the size that would matter, over that size. They exist where derivatives at
//! zero strength do not (a shaft with a little compliance is stiff), and cost one plain simulation each, in longer steps with cubics
//! between them where the signals are smooth. The sums are over every row: over sums of rows the noise model describes other noise, and
//! effects that imitate one another are ranked otherwise.

use std::ops::Range;
use std::sync::OnceLock;

use im_identify::offline::{ChannelKind, Experiment, Free, Residuals, Thinned, effect_parameters, residuals};
use im_model::effects::{COEFFICIENTS, FreeForm, Role};
use im_model::{Bound, EffectId, Machine, ParameterId, Rating, State};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::noise::{Whitener, whiteners};
use crate::residuals::{all_residuals, change, deviance, slopes};
use crate::shaft_lines::{self, Run, same_order};
use crate::statistics::{Basis, closest_of, complement, dot, log_p, threshold};

/// Score of one effect at its best shape.
#[derive(Clone, Debug)]
pub struct Score {
    /// The effect.
    pub effect: EffectId,
    /// χ² score, best over the shapes tried.
    pub score: f64,
    /// By how much D, minus twice the log-likelihood, would fall if the slopes held: what a refit promises. The score with the colour of the noise
    /// as it seems now, or the fall of D by a plain least-squares fit, with the colour of what that leaves, if that is more.
    pub gain: f64,
    /// Degrees of freedom: the number of strengths; of an effect fixed to the shaft, for every recording.
    pub freedom: usize,
    /// −log₁₀ of the p-value, corrected for the shapes tried.
    pub log_p: f64,
    /// What of the signature a refit of the present parameters cannot imitate: ‖PG‖²/‖G‖² of the leading strength.
    pub explained_share: f64,
    /// The same of the signature as it is, if that is more: what a wrong model leaves has another colour than noise.
    pub excitation: f64,
    /// Sizes that the score predicts, one per strength, in the parameter's unit.
    pub predicted: Vec<f64>,
    /// Where to begin a refit: at the best shape; of a resonance, at the three best of the grid, as each may lead to another minimum.
    pub seeds: Vec<Seed>,
    /// Smallest size of the leading strength that would be found, in its unit.
    pub detectable: f64,
    /// χ² that it explains at that size.
    pub chi2_detectable: f64,
    /// The shape it was found at: parameter index and value.
    pub shape: Vec<(usize, f64)>,
    /// What the effect explains of the residual at the sizes predicted, projected and decimated, for comparing effects.
    pub signature: Vec<f64>,
    /// The projected signature of each strength by itself, decimated alike.
    pub directions: Vec<Vec<f64>>,
    /// By how many σ a unit of each strength changes the outputs, per shape tried: where the next score looks for sizes that matter.
    pub sensitivity: Vec<Vec<f64>>,
    /// What it would do in the place of each of the effects that are there.
    pub instead: Vec<Instead>,
}

impl Score {
    /// Whether enough of it is left by a refit of the present parameters to say anything.
    pub fn is_excited(&self) -> bool {
        self.excitation >= LEAST_EXPLAINED_SHARE
    }

    /// The same with refits that begin at a part of the sizes.
    pub fn smaller(&self, part: f64) -> Self {
        let mut score = self.clone();
        score.seeds.iter_mut().flat_map(|s| &mut s.predicted).for_each(|x| *x *= part);
        score
    }
}

/// What an effect would do in the place of another that is there.
#[derive(Clone, Debug)]
pub struct Instead {
    /// The other.
    pub of: EffectId,
    /// The part of what the other does beside the rest, as far as slopes tell.
    pub part: f64,
    /// Where to begin a refit.
    pub seed: Seed,
}

/// A shape, parameter index and value, and the sizes that the score predicts there.
#[derive(Clone, Debug)]
pub struct Seed {
    /// The shape.
    pub shape: Vec<(usize, f64)>,
    /// The sizes, one per strength.
    pub predicted: Vec<f64>,
}

/// Lines of the residual at most whose order an effect is tried at.
const MOST_LINES: usize = 3;

/// Shapes of a resonance that a refit begins at.
const RESONANCES: usize = 3;

/// Everything a score needs at the present machine.
pub struct ScoreContext<'a> {
    experiments: &'a [Experiment],
    starts: &'a [State<f64>],
    machine: Machine<f64>,
    rating: &'a Rating,
    every_row: Way<'a>,
    /// `None` where the recordings allow no longer steps.
    longer_steps: Option<Way<'a>>,
    whiteners: Vec<Vec<Whitener>>,
    /// Whitened, and plain.
    white: Projection,
    plain: Projection,
    /// D of what a plain refit of the present parameters leaves.
    deviance: f64,
    /// Root mean square of the raw residual, in σ.
    raw_rms: f64,
    /// Variance of the whitened residual.
    variance: f64,
    /// Chance of a false alarm per effect.
    level: f64,
    /// The residual in σ, at every row.
    residuals: Residuals,
    /// Orders, per turn of the rotor, of lines in the residual: looked for when an effect of some order is scored.
    lines: OnceLock<Vec<f64>>,
    /// Effects that are there, and that others may take the place of.
    replaceable: Vec<Replaceable>,
}

/// An effect that is there, as the others see it when it is gone.
struct Replaceable {
    effect: EffectId,
    /// The residual without it, which no other parameter has followed.
    residual: Column,
    /// What of the slopes' span, in its basis, belongs to this effect's parameters alone: orthonormal.
    own: Vec<Vec<f64>>,
    /// What the effect does: how much more is left without it when the others have followed.
    does: f64,
}

impl Replaceable {
    /// gᵀP'h, where P' takes out only what the other parameters can follow.
    fn product(&self, g: &Column, h: &Column) -> f64 {
        g.product(h) + self.own.iter().map(|q| dot(q, &g.onto) * dot(q, &h.onto)).sum::<f64>()
    }
}

/// Least part of a signature that a refit must not be able to imitate for its size to mean anything: below it, what tells it apart is
/// smaller than what the linear projection neglects.
const LEAST_EXPLAINED_SHARE: f64 = 1e-3;

/// A change of the outputs of more than so many times the residual is too large for a secant.
const FAR: f64 = 4.0;

/// Rows of a signature that are enough to compare effects by.
const SKETCH: usize = 4000;

/// A part of a size that is next to nothing: what changes the outputs no less than half as much has no slope there. A load behind a spring swings
/// however little of the inertia it has.
const NOTHING: f64 = 1e-3;

/// The residual of a fit, and what the slopes of the present parameters span.
#[derive(Default)]
struct Projection {
    basis: Basis<f32>,
    /// Of every slope, in the basis.
    coordinates: Vec<Vec<f64>>,
    /// Projected.
    residual: Vec<f64>,
    /// Every so many rows of the basis.
    stride: usize,
    sketch: Basis<f32>,
}

/// A column that is zero but for the rows from `begin` on, and what of it lies in the span of a [`Projection`].
struct Column {
    begin: usize,
    values: Vec<f64>,
    onto: Vec<f64>,
}

impl Column {
    fn rows(&self) -> Range<usize> {
        self.begin..self.begin + self.values.len()
    }

    /// gᵀg.
    fn norm(&self) -> f64 {
        dot(&self.values, &self.values)
    }

    /// gᵀPh = gᵀh − (Qᵀg)ᵀ(Qᵀh).
    fn product(&self, other: &Self) -> f64 {
        let common = self.begin.max(other.begin)..self.rows().end.min(other.rows().end);
        let part = |c: &Self| common.start - c.begin..common.end - c.begin;
        let whole = if common.is_empty() { 0.0 } else { dot(&self.values[part(self)], &other.values[part(other)]) };
        whole - dot(&self.onto, &other.onto)
    }

    /// gᵀPg.
    fn apart(&self) -> f64 {
        self.product(self).max(0.0)
    }
}

impl Projection {
    /// One more slope: before there is a residual.
    fn push(&mut self, slope: Vec<f64>) {
        self.coordinates.push(self.basis.push(slope));
    }

    /// Of this residual.
    fn of(mut self, mut residual: Vec<f64>) -> Self {
        let along = self.basis.along(0, &residual);
        self.basis.take(&along, &mut residual);
        self.stride = (residual.len() / SKETCH).max(1);
        self.sketch = self.basis.in_steps(self.stride);
        Self { residual, ..self }
    }

    /// A slope in the basis.
    fn coordinates_of(&self, slope: usize) -> Vec<f64> {
        let mut whole = self.coordinates[slope].clone();
        whole.resize(self.basis.rank(), 0.0);
        whole
    }

    fn column(&self, begin: usize, values: Vec<f64>) -> Column {
        let onto = self.basis.along(begin, &values);
        Column { begin, values, onto }
    }

    /// The rows of (Pg)x.
    fn projected(&self, columns: &[(&Column, f64)]) -> Vec<f64> {
        let mut out = vec![0.0; self.residual.len()];
        for (c, x) in columns {
            out[c.rows()].iter_mut().zip(&c.values).for_each(|(out, v)| *out += x * v);
        }
        self.basis.take(&self.onto(columns), &mut out);
        out
    }

    /// (Qᵀg)x.
    fn onto(&self, columns: &[(&Column, f64)]) -> Vec<f64> {
        (0..self.basis.rank()).map(|k| columns.iter().map(|(c, x)| x * c.onto[k]).sum()).collect()
    }

    /// Every so many rows of (Pg)x.
    fn sketched(&self, columns: &[(&Column, f64)]) -> Vec<f64> {
        let mut out = vec![0.0; self.residual.len().div_ceil(self.stride)];
        for (c, x) in columns {
            let first = c.begin.next_multiple_of(self.stride);
            let values = c.values.get(first - c.begin..).unwrap_or_default().iter().step_by(self.stride);
            out[first / self.stride..].iter_mut().zip(values).for_each(|(out, v)| *out += x * v);
        }
        self.sketch.take(&self.onto(columns), &mut out);
        out
    }

    /// Least-squares sizes of columns, with what is `known` of the sizes before: their precision.
    fn solved(&self, columns: &[&Column], known: Option<&DMatrix<f64>>) -> Option<(DMatrix<f64>, DVector<f64>, f64)> {
        let n = columns.len();
        let gram = DMatrix::from_fn(n, n, |a, b| columns[a].product(columns[b]));
        let gram = match known {
            Some(known) => gram + known,
            None => gram,
        };
        let b = DVector::from_fn(n, |a, _| dot(&columns[a].values, &self.residual[columns[a].rows()]));
        let x = gram.clone().cholesky()?.solve(&b);
        let taken = b.dot(&x);
        Some((gram, x, taken))
    }
}

/// Strings everything into one column.
fn strung(signals: &[Vec<Vec<f64>>]) -> Vec<f64> {
    signals.iter().flatten().flatten().copied().collect()
}

/// The other way.
fn cut(runs: &[Experiment], column: &[f64]) -> Residuals {
    let mut rest = column;
    let mut channel = |rows: usize| {
        let (head, tail) = rest.split_at(rows);
        rest = tail;
        head.to_vec()
    };
    runs.iter().map(|e| e.channels.iter().map(|_| channel(e.len())).collect()).collect()
}

/// Runs in some steps, and what the machine does there.
struct Way<'a> {
    thinned: Thinned<'a>,
    /// What it leaves, in σ.
    before: Residuals,
}

impl<'a> Way<'a> {
    fn new(machine: &Machine<f64>, starts: &[State<f64>], thinned: Thinned<'a>) -> Self {
        let before = all_residuals(machine, starts, thinned.runs());
        Self { thinned, before }
    }

    /// The change of the outputs to another machine, in σ at every row.
    fn change_to(&self, other: &Machine<f64>, starts: &[State<f64>]) -> Option<Residuals> {
        let runs = self.thinned.runs().iter().zip(starts).zip(&self.before);
        let to = |((e, x), before): ((&Experiment, &State<f64>), &Vec<Vec<f64>>)| {
            let d = change(before, &residuals(other, e, x));
            d.iter().flatten().all(|v| v.is_finite()).then_some(d)
        };
        let change: Residuals = runs.map(to).collect::<Option<_>>()?;
        Some(self.thinned.at_every_row(&change))
    }
}

/// Whitens per channel and strings everything into one column.
fn column(signals: &[Vec<Vec<f64>>], whiteners: &[Vec<Whitener>]) -> Vec<f64> {
    signals.iter().zip(whiteners).flat_map(|(s, w)| s.iter().zip(w).flat_map(|(x, w)| w.apply(x)).collect::<Vec<_>>()).collect()
}

impl<'a> ScoreContext<'a> {
    /// Prepares the scores at `machine`, whose parameters `free` have been fitted; sizes are detectable at `level`, the chance of a false
    /// alarm per effect.
    pub fn new(
        machine: &Machine<f64>,
        starts: &'a [State<f64>],
        experiments: &'a [Experiment],
        rating: &'a Rating,
        free: &[im_identify::offline::Free],
        level: f64,
    ) -> Self {
        let residuals = all_residuals(machine, starts, experiments);
        let whiteners = whiteners(experiments, &residuals);
        let (mut white, mut plain) = (Projection::default(), Projection::default());
        for slope in slopes(machine, starts, experiments, free) {
            rayon::join(|| white.push(column(&slope, &whiteners)), || plain.push(strung(&slope)));
        }
        let (white, plain) = (white.of(column(&residuals, &whiteners)), plain.of(strung(&residuals)));
        let count: usize = experiments.iter().map(Experiment::count).sum();
        let raw_rms = (residuals.iter().flatten().flatten().map(|r| r * r).sum::<f64>() / count as f64).sqrt();
        let variance = (dot(&white.residual, &white.residual) / count as f64).max(1.0);
        let every_row = Way::new(machine, starts, Thinned::whole(experiments));
        let longer_steps = Some(Thinned::of_changes(experiments)).filter(|t| t.stride() > 1);
        let longer_steps = longer_steps.map(|t| Way::new(machine, starts, t));
        Self {
            deviance: deviance(experiments, &cut(experiments, &plain.residual)),
            experiments,
            starts,
            machine: *machine,
            rating,
            every_row,
            longer_steps,
            whiteners,
            white,
            plain,
            raw_rms,
            variance,
            level,
            residuals,
            lines: OnceLock::new(),
            replaceable: Vec::new(),
        }
    }

    /// The same, to see what others would do in the place of some effects whose parameters were among those fitted, `free`.
    pub fn replacing(mut self, effects: &[EffectId], free: &[Free]) -> Self {
        self.replaceable = effects.par_iter().filter_map(|&e| self.replaceable(e, free)).collect();
        self
    }

    fn replaceable(&self, effect: EffectId, free: &[Free]) -> Option<Replaceable> {
        let change = self.way(effect).change_to(&self.machine.without([effect]).ok()?, self.starts)?;
        let left = column(&self.residuals, &self.whiteners);
        let left = left.iter().zip(column(&change, &self.whiteners)).map(|(r, d)| r - d).collect();
        let residual = self.white.column(0, left);
        let others = free.iter().enumerate().filter(|(_, f)| !matches!(f.id(), Some(ParameterId::Effect(e, _)) if e == effect));
        let own = complement(others.map(|(k, _)| self.white.coordinates_of(k)), self.white.basis.rank());
        let mut gone = Replaceable { effect, residual, own, does: 0.0 };
        gone.does = gone.product(&gone.residual, &gone.residual) - dot(&self.white.residual, &self.white.residual);
        (gone.does > 0.0).then_some(gone)
    }

    /// What an effect of a shape, with such columns, would do in the place of one that is there.
    fn instead(&self, gone: &Replaceable, effect: EffectId, shape: &[(usize, f64)], columns: &[Column]) -> Option<Instead> {
        let size = |k: usize| gone.product(&columns[k], &columns[k]);
        let used: Vec<usize> = (0..columns.len()).filter(|&k| size(k) > LEAST_EXPLAINED_SHARE * columns[k].norm()).collect();
        let n = used.len();
        let mut gram = DMatrix::from_fn(n, n, |a, b| gone.product(&columns[used[a]], &columns[used[b]]));
        if let Some(known) = self.smoothness(effect, &used) {
            gram += known;
        }
        let b = DVector::from_fn(n, |a, _| gone.product(&columns[used[a]], &gone.residual));
        let x = gram.cholesky()?.solve(&b);
        // The sizes in the recording that shows it best.
        let strengths = strengths(effect).len();
        let lead = (0..n).max_by(|&p, &q| (size(used[p]) * x[p] * x[p]).total_cmp(&(size(used[q]) * x[q] * x[q])))?;
        let run = used[lead] / strengths;
        let predicted = |k: usize| used.iter().position(|u| *u == run * strengths + k).map_or(0.0, |p| x[p]);
        let seed = Seed { shape: shape.to_vec(), predicted: (0..strengths).map(predicted).collect() };
        Some(Instead { of: gone.effect, part: b.dot(&x) / gone.does, seed })
    }

    /// D of a residual strung into a column.
    fn deviance_of(&self, column: &[f64]) -> f64 {
        deviance(self.experiments, &cut(self.experiments, column))
    }

    /// In which steps an effect is simulated: what turns with the shaft may be faster than the signals, and is at every row.
    fn way(&self, effect: EffectId) -> &Way<'a> {
        self.longer_steps.as_ref().filter(|_| !effect.about().fixed_to_shaft).unwrap_or(&self.every_row)
    }

    /// Orders, per turn of the rotor, of lines in the residual.
    fn lines(&self) -> &[f64] {
        self.lines.get_or_init(|| {
            let runs = self.experiments.par_iter().zip(self.starts).zip(&self.residuals).filter(|((e, _), _)| !e.is_table());
            let of_speed = runs.filter_map(|((e, x), r)| {
                let c = e.channels.iter().position(|c| c.kind == ChannelKind::Speed)?;
                Some(Run::new(&self.machine, e, x, &r[c]))
            });
            shaft_lines::orders(&of_speed.collect::<Vec<_>>())
        })
    }

    /// The noise models.
    pub fn whiteners(&self) -> &[Vec<Whitener>] {
        &self.whiteners
    }

    /// The signature of strength `k` per unit, at a shape, whitened and plain; `sensitivity` (zero: not known; infinite: there is none) is what is
    /// known of it before, and after.
    fn secant(&self, effect: EffectId, k: usize, shape: &[(usize, f64)], sensitivity: &mut f64) -> Option<[Vec<f64>; 2]> {
        if sensitivity.is_infinite() {
            return None;
        }
        let info = &effect.parameters()[k];
        let unit = self.rating.unit_of(info.scale, self.machine.parameters(), self.machine.pole_pairs());
        let usual = (info.typical.0 * info.typical.1).sqrt() * unit;
        // Far beyond the residual the secant is not the slope any more.
        let wanted = self.raw_rms.max(1.0);
        let mut size = if usual * *sensitivity > FAR * wanted { wanted / *sensitivity } else { usual };
        let count: usize = self.experiments.iter().map(Experiment::count).sum();
        let mut begun = None;
        for _ in 0..8 {
            let mut set: Vec<(ParameterId, f64)> = shape.iter().map(|&(i, v)| (ParameterId::Effect(effect, i), v)).collect();
            set.push((ParameterId::Effect(effect, k), size));
            let there = self.machine.with(&set).ok();
            let Some(d) = there.and_then(|m| self.way(effect).change_to(&m, self.starts)) else {
                size *= 0.1;
                continue;
            };
            let rms = (d.iter().flatten().flatten().map(|x| x * x).sum::<f64>() / count as f64).sqrt();
            *sensitivity = rms / size;
            if rms > FAR * wanted {
                let (first, change) = *begun.get_or_insert((size, rms));
                if size < NOTHING * first && rms > 0.5 * change {
                    *sensitivity = f64::INFINITY;
                    return None;
                }
                size *= (wanted / rms).max(0.01);
                continue;
            }
            return Some([column(&d, &self.whiteners), strung(&d)].map(|g| g.iter().map(|x| x / size).collect()));
        }
        None
    }

    /// The signatures of all coefficients of a learned curve, per unit: derivatives, which exist at zero and come all at once.
    fn tangents(&self, effect: EffectId) -> Option<Vec<[Vec<f64>; 2]>> {
        let machine = self.machine.with(&[(ParameterId::Effect(effect, 0), 0.0)]).ok()?;
        let free = effect_parameters(effect, &machine, self.rating);
        let steps = &self.way(effect).thinned;
        let all = slopes(&machine, self.starts, steps.runs(), &free);
        let signature = |(slopes, f): (&Residuals, &Free)| {
            let finite = slopes.iter().flatten().flatten().all(|x| x.is_finite());
            let (unit, slopes) = (f.slope(0.0), steps.at_every_row(slopes));
            finite.then(|| [column(&slopes, &self.whiteners), strung(&slopes)].map(|g| g.iter().map(|x| x / unit).collect()))
        };
        all.iter().zip(&free).map(signature).collect()
    }

    /// Whether an effect begins at another angle, which is not known, in each recording.
    fn turns_anew(&self, effect: EffectId) -> bool {
        effect.about().fixed_to_shaft && !self.machine.effects().any_fixed_to_shaft()
    }

    /// Columns whole, or cut to the rows of each recording.
    fn columns(&self, of: &Projection, all: Vec<Vec<f64>>, run_by_run: bool) -> Vec<Column> {
        if !run_by_run {
            return all.into_iter().map(|g| of.column(0, g)).collect();
        }
        let mut begin = 0;
        let mut parts = Vec::new();
        for run in &self.every_row.before {
            let end = begin + run.iter().map(Vec::len).sum::<usize>();
            parts.extend(all.iter().map(|g| of.column(begin, g[begin..end].to_vec())));
            begin = end;
        }
        parts
    }

    /// Scores one effect over its shapes; a score at another machine, `before`, saves looking for sizes.
    pub fn score(&self, effect: EffectId, before: Option<&Score>) -> Option<Score> {
        let shapes = shapes(effect, &self.machine, self.rating, || self.lines());
        let tried = shapes.len();
        let mut sensitivity = vec![vec![0.0; strengths(effect).len()]; tried];
        if let Some(known) = before.map(|s| &s.sensitivity).filter(|s| s.len() == tried) {
            sensitivity.clone_from(known);
        }
        let at = |(shape, sensitivity): (_, &mut Vec<f64>)| self.score_at(effect, shape, tried, sensitivity);
        let mut all: Vec<Score> = shapes.into_par_iter().zip(&mut sensitivity).filter_map(at).collect();
        all.sort_by(|a, b| b.score.total_cmp(&a.score));
        let begun = if effect.about().resonant { RESONANCES } else { 1 };
        let seeds = all.iter().take(begun).map(|s| Seed { shape: s.shape.clone(), predicted: s.predicted.clone() }).collect();
        let instead = |gone: &Replaceable| {
            let at_each = all.iter().flat_map(|s| &s.instead).filter(|i| i.of == gone.effect);
            at_each.max_by(|a, b| a.part.total_cmp(&b.part)).cloned()
        };
        let instead = self.replaceable.iter().filter_map(instead).collect();
        all.into_iter().next().map(|score| Score { sensitivity, seeds, instead, ..score })
    }

    /// The precision of the coefficients `used` of a learned curve before the data; those of each recording by themselves where it turns anew.
    fn smoothness(&self, effect: EffectId, used: &[usize]) -> Option<DMatrix<f64>> {
        let precision = effect.free_form()?.precision();
        let info = &effect.parameters()[FreeForm::SPREAD];
        let spread = info.default * self.rating.unit_of(info.scale, self.machine.parameters(), self.machine.pole_pairs());
        let of = |a: usize, b: usize| {
            let (run, k) = (a / COEFFICIENTS, a % COEFFICIENTS);
            if b / COEFFICIENTS == run { precision[k][b % COEFFICIENTS] * self.variance / (spread * spread) } else { 0.0 }
        };
        Some(DMatrix::from_fn(used.len(), used.len(), |a, b| of(used[a], used[b])))
    }

    /// The score at one of so many shapes tried.
    fn score_at(&self, effect: EffectId, shape: Vec<(usize, f64)>, tried: usize, sensitivity: &mut [f64]) -> Option<Score> {
        let strengths = strengths(effect);
        let signatures = if effect.free_form().is_some() {
            self.tangents(effect)?
        } else {
            let secants = strengths.par_iter().zip(sensitivity).map(|(&k, s)| self.secant(effect, k, &shape, s));
            secants.collect::<Option<Vec<_>>>()?
        };
        let (white, plain): (Vec<_>, Vec<_>) = signatures.into_iter().map(|[w, p]| (w, p)).unzip();
        let run_by_run = self.turns_anew(effect);
        let columns = self.columns(&self.white, white, run_by_run);
        let norms: Vec<f64> = columns.iter().map(Column::norm).collect();
        // A strength that a refit imitates all but wholly has no size of its own here: the others speak for the effect.
        let kept = |least: f64| -> Vec<usize> { (0..columns.len()).filter(|&k| columns[k].apart() > least * norms[k]).collect() };
        let used = Some(kept(LEAST_EXPLAINED_SHARE)).filter(|u| !u.is_empty()).unwrap_or_else(|| kept(1e-12));
        let n = used.len();
        if n == 0 {
            return None;
        }
        let smooth = self.smoothness(effect, &used);
        let (gram, mut x, taken) = self.white.solved(&used.iter().map(|&k| &columns[k]).collect::<Vec<_>>(), smooth.as_ref())?;
        let score = (taken / self.variance).max(0.0);
        let mut gain = score;
        let every_plain = self.columns(&self.plain, plain, run_by_run);
        let plain: Vec<&Column> = used.iter().map(|&k| &every_plain[k]).collect();
        if let Some((_, sizes, _)) = self.plain.solved(&plain, smooth.as_ref()) {
            let taken: Vec<(&Column, f64)> = plain.into_iter().zip(sizes.iter().copied()).collect();
            let taken = self.plain.projected(&taken);
            let left: Vec<f64> = self.plain.residual.iter().zip(taken).map(|(r, t)| r - t).collect();
            let fall = self.deviance - self.deviance_of(&left);
            if fall > gain {
                (gain, x) = (fall, sizes);
            }
        }
        let part = |p: usize| gram[(p, p)] * x[p] * x[p];
        let lead = (0..n).max_by(|&p, &q| part(p).total_cmp(&part(q))).unwrap_or(0);
        // The leading strength in all recordings, and the sizes in the one that shows it best.
        let (run, strength) = (used[lead] / strengths.len(), used[lead] % strengths.len());
        let all_of = |k: usize| (k..columns.len()).step_by(strengths.len());
        let share = |of: &[Column]| -> f64 {
            let [apart, whole] = [Column::apart, Column::norm].map(|size| all_of(strength).map(|k| size(&of[k])).sum::<f64>());
            apart / whole
        };
        let explained_share = share(&columns);
        let seen: f64 = all_of(strength).map(|k| columns[k].apart()).sum();
        let size = |k: usize| used.iter().position(|u| *u == run * strengths.len() + k).map_or(0.0, |p| x[p]);
        // In nine of ten recordings beyond the threshold.
        let least = (threshold(n, self.level / tried as f64).sqrt() + 1.3).powi(2);
        let direction = |k: usize| self.white.sketched(&all_of(k).map(|c| (&columns[c], 1.0)).collect::<Vec<_>>());
        let instead = |gone: &Replaceable| self.instead(gone, effect, &shape, &columns);
        let instead = self.replaceable.iter().filter_map(instead).collect();
        Some(Score {
            effect,
            score,
            gain,
            freedom: n,
            log_p: (log_p(score, n) - (tried as f64).log10()).max(0.0),
            explained_share,
            excitation: share(&every_plain).max(explained_share),
            predicted: (0..strengths.len()).map(size).collect(),
            seeds: Vec::new(),
            detectable: (least * self.variance / seen).sqrt(),
            chi2_detectable: least,
            shape,
            signature: self.white.sketched(&used.iter().zip(&x).map(|(&k, &x)| (&columns[k], x)).collect::<Vec<_>>()),
            directions: (0..strengths.len()).map(direction).collect(),
            sensitivity: Vec::new(),
            instead,
        })
    }
}

/// Cosine of the least angle between what two effects can do, at whatever sizes.
pub fn closest(a: &Score, b: &Score) -> f64 {
    let rows = a.directions.first().map_or(0, Vec::len);
    if a.directions.iter().chain(&b.directions).any(|d| d.len() != rows) {
        return 0.0;
    }
    closest_of(&a.directions, &b.directions)
}

/// Indices of the strengths of an effect.
pub fn strengths(effect: EffectId) -> Vec<usize> {
    effect.parameters().iter().enumerate().filter(|(_, p)| p.role == Role::Strength).map(|(k, _)| k).collect()
}

/// The parameter of an effect that is an order and need not be whole.
pub(super) fn free_order(effect: EffectId) -> Option<usize> {
    effect.parameters().iter().position(|p| p.role == Role::Order && !matches!(p.bound, Bound::Whole(..)))
}

/// The shapes to try: the whole numbers of an order, and the first of `lines` where others are possible; else the default, and the ends of the usual range
/// of the leading shape parameter.
fn shapes<'a>(
    effect: EffectId,
    machine: &Machine<f64>,
    rating: &Rating,
    lines: impl Fn() -> &'a [f64],
) -> Vec<Vec<(usize, f64)>> {
    let unit = |k: usize| {
        let info = &effect.parameters()[k];
        rating.unit_of(info.scale, machine.parameters(), machine.pole_pairs())
    };
    let present = |k: usize| machine.get(ParameterId::Effect(effect, k));
    if let Some((k, order)) = effect.parameters().iter().enumerate().find(|(_, p)| p.role == Role::Order) {
        let (least, most) = (order.typical.0.round() as u32, order.typical.1.round() as u32);
        let whole = (least..=most).map(f64::from);
        let lines = if free_order(effect).is_some() { lines() } else { &[] };
        // A torque at twice the supply's frequency stands near a whole number, too, and turns with no shaft.
        let between = lines.iter().copied().filter(|o| !same_order(*o, o.round())).take(MOST_LINES);
        return whole.chain(between).map(|n| vec![(k, n)]).collect();
    }
    let lead = effect.parameters().iter().position(|p| p.role == Role::Shape && p.typical.0 > 0.0);
    let Some(k) = lead else { return vec![vec![]] };
    let (lo, hi) = effect.parameters()[k].typical;
    let (lo, hi) = (lo * unit(k), hi * unit(k));
    let middle = present(k);
    let points = if effect.about().resonant {
        // A resonance is narrow: a finer grid.
        (0..7).map(|i| lo * (hi / lo).powf(f64::from(i) / 6.0)).collect()
    } else {
        vec![(lo * middle).sqrt(), middle, (hi * middle).sqrt()]
    };
    points.into_iter().map(|x| vec![(k, x)]).collect()
}
