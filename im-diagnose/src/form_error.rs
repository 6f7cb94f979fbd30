//! What the form of a model may be wrong by: the library's curve of an effect is never exactly the machine's, and the ratio of the leakages is
//! only given.
//!
//! The difference between two forms of an effect looks like the effect itself, bent over what its curve may be over. A model's likelihood is
//! therefore taken with such changes d_m of its outputs as unknowns of the size of a few per cent, β_m ~ N(0, 1), beside the parameters:
//!
//!   −2 log L = min_{δ,β} ‖W(r − Jδ − Dβ)‖² + λ‖β‖²
//!
//! so that no effect is named for what only mends the form of another. A sample counts 1/λ in the search, what is known of β does not.

use std::borrow::Cow;
use std::ops::Range;

use im_identify::offline::{Channel, ChannelKind, Experiment, Free, Thinned, outputs, smoothness};
use im_model::effects::Role;
use im_model::{BaseParameter, Complex, EffectId, Machine, ParameterId, State, TParameters};
use nalgebra::{DMatrix, DVector, DVectorView};
use rayon::prelude::*;

use crate::noise::sensor_whiteners;
use crate::residuals::{all_residuals, change, deviance, slopes};

/// Standard deviation of the difference in form: a part of what an effect explains.
const SIZE: f64 = 0.05;

/// The same where sets of effects are compared: a real machine's form may be farther from the library's than that of another machine is.
pub const SIZE_IN_SEARCH: f64 = 0.1;

/// Rows that are enough to find how much of each change is in a residual.
const ROWS: usize = 30_000;

/// Rows that are multiplied at once: as many as stay in the nearest memory.
const ROWS_AT_ONCE: usize = 512;

/// Fewest values per unknown: a table of steady states is too short to tell errors of form from noise.
const LEAST_ROWS: usize = 10;

/// Part by which a resonance is changed, to see what it does.
const RETUNED: f64 = 0.01;

/// Halvings that find the stiffness of curves which bend so far and no further.
const BISECTIONS: usize = 25;

/// Changes of the outputs that no parameter follows.
pub struct Disturbances {
    /// Of another ratio of the leakages, by one standard deviation.
    of_ratio: Option<Change>,
    /// What each effect explains.
    explained: Vec<Change>,
    /// What other shapes of resonances would change, as far as a change of the shape by the whole of it would.
    detuned: Vec<Change>,
    /// How they bend.
    bending: Bending,
}

/// How curves bend: what is bent is made when it is needed, as there are many and each is as long as the recordings.
struct Bending {
    /// What a curve may be over, per experiment: current, speed, time, as modelled; measured ones have the noise of the residual in them.
    over: Vec<[Vec<f64>; 3]>,
    /// Which of these vary, and between what.
    ranges: Vec<(usize, f64, f64)>,
}

impl Bending {
    fn new(experiments: &[Experiment], modelled: &Change) -> Self {
        let over = |(e, modelled): (&Experiment, &Vec<Vec<f64>>)| {
            let speed = e.channels.iter().position(|c| c.kind == ChannelKind::Speed);
            let current = |k: usize| e.current_vector(k, |c| modelled[c][k]).map_or(e.u_s[k].norm(), |i| i.norm());
            [
                (0..e.len()).map(current).collect(),
                (0..e.len()).map(|k| speed.map_or(0.0, |c| modelled[c][k])).collect(),
                (0..e.len()).map(|k| k as f64 * e.sample_time_s).collect(),
            ]
        };
        let over: Vec<[Vec<f64>; 3]> = experiments.iter().zip(modelled).map(over).collect();
        let range = |variable: usize| {
            let all = || over.iter().flat_map(|o| &o[variable]).copied().filter(|x| x.is_finite());
            // From standstill, or no current, on: a curve does not bend within the ripple of a steady state.
            (variable, all().fold(0.0, f64::min), all().fold(0.0, f64::max))
        };
        let ranges = (0..3).map(range).filter(|(_, low, high)| high > low).collect();
        Self { over, ranges }
    }

    /// In how many ways.
    fn ways(&self) -> usize {
        1 + 2 * self.ranges.len()
    }

    /// What an effect explains, bent in one way by one standard deviation: times the first Legendre polynomials of what its curve may be over.
    fn bent(&self, explained: &Change, way: usize) -> Change {
        if way == 0 {
            return scaled(explained, |_, _| SIZE);
        }
        let (variable, low, high) = self.ranges[(way - 1) / 2];
        let at = |e: usize, k: usize| 2.0 * (self.over[e][variable][k] - low) / (high - low) - 1.0;
        if way % 2 == 1 {
            scaled(explained, |e, k| SIZE * at(e, k))
        } else {
            scaled(explained, |e, k| SIZE * (1.5 * at(e, k).powi(2) - 0.5))
        }
    }
}

/// A fitted model around its minimum: residuals, and what moves them.
struct Around<'a> {
    /// At every row.
    residuals: Change,
    /// Their sums over the steps of `thinned`.
    sums: Change,
    thinned: Thinned<'a>,
    /// By each free parameter; all changes are in the steps of `thinned`.
    slopes: Vec<Change>,
    /// What bends.
    explained: Vec<Change>,
    bending: Bending,
    of_ratio: Option<Change>,
}

impl<'a> Around<'a> {
    fn new(machine: &Machine<f64>, starts: &[State<f64>], experiments: &'a [Experiment], free: &[Free], ratio_std: f64) -> Self {
        let residuals = all_residuals(machine, starts, experiments);
        let thinned = Thinned::keeping(experiments, &residuals);
        let runs = thinned.runs();
        let Disturbances { of_ratio, mut explained, detuned, bending } = disturbances(machine, starts, runs, ratio_std);
        // Forms differ in phase as well.
        let turned: Vec<Change> = explained.iter().map(|d| turned(runs, d)).collect();
        explained.extend(detuned);
        explained.extend(turned);
        let slopes = slopes(machine, starts, runs, free);
        let sums = thinned.sums(&residuals).into_owned();
        Self { residuals, sums, thinned, slopes, explained, bending, of_ratio }
    }

    /// Changes by the free parameters, then the bends, then that by the ratio of the leakages.
    fn changes(&self) -> usize {
        self.bends().end + usize::from(self.of_ratio.is_some())
    }

    /// Which are bends.
    fn bends(&self) -> Range<usize> {
        let parameters = self.slopes.len();
        parameters..parameters + self.explained.len() * self.bending.ways()
    }

    fn change(&self, k: usize) -> Cow<'_, Change> {
        let bends = self.bends();
        if k < bends.start {
            Cow::Borrowed(&self.slopes[k])
        } else if bends.contains(&k) {
            let (what, way) = ((k - bends.start) / self.bending.ways(), (k - bends.start) % self.bending.ways());
            Cow::Owned(self.bending.bent(&self.explained[what], way))
        } else {
            self.of_ratio.as_ref().map_or_else(|| Cow::Owned(Change::new()), Cow::Borrowed)
        }
    }

    /// Whether there are too few values to tell errors of form from noise.
    fn is_short(&self) -> bool {
        values(&self.residuals) < LEAST_ROWS * self.changes()
    }

    /// The normal equations, filtered by `whiten`, with one row more for every unknown.
    fn normal(
        &self,
        machine: &Machine<f64>,
        free: &[Free],
        whiten: impl Fn(&Change) -> Change + Sync,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let stride = (values(&self.sums) / ROWS).max(1);
        let thinned =
            |c: &Change| -> Vec<f64> { whiten(c).iter().flatten().flat_map(|x| x.iter().step_by(stride).copied()).collect() };
        let columns: Vec<Vec<f64>> = (0..self.changes()).into_par_iter().map(|k| thinned(&self.change(k))).collect();
        let r = thinned(&self.sums);
        let (mut normal, mut b) = products(&columns, &r);
        normal *= stride as f64;
        b *= stride as f64;
        // The parameters move by logarithms: one that the data do not determine stays within a factor of a few.
        for k in 0..columns.len() {
            normal[(k, k)] += 1.0;
        }
        if let Some(smooth) = smoothness(machine, free) {
            let p = self.slopes.len();
            let (mut information, mut downhill) = (normal.view_mut((0, 0), (p, p)), b.rows_mut(0, p));
            information += &smooth.information;
            downhill += &smooth.downhill;
        }
        (normal, b)
    }

    /// What is left with changes of such sizes.
    fn left(&self, sizes: &DVector<f64>) -> Change {
        let mut taken: Change = self.thinned.runs().iter().map(|e| vec![vec![0.0; e.len()]; e.channels.len()]).collect();
        for (k, size) in sizes.iter().enumerate().filter(|(_, size)| **size != 0.0) {
            add(&mut taken, *size, &self.change(k));
        }
        let mut left = self.residuals.clone();
        add(&mut left, -1.0, &self.thinned.at_every_row(&taken));
        left
    }
}

/// XᵀX and Xᵀr.
fn products(columns: &[Vec<f64>], r: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
    let of_rows = |begin: usize| {
        let rows = begin..(begin + ROWS_AT_ONCE).min(r.len());
        let across = DMatrix::from_fn(columns.len(), rows.len(), |k, row| columns[k][begin + row]);
        let b = &across * DVectorView::from_slice(&r[rows], across.ncols());
        (&across * across.transpose(), b)
    };
    let begins: Vec<usize> = (0..r.len()).step_by(ROWS_AT_ONCE).collect();
    let parts: Vec<_> = begins.into_par_iter().map(of_rows).collect();
    let nothing = (DMatrix::zeros(columns.len(), columns.len()), DVector::zeros(columns.len()));
    parts.into_iter().fold(nothing, |(gram, b), (more_gram, more_b)| (gram + more_gram, b + more_b))
}

fn values(change: &Change) -> usize {
    change.iter().flatten().map(Vec::len).sum()
}

fn add(to: &mut Change, times: f64, change: &Change) {
    for (to, c) in to.iter_mut().flatten().zip(change.iter().flatten()) {
        to.iter_mut().zip(c).for_each(|(to, c)| *to += times * c);
    }
}

/// −2 log L of a fitted model, up to a constant, with the errors of its form as unknowns, where a sample counts 1/λ: what is known of these errors
/// does not count less for that. `ratio_std` is how well L_ls/L_lr is known.
pub fn marginal(
    machine: &Machine<f64>,
    starts: &[State<f64>],
    experiments: &[Experiment],
    free: &[Free],
    ratio_std: f64,
    lambda: f64,
) -> f64 {
    let around = Around::new(machine, starts, experiments, free, ratio_std);
    let as_it_is = deviance(experiments, &around.residuals);
    if around.is_short() {
        return as_it_is;
    }
    let whiteners = sensor_whiteners(around.thinned.runs(), &around.sums, around.thinned.stride());
    let whiten = |c: &Change| -> Change {
        c.iter().zip(&whiteners).map(|(run, w)| run.iter().zip(w).map(|(x, w)| w.apply(x)).collect()).collect()
    };
    let (mut normal, b) = around.normal(machine, free, whiten);
    let bends = around.bends();
    let known: Vec<f64> = (0..around.changes())
        .map(|k| match k {
            k if k < bends.start => 1.0,
            k if bends.contains(&k) => lambda * (SIZE / SIZE_IN_SEARCH).powi(2),
            _ => lambda,
        })
        .collect();
    for (k, known) in known.iter().enumerate() {
        normal[(k, k)] += known - 1.0;
    }
    let cost = |sizes: &DVector<f64>| -> f64 { sizes.iter().zip(&known).map(|(size, known)| known * size * size).sum() };
    let with = |sizes: &DVector<f64>| deviance(experiments, &around.left(sizes)) + cost(sizes);
    // What the parameters alone promise is no error of form: a refit takes it, or the slopes lead nowhere.
    let p = bends.start;
    let alone = normal.view((0, 0), (p, p)).clone_owned().cholesky().map(|c| c.solve(&b.rows(0, p)));
    let (Some(sizes), Some(alone)) = (normal.cholesky().map(|c| c.solve(&b)), alone) else { return as_it_is };
    let alone = alone.resize_vertically(sizes.len(), 0.0);
    let (with, alone) = rayon::join(|| with(&sizes), || with(&alone));
    as_it_is + (with - alone).min(0.0)
}

/// The residuals, in σ, with the curves of the effects bent as the data ask for, by two standard deviations at most.
pub fn bent(machine: &Machine<f64>, starts: &[State<f64>], experiments: &[Experiment], free: &[Free], ratio_std: f64) -> Change {
    let around = Around::new(machine, starts, experiments, free, ratio_std);
    let nothing = DVector::zeros(around.changes());
    if around.is_short() {
        return around.left(&nothing);
    }
    let (normal, b) = around.normal(machine, free, Change::clone);
    let bends = around.bends();
    // Curves as stiff as this: of no stiffness, they bend freely.
    let at = |stiffness: f64| {
        let mut stiff = normal.clone();
        bends.clone().for_each(|k| stiff[(k, k)] += stiffness);
        stiff.cholesky().map(|c| c.solve(&b))
    };
    let mild = |sizes: &DVector<f64>| SIZE * sizes.rows(bends.start, bends.len()).amax() <= 2.0 * SIZE_IN_SEARCH;
    let Some(mut mildly) = at(0.0) else { return around.left(&nothing) };
    if !bends.is_empty() && !mild(&mildly) {
        let (mut low, mut high) = (0.0, (1.0 + normal.diagonal().amax()).ln());
        mildly = nothing;
        for _ in 0..BISECTIONS {
            let middle: f64 = 0.5 * (low + high);
            match at(middle.exp()) {
                Some(sizes) if mild(&sizes) => (high, mildly) = (middle, sizes),
                _ => low = middle,
            }
        }
    }
    around.left(&mildly)
}

/// The currents of a change turned by a right angle.
fn turned(experiments: &[Experiment], change: &Change) -> Change {
    let run = |(e, run): (&Experiment, &Vec<Vec<f64>>)| -> Vec<Vec<f64>> {
        let vector = |k: usize| e.current_vector(k, |c| run[c][k] * e.channels[c].sigma).unwrap_or(Complex::new(0.0, 0.0));
        let turned: Vec<Complex<f64>> = (0..e.len()).map(|k| vector(k) * Complex::i()).collect();
        let channel = |c: &Channel| match c.kind {
            ChannelKind::Current { direction_rad } => {
                let (s, cos) = direction_rad.sin_cos();
                turned.iter().map(|v| (v.re * cos + v.im * s) / c.sigma).collect()
            }
            _ => vec![0.0; e.len()],
        };
        e.channels.iter().map(channel).collect()
    };
    experiments.iter().zip(change).map(run).collect()
}

/// Per experiment and channel: a change of the outputs, in σ.
type Change = Vec<Vec<Vec<f64>>>;

/// Changes of one standard deviation that no parameter is meant to follow; `ratio_std` is that of ln(L_ls/L_lr)
/// ([`leakage_ratio_std`](im_model::MotorFile::leakage_ratio_std)).
pub fn disturbances(machine: &Machine<f64>, starts: &[State<f64>], experiments: &[Experiment], ratio_std: f64) -> Disturbances {
    let (here, left): (Change, Change) = experiments.par_iter().zip(starts).map(|(e, x)| outputs(machine, e, x)).unzip();
    let change_to = |other: &Machine<f64>| -> Option<Change> {
        let there = all_residuals(other, starts, experiments);
        let out: Change = left.iter().zip(&there).map(|(before, after)| change(before, after)).collect();
        out.iter().flatten().flatten().all(|x| x.is_finite()).then_some(out)
    };
    // Half of the way is linear enough, and twice the change is that of one standard deviation.
    let mut of_ratio = with_ratio(machine, 0.5 * ratio_std).as_ref().and_then(change_to);
    of_ratio.iter_mut().flatten().flatten().flatten().for_each(|x| *x *= 2.0);
    let active = || machine.effects().active();
    let explained = active().filter_map(|e| change_to(&machine.without([e]).ok()?)).collect();
    let mut detuned: Vec<Change> = active().flat_map(|e| retuned(machine, e)).filter_map(|m| change_to(&m)).collect();
    detuned.iter_mut().flatten().flatten().flatten().for_each(|x| *x /= RETUNED);
    Disturbances { of_ratio, explained, detuned, bending: Bending::new(experiments, &here) }
}

/// The machine with each shape of a resonance, its frequency and its damping, changed a little: another spring rings elsewhere, and what it
/// explains then differs in phase.
fn retuned(machine: &Machine<f64>, effect: EffectId) -> Vec<Machine<f64>> {
    if !effect.about().resonant {
        return Vec::new();
    }
    let shapes = effect.parameters().iter().enumerate().filter(|(_, p)| p.role == Role::Shape);
    let ids = shapes.map(|(k, _)| ParameterId::Effect(effect, k));
    ids.filter_map(|id| machine.with(&[(id, machine.get(id) * (1.0 + RETUNED))]).ok()).collect()
}

impl Disturbances {
    /// All that counts in an interval, one after the other.
    pub fn each(&self) -> impl Iterator<Item = Change> {
        let bent = move |d| (0..self.bending.ways()).map(move |way| self.bending.bent(d, way));
        self.of_ratio.iter().cloned().chain(self.explained.iter().chain(&self.detuned).flat_map(bent))
    }
}

/// The machine with the logarithm of L_ls/L_lr changed, and the inverse-Γ circuit that its terminals show kept: without saturation it is the same
/// there.
fn with_ratio(machine: &Machine<f64>, change: f64) -> Option<Machine<f64>> {
    use BaseParameter as P;
    let shown = at_low_slip(machine);
    let ratio = shown.leakage_ratio() * change.exp();
    let t = shown.inverse_gamma().to_t(ratio, shown.inertia_kg_m2, shown.viscous_friction_nm_s_per_rad);
    let branch = machine.effects().rotor_skin_effect.low_slip_leakage_h(t.rotor_resistance_ohm);
    let set = [
        (P::RotorResistance, t.rotor_resistance_ohm),
        (P::StatorLeakageInductance, t.stator_leakage_inductance_h),
        (P::RotorLeakageInductance, t.rotor_leakage_inductance_h - branch),
        (P::MagnetizingInductance, t.magnetizing_inductance_h),
    ];
    machine.with(&set.map(|(p, x)| (ParameterId::Base(p), x))).ok()
}

/// The T circuit at low slip frequency, where a second branch of the rotor is one more leakage.
pub(crate) fn at_low_slip(machine: &Machine<f64>) -> TParameters<f64> {
    let mut p = *machine.parameters();
    p.rotor_leakage_inductance_h += machine.effects().rotor_skin_effect.low_slip_leakage_h(p.rotor_resistance_ohm);
    p
}

fn scaled(change: &Change, by: impl Fn(usize, usize) -> f64) -> Change {
    let run = |(e, run): (usize, &Vec<Vec<f64>>)| {
        run.iter().map(|c| c.iter().enumerate().map(|(k, x)| x * by(e, k)).collect()).collect()
    };
    change.iter().enumerate().map(run).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_identify::offline::predict;
    use im_model::machines::MOTULATOR_2_2_KW as M;
    use im_model::{EffectId, Recording};

    /// A machine coasts with a friction whose curve is bent over the speed: by 15 % that is an error of form, by 60 % not all of it is one: curves
    /// over speed, time and their squares share it.
    #[test]
    fn a_curve_bends_as_far_as_forms_differ_and_no_further() {
        let machine = Machine::base(M.parameters(), M.pole_pairs).unwrap();
        let machine = machine.with(&[(ParameterId::Effect(EffectId::CoulombFriction, 0), 0.5)]).unwrap();
        let (n, start) = (2000, State { omega_m: 150.0, ..State::default() });
        let none = vec![Complex::new(0.0, 0.0); n];
        let r = Recording {
            name: "coasting".into(),
            start_s: 0.0,
            sample_time_s: 1e-3,
            u_s: none.clone(),
            i_s: none,
            omega_m: vec![0.0; n],
            tau_load: Some(vec![0.0; n]),
        };
        let mut e = Experiment::from_recording(&r, [1.0, 1.0], 1e-3);
        let starts = [start];
        let here = predict(&machine, &e, &start);
        let explained = &disturbances(&machine, &starts, std::slice::from_ref(&e), 0.1).explained[0][0][2];
        let shares = [0.15, 0.6].map(|part| {
            let fastest = here[2][0];
            let at = |k: usize| 2.0 * here[2][k] / fastest - 1.0;
            e.channels[2].values = (0..n).map(|k| here[2][k] + 1e-3 * part * at(k) * explained[k]).collect();
            let missed =
                im_identify::offline::residuals(&machine, &e, &start)[2].iter().map(|r| r * r).sum::<f64>() / (3 * n) as f64;
            let left = bent(&machine, &starts, std::slice::from_ref(&e), &[], 0.1);
            left.iter().flatten().flatten().map(|r| r * r).sum::<f64>() / (3 * n) as f64 / missed
        });
        assert!(shares[0] < 1e-3 && shares[1] > 1e-3 && shares[1] < 0.5, "{shares:?}");
    }

    /// The ratio of the leakages is another name for the same inverse-Γ circuit, with a second branch of the rotor or without.
    #[test]
    fn another_ratio_is_the_same_circuit_at_the_terminals() {
        let plain = Machine::base(M.parameters(), M.pole_pairs).unwrap();
        let branch = plain.with(&[(ParameterId::Effect(EffectId::RotorSkinEffect, 0), 0.5)]).unwrap();
        for machine in [plain, branch] {
            let other = with_ratio(&machine, 0.1).unwrap();
            let (a, b) = (at_low_slip(&machine), at_low_slip(&other));
            assert!((b.leakage_ratio() / a.leakage_ratio() - 0.1f64.exp()).abs() < 1e-9);
            let (a, b) = (a.inverse_gamma(), b.inverse_gamma());
            for (a, b) in [
                (a.rotor_resistance_ohm, b.rotor_resistance_ohm),
                (a.leakage_inductance_h, b.leakage_inductance_h),
                (a.magnetizing_inductance_h, b.magnetizing_inductance_h),
            ] {
                assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
            }
        }
    }
}
