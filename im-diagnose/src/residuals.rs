//! Recordings as models are fitted to them and judged on them, and the errors of a model.

use std::borrow::Borrow;
use std::collections::BTreeMap;
use std::mem::take;

use im_identify::offline::{Channel, ChannelKind, Experiment, Free, Residuals, linearize, outputs, residuals};
use im_model::{Machine, State};
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::noise::sensor_whiteners;

/// Rate at which the speed is nudged towards the measured one, 1/s: slower than the electrical transients, faster than pulling out.
const NUDGE_PER_S: f64 = 30.0;

/// The measured speed towards which a simulated one can be nudged: not that of a table, nor one that drives the machine.
fn nudging(e: &Experiment) -> Option<&Channel> {
    let speed = e.channels.iter().find(|c| c.kind == ChannelKind::Speed && c.valid.is_none());
    speed.filter(|_| !e.is_table())
}

/// Whether a measured speed helps the simulated one in any of these.
pub fn any_nudged(experiments: &[Experiment]) -> bool {
    experiments.iter().any(|e| nudging(e).is_some())
}

/// Copies of experiments with the speed nudged towards the measured one, where it is measured.
pub fn nudged(experiments: &[Experiment]) -> Vec<Experiment> {
    let rate = |e: &Experiment| NUDGE_PER_S * e.nudge_part;
    let with = |e: &Experiment| match nudging(e) {
        Some(c) => e.clone().nudged_towards(c.values.clone(), rate(e)),
        None => e.clone(),
    };
    experiments.iter().map(with).collect()
}

/// How much worse a machine may be without help before a recording counts as unstable.
pub const UNSTABLE: f64 = 1.2;

/// A recording as models are judged on it. Voltage replayed without the drive that made it can be unstable (a slow, loaded machine falls
/// out of step on the slightest difference): there, the speed is nudged towards the measured one. Recordings that `machine` can follow
/// without nudging, to within `factor` of the error with it, stay as they are.
pub fn judged(e: &Experiment, machine: &Machine<f64>, start: &State<f64>, factor: f64) -> Experiment {
    let nudged_run = nudged(std::slice::from_ref(e)).remove(0);
    if nudged_run.speed_nudge.is_none() {
        return nudged_run;
    }
    let (alone, helped) = rayon::join(|| mean_square(machine, e, start), || mean_square(machine, &nudged_run, start));
    if alone <= factor * helped { e.clone() } else { nudged_run }
}

/// −2 log L of residuals under an autoregressive noise model per channel, up to a constant: of a table with the noise of its instruments at least.
pub fn deviance<E: Borrow<Experiment> + Sync, R: AsRef<[Vec<f64>]> + Sync>(experiments: &[E], residuals: &[R]) -> f64 {
    let w = sensor_whiteners(experiments, residuals, 1);
    let mut sum = 0.0;
    for ((e, r), w) in experiments.iter().zip(residuals).zip(&w) {
        let e = e.borrow();
        for ((c, r), w) in e.channels.iter().zip(r.as_ref()).zip(w) {
            sum += c.count() as f64 * w.variance.ln();
            // Where the variance is that of the residual, the other term is a constant.
            if e.is_table() {
                sum += r.iter().map(|r| r * r).sum::<f64>() / w.variance;
            }
        }
    }
    sum
}

/// Slopes of the residuals, by parameter, then as residuals are: those of all runs at once, and none twice.
pub fn slopes(machine: &Machine<f64>, starts: &[State<f64>], experiments: &[Experiment], free: &[Free]) -> Vec<Residuals> {
    let runs = experiments.par_iter().zip(starts).enumerate();
    let mut of_runs: Vec<_> = runs.map(|(k, (e, x))| linearize(machine, e, x, k, free).slopes).collect();
    (0..free.len()).map(|p| of_runs.iter_mut().map(|s| take(&mut s[p])).collect()).collect()
}

/// How the outputs of an experiment change, in σ, between two runs that leave these residuals.
pub fn change(before: &[Vec<f64>], after: &[Vec<f64>]) -> Vec<Vec<f64>> {
    before.iter().zip(after).map(|(before, after)| before.iter().zip(after).map(|(b, a)| b - a).collect()).collect()
}

/// Mean squared residual of one experiment, in σ².
pub fn mean_square(machine: &Machine<f64>, e: &Experiment, start: &State<f64>) -> f64 {
    residuals(machine, e, start).iter().flatten().map(|r| r * r).sum::<f64>() / e.count() as f64
}

/// Mean square of the residual, in σ², up to which a model fits so well that no signal can be in another convention.
pub(crate) const FITS: f64 = 4.0;

/// Error of a model on a set of recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors {
    /// χ²/N: mean squared residual in σ²; 1 is the noise of the sensors.
    pub chi2_per_sample: f64,
    /// Root mean square per channel, in its unit, with what the noise of a measured voltage does.
    pub rmse: BTreeMap<String, f64>,
    /// Fit percent per channel: 100 (1 − ‖e‖/‖y − mean y‖); none of a signal that stays where it is.
    pub fit_percent: BTreeMap<String, f64>,
}

impl Errors {
    /// Root mean square residual in σ, as people read it.
    pub fn rms_in_sigma(&self) -> f64 {
        self.chi2_per_sample.sqrt()
    }

    /// For programs; `null` where there is no number.
    pub fn to_json(&self) -> Value {
        json!({
            "chi2_per_sample": self.chi2_per_sample, "rms_in_sigma": self.rms_in_sigma(), "rmse": self.rmse,
            "fit_percent": self.fit_percent,
        })
    }
}

/// What a machine leaves of experiments from given starts, in σ.
pub fn all_residuals(machine: &Machine<f64>, starts: &[State<f64>], experiments: &[Experiment]) -> Residuals {
    experiments.par_iter().zip(starts).map(|(e, x)| residuals(machine, e, x)).collect()
}

/// A signal that varies by less than so many times its noise, rms, stays where it is.
const STANDS: f64 = 3.0;

/// Errors of a machine on experiments.
pub fn errors(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> Errors {
    let runs: Vec<_> = experiments.par_iter().zip(starts).map(|(e, x)| outputs(machine, e, x)).collect();
    let mut sums: BTreeMap<String, [f64; 6]> = BTreeMap::new();
    for (e, (predicted, left)) in experiments.iter().zip(&runs) {
        for (c, (modelled, r)) in e.channels.iter().zip(predicted.iter().zip(left)) {
            let s = sums.entry(c.name.clone()).or_default();
            for (k, x) in r.iter().enumerate().filter(|(k, _)| c.is_valid(*k)) {
                let y = c.values[k];
                s[0] += 1.0;
                s[1] += x * x;
                s[2] += (y - modelled[k]).powi(2);
                s[3] += y;
                s[4] += y * y;
                s[5] += c.sigma * c.sigma;
            }
        }
    }
    let n: f64 = sums.values().map(|s| s[0]).sum();
    Errors {
        chi2_per_sample: sums.values().map(|s| s[1]).sum::<f64>() / n,
        rmse: sums.iter().map(|(k, s)| (k.clone(), (s[2] / s[0]).sqrt())).collect(),
        fit_percent: sums
            .iter()
            .filter_map(|(k, s)| {
                let spread = s[4] - s[3] * s[3] / s[0];
                // Of a signal that stays where it is no part is explained.
                (spread > (STANDS * STANDS * s[5]).max(1e-300)).then(|| (k.clone(), 100.0 * (1.0 - (s[2] / spread).sqrt())))
            })
            .collect(),
    }
}
