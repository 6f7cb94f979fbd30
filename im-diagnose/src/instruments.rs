//! What the instruments of tables are off by in all rows alike.
//!
//! A meter of class c may be off by c % of its reading, evenly distributed: c/√3 in standard deviation, and the same wherever that meter is read. No
//! residual shows that, and parameters move with it: R_s by twice the error of the ammeter.

use im_identify::offline::{Channel, ChannelKind, Experiment, residuals};
use im_model::{Machine, State};

use crate::residuals::change;

/// Per experiment and channel: a change of the readings, in σ.
type Change = Vec<Vec<Vec<f64>>>;

/// One change of a standard deviation for each of the meters of current, power, voltage and torque; empty for what is no table.
pub fn scale_errors(machine: &Machine<f64>, experiments: &[Experiment]) -> Vec<Change> {
    let of = |change: &dyn Fn(&Experiment, f64) -> Vec<Vec<f64>>| -> Change {
        experiments.iter().map(|e| std_of_scale(e).map_or_else(Vec::new, |std| change(e, std))).collect()
    };
    let shown = |kinds: &'static [ChannelKind]| {
        move |e: &Experiment, std: f64| -> Vec<Vec<f64>> {
            let readings = |c: &Channel| if kinds.contains(&c.kind) { 1.0 } else { 0.0 };
            e.channels.iter().map(|c| c.values.iter().map(|x| readings(c) * std * x / c.sigma).collect()).collect()
        }
    };
    let driven = |other: &dyn Fn(&mut Experiment, f64)| {
        of(&|e, std| {
            let mut moved = e.clone();
            other(&mut moved, 1.0 + std);
            let [here, there] = [e, &moved].map(|e| residuals(machine, e, &State::default()));
            change(&here, &there)
        })
    };
    let all = [
        of(&shown(&[ChannelKind::RmsCurrent])),
        of(&shown(&[ChannelKind::ActivePower, ChannelKind::ReactivePower])),
        driven(&|e, by| e.u_s.iter_mut().for_each(|u| *u *= by)),
        driven(&|e, by| e.tau_load.iter_mut().for_each(|t| *t *= by)),
    ];
    all.into_iter().filter(|c| c.iter().flatten().flatten().all(|x| x.is_finite())).collect()
}

/// Standard deviation of the scale of a table's instruments; by its noise, which is their class.
fn std_of_scale(e: &Experiment) -> Option<f64> {
    let current = e.channels.iter().filter(|_| e.is_table()).find(|c| c.kind == ChannelKind::RmsCurrent)?;
    let largest = current.values.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    (largest > 0.0).then(|| current.sigma / largest / 3f64.sqrt())
}
