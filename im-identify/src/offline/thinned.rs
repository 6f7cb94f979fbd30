//! A run in fewer, longer steps, for slopes.
//!
//! A recording has many more rows than its signals need. Residuals are taken at every row; their slopes J are as smooth as the signals, and found
//! on every K-th row, in steps with the mean voltage. With r̄_j = Σ r/√K over the K rows around row jK,
//!
//!   Jᵀr ≈ Σ_j (√K J_j) r̄_j,   JᵀJ ≈ Σ_j (√K J_j)ᵀ(√K J_j)
//!
//! and white noise in r is as white, and as large, in r̄. Within K rows the slopes change by a few per cent, which noise does not average out: where
//! it is not the noise in r̄ that counts but Jᵀr, each row's r is shared between the rows around as a cubic through their slopes has it.

use std::borrow::Cow;

use im_model::Complex;
use rayon::prelude::*;

use super::channel::{Channel, ChannelKind};
use super::experiment::Experiment;
use super::load::Load;
use super::simulate::Residuals;
use super::speed::VoltageNoise;

/// Runs on every K-th of their rows, K odd and alike for all; tables as they are.
#[derive(Clone, Debug)]
pub struct Thinned<'a> {
    stride: usize,
    whole: &'a [Experiment],
    runs: Cow<'a, [Experiment]>,
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

/// Of what is no white noise in a residual, this part may be lost in the sums over steps.
const LOST: f64 = 0.2;

impl<'a> Thinned<'a> {
    /// In the longest steps that the currents and voltages of all allow.
    pub fn of(whole: &'a [Experiment]) -> Self {
        Self::by(whole, stride_of(whole))
    }

    /// The same for what is examined, and not only lessened: where unknown inputs move with the innovations, over a longer step they are others, and
    /// every row is taken.
    pub fn of_changes(whole: &'a [Experiment]) -> Self {
        Self::by(whole, stride_of_changes(whole))
    }

    /// The same in steps that do not lose what `residuals` hold.
    pub fn keeping(whole: &'a [Experiment], residuals: &Residuals) -> Self {
        let most = stride_of_changes(whole);
        let keeps = |k: &&usize| **k <= most && whole.iter().zip(residuals).all(|(e, r)| e.is_table() || keeps(r, **k));
        Self::by(whole, STRIDES.iter().find(keeps).copied().unwrap_or(1))
    }

    fn by(whole: &'a [Experiment], stride: usize) -> Self {
        if stride == 1 {
            return Self::whole(whole);
        }
        let runs = whole.par_iter().map(|e| if e.is_table() { e.clone() } else { every(e, stride) }).collect();
        Self { stride, whole, runs: Cow::Owned(runs) }
    }

    /// As they are.
    pub fn whole(whole: &'a [Experiment]) -> Self {
        Self { stride: 1, whole, runs: Cow::Borrowed(whole) }
    }

    /// Rows of a recording in a step.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// What they were made of.
    pub fn recordings(&self) -> &'a [Experiment] {
        self.whole
    }

    /// The runs in these steps; a channel's noise is that of the sum of a step's rows over √K.
    pub fn runs(&self) -> &[Experiment] {
        &self.runs
    }

    fn is_whole(&self, run: usize) -> bool {
        self.stride == 1 || self.whole[run].is_table()
    }

    /// Σ r/√K over the rows around each that is left, per run and channel.
    pub fn sums<'r>(&self, residuals: &'r Residuals) -> Cow<'r, Residuals> {
        if self.stride == 1 {
            return Cow::Borrowed(residuals);
        }
        let weight = (self.stride as f64).sqrt();
        let sums = |r: &Vec<f64>| means(r, self.stride).into_iter().map(|x| x * weight).collect();
        let run = |(k, r): (usize, &Vec<Vec<f64>>)| if self.is_whole(k) { r.clone() } else { r.iter().map(sums).collect() };
        Cow::Owned(residuals.iter().enumerate().map(run).collect())
    }

    /// Whether residuals are white noise to steps: sums over ten of them, a sixth of the shortest period, vary no more than it does (three standard
    /// deviations).
    pub(super) fn leave_noise(&self, residuals: &Residuals) -> bool {
        let rows = 10 * self.stride;
        let is_white = |r: &Vec<f64>| {
            let sums: f64 = r.chunks(rows).map(|c| c.iter().sum::<f64>().powi(2)).sum();
            let all: f64 = r.iter().map(|x| x * x).sum();
            sums <= all * (1.0 + 3.0 * (2.0 * rows as f64 / r.len().max(1) as f64).sqrt())
        };
        self.whole.iter().zip(residuals).all(|(e, r)| !e.is_table() && r.iter().all(is_white))
    }

    /// r/√K shared between the rows that are left, to be multiplied with slopes there: each row's between the four from which a cubic gives its slope,
    /// so Jᵀr is that of all rows. Where one of the four does not count, and at the ends, to the nearest.
    pub fn shared<'r>(&self, residuals: &'r Residuals) -> Cow<'r, Residuals> {
        if self.stride == 1 {
            return Cow::Borrowed(residuals);
        }
        let weight = 1.0 / (self.stride as f64).sqrt();
        let run = |(k, r): (usize, &Vec<Vec<f64>>)| {
            if self.is_whole(k) {
                return r.clone();
            }
            let channels = self.runs[k].channels.iter().zip(r);
            channels.map(|(c, r)| shared(r, self.stride, |j| c.is_valid(j)).into_iter().map(|x| weight * x).collect()).collect()
        };
        Cow::Owned(residuals.par_iter().enumerate().map(run).collect())
    }

    /// The other way: a smooth change of the outputs, in σ, at every row, with cubics between the steps; zero at rows that do not count.
    pub fn at_every_row(&self, change: &Residuals) -> Residuals {
        let weight = 1.0 / (self.stride as f64).sqrt();
        let channel = |(c, d): (&Channel, &Vec<f64>), rows: usize| -> Vec<f64> {
            let mut d = between(d, self.stride, rows);
            d.iter_mut().enumerate().for_each(|(k, d)| *d = if c.is_valid(k) { *d * weight } else { 0.0 });
            d
        };
        let run = |(k, (e, d)): (usize, (&Experiment, &Vec<Vec<f64>>))| -> Vec<Vec<f64>> {
            if self.is_whole(k) { d.clone() } else { e.channels.iter().zip(d).map(|x| channel(x, e.len())).collect() }
        };
        self.whole.iter().zip(change).enumerate().map(run).collect()
    }
}

/// Whether sums over so many rows keep what of a residual is no white noise. How large that noise is, neighbours show.
fn keeps(residuals: &[Vec<f64>], stride: usize) -> bool {
    residuals.iter().all(|r| {
        let all: f64 = r.iter().map(|x| x * x).sum();
        let white: f64 = r.windows(2).map(|w| 0.5 * (w[1] - w[0]).powi(2)).sum();
        let steps = stride as f64;
        let kept: f64 = means(r, stride).iter().map(|x| x * x).sum::<f64>() * steps;
        let (there, left) = (all - white, kept - white / steps);
        // White noise of N values seems to hold so much by chance, in three standard deviations.
        let chance = 3.0 * white * (2.0 / r.len().max(1) as f64).sqrt();
        there - left <= (LOST * there).max(chance)
    })
}

/// The longest steps that all runs allow; where valid rows come and go, all of them count.
fn stride_of(runs: &[Experiment]) -> usize {
    let fits = |run: &Experiment, k: usize| {
        run.len() >= LEAST_ROWS * k
            && run.channels.iter().all(|c| changes(c) * 10 * k < run.len())
            && flows_smoothly(run, k)
            && is_held(run, k)
    };
    let of_run = |run: &Experiment| STRIDES.iter().find(|k| fits(run, **k)).copied().unwrap_or(1);
    runs.par_iter().filter(|e| !e.is_table()).map(of_run).min().unwrap_or(1)
}

fn stride_of_changes(runs: &[Experiment]) -> usize {
    if runs.iter().any(|e| e.unsure_inputs().is_some()) { 1 } else { stride_of(runs) }
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

/// What each of four nodes weighs at the rows of a step between the middle two: a cubic with the slopes of the neighbours' secants (Catmull and Rom).
fn cubic(stride: usize) -> Vec<[f64; 4]> {
    (0..stride)
        .map(|k| {
            let t = k as f64 / stride as f64;
            let (t2, t3) = (t * t, t * t * t);
            [-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1.0, -1.5 * t3 + 2.0 * t2 + 0.5 * t, 0.5 * t3 - 0.5 * t2]
        })
        .collect()
}

/// The values of all rows shared between every `stride`-th: the transpose of [`between`].
fn shared(x: &[f64], stride: usize, counts: impl Fn(usize) -> bool) -> Vec<f64> {
    let mut out = vec![0.0; x.len().div_ceil(stride)];
    let weights = cubic(stride);
    for (j, step) in x.chunks(stride).enumerate() {
        if j > 0 && j + 2 < out.len() && (j - 1..j + 3).all(&counts) {
            for (weights, x) in weights.iter().zip(step) {
                weights.iter().zip(&mut out[j - 1..]).for_each(|(w, out)| *out += w * x);
            }
        } else {
            let last = out.len() - 1;
            step.iter().enumerate().for_each(|(k, x)| out[(j + usize::from(2 * k > stride)).min(last)] += x);
        }
    }
    out
}

/// Values at every row from those at every `stride`-th.
fn between(at: &[f64], stride: usize, rows: usize) -> Vec<f64> {
    let node = |j: isize| at[j.clamp(0, at.len() as isize - 1) as usize];
    let weights = cubic(stride);
    let mut out = Vec::with_capacity(rows);
    for j in 0..at.len() as isize {
        let near = [node(j - 1), node(j), node(j + 1), node(j + 2)];
        let left = rows - out.len();
        out.extend(weights.iter().take(left).map(|w| w.iter().zip(near).map(|(w, x)| w * x).sum::<f64>()));
    }
    out
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
        is_smooth: run.is_smooth,
        voltage_noise: VoltageNoise::default(),
        tau_load: held(&run.tau_load),
        load: Load::Known,
        imposed_speed: run.imposed_speed.as_deref().map(thin),
        speed_nudge: run.speed_nudge.as_ref().map(|(w, rate)| (thin(w), *rate)),
        warmth: run.warmth.clone(),
        inert: run.inert,
        nudge_part: run.nudge_part,
        channels: run.channels.iter().map(channel).collect(),
        start: run.start,
    };
    let (channels, t) = (&thinned.channels, thinned.sample_time_s);
    let load = match &run.load {
        Load::Unknown(shown) => Load::Unknown(shown.every(stride, channels, t)),
        Load::Unseen(found) => Load::Unseen(found.every(stride, channels, t)),
        known => known.clone(),
    };
    let voltage_noise = run.voltage_noise.every(stride, channels, t);
    Experiment { load, voltage_noise, ..thinned }
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
        let whole = [e.clone()];
        let thinned = Thinned::of(&whole);
        assert_eq!(thinned.stride, 3, "60 steps a period");
        let free = base_parameters(&machine);
        let start = e.start_state();
        let (all, few) = (linearize(&machine, &e, &start, 0, &free), linearize(&machine, &thinned.runs()[0], &start, 0, &free));
        let dot = |a: &[Vec<f64>], b: &[Vec<f64>]| a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| x * y).sum::<f64>();
        // The residual of a machine that is off by some per cent.
        let other = machine.map(|_, x| x * 1.03);
        let r: Vec<Vec<f64>> = predict(&other, &e, &start)
            .iter()
            .zip(predict(&machine, &e, &start))
            .zip(&e.channels)
            .map(|((a, b), c)| a.iter().zip(b).map(|(a, b)| (a - b) / c.sigma).collect())
            .collect();
        let all_rows = vec![r.clone()];
        let sums = &thinned.sums(&all_rows)[0];
        for a in 0..free.len() {
            let size = (dot(&all.slopes[a], &all.slopes[a]) * dot(&r, &r)).sqrt();
            let (g, h) = (dot(&all.slopes[a], &r), dot(&few.slopes[a], sums));
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
        assert_eq!(stride_of(std::slice::from_ref(&e)), 1);
        e.channels[2].valid = None;
        e.u_s.iter_mut().enumerate().for_each(|(k, u)| *u = Complex::new(if k % 3 == 0 { 560.0 } else { -280.0 }, u.im));
        let whole = [e.clone()];
        let thinned = Thinned::of(&whole);
        assert_eq!(thinned.stride, 1);
        let r = vec![residuals(&machine, &e, &e.start_state())];
        assert_eq!(*thinned.sums(&r), r);
    }

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

    /// Sums over steps lose a line that is faster than these, and the steps stay short; slow or white residuals, and coloured noise, lose nothing.
    #[test]
    fn steps_keep_what_a_residual_holds() {
        let (_, e) = run(12_000, 0.0);
        let mut seed = 7_u64;
        let mut noise = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            12f64.sqrt() * ((seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
        };
        let white: Vec<f64> = (0..e.len()).map(|_| noise()).collect();
        let line = |period: f64| -> Vec<f64> {
            white.iter().enumerate().map(|(k, w)| w + (std::f64::consts::TAU * k as f64 / period).sin()).collect()
        };
        let mut before = 0.0;
        let coloured: Vec<f64> = white
            .iter()
            .map(|w| {
                before = 0.9 * before + w;
                before
            })
            .collect();
        let whole = [e];
        let stride = |r: &Vec<f64>| Thinned::keeping(&whole, &vec![vec![r.clone(); 3]]).stride();
        assert_eq!([&white, &line(200.0), &coloured].map(stride), [3, 3, 3]);
        assert_eq!(stride(&line(6.0)), 1);
    }

    /// Of white noise sums over steps take what it leaves in step with slopes that change within them; shared as a cubic has it, none of that is lost.
    #[test]
    fn a_gradient_of_noise_is_that_of_all_rows() {
        let (machine, e) = run(10_000, 5.0);
        let whole = [e];
        let thinned = Thinned::of(&whole);
        let free = base_parameters(&machine);
        let start = whole[0].start_state();
        let slopes = |e: &Experiment| linearize(&machine, e, &start, 0, &free).slopes;
        let (all, few) = (slopes(&whole[0]), slopes(&thinned.runs()[0]));
        let mut seed = 7_u64;
        let mut noise = |_| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            12f64.sqrt() * ((seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
        };
        let noise: Residuals = vec![(0..3).map(|_| (0..10_000).map(&mut noise).collect()).collect()];
        let dot = |a: &[Vec<f64>], b: &[Vec<f64>]| a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| x * y).sum::<f64>();
        // In standard deviations of the noise, rms over the parameters.
        let off = |r: &Residuals| {
            let one =
                |(all, few): (&Vec<Vec<f64>>, &Vec<Vec<f64>>)| (dot(few, &r[0]) - dot(all, &noise[0])).powi(2) / dot(all, all);
            (all.iter().zip(&few).map(one).sum::<f64>() / free.len() as f64).sqrt()
        };
        let (summed, shared) = (off(&thinned.sums(&noise)), off(&thinned.shared(&noise)));
        assert!(shared < 0.01 && 3.0 * shared < summed, "{shared} {summed}");
    }

    /// Shared values are the transpose of cubics between nodes: x·between(y) = shared(x)·y but for the ends.
    #[test]
    fn to_share_is_the_transpose_of_between() {
        for stride in [3, 5, 7, 9] {
            let rows = 20 * stride + 2;
            let mut x: Vec<f64> = (0..rows).map(|k| ((k * 37 % 11) as f64 - 5.0) * 0.3).collect();
            x[..stride].fill(0.0);
            x[18 * stride..].fill(0.0);
            let y: Vec<f64> = (0..21).map(|j| ((j * 29 % 13) as f64 - 6.0) * 0.2).collect();
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let (there, back) = (dot(&x, &between(&y, stride, rows)), dot(&shared(&x, stride, |_| true), &y));
            assert!((there - back).abs() < 1e-12, "{stride}: {there} {back}");
            // Nothing is lost, whichever nodes count.
            let sum = |x: &[f64]| x.iter().sum::<f64>();
            assert!((sum(&shared(&x, stride, |j| j % 5 > 0)) - sum(&x)).abs() < 1e-12);
        }
    }

    /// A change that is smooth comes back as it was.
    #[test]
    fn a_smooth_change_is_the_same_at_every_row() {
        let (machine, e) = run(10_000, 5.0);
        let whole = [e];
        let e = &whole[0];
        let thinned = Thinned::of(&whole);
        let other = machine.map(|_, x| x * 1.01);
        let change = |e: &Experiment| -> Vec<Vec<f64>> {
            let [a, b] = [&other, &machine].map(|m| predict(m, e, &e.start_state()));
            a.iter()
                .zip(&b)
                .zip(&e.channels)
                .map(|((a, b), c)| a.iter().zip(b).map(|(a, b)| (a - b) / c.sigma).collect())
                .collect()
        };
        let (all, back) = (change(e), thinned.at_every_row(&vec![change(&thinned.runs()[0])]));
        for (a, b) in all.iter().zip(&back[0]) {
            let size = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let off = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 0.02 * size, "{off} of {size}");
        }
    }
}
