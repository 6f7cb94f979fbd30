//! Lines of a signal over the angle of the rotor: what turns with the shaft at any ratio, a belt at 0.54 or a gear at 3.2 per turn.

use std::f64::consts::{LN_2, PI, TAU};

use im_identify::offline::Experiment;
use im_model::{Complex, Machine, State};
use rayon::prelude::*;
use realfft::RealFftPlanner;

use crate::statistics::median;

/// Orders looked at, per turn.
const ORDERS: (f64, f64) = (0.2, 12.0);
/// What is taken out before: the mean over so many turns, one period of the lowest order. A step of the load is a short thing then.
const SLOW_TURNS: f64 = 1.0 / ORDERS.0;
/// Places on the way from one independent order to the next.
const FINENESS: usize = 4;
/// Width of a cell of the angle at the highest order, rad: a line there loses 1 %.
const CELL: f64 = 0.5;
/// Cells at most: of more turns, the orders lie further apart.
const MOST_CELLS: usize = 1 << 20;
/// Two orders this near to one another are the same line.
const SAME: f64 = 0.03;
/// ln of the probability, over all orders tried, that chance makes such a line.
const CHANCE: f64 = -14.0;
/// Independent orders to either side whose median is the background of one.
const BESIDE: usize = 16;
/// Standard deviations of most rows beyond which a row shows a start or a step and not what goes on all the time.
const CALM: f64 = 3.0;

/// A signal over the angle of the rotor.
pub(crate) struct Run {
    theta_rad: Vec<f64>,
    /// Of each row, times the angle that it turns on: what stands still repeats nothing.
    signal_rad: Vec<f64>,
}

impl Run {
    /// Of an experiment as a machine turns in it.
    pub fn new(machine: &Machine<f64>, e: &Experiment, start: &State<f64>, signal: &[f64]) -> Self {
        let mut bench = e.bench(machine, start);
        let step = |k: usize| {
            let theta = bench.state().theta_m;
            bench.advance(&e.input(k, bench.plant()));
            theta
        };
        Self::over((0..e.len()).map(step).collect(), signal)
    }

    fn over(theta_rad: Vec<f64>, signal: &[f64]) -> Self {
        let turned: Vec<f64> = theta_rad.windows(2).map(|t| (t[1] - t[0]).abs()).chain([0.0]).collect();
        let quick = quick(signal, &turned);
        let signal_rad = calm(&quick).into_iter().zip(turned).map(|(x, turned)| x * turned).collect();
        Self { theta_rad, signal_rad }
    }

    /// The amplitude of a line.
    pub fn amplitude(&self, order: f64) -> f64 {
        let terms = self.theta_rad.iter().zip(&self.signal_rad).map(|(t, x)| Complex::from_polar(*x, -order * t));
        let all: f64 = self.theta_rad.windows(2).map(|t| (t[1] - t[0]).abs()).sum();
        let of_slow = PI * order * SLOW_TURNS;
        2.0 * terms.sum::<Complex<f64>>().norm() / (all * (1.0 - of_slow.sin() / of_slow))
    }

    fn range(&self) -> (f64, f64) {
        self.theta_rad.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(*t), h.max(*t)))
    }

    /// Turns from end to end.
    pub fn turns(&self) -> f64 {
        (self.range().1 - self.range().0) / TAU
    }
}

/// Whether two orders are too near to one another to be two lines.
pub(crate) fn same_order(a: f64, b: f64) -> bool {
    (a - b).abs() < SAME
}

/// The orders, per turn, of the lines in signals that belong together, strongest first. A whitener would go by starts and steps, which are most of
/// what a wrong model leaves, and take the lines away: each stands out from its neighbourhood instead.
pub(crate) fn orders(runs: &[Run]) -> Vec<f64> {
    let most = runs.iter().map(Run::turns).fold(0.0, f64::max);
    if !(most > 3.0 && most.is_finite()) {
        return Vec::new();
    }
    // The sums over the angle by a Fourier transform of cells of it, so many that they reach FINENESS times around the longest run.
    let cells = ((FINENESS as f64 * most * TAU * ORDERS.1 / CELL) as usize + 1).next_power_of_two().min(MOST_CELLS);
    let cell = (CELL / ORDERS.1).max(most * TAU / cells as f64);
    let step = TAU / (cell * cells as f64);
    let (first, last) = ((ORDERS.0 / step).ceil() as usize, (ORDERS.1.min(0.5 * TAU / cell) / step) as usize);
    if last < first + 2 {
        return Vec::new();
    }
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(cells);
    let spectrum = |run: &Run| -> Vec<f64> {
        let mut summed = vec![0.0; cells];
        let from = run.range().0;
        for (t, x) in run.theta_rad.iter().zip(&run.signal_rad) {
            summed[(((t - from) / cell) as usize).min(cells - 1)] += x;
        }
        let mut out = transform.make_output_vec();
        // The lengths are those of the plan.
        let _ = transform.process(&mut summed, &mut out);
        over_background(&out[first..=last].iter().map(|x| x.norm_sqr()).collect::<Vec<_>>())
    };
    let mut power = vec![0.0; last + 1 - first];
    for run in runs.par_iter().map(spectrum).collect::<Vec<_>>() {
        power.iter_mut().zip(run).for_each(|(p, x)| *p += x);
    }
    let count = power.len() - 1;
    // Of noise each run's power is exponential with mean one.
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
        if !found.iter().any(|o| (o - order).abs() < 2.0 / most || same_order(*o, order)) {
            found.push(order);
        }
    }
    found
}

/// A signal without its mean over some turns about each row; each counts by the angle that it turns on.
fn quick(signal: &[f64], turned: &[f64]) -> Vec<f64> {
    let half = 0.5 * SLOW_TURNS * TAU;
    let (mut path, mut sums) = (vec![0.0], vec![0.0]);
    for (k, (x, turned)) in signal.iter().zip(turned).enumerate() {
        path.push(path[k] + turned);
        sums.push(sums[k] + x * turned);
    }
    let (mut from, mut to) = (0, 0);
    let slow = |k: usize| {
        while path[from] < path[k] - half {
            from += 1;
        }
        while to + 1 < path.len() && path[to + 1] <= path[k] + half {
            to += 1;
        }
        let way = path[to] - path[from];
        if way > 0.0 { (sums[to] - sums[from]) / way } else { signal[k] }
    };
    let slow: Vec<f64> = (0..signal.len()).map(slow).collect();
    signal.iter().zip(slow).map(|(x, slow)| x - slow).collect()
}

/// A signal about its median, no further off than most rows are.
fn calm(signal: &[f64]) -> Vec<f64> {
    let middle = median(&mut signal.to_vec());
    let far = CALM * 1.4826 * median(&mut signal.iter().map(|x| (x - middle).abs()).collect::<Vec<_>>());
    signal.iter().map(|x| (x - middle).max(-far).min(far)).collect()
}

/// A spectrum over the mean that its neighbourhood has, as the median of exponentials tells.
fn over_background(power: &[f64]) -> Vec<f64> {
    let beside = BESIDE * FINENESS;
    let near = |k: usize| power[k.saturating_sub(beside)..power.len().min(k + beside + 1)].to_vec();
    let mean = |k: usize| (median(&mut near(k)) / LN_2).max(f64::MIN_POSITIVE);
    (0..power.len()).map(|k| power[k] / mean(k)).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// 5 kHz for 2.5 s: from rest to 25 turns per second in 0.2 s, with slow errors of the start forty times as large as the noise, which is coloured as
    /// that of an encoder read over 4 ms, and a line.
    fn start(line: impl Fn(f64) -> f64, seed: u64) -> Run {
        let mut chance = Xoshiro256PlusPlus::seed_from_u64(seed);
        let white: Vec<f64> = (0..12_500).map(|_| chance.random_range(-1.0..1.0)).collect();
        let mut theta = 0.0;
        let rows = (0..white.len()).map(|k| {
            let t = k as f64 * 2e-4;
            theta += 2e-4 * 25.0 * TAU * (t / 0.2).min(1.0);
            let encoder = white[k.saturating_sub(20)..=k].iter().sum::<f64>() / 20f64.sqrt();
            (theta, encoder + 40.0 * (-t / 0.05).exp() * (30.0 * t).sin() + line(theta))
        });
        let (theta_rad, signal): (Vec<f64>, Vec<f64>) = rows.unzip();
        Run::over(theta_rad, &signal)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn a_line_of_any_order_is_found_beside_the_error_of_a_start(order in 0.3..10.0f64, phase in 0.0..TAU, seed in 0u64..1000) {
            let found = orders(&[start(|theta| (order * theta + phase).cos(), seed)]);
            // Sixty turns tell orders apart that are a sixtieth apart.
            prop_assert!(found.first().is_some_and(|o| (o - order).abs() < 0.005), "{found:?}");
        }

        #[test]
        fn noise_and_a_start_have_no_lines(seed in 0u64..1000) {
            let found = orders(&[start(|_| 0.0, seed)]);
            prop_assert!(found.is_empty(), "{found:?}");
        }
    }

    /// A load that steps in the middle by thirty times the line.
    #[test]
    fn a_step_hides_no_line() {
        let step = |theta: f64| (0.54 * theta).cos() + if theta > 30.0 * TAU { 30.0 } else { 0.0 };
        let found = orders(&[start(step, 3)]);
        assert!(found.first().is_some_and(|o| (o - 0.54).abs() < 0.005), "{found:?}");
    }

    #[test]
    fn an_amplitude_is_that_of_the_line() {
        let run = start(|theta| 3.0 * (2.54 * theta).cos(), 1);
        assert!((run.amplitude(2.54) - 3.0).abs() < 0.15, "{}", run.amplitude(2.54));
    }

    #[test]
    fn few_turns_and_no_rows_have_no_lines() {
        let still = Run::over(vec![0.0; 1000], &[1.0; 1000]);
        assert!(orders(&[still]).is_empty() && orders(&[]).is_empty());
    }
}
