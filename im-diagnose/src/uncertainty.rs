//! What recordings determine of a machine, and how well.
//!
//! A linear machine shows its inverse-Γ circuit at its terminals, not how the leakage is shared between stator and rotor: the ratio
//! L_ls/L_lr is held as given, and intervals are of R_s, R_R, L_σ, L_M, of the mechanics and of the effects. With J the slopes of the
//! residuals and N = JᵀJ, the covariance of the estimates is
//!
//! C = N⁻¹ (JᵀΣJ + Σ_m g_m g_mᵀ) N⁻¹,   g_m = Jᵀ d_m
//!
//! Σ is the covariance of the noise: an autoregressive model per channel fitted to the residuals, and what the noise of the measured load torque
//! does (`input_noise`). What it does not know (a residual that is larger where more happens) shows in the sums of Jᵀr over stretches of the
//! recordings: where their spread asks for a wider interval, that is taken. d_m are changes of the outputs that the model cannot follow and
//! the residual hardly shows: the curve of each effect, bent by 5 % of what it explains, the ratio of the leakages, off as far as it is known (`form_error`), and the
//! scales of a table's instruments (`instruments`).

pub use im_identify::offline::HALF_95;
use im_identify::offline::{
    Experiment, Fit, Free, Linearized, NOT_SEEN, Target, Thinned, inverse_of_normal, linearize, prior_terms, smoothness,
};
use im_model::{BaseParameter, EffectId, Machine, MotorFile, ParameterId, State};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::form_error::{at_low_slip, disturbances};
use crate::input_noise::torque_noise;
use crate::instruments::scale_errors;
use crate::noise::whiteners;
use crate::residuals::all_residuals;

/// A quantity that recordings can determine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MachineQuantity {
    /// R_R = R_r (L_m/L_r)² of the inverse-Γ circuit, at low slip frequency, Ω.
    RotorResistance,
    /// L_σ = L_s − L_m²/L_r, H.
    LeakageInductance,
    /// L_M = L_m²/L_r, H.
    MagnetizingInductance,
    /// A parameter that is the same in every circuit: R_s, J, D, or one of an effect.
    Parameter(ParameterId),
}

impl MachineQuantity {
    /// Key in files.
    pub fn key(self) -> String {
        match self {
            Self::RotorResistance => "inverse_gamma.rotor_resistance_ohm".into(),
            Self::LeakageInductance => "inverse_gamma.leakage_inductance_h".into(),
            Self::MagnetizingInductance => "inverse_gamma.magnetizing_inductance_h".into(),
            Self::Parameter(id) => id.to_string(),
        }
    }

    /// Whether it is one of the coefficients of a learned curve: the curve's band says how well that is known.
    pub(crate) fn is_of_a_curve(self) -> bool {
        matches!(self, Self::Parameter(ParameterId::Effect(e, _)) if e.free_form().is_some())
    }

    /// The quantity of a key.
    pub fn from_key(key: &str) -> Option<Self> {
        if let Some(q) =
            [Self::RotorResistance, Self::LeakageInductance, Self::MagnetizingInductance].into_iter().find(|q| q.key() == key)
        {
            return Some(q);
        }
        if let Some(p) = BaseParameter::ALL.into_iter().find(|p| p.key() == key) {
            return Some(Self::Parameter(ParameterId::Base(p)));
        }
        let (effect, parameter) = key.split_once('.')?;
        let effect = EffectId::from_name(effect)?;
        let index = effect.parameters().iter().position(|p| p.key == parameter)?;
        Some(Self::Parameter(ParameterId::Effect(effect, index)))
    }

    /// Unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::RotorResistance => "Ω",
            Self::LeakageInductance | Self::MagnetizingInductance => "H",
            Self::Parameter(id) => id.unit(),
        }
    }

    /// Its value in a machine.
    pub fn of(self, machine: &Machine<f64>) -> f64 {
        let inverse_gamma = at_low_slip(machine).inverse_gamma();
        match self {
            Self::RotorResistance => inverse_gamma.rotor_resistance_ohm,
            Self::LeakageInductance => inverse_gamma.leakage_inductance_h,
            Self::MagnetizingInductance => inverse_gamma.magnetizing_inductance_h,
            Self::Parameter(id) => machine.get(id),
        }
    }
}

/// One quantity before and after.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Which.
    pub quantity: MachineQuantity,
    /// As given.
    pub before: f64,
    /// As estimated.
    pub after: f64,
    /// Standard deviation.
    pub std: f64,
}

impl Estimate {
    /// Whether the recordings leave it open.
    pub fn is_open(&self) -> bool {
        is_open(self.after, self.std)
    }
}

/// A parameter counts as not determined when its standard deviation exceeds this fraction of it.
const UNDETERMINED: f64 = 0.3;

/// Whether an estimate with this standard deviation leaves its parameter open.
pub(crate) fn is_open(value: f64, std: f64) -> bool {
    std.is_nan() || std > UNDETERMINED * value.abs()
}

/// Whether nothing is known but its size: it may as well be twice as large, or nothing.
pub(crate) fn is_unknown(value: f64, std: f64) -> bool {
    std > 0.0 && std >= value.abs()
}

/// All that was estimated.
#[derive(Clone, Debug)]
pub struct Estimates {
    /// The quantities, R_s and the rest of the inverse-Γ circuit first.
    pub list: Vec<Estimate>,
    /// Their covariance, in the order of the list and in their units.
    pub covariance: DMatrix<f64>,
    /// What was free in the fit, initial states included.
    pub free: Vec<Free>,
    /// The covariance of its search variables, by the noise alone: an error of form moves parameters, and the signals hardly.
    pub search: DMatrix<f64>,
    /// What all of it follows from.
    spread: Spread,
}

impl Estimates {
    /// Of a machine fitted to `experiments` with `starts` and the parameters `free`; `before` is the motor as given.
    pub fn new(
        before: &MotorFile,
        machine: &Machine<f64>,
        starts: &[State<f64>],
        experiments: &[Experiment],
        free: &[Free],
    ) -> Self {
        let quantities = quantities(free);
        let spread = Spread::new(machine, starts, experiments, free, before.leakage_ratio_std());
        let here: Vec<f64> = quantities.iter().map(|q| q.of(machine)).collect();
        let t = slopes_along(free, machine, &here, |m| Some(quantities.iter().map(|q| q.of(m)).collect()));
        let covariance = spread.covariance(&t);
        let std = spread.std(&t, &covariance);
        let search = spread.by_noise(&DMatrix::identity(free.len(), free.len()));
        let estimate = |(k, &quantity): (usize, &MachineQuantity)| Estimate {
            quantity,
            before: quantity.of(&before.machine),
            after: quantity.of(machine),
            std: std[k],
        };
        Self { list: quantities.iter().enumerate().map(estimate).collect(), covariance, free: free.to_vec(), search, spread }
    }

    /// Standard deviations of numbers that follow from the machine, which are `here` with `machine`, its form taken as right.
    pub fn std_of(&self, machine: &Machine<f64>, here: &[f64], of: impl Fn(&Machine<f64>) -> Option<Vec<f64>>) -> Vec<f64> {
        let t = slopes_along(&self.free, machine, here, of);
        let covariance = self.spread.by_noise(&t) + self.spread.from(&t, &self.spread.scales);
        self.spread.std(&t, &covariance)
    }

    /// Of a fit to `experiments`.
    pub fn of_fit(before: &MotorFile, fit: &Fit, experiments: &[Experiment]) -> Self {
        Self::new(before, &fit.machine, &fit.starts, experiments, &fit.free)
    }

    /// About the machine that the other recordings give without the one of this number: by one step, for which every recording tells as much as
    /// another. What it alone determines stays, as nothing pulls at it; so does everything where there are no others.
    ///
    /// δ = −m/(m − 1) N⁻¹ Jᵀr, of its rows
    pub fn without(&self, machine: &Machine<f64>, number: usize) -> Machine<f64> {
        let m = self.spread.pulls.len() as f64;
        let Some(pull) = self.spread.pulls.get(number).filter(|_| m > 1.0) else { return *machine };
        let step = &self.spread.inverse * pull * (-m / (m - 1.0));
        let moved = |(f, v): (&Free, &f64)| match &f.target {
            // A step beyond that is none: the slopes do not hold so far.
            Target::Machine(ids) => ids.iter().map(|&id| (id, f.value(machine.get(id), v.clamp(-1.0, 1.0)))).collect(),
            Target::Initial { .. } => Vec::new(),
        };
        let set: Vec<_> = self.free.iter().zip(step.iter()).flat_map(moved).collect();
        machine.with(&set).unwrap_or(*machine)
    }

    /// Half the width of the 95 % band in which the uncertainty of the parameters lets the model's signals be, sample by sample and channel by
    /// channel in their units. `number` is that of the experiment in the fit; of one that no fit has seen, the initial state counts as exact.
    pub fn band_of_parameters(
        &self,
        machine: &Machine<f64>,
        e: &Experiment,
        start: &State<f64>,
        number: Option<usize>,
    ) -> Vec<Vec<f64>> {
        let slopes = linearize(machine, e, start, number.unwrap_or(usize::MAX), &self.free).slopes;
        let moved: Vec<usize> = (0..slopes.len()).filter(|&k| slopes[k].iter().flatten().any(|s| *s != 0.0)).collect();
        let half = |c: usize, row: usize| {
            let at = |k: usize| slopes[k][c][row];
            let variance: f64 =
                moved.iter().map(|&a| at(a) * moved.iter().map(|&b| self.search[(a, b)] * at(b)).sum::<f64>()).sum();
            HALF_95 * e.channels[c].sigma * variance.max(0.0).sqrt()
        };
        (0..e.channels.len()).map(|c| (0..e.len()).into_par_iter().map(|row| half(c, row)).collect()).collect()
    }

    /// The covariance with the names of its rows.
    pub fn to_json(&self) -> serde_json::Value {
        let names: Vec<String> = self.list.iter().map(|e| e.quantity.key()).collect();
        let rows: Vec<Vec<f64>> = self.covariance.row_iter().map(|r| r.iter().copied().collect()).collect();
        serde_json::json!({"of": names, "matrix": rows})
    }

    /// Pairs of quantities whose estimates go together, with their correlation; of what has no variance none can be said.
    pub fn correlated(&self, least: f64) -> Vec<(MachineQuantity, MachineQuantity, f64)> {
        let c = |a: usize, b: usize| self.covariance[(a, b)] / (self.list[a].std * self.list[b].std);
        let pairs = (0..self.list.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        pairs
            .map(|(a, b)| (self.list[a].quantity, self.list[b].quantity, c(a, b)))
            .filter(|(_, _, c)| c.is_finite() && c.abs() >= least)
            .collect()
    }
}

/// What free parameters determine.
fn quantities(free: &[Free]) -> Vec<MachineQuantity> {
    let mut out = Vec::new();
    for id in free.iter().filter_map(Free::id) {
        use BaseParameter as P;
        out.push(match id {
            ParameterId::Base(P::RotorResistance) => MachineQuantity::RotorResistance,
            ParameterId::Base(P::StatorLeakageInductance) => MachineQuantity::LeakageInductance,
            ParameterId::Base(P::MagnetizingInductance) => MachineQuantity::MagnetizingInductance,
            other => MachineQuantity::Parameter(other),
        });
    }
    out
}

/// Derivatives of numbers that follow from a machine, `here` for this one, with respect to the search variables, by central differences.
fn slopes_along(
    free: &[Free],
    machine: &Machine<f64>,
    here: &[f64],
    of: impl Fn(&Machine<f64>) -> Option<Vec<f64>>,
) -> DMatrix<f64> {
    const STEP: f64 = 1e-4;
    let mut t = DMatrix::zeros(here.len(), free.len());
    for (column, f) in free.iter().enumerate() {
        let Target::Machine(ids) = &f.target else { continue };
        // Limits do not count: the slope is that of the law.
        let unlimited = Free { limits: (f64::NEG_INFINITY, f64::INFINITY), ..f.clone() };
        let moved = |v: f64| {
            let set: Vec<_> = ids.iter().map(|&id| (id, unlimited.value(machine.get(id), v))).collect();
            machine.with(&set).ok().and_then(|m| of(&m))
        };
        let (low, high) = (moved(-STEP), moved(STEP));
        let width = STEP * (f64::from(u8::from(low.is_some())) + f64::from(u8::from(high.is_some())));
        let (low, high) = (low.as_deref().unwrap_or(here), high.as_deref().unwrap_or(here));
        for (row, (low, high)) in low.iter().zip(high).enumerate() {
            t[(row, column)] = if width > 0.0 { (high - low) / width } else { 0.0 };
        }
    }
    t
}

/// Stretches of a recording whose errors count as independent: some tenths of a second, beyond what mechanics remember.
const STRETCHES: usize = 32;

/// What is known of the search variables.
#[derive(Clone, Debug)]
struct Spread {
    /// N⁻¹.
    inverse: DMatrix<f64>,
    /// JᵀΣJ with the noise model, and as the stretches show it.
    noise: [DMatrix<f64>; 2],
    /// Σ g gᵀ of what the residual does not show: errors of form, and of the scales of instruments.
    hidden: DMatrix<f64>,
    /// The part of the scales.
    scales: DMatrix<f64>,
    /// Jᵀr of each recording.
    pulls: Vec<DVector<f64>>,
}

impl Spread {
    fn new(machine: &Machine<f64>, starts: &[State<f64>], experiments: &[Experiment], free: &[Free], ratio_std: f64) -> Self {
        let residuals = all_residuals(machine, starts, experiments);
        let thinned = Thinned::keeping(experiments, &residuals);
        let (experiments, sums) = (thinned.runs(), thinned.sums(&residuals));
        let linear = experiments.par_iter().zip(sums.as_slice()).enumerate().map(|(k, (e, sums))| {
            let slopes = linearize(machine, e, &starts[k], k, free).slopes;
            Linearized { residuals: sums.clone(), slopes }
        });
        let linear: Vec<Linearized> = linear.collect();
        let noise = whiteners(experiments, &sums);
        let p = free.len();
        let mut normal = DMatrix::zeros(p, p);
        let mut modelled = DMatrix::zeros(p, p);
        for (l, noise) in linear.iter().zip(&noise) {
            for (c, w) in noise.iter().enumerate() {
                let columns: Vec<&[f64]> = l.slopes.iter().map(|s| s[c].as_slice()).collect();
                let coloured: Vec<Vec<f64>> = columns.par_iter().map(|x| w.coloured_backwards(x)).collect();
                normal += gram(&columns);
                modelled += gram(&coloured.iter().map(Vec::as_slice).collect::<Vec<_>>());
            }
        }
        let sums: Vec<DVector<f64>> = linear.iter().zip(experiments).flat_map(|(l, e)| stretch_sums(l, e, p)).collect();
        let lost = sums.len() as f64 / (sums.len() as f64 - p as f64).max(1.0);
        let shown = sums.iter().map(|s| s * s.transpose()).fold(DMatrix::zeros(p, p), |a, b| a + b) * lost;
        let spread_by = |changes: &mut dyn Iterator<Item = Vec<Vec<Vec<f64>>>>| {
            let all = changes.map(|change| linear.iter().zip(&change).map(|(l, d)| along(l, d)).sum());
            all.fold(DMatrix::zeros(p, p), |sum, g: DVector<f64>| sum + &g * g.transpose())
        };
        let scales = spread_by(&mut scale_errors(machine, experiments).into_iter());
        let hidden = spread_by(&mut disturbances(machine, starts, experiments, ratio_std).each()) + &scales;
        for ((l, e), x) in linear.iter().zip(experiments).zip(starts) {
            let drawn = torque_noise(machine, e, x, |change| along(l, change));
            let each = 1.0 / drawn.len().max(1) as f64;
            for g in &drawn {
                modelled += g * g.transpose() * each;
            }
        }
        // What is known beforehand is as independent of the rest as a row more.
        for (k, [_, _, information]) in prior_terms(machine, free).into_iter().enumerate() {
            for m in [&mut normal, &mut modelled] {
                m[(k, k)] += information;
            }
        }
        if let Some(smooth) = smoothness(machine, free) {
            normal += &smooth.information;
            modelled += &smooth.information;
        }
        let pulls = linear.iter().map(|l| along(l, &l.residuals)).collect();
        Self { inverse: inverse_of_normal(&normal), noise: [modelled, shown], hidden, scales, pulls }
    }

    /// Covariance of quantities with the slopes `t`: of both views of the noise, each quantity has the wider one.
    fn covariance(&self, t: &DMatrix<f64>) -> DMatrix<f64> {
        self.by_noise(t) + self.from(t, &self.hidden)
    }

    /// The same without what the residual does not show.
    fn by_noise(&self, t: &DMatrix<f64>) -> DMatrix<f64> {
        let [modelled, shown] = self.noise.each_ref().map(|n| self.from(t, n));
        let wider = |k: usize| (shown[(k, k)] / modelled[(k, k)].max(1e-300)).max(1.0).sqrt();
        DMatrix::from_fn(t.nrows(), t.nrows(), |a, b| modelled[(a, b)] * wider(a) * wider(b))
    }

    /// Standard deviations of quantities with the slopes `t`; infinite where a parameter that the data do not show moves one.
    fn std(&self, t: &DMatrix<f64>, covariance: &DMatrix<f64>) -> Vec<f64> {
        let not_seen = |row: usize| (0..t.ncols()).any(|k| t[(row, k)] != 0.0 && self.inverse[(k, k)] >= NOT_SEEN);
        let std = |row: usize| match covariance[(row, row)] {
            v if v.is_nan() || not_seen(row) => f64::INFINITY,
            v => v.max(0.0).sqrt(),
        };
        (0..t.nrows()).map(std).collect()
    }

    fn from(&self, t: &DMatrix<f64>, spread: &DMatrix<f64>) -> DMatrix<f64> {
        let half = t * &self.inverse;
        &half * spread * half.transpose()
    }
}

/// Jᵀr over stretches of one recording; of a table, which has too few rows for that, none.
fn stretch_sums(l: &Linearized, e: &Experiment, parameters: usize) -> Vec<DVector<f64>> {
    if e.is_table() {
        return Vec::new();
    }
    let rows = e.len();
    let sum = |stretch: usize| {
        let part = stretch * rows / STRETCHES..(stretch + 1) * rows / STRETCHES;
        let of =
            |k: usize| l.slopes[k].iter().zip(&l.residuals).map(|(s, r)| dot(&s[part.clone()], &r[part.clone()])).sum::<f64>();
        DVector::from_fn(parameters, |k, _| of(k))
    };
    (0..STRETCHES).map(sum).collect()
}

/// Jᵀd: how much of a change of one recording's outputs lies along each parameter.
fn along(l: &Linearized, change: &[Vec<f64>]) -> DVector<f64> {
    DVector::from_iterator(l.slopes.len(), l.slopes.iter().map(|s| s.iter().zip(change).map(|(s, d)| dot(s, d)).sum()))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn gram(columns: &[&[f64]]) -> DMatrix<f64> {
    let mut m = DMatrix::from_fn(columns.len(), columns.len(), |a, b| if b <= a { dot(columns[a], columns[b]) } else { 0.0 });
    m.fill_upper_triangle_with_lower_triangle();
    m
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a quantity whose variance is zero, or none at all, no correlation is given.
    #[test]
    fn what_has_no_variance_is_correlated_with_nothing() {
        use MachineQuantity as Q;
        let of = |quantity, std| Estimate { quantity, before: 1.0, after: 1.0, std };
        let list = vec![of(Q::RotorResistance, 0.1), of(Q::LeakageInductance, 0.2), of(Q::MagnetizingInductance, 0.0)];
        let covariance =
            DMatrix::from_row_slice(3, 3, &[0.01, 0.0199, 1e-9, 0.0199, 0.04, f64::INFINITY, 1e-9, f64::INFINITY, 0.0]);
        let nothing = || DMatrix::zeros(0, 0);
        let spread =
            Spread { inverse: nothing(), noise: [nothing(), nothing()], hidden: nothing(), scales: nothing(), pulls: Vec::new() };
        let none = Estimates { list, covariance, free: Vec::new(), search: nothing(), spread };
        let pairs = none.correlated(0.98);
        assert_eq!(pairs.len(), 1, "{pairs:?}");
        assert!((pairs[0].2 - 0.995).abs() < 1e-12 && (pairs[0].0, pairs[0].1) == (Q::LeakageInductance, Q::RotorResistance));
    }
}
