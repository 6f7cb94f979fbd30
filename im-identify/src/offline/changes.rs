//! How the outputs change from one machine to others: as smooth as the signals, and found in longer steps.

use im_model::{Machine, State};
use rayon::prelude::*;

use super::experiment::Experiment;
use super::simulate::predict;
use super::thinned::Thinned;

/// Outputs per channel.
type Outputs = Vec<Vec<f64>>;

/// Changes of all outputs from those of one machine, each found in one simulation of its own.
pub struct Changes<'a> {
    experiments: &'a [Experiment],
    starts: &'a [State<f64>],
    every_row: Way<'a>,
    /// `None` where the signals allow no longer steps, and where an unknown load moves with the innovations: over a longer step they are others.
    longer_steps: Option<Way<'a>>,
}

/// Runs in some steps, and what the machine does there.
struct Way<'a> {
    runs: Vec<Thinned<'a>>,
    before: Vec<Outputs>,
}

impl<'a> Way<'a> {
    fn new(machine: &Machine<f64>, starts: &[State<f64>], runs: Vec<Thinned<'a>>) -> Self {
        let before = runs.par_iter().zip(starts).map(|(run, x)| predict(machine, run.run(), x)).collect();
        Self { runs, before }
    }
}

impl<'a> Changes<'a> {
    /// From `machine`, each experiment beginning in its state of `starts`.
    pub fn from(machine: &Machine<f64>, experiments: &'a [Experiment], starts: &'a [State<f64>]) -> Self {
        let whole = experiments.iter().map(Thinned::whole).collect();
        let thinned = Thinned::all(experiments);
        let longer = thinned.iter().any(|run| run.rows() > 1) && experiments.iter().all(|e| e.load.unsure_speed().is_none());
        Self {
            experiments,
            starts,
            every_row: Way::new(machine, starts, whole),
            longer_steps: longer.then(|| Way::new(machine, starts, thinned)),
        }
    }

    /// The outputs of the machine itself, at every row.
    pub fn before(&self) -> &[Outputs] {
        &self.every_row.before
    }

    /// To another machine, per experiment and channel in σ; zero at rows that do not count, `None` where the simulation runs away. In steps as long
    /// as the signals allow, with a cubic between them, or, of what is faster than the signals, at `every_row`.
    pub fn to(&self, other: &Machine<f64>, every_row: bool) -> Option<Vec<Outputs>> {
        let way = self.longer_steps.as_ref().filter(|_| !every_row).unwrap_or(&self.every_row);
        let mut out = Vec::with_capacity(self.experiments.len());
        for (((e, x), run), before) in self.experiments.iter().zip(self.starts).zip(&way.runs).zip(&way.before) {
            let after = predict(other, run.run(), x);
            let mut change = Vec::with_capacity(after.len());
            for ((a, b), c) in after.iter().zip(before).zip(&e.channels) {
                let weight = 1.0 / c.sigma;
                let mut d: Vec<f64> = a.iter().zip(b).map(|(a, b)| (a - b) * weight).collect();
                if run.rows() > 1 {
                    d = between(&d, run.rows(), e.len());
                }
                d.iter_mut().enumerate().filter(|(k, _)| !c.is_valid(*k)).for_each(|(_, d)| *d = 0.0);
                if !d.iter().all(|v| v.is_finite()) {
                    return None;
                }
                change.push(d);
            }
            out.push(change);
        }
        Some(out)
    }
}

/// Values at every row from those at every `stride`-th: cubics with the slopes of the neighbours' secants (Catmull and Rom).
fn between(at: &[f64], stride: usize, rows: usize) -> Vec<f64> {
    let node = |j: isize| at[j.clamp(0, at.len() as isize - 1) as usize];
    // What each of four nodes weighs at the rows of a step.
    let weights: Vec<[f64; 4]> = (0..stride)
        .map(|k| {
            let t = k as f64 / stride as f64;
            let (t2, t3) = (t * t, t * t * t);
            [-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1.0, -1.5 * t3 + 2.0 * t2 + 0.5 * t, 0.5 * t3 - 0.5 * t2]
        })
        .collect();
    let mut out = Vec::with_capacity(rows);
    for j in 0..at.len() as isize {
        let near = [node(j - 1), node(j), node(j + 1), node(j + 2)];
        let left = rows - out.len();
        out.extend(weights.iter().take(left).map(|w| w.iter().zip(near).map(|(w, x)| w * x).sum::<f64>()));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_between_nodes_is_met_and_the_ends_are_held() {
        let f = |k: usize| {
            let x = k as f64 / 50.0;
            0.3 + x - 0.7 * x * x
        };
        let nodes: Vec<f64> = (0..100).step_by(7).map(f).collect();
        let all = between(&nodes, 7, 100);
        assert_eq!(all.len(), 100);
        for (k, x) in all.iter().enumerate().take(91).skip(7) {
            assert!((x - f(k)).abs() < 1e-12, "row {k}: {x} {}", f(k));
        }
        assert!(all.iter().enumerate().all(|(k, x)| (x - f(k)).abs() < 0.2), "held");
    }
}
