//! Tables of steady states: each row is the machine settled on a sinusoidal supply, loaded or held.

use im_model::{Held, Machine, Plant, steady_state};

use super::channel::ChannelKind;
use super::experiment::Experiment;
use super::free::{Free, Target};

/// Solves the first `rows` rows; `sink` receives each row's channel values, NaN where the machine has no steady state.
pub(super) fn run(
    machine: &Machine<f64>,
    experiment: &Experiment,
    frequency_hz: f64,
    rows: usize,
    mut sink: impl FnMut(usize, usize, f64),
) {
    for k in 0..rows {
        let machine = &experiment.machine_of(machine, k);
        let plant = Plant::new(machine);
        let u = experiment.u_s[k].norm();
        let held = match &experiment.imposed_speed {
            Some(w) => Held::Speed(w[k]),
            None => Held::Load(experiment.tau_load[k]),
        };
        let found = steady_state(machine, u, frequency_hz, held).ok();
        for (c, channel) in experiment.channels.iter().enumerate() {
            let y = found.map_or(f64::NAN, |x| {
                let i = plant.currents(&x).i_s;
                // The voltage lies along α: p = 3/2 Re(u ī), q = 3/2 Im(u ī).
                match channel.kind {
                    ChannelKind::RmsCurrent => i.norm() * core::f64::consts::FRAC_1_SQRT_2,
                    ChannelKind::ActivePower => 1.5 * u * i.re,
                    ChannelKind::ReactivePower => -1.5 * u * i.im,
                    ChannelKind::Speed => x.omega_m,
                    ChannelKind::Current { direction_rad } => i.re * direction_rad.cos() + i.im * direction_rad.sin(),
                }
            });
            sink(k, c, y);
        }
    }
}

/// Change of a search variable over which a steady state is linear to a millionth and far above its rounding.
const STEP: f64 = 1e-4;

/// Residuals of each channel.
type Residuals = Vec<Vec<f64>>;

/// Residuals and, for each free parameter, their slopes by differences: the solutions are exact to 1e-12, a table has tens of rows.
pub(super) fn linearize(
    machine: &Machine<f64>,
    free: &[Free],
    residuals_of: impl Fn(&Machine<f64>) -> Residuals,
) -> (Residuals, Vec<Residuals>) {
    let residuals = residuals_of(machine);
    let at = |f: &Free, v: f64| match &f.target {
        Target::Machine(ids) => {
            let set: Vec<_> = ids.iter().map(|&id| (id, f.value(machine.get(id), v))).collect();
            if set.iter().all(|&(id, p)| p == machine.get(id)) {
                return None;
            }
            machine.with(&set).ok().map(|m| residuals_of(&m))
        }
        Target::Initial { .. } => None,
    };
    let slopes = free
        .iter()
        .map(|f| {
            // At a limit, the side that exists.
            let (low, high) = (at(f, -STEP), at(f, STEP));
            let width = if low.is_some() && high.is_some() { 2.0 * STEP } else { STEP };
            let (low, high) = (low.as_ref().unwrap_or(&residuals), high.as_ref().unwrap_or(&residuals));
            let column = |c: usize| low[c].iter().zip(&high[c]).map(|(a, b)| (a - b) / width).collect();
            (0..residuals.len()).map(column).collect()
        })
        .collect();
    (residuals, slopes)
}
