//! The load torque of a run whose speed drives the machine.
//!
//! J dω/dt = τ_e(u, ω) − friction − τ_L:   with ω given, the electrical side needs no torque balance, and what is left of the balance is the
//! load, a random walk behind the noise of the speed sensor ([`trend`](super::trend)).

use im_model::{Machine, Plant, State};

use super::experiment::Experiment;
use super::load::Load;
use super::trend::Trend;

/// A load torque found from the speed.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadEstimate {
    /// One value per row, Nm.
    pub torque_nm: Vec<f64>,
    /// Standard deviation, by the noise of the speed sensor alone.
    pub std_nm: Vec<f64>,
}

/// The change of the speed over each sample by the torques that `machine` knows, rad/s, while the measured speed drives it.
fn known_changes(machine: &Machine<f64>, e: &Experiment, start: &State<f64>) -> Vec<f64> {
    let mut bench = e.bench(machine, start);
    let change = |k: usize| {
        let input = e.input(k, bench.plant());
        let mut sum = 0.0;
        bench.advance_observed(&input, |weight, stage| sum += weight * stage.rates.omega_m);
        sum
    };
    (0..e.len()).map(change).collect()
}

impl Experiment {
    /// The same run with its speed smoothed by what the torque of `machine` does to it, where that makes the measured speed likelier: torque steps
    /// are then no noise. Nothing changes where the load is known.
    pub fn smoothed_by_torque(mut self, machine: &Machine<f64>, start: &State<f64>) -> Self {
        if let Load::Unknown(shown) = &self.load {
            let changes = known_changes(machine, &self, start);
            let better = shown.with_known_changes(&changes, machine.parameters().inertia_kg_m2, self.sample_time_s);
            if let Some(better) = better.filter(|_| changes.iter().all(|x| x.is_finite())) {
                self.load = Load::Unknown(better);
            }
        }
        self
    }
}

/// The load torque of a run whose speed drives the machine: all that brakes the shaft beyond the machine's own friction. `None` where the
/// load is known.
pub fn load_torque(machine: &Machine<f64>, e: &Experiment, start: &State<f64>) -> Option<LoadEstimate> {
    let Load::Unknown(shown) = &e.load else { return None };
    let change = known_changes(machine, e, start);
    let inertia = machine.parameters().inertia_kg_m2;
    // What drives the shaft moves the true speed; the sensor's noise is in what it shows.
    let true_speed: Vec<f64> = {
        let plant = Plant::new(machine);
        let behind = |k: usize| shown.behind(&plant, k) - shown.smooth[k][0];
        (0..e.len()).map(|k| shown.channel.values[k] + behind(k)).collect()
    };
    let valid = |k: usize| shown.channel.is_valid(k);
    let trend = Trend {
        values: &true_speed,
        valid: &valid,
        known: &|k| change[k],
        coupling: -1.0 / inertia,
        sample_time_s: e.sample_time_s,
    };
    let s = trend.smooth();
    // The input's own load, if it says one, is part of what is found.
    let torque_nm = s.s.iter().zip(&e.tau_load).map(|(x, given)| x + given).collect();
    Some(LoadEstimate { torque_nm, std_nm: s.s_std })
}
