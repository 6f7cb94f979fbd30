//! What the form of a model may be wrong by: the library's curve of an effect is never exactly the machine's, and the ratio of the leakages is
//! only given.
//!
//! The difference between two forms of an effect looks like the effect itself, bent over what its curve may be over. A model's likelihood is
//! therefore taken with such changes d_m of its outputs as unknowns of the size of a few per cent, β_m ~ N(0, 1), beside the parameters:
//!
//!   −2 log L = min_{δ,β} ‖W(r − Jδ − Dβ)‖² + λ‖β‖²
//!
//! so that no effect is named for what only mends the form of another. A sample counts 1/λ in the search, what is known of β does not.

use im_identify::offline::{Channel, ChannelKind, Experiment, Free, Linearized, linearize, predict, smoothness};
use im_model::{BaseParameter, Complex, Machine, ParameterId, State, TParameters};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::noise::sensor_whiteners;
use crate::residuals::{deviance, difference};

/// Standard deviation of the difference in form: a part of what an effect explains.
const SIZE: f64 = 0.05;

/// The same where sets of effects are compared: a real machine's form may be farther from the library's than that of another machine is.
const SIZE_IN_SEARCH: f64 = 0.1;

/// Standard deviation of the logarithm of L_ls/L_lr as given.
const RATIO_ERROR: f64 = 0.2;

/// Rows that are enough to find how much of each change is in a residual.
const ROWS: usize = 30_000;

/// Fewest values per unknown: a table of steady states is too short to tell errors of form from noise.
const LEAST_ROWS: usize = 10;

/// Changes of the outputs that no parameter follows.
pub struct Disturbances {
    /// Of another ratio of the leakages, by one standard deviation.
    of_ratio: Option<Change>,
    /// Of other forms of the effects, by one standard deviation.
    bends: Vec<Change>,
    /// What each effect explains.
    explained: Vec<Change>,
    /// The outputs, in their units.
    modelled: Change,
}

/// A fitted model's likelihood with the errors of its form as unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marginal {
    /// −2 log L, up to a constant.
    pub deviance: f64,
    /// By how much the data would bend an effect's curve at most, if they alone did, as a part of what the effect explains.
    pub largest_bend: f64,
}

/// The likelihood of a fitted model with the errors of its form as unknowns, where a sample counts 1/λ: what is known of these errors does not
/// count less for that.
pub fn marginal(
    machine: &Machine<f64>,
    starts: &[State<f64>],
    experiments: &[Experiment],
    free: &[Free],
    lambda: f64,
) -> Marginal {
    let linear: Vec<Linearized> =
        experiments.par_iter().enumerate().map(|(k, e)| linearize(machine, e, &starts[k], k, free)).collect();
    let Disturbances { of_ratio, bends: mut list, explained, modelled } = disturbances(machine, starts, experiments);
    // Forms differ in phase as well.
    list.extend(explained.iter().flat_map(|d| bends(experiments, &modelled, &turned(experiments, d))));
    let bends = list.len();
    list.extend(of_ratio);
    let residuals: Vec<Vec<Vec<f64>>> = linear.iter().map(|l| l.residuals.clone()).collect();
    let slopes: Vec<Change> = (0..free.len()).map(|p| linear.iter().map(|l| l.slopes[p].clone()).collect()).collect();
    let (p, m) = (slopes.len(), list.len());
    let rows: usize = residuals.iter().flatten().map(Vec::len).sum();
    let as_it_is = || Marginal { deviance: deviance(experiments, &residuals), largest_bend: 0.0 };
    if rows < LEAST_ROWS * (p + m) {
        return as_it_is();
    }
    let whiteners = sensor_whiteners(experiments, &residuals);
    let stride = (rows / ROWS).max(1);
    let thinned = |c: &Change| -> Vec<f64> {
        let runs = c.iter().zip(&whiteners).flat_map(|(run, w)| run.iter().zip(w));
        runs.flat_map(|(x, w)| w.apply(x).into_iter().step_by(stride).collect::<Vec<_>>()).collect()
    };
    let columns: Vec<Vec<f64>> = slopes.par_iter().chain(&list).map(thinned).collect();
    let r = DVector::from_vec(thinned(&residuals));
    let flat: Vec<f64> = columns.concat();
    let all = DMatrix::from_vec(r.len(), p + m, flat);
    let mut normal = all.tr_mul(&all) * stride as f64;
    let mut b = all.tr_mul(&r) * stride as f64;
    // The parameters move by logarithms: one that the data do not determine stays within a factor of a few.
    for k in 0..p + m {
        normal[(k, k)] += 1.0;
    }
    if let Some(smooth) = smoothness(machine, free) {
        let (mut information, mut downhill) = (normal.view_mut((0, 0), (p, p)), b.rows_mut(0, p));
        information += &smooth.information;
        downhill += &smooth.downhill;
    }
    let Some(bent) = normal.clone().cholesky().map(|c| c.solve(&b)) else { return as_it_is() };
    let largest_bend = SIZE * bent.rows(p, bends).amax();
    let known = lambda * (SIZE / SIZE_IN_SEARCH).powi(2);
    for k in p..p + m {
        normal[(k, k)] += known - 1.0;
    }
    let Some(sizes) = normal.cholesky().map(|c| c.solve(&b)) else { return as_it_is() };
    let mut left = residuals.clone();
    for (size, change) in sizes.iter().zip(slopes.iter().chain(&list)) {
        for (l, c) in left.iter_mut().flatten().zip(change.iter().flatten()) {
            l.iter_mut().zip(c).for_each(|(l, c)| *l -= size * c);
        }
    }
    // Far from where the slopes were taken they may lead nowhere: then the form is taken as it is.
    let cost = sizes.rows(0, p).norm_squared() + known * sizes.rows(p, m).norm_squared();
    let with_errors = deviance(experiments, &left) + cost;
    Marginal { deviance: with_errors.min(as_it_is().deviance), largest_bend }
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

/// Changes of one standard deviation that no parameter is meant to follow.
pub fn disturbances(machine: &Machine<f64>, starts: &[State<f64>], experiments: &[Experiment]) -> Disturbances {
    let here: Change = experiments.par_iter().zip(starts).map(|(e, x)| predict(machine, e, x)).collect();
    let change = |other: &Machine<f64>| -> Option<Change> {
        let there: Vec<_> = experiments.par_iter().zip(starts).map(|(e, x)| predict(other, e, x)).collect();
        let out: Change = experiments.iter().zip(here.iter().zip(&there)).map(|(e, (a, b))| difference(e, a, b)).collect();
        out.iter().flatten().flatten().all(|x| x.is_finite()).then_some(out)
    };
    // Half of the way is linear enough, and twice the change is that of one standard deviation.
    let mut of_ratio = with_ratio(machine, 0.5 * RATIO_ERROR).as_ref().and_then(change);
    of_ratio.iter_mut().flatten().flatten().flatten().for_each(|x| *x *= 2.0);
    let (mut all_bends, mut explained) = (Vec::new(), Vec::new());
    for effect in machine.effects().active() {
        let mut effects = *machine.effects();
        effects.switch_off(effect);
        if let Some(d) = machine.with_effects(effects).ok().as_ref().and_then(change) {
            all_bends.extend(bends(experiments, &here, &d));
            explained.push(d);
        }
    }
    Disturbances { of_ratio, bends: all_bends, explained, modelled: here }
}

impl Disturbances {
    /// All that counts in an interval.
    pub fn all(self) -> Vec<Change> {
        self.of_ratio.into_iter().chain(self.bends).collect()
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

/// What an effect explains, bent: times the first Legendre polynomials of what its curve may be over (current, speed, time), as modelled: measured
/// ones have the noise of the residual in them.
fn bends(experiments: &[Experiment], modelled: &Change, explained: &Change) -> Vec<Change> {
    let over: Vec<[Vec<f64>; 3]> = experiments
        .iter()
        .zip(modelled)
        .map(|(e, modelled)| {
            let speed = e.channels.iter().position(|c| c.kind == ChannelKind::Speed);
            let current = |k: usize| e.current_vector(k, |c| modelled[c][k]).map_or(e.u_s[k].norm(), |i| i.norm());
            [
                (0..e.len()).map(current).collect(),
                (0..e.len()).map(|k| speed.map_or(0.0, |c| modelled[c][k])).collect(),
                (0..e.len()).map(|k| k as f64 * e.sample_time_s).collect(),
            ]
        })
        .collect();
    let mut out = vec![scaled(explained, |_, _| SIZE)];
    for variable in 0..3 {
        let all = || over.iter().flat_map(|o| &o[variable]).copied().filter(|x| x.is_finite());
        // From standstill, or no current, on: a curve does not bend within the ripple of a steady state.
        let (low, high) = (all().fold(0.0, f64::min), all().fold(0.0, f64::max));
        if high - low <= 0.0 {
            continue;
        }
        let at = |e: usize, k: usize| 2.0 * (over[e][variable][k] - low) / (high - low) - 1.0;
        out.push(scaled(explained, |e, k| SIZE * at(e, k)));
        out.push(scaled(explained, |e, k| SIZE * (1.5 * at(e, k).powi(2) - 0.5)));
    }
    out
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
    use im_model::EffectId;
    use im_model::machines::MOTULATOR_2_2_KW as M;

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
