//! Lines of the speed's residual over the angle of the rotor: what turns with the shaft at any ratio, a belt at 0.54 or a gear at 3.2 per turn.

use std::f64::consts::TAU;

use im_identify::offline::{ChannelKind, Experiment};
use im_model::{Machine, State};
use rayon::prelude::*;
use realfft::RealFftPlanner;

/// Orders looked at, per turn.
const ORDERS: (f64, f64) = (0.1, 12.0);
/// Places on the way from one independent order to the next.
const FINENESS: f64 = 4.0;
/// Width of a cell of the angle at the highest order, rad: a line there loses 1 %.
const CELL: f64 = 0.5;
/// Cells at most: of more turns, the orders lie further apart.
const MOST_CELLS: usize = 1 << 20;
/// Lines given back at most.
const MOST: usize = 3;
/// An order this near to a whole one is that one, which is tried anyway.
const WHOLE: f64 = 0.03;
/// ln of the probability, over all orders tried, that chance makes such a line.
const CHANCE: f64 = -14.0;

/// The orders, per turn, of the strongest lines that are not whole numbers, strongest first. `white` are whitened residuals per experiment
/// and channel.
pub(super) fn orders(
    machine: &Machine<f64>,
    starts: &[State<f64>],
    experiments: &[Experiment],
    white: &[Vec<Vec<f64>>],
) -> Vec<f64> {
    let runs: Vec<(Vec<f64>, &[f64])> = experiments
        .iter()
        .zip(starts)
        .zip(white)
        .filter(|((e, _), _)| !e.is_table())
        .filter_map(|((e, x), white)| {
            let c = e.channels.iter().position(|c| c.kind == ChannelKind::Speed)?;
            Some((angles(machine, e, x), white[c].as_slice()))
        })
        .collect();
    let range = |theta: &[f64]| theta.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(*t), h.max(*t)));
    let turns = |theta: &[f64]| (range(theta).1 - range(theta).0) / TAU;
    let most = runs.iter().map(|(theta, _)| turns(theta)).fold(0.0, f64::max);
    if !(most > 3.0 && most.is_finite()) {
        return Vec::new();
    }
    // The sums over the angle by a Fourier transform of cells of it, so many that they reach FINENESS times around the longest run.
    let cells = ((FINENESS * most * TAU * ORDERS.1 / CELL) as usize + 1).next_power_of_two().min(MOST_CELLS);
    let cell = (CELL / ORDERS.1).max(most * TAU / cells as f64);
    let step = TAU / (cell * cells as f64);
    let (first, last) = ((ORDERS.0 / step).ceil() as usize, (ORDERS.1.min(0.5 * TAU / cell) / step) as usize);
    if last < first + 2 {
        return Vec::new();
    }
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(cells);
    let spectrum = |(theta, r): &(Vec<f64>, &[f64])| -> Vec<f64> {
        let mut summed = vec![0.0; cells];
        let from = range(theta).0;
        for (t, x) in theta.iter().zip(*r) {
            summed[(((t - from) / cell) as usize).min(cells - 1)] += x;
        }
        let mut out = transform.make_output_vec();
        // The lengths are those of the plan.
        let _ = transform.process(&mut summed, &mut out);
        out[first..=last].iter().map(|x| x.norm_sqr() / r.len() as f64).collect()
    };
    let rows: usize = runs.iter().map(|(_, r)| r.len()).sum();
    let variance = runs.iter().flat_map(|(_, r)| *r).map(|x| x * x).sum::<f64>() / rows as f64;
    let mut power = vec![0.0; last + 1 - first];
    for run in runs.par_iter().map(spectrum).collect::<Vec<_>>() {
        power.iter_mut().zip(run).for_each(|(p, x)| *p += x / variance);
    }
    let count = power.len() - 1;
    // Of white noise each run's power is exponential with mean one.
    let threshold = (count as f64 + 1.0).ln() - CHANCE + runs.len() as f64;
    let mut peaks: Vec<usize> =
        (1..count).filter(|&k| power[k] > threshold && power[k] >= power[k - 1] && power[k] > power[k + 1]).collect();
    peaks.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    let mut found: Vec<f64> = Vec::new();
    for k in peaks {
        let [a, b, c] = [power[k - 1], power[k], power[k + 1]];
        let shift = 0.5 * (a - c) / (a - 2.0 * b + c);
        let order = step * ((first + k) as f64 + if shift.is_finite() { shift } else { 0.0 });
        // Beside a strong line stand its side lobes.
        let near = |o: &f64| (o - order).abs() < 2.0 / most;
        if (order - order.round()).abs() > WHOLE.max(1.0 / most) && !found.iter().any(near) {
            found.push(order);
        }
        if found.len() == MOST {
            break;
        }
    }
    found
}

/// The angle of the rotor at each row, rad.
fn angles(machine: &Machine<f64>, e: &Experiment, start: &State<f64>) -> Vec<f64> {
    let mut bench = e.bench(machine, start);
    let step = |k: usize| {
        let theta = bench.state().theta_m;
        bench.advance(&e.input(k, bench.plant()));
        theta
    };
    (0..e.len()).map(step).collect()
}
