//! A run in fewer, longer steps, for slopes.
//!
//! A recording has many more rows than its signals need. Residuals are taken at every row; their slopes J are as smooth as the signals, and found
//! on every K-th row, in steps with the mean voltage. With r̄_j = Σ r/√K over the K rows around row jK,
//!
//!   Jᵀr ≈ Σ_j (√K J_j) r̄_j,   JᵀJ ≈ Σ_j (√K J_j)ᵀ(√K J_j)
//!
//! and white noise in r is as white, and as large, in r̄.

use std::borrow::Cow;

use im_model::Complex;
use rayon::prelude::*;

use super::channel::{Channel, ChannelKind};
use super::experiment::Experiment;
use super::load::Load;

/// A run on every K-th of its rows, K odd.
#[derive(Clone, Debug)]
pub(super) struct Thinned<'a> {
    stride: usize,
    run: Cow<'a, Experiment>,
}

/// Steps that are tried, in rows.
const STRIDES: [usize; 4] = [9, 7, 5, 3];

/// Rows that are left at least.
const LEAST_ROWS: usize = 1000;

/// From step to step the currents may change by this part of themselves (rms): on a sine, 60 steps a period, in which a zero crossing still
/// has its shape.
const CHANGE: f64 = 0.105;

/// Within a step, ∫u dt may differ from a straight line by this part (rms) of what it changes in a step: a switched voltage is not smooth.
const RIPPLE: f64 = 0.1;

/// Recordings, as they are and in longer steps.
pub(super) struct Runs<'a> {
    pub experiments: &'a [Experiment],
    pub thinned: Vec<Thinned<'a>>,
}

impl<'a> Runs<'a> {
    pub fn of(experiments: &'a [Experiment]) -> Self {
        Self { experiments, thinned: Thinned::all(experiments) }
    }
}

impl<'a> Thinned<'a> {
    /// In the longest steps that the currents and voltages of all allow, alike for all; tables as they are.
    pub fn all(runs: &'a [Experiment]) -> Vec<Self> {
        let strides = runs.par_iter().filter(|e| !e.is_table()).map(stride_of);
        let common = strides.min().unwrap_or(1);
        runs.par_iter().map(|e| if e.is_table() { Self::whole(e) } else { Self::new(e, common) }).collect()
    }

    fn new(run: &'a Experiment, stride: usize) -> Self {
        if stride == 1 { Self::whole(run) } else { Self { stride, run: Cow::Owned(every(run, stride)) } }
    }

    /// As it is.
    pub fn whole(run: &'a Experiment) -> Self {
        Self { stride: 1, run: Cow::Borrowed(run) }
    }

    /// Rows of the recording in a step.
    pub fn rows(&self) -> usize {
        self.stride
    }

    /// The run in these steps; a channel's noise is that of the sum of a step's rows over √K.
    pub fn run(&self) -> &Experiment {
        &self.run
    }

    /// Σ r/√K over the rows around each that is left, per channel.
    pub fn sums<'r>(&self, residuals: &'r [Vec<f64>]) -> Cow<'r, [Vec<f64>]> {
        if self.stride == 1 {
            return Cow::Borrowed(residuals);
        }
        let weight = (self.stride as f64).sqrt();
        residuals.iter().map(|r| means(r, self.stride).into_iter().map(|x| x * weight).collect()).collect()
    }
}

/// The longest steps that a run allows; where valid rows come and go, all of them count.
fn stride_of(run: &Experiment) -> usize {
    let fits = |k: &&usize| {
        run.len() >= LEAST_ROWS * **k
            && run.channels.iter().all(|c| changes(c) * 10 * **k < run.len())
            && flows_smoothly(run, **k)
            && is_held(run, **k)
    };
    STRIDES.iter().find(fits).copied().unwrap_or(1)
}

/// The rows around row `row` for which it stands.
fn around(row: usize, stride: usize, rows: usize) -> std::ops::Range<usize> {
    row.saturating_sub(stride / 2)..(row + stride / 2 + 1).min(rows)
}

/// Sums over the rows around each that is left, by K.
fn means(x: &[f64], stride: usize) -> Vec<f64> {
    let mean = |row: usize| x[around(row, stride, x.len())].iter().sum::<f64>() / stride as f64;
    (0..x.len()).step_by(stride).map(mean).collect()
}

/// How often a channel begins or ends to count.
fn changes(c: &Channel) -> usize {
    c.valid.as_ref().map_or(0, |v| v.windows(2).filter(|w| w[0] != w[1]).count())
}

/// Whether the currents go smoothly from one step of so many rows to the next.
fn flows_smoothly(run: &Experiment, stride: usize) -> bool {
    let (mut size, mut change) = (0.0, 0.0);
    for c in run.channels.iter().filter(|c| matches!(c.kind, ChannelKind::Current { .. })) {
        let means = means(&c.values, stride);
        size += means.iter().map(|x| x * x).sum::<f64>();
        change += means.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>();
    }
    change <= CHANGE * CHANGE * size
}

/// Whether the voltage is as good as its mean over steps of so many rows.
fn is_held(run: &Experiment, stride: usize) -> bool {
    let zero = Complex::new(0.0, 0.0);
    let (mut ripple, mut size) = (0.0, 0.0);
    for step in run.u_s.chunks_exact(stride) {
        let mean = step.iter().fold(zero, |s, &u| s + u) / stride as f64;
        let mut off = zero;
        for &u in step {
            off += u - mean;
            ripple += off.norm_sqr();
        }
        size += mean.norm_sqr() * (stride * stride * stride) as f64;
    }
    ripple <= RIPPLE * RIPPLE * size
}

fn every(run: &Experiment, stride: usize) -> Experiment {
    let thin = |x: &[f64]| x.iter().step_by(stride).copied().collect::<Vec<f64>>();
    let held = |x: &[f64]| x.chunks(stride).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect();
    let counts = |v: &[bool], row: usize| v[around(row, stride, v.len())].iter().all(|x| *x);
    let channel = |c: &Channel| Channel {
        values: means(&c.values, stride),
        valid: c.valid.as_ref().map(|v| (0..v.len()).step_by(stride).map(|row| counts(v, row)).collect()),
        sigma: c.sigma / (stride as f64).sqrt(),
        ..c.clone()
    };
    let of = |part: fn(&Complex<f64>) -> f64| -> Vec<f64> { held(&run.u_s.iter().map(part).collect::<Vec<_>>()) };
    let thinned = Experiment {
        name: run.name.clone(),
        sample_time_s: run.sample_time_s * stride as f64,
        supply_frequency_hz: None,
        u_s: of(|u| u.re).into_iter().zip(of(|u| u.im)).map(|(re, im)| Complex::new(re, im)).collect(),
        tau_load: held(&run.tau_load),
        load: Load::Known,
        imposed_speed: run.imposed_speed.as_deref().map(thin),
        speed_nudge: run.speed_nudge.as_ref().map(|(w, rate)| (thin(w), *rate)),
        warmth: run.warmth.clone(),
        channels: run.channels.iter().map(channel).collect(),
        start: run.start,
    };
    let (channels, t) = (&thinned.channels, thinned.sample_time_s);
    let load = match &run.load {
        Load::Unknown(shown) => Load::Unknown(shown.every(stride, channels, t)),
        Load::Unseen(found) => Load::Unseen(found.every(stride, channels, t)),
        known => known.clone(),
    };
    Experiment { load, ..thinned }
}

#[cfg(test)]
mod tests {
    use im_model::{Recording, machines};

    use super::*;
    use crate::offline::{base_parameters, linearize, predict, residuals};

    /// A start from rest on 50 Hz, at 10 kHz.
    fn run(rows: usize, load_nm: f64) -> (im_model::Machine<f64>, Experiment) {
        let m = machines::MOTULATOR_2_2_KW;
        let machine = im_model::Machine::base(m.parameters(), m.pole_pairs).unwrap();
        let u_s: Vec<_> = (0..rows).map(|k| Complex::from_polar(326.6, 314.159 * 1e-4 * (k as f64 + 0.5))).collect();
        let r = Recording {
            name: "start".into(),
            start_s: 0.0,
            sample_time_s: 1e-4,
            i_s: vec![Complex::new(0.0, 0.0); rows],
            omega_m: vec![0.0; rows],
            tau_load: Some(vec![load_nm; rows]),
            u_s,
        };
        let mut e = Experiment::from_recording(&r, [0.05; 2], 0.1);
        let predicted = predict(&machine, &e, &e.start_state());
        e.channels.iter_mut().zip(predicted).for_each(|(c, y)| c.values = y);
        (machine, e)
    }

    #[test]
    fn normal_equations_are_those_of_all_rows() {
        let (machine, e) = run(10_000, 5.0);
        let thinned = Thinned::all(std::slice::from_ref(&e)).remove(0);
        assert_eq!(thinned.stride, 3, "60 steps a period");
        let free = base_parameters(&machine);
        let start = e.start_state();
        let (all, few) = (linearize(&machine, &e, &start, 0, &free), linearize(&machine, thinned.run(), &start, 0, &free));
        let dot = |a: &[Vec<f64>], b: &[Vec<f64>]| a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| x * y).sum::<f64>();
        // The residual of a machine that is off by some per cent.
        let other = machine.map(|_, x| x * 1.03);
        let r: Vec<Vec<f64>> = predict(&other, &e, &start)
            .iter()
            .zip(predict(&machine, &e, &start))
            .zip(&e.channels)
            .map(|((a, b), c)| a.iter().zip(b).map(|(a, b)| (a - b) / c.sigma).collect())
            .collect();
        let sums = thinned.sums(&r);
        for a in 0..free.len() {
            let size = (dot(&all.slopes[a], &all.slopes[a]) * dot(&r, &r)).sqrt();
            let (g, h) = (dot(&all.slopes[a], &r), dot(&few.slopes[a], &sums));
            assert!((g - h).abs() < 0.01 * size, "gradient {a}: {g} {h} of {size}");
            for b in 0..=a {
                let (g, h) = (dot(&all.slopes[a], &all.slopes[b]), dot(&few.slopes[a], &few.slopes[b]));
                let size = (dot(&all.slopes[a], &all.slopes[a]) * dot(&all.slopes[b], &all.slopes[b])).sqrt();
                assert!((g - h).abs() < 0.01 * size, "{a}, {b}: {g} {h} of {size}");
            }
        }
    }

    #[test]
    fn a_switched_voltage_and_a_mask_that_comes_and_goes_keep_all_rows() {
        let (machine, mut e) = run(10_000, 0.0);
        e.channels[2].valid = Some((0..e.len()).map(|k| k % 10 == 0).collect());
        assert_eq!(stride_of(&e), 1);
        e.channels[2].valid = None;
        e.u_s.iter_mut().enumerate().for_each(|(k, u)| *u = Complex::new(if k % 3 == 0 { 560.0 } else { -280.0 }, u.im));
        let thinned = Thinned::all(std::slice::from_ref(&e)).remove(0);
        assert_eq!(thinned.stride, 1);
        let r = residuals(&machine, &e, &e.start_state());
        assert_eq!(thinned.sums(&r).as_ref(), r.as_slice());
    }
}
