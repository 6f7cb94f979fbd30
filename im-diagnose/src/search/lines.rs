//! Lines of the speed's residual over the angle of the rotor: what turns with the shaft at any ratio, a belt at 0.54 or a gear at 3.2 per turn.

use im_identify::offline::{ChannelKind, Experiment};
use im_model::{Bench, Complex, Machine, State};
use rayon::prelude::*;

/// Orders looked at, per turn.
const ORDERS: (f64, f64) = (0.1, 12.0);
/// Places on the way from one independent order to the next.
const FINENESS: f64 = 4.0;
/// Orders tried at most.
const MOST_TRIED: f64 = 3000.0;
/// Phase of the highest order over a block of rows, rad: it loses a tenth.
const BLOCK: f64 = 1.5;
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
    let runs: Vec<(Vec<f64>, Vec<f64>)> = experiments
        .iter()
        .zip(starts)
        .zip(white)
        .filter(|((e, _), _)| !e.is_table())
        .filter_map(|((e, x), white)| {
            let c = e.channels.iter().position(|c| c.kind == ChannelKind::Speed)?;
            Some(thinned(&angles(machine, e, x), &white[c]))
        })
        .collect();
    let turns = |theta: &[f64]| {
        let (low, high) = theta.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(*t), h.max(*t)));
        (high - low) / std::f64::consts::TAU
    };
    let most = runs.iter().map(|(theta, _)| turns(theta)).fold(0.0, f64::max);
    if !(most > 3.0 && most.is_finite()) {
        return Vec::new();
    }
    let step = (1.0 / (FINENESS * most)).max((ORDERS.1 - ORDERS.0) / MOST_TRIED);
    let count = ((ORDERS.1 - ORDERS.0) / step) as usize;
    let rows: usize = runs.iter().map(|(_, r)| r.len()).sum();
    let variance = runs.iter().flat_map(|(_, r)| r.iter()).map(|x| x * x).sum::<f64>() / rows as f64;
    let power: Vec<f64> = (0..=count)
        .into_par_iter()
        .map(|k| {
            let order = ORDERS.0 + step * k as f64;
            let line = |(theta, r): &(Vec<f64>, Vec<f64>)| {
                theta.iter().zip(r).map(|(t, r)| Complex::from_polar(*r, -order * t)).sum::<Complex<f64>>().norm_sqr()
                    / r.len() as f64
            };
            runs.iter().map(line).sum::<f64>() / variance
        })
        .collect();
    // Of white noise each run's power is exponential with mean one.
    let threshold = (count as f64 + 1.0).ln() - CHANCE + runs.len() as f64;
    let mut peaks: Vec<usize> =
        (1..count).filter(|&k| power[k] > threshold && power[k] >= power[k - 1] && power[k] > power[k + 1]).collect();
    peaks.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    let mut found: Vec<f64> = Vec::new();
    for k in peaks {
        let [a, b, c] = [power[k - 1], power[k], power[k + 1]];
        let shift = 0.5 * (a - c) / (a - 2.0 * b + c);
        let order = ORDERS.0 + step * (k as f64 + if shift.is_finite() { shift } else { 0.0 });
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

/// Blocks of rows, short against the highest order: the angle in their middle, and their sum as noise of the same size.
fn thinned(theta: &[f64], r: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let fastest = theta.windows(2).map(|w| (w[1] - w[0]).abs()).fold(1e-9, f64::max);
    let block = (BLOCK / (ORDERS.1 * fastest)).clamp(1.0, 100.0) as usize;
    let middle = theta.chunks_exact(block).map(|c| c[block / 2]).collect();
    let sum = r.chunks_exact(block).map(|c| c.iter().sum::<f64>() / (block as f64).sqrt()).collect();
    (middle, sum)
}

/// The angle of the rotor at each row, rad.
fn angles(machine: &Machine<f64>, e: &Experiment, start: &State<f64>) -> Vec<f64> {
    let mut bench = Bench::new(machine, *start, e.sample_time_s);
    let step = |k: usize| {
        let theta = bench.state().theta_m;
        bench.advance(&e.input(k, bench.plant()));
        theta
    };
    (0..e.len()).map(step).collect()
}
