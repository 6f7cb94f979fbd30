//! Recordings as models are fitted to them and judged on them.

use im_identify::offline::{ChannelKind, Experiment, residuals};
use im_model::{Machine, State};

use crate::score::whiteners;

/// Rate at which the speed is drawn to the measured one, 1/s: slower than the electrical transients, faster than pulling out.
const PULL_PER_S: f64 = 30.0;

/// Copies of experiments with the speed drawn towards the measured one, where it is measured.
pub fn pulled(experiments: &[Experiment]) -> Vec<Experiment> {
    experiments
        .iter()
        .map(|e| {
            let speed = e.channels.iter().find(|c| c.kind == ChannelKind::Speed && c.valid.is_none());
            let speed = speed.filter(|_| !e.is_table());
            Experiment { speed_nudge: speed.map(|c| (c.values.clone(), PULL_PER_S)), ..e.clone() }
        })
        .collect()
}

/// How much worse a machine may be without help before a recording counts as unstable.
pub const UNSTABLE: f64 = 1.2;

/// A recording as models are judged on it. Voltage replayed without the drive that made it can be unstable (a slow, loaded machine falls
/// out of step on the slightest difference): there, the speed is drawn towards the measured one. Recordings that `machine` can follow
/// unaided, to within `factor` of its aided error, stay unaided.
pub fn judged(e: &Experiment, machine: &Machine<f64>, start: &State<f64>, factor: f64) -> Experiment {
    let aided = pulled(std::slice::from_ref(e)).remove(0);
    let stable = aided.speed_nudge.is_none() || mean_square(machine, e, start) <= factor * mean_square(machine, &aided, start);
    if stable { e.clone() } else { aided }
}

/// −2 log L of residuals under an autoregressive noise model per channel, up to a constant.
pub fn evidence(experiments: &[Experiment], residuals: &[Vec<Vec<f64>>]) -> f64 {
    let w = whiteners(experiments, residuals);
    experiments.iter().zip(&w).flat_map(|(e, w)| e.channels.iter().zip(w).map(|(c, w)| c.count() as f64 * w.variance.ln())).sum()
}

/// Mean squared residual of one experiment, in σ².
pub fn mean_square(machine: &Machine<f64>, e: &Experiment, start: &State<f64>) -> f64 {
    residuals(machine, e, start).iter().flatten().map(|r| r * r).sum::<f64>() / e.count() as f64
}
