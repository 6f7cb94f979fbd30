//! Sensor noise from the data alone, and whitening of coloured residuals.

use std::borrow::Borrow;
use std::collections::{BTreeMap, BTreeSet};

use im_identify::offline::Experiment;
use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::statistics::median;

/// Standard deviation of white noise on a smooth signal, from fourth differences: Var(Δ⁴e) = 70 σ², while a sine of 50 Hz sampled
/// at 10 kHz leaves a millionth of itself. Median-based, so that steps and spikes do not count.
pub fn white_sigma(values: &[f64]) -> f64 {
    let d4 = |w: &[f64]| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4];
    let mut d: Vec<f64> = values.windows(5).map(|w| d4(w).abs()).collect();
    if d.is_empty() {
        return 0.0;
    }
    let rms = (d.iter().map(|x| x * x).sum::<f64>() / d.len() as f64).sqrt();
    // 0.6745: the median of |N(0, 1)|. Quantized signals may have a median of zero, but for rounding.
    let robust = median(&mut d) / 0.6745;
    (if robust > ROUNDING * rms { robust } else { rms }) / 70f64.sqrt()
}

/// Part of a number that it may be off by because it is written in binary.
const ROUNDING: f64 = 1e-9;

/// Standard deviation of what a sensor's steps leave unknown: a reading in steps of q is off by q/√12. The step is what nine tenths of the
/// differences between neighbouring readings reach, where most readings have been read before; else there is none. (The least difference is one that
/// a single reading between the steps makes, such as a spike that was drawn over.)
pub fn step_sigma(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let [Some(least), Some(most)] = [sorted.first(), sorted.last()] else { return 0.0 };
    let rounding = ROUNDING * least.abs().max(most.abs());
    let mut steps: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > rounding).collect();
    if 2 * steps.len() > values.len() {
        return 0.0;
    }
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 10).map_or(0.0, |step| step / 12f64.sqrt())
}

/// An autoregressive noise model: e_k = Σ a_j e_{k−j} + w_k.
#[derive(Clone, Debug, PartialEq)]
pub struct Whitener {
    /// a_1 … a_p.
    pub coefficients: Vec<f64>,
    /// Variance of the innovations w.
    pub variance: f64,
}

impl Whitener {
    /// No colour, unit variance.
    pub fn white() -> Self {
        Self { coefficients: Vec::new(), variance: 1.0 }
    }

    /// Fits by Burg-Levinson on the sample autocovariance, with the order up to `max_order` that minimizes BIC.
    pub fn fit(runs: &[&[f64]], max_order: usize) -> Self {
        let n: usize = runs.iter().map(|r| r.len()).sum();
        if n < 10 * (max_order + 1) {
            return Self::white();
        }
        let autocovariance: Vec<f64> = products(runs, max_order).iter().map(|sum| sum / n as f64).collect();
        let mut best = (f64::INFINITY, Self { coefficients: Vec::new(), variance: autocovariance[0].max(1e-300) });
        let mut a: Vec<f64> = Vec::new();
        let mut variance = autocovariance[0].max(1e-300);
        let bic = |variance: f64, order: usize| n as f64 * variance.ln() + order as f64 * (n as f64).ln();
        if bic(variance, 0) < best.0 {
            best.0 = bic(variance, 0);
        }
        for order in 1..=max_order {
            let reflected =
                autocovariance[order] - a.iter().enumerate().map(|(j, x)| x * autocovariance[order - 1 - j]).sum::<f64>();
            let k = reflected / variance;
            let mut next: Vec<f64> = (0..a.len()).map(|j| a[j] - k * a[a.len() - 1 - j]).collect();
            next.push(k);
            a = next;
            variance *= (1.0 - k * k).max(1e-12);
            let score = bic(variance, order);
            if score < best.0 {
                best = (score, Self { coefficients: a.clone(), variance });
            }
        }
        best.1
    }

    /// The same with a memory of a few samples at most, as sensors have: poles within 0.9 from sample to sample, `stride` of which a row holds,
    /// and the variance that this filter leaves of `runs`. What stays longer is no noise.
    pub fn of_a_sensor(mut self, runs: &[&[f64]], stride: usize) -> Self {
        let memory = (MEMORY.powi(stride as i32) / self.longest_memory()).min(1.0);
        let mut shrink = 1.0;
        for a in &mut self.coefficients {
            shrink *= memory;
            *a *= shrink;
        }
        self.variance = 1.0;
        let n: usize = runs.iter().map(|r| r.len()).sum();
        let left: f64 = runs.iter().map(|r| self.apply(r).iter().map(|w| w * w).sum::<f64>()).sum();
        self.variance = (left / n.max(1) as f64).max(1e-300);
        self
    }

    /// The largest magnitude of its poles: the zeros of z^p − a_1 z^(p−1) − … − a_p.
    fn longest_memory(&self) -> f64 {
        let p = self.coefficients.len();
        let companion = DMatrix::from_fn(p, p, |i, j| match i {
            0 => self.coefficients[j],
            _ => f64::from(u8::from(j + 1 == i)),
        });
        if p == 0 { 0.0 } else { companion.complex_eigenvalues().iter().map(|z| z.norm()).fold(0.0, f64::max) }
    }

    /// Filters a signal to innovations of unit variance; the first p rows use what history there is.
    pub fn apply(&self, x: &[f64]) -> Vec<f64> {
        let scale = 1.0 / self.variance.sqrt();
        let mut history = vec![0.0; x.len()];
        for (j, a) in self.coefficients.iter().enumerate() {
            history.iter_mut().skip(j + 1).zip(x).for_each(|(h, x)| *h += a * x);
        }
        x.iter().zip(&history).map(|(x, h)| (x - h) * scale).collect()
    }

    /// A⁻ᵀx √v, where A filters a signal to innovations: its square is xᵀΣx, with Σ the covariance of the noise.
    pub fn coloured_backwards(&self, x: &[f64]) -> Vec<f64> {
        let scale = self.variance.sqrt();
        let mut y = vec![0.0; x.len()];
        for k in (0..x.len()).rev() {
            let later: f64 = self.coefficients.iter().zip(&y[k + 1..]).map(|(a, y)| a * y).sum();
            y[k] = x[k] + later;
        }
        y.iter_mut().for_each(|y| *y *= scale);
        y
    }
}

/// Σ x_k x_{k+lag} over all runs, for every lag up to `most`: all in one pass.
fn products(runs: &[&[f64]], most: usize) -> Vec<f64> {
    let mut sums = vec![0.0; most + 1];
    for r in runs {
        for k in 0..r.len() {
            let rest = &r[k..r.len().min(k + most + 1)];
            sums.iter_mut().zip(rest).for_each(|(sum, x)| *sum += r[k] * x);
        }
    }
    sums
}

/// Largest pole of a sensor's noise: a memory of ten samples.
const MEMORY: f64 = 0.9;

/// Highest order of the noise model.
pub const NOISE_ORDER: usize = 8;

/// Noise models per experiment and channel from residuals; channels of the same kind over all experiments share one.
pub fn whiteners<E: Borrow<Experiment> + Sync, R: AsRef<[Vec<f64>]> + Sync>(
    experiments: &[E],
    residuals: &[R],
) -> Vec<Vec<Whitener>> {
    per_channel(experiments, residuals, Whitener::fit)
}

/// The same for noise as sensors have it, without memory of more than a few samples, `stride` of which a row holds.
pub fn sensor_whiteners<E: Borrow<Experiment> + Sync, R: AsRef<[Vec<f64>]> + Sync>(
    experiments: &[E],
    residuals: &[R],
    stride: usize,
) -> Vec<Vec<Whitener>> {
    per_channel(experiments, residuals, |alike, order| Whitener::fit(alike, order).of_a_sensor(alike, stride))
}

fn per_channel<E: Borrow<Experiment> + Sync, R: AsRef<[Vec<f64>]> + Sync>(
    experiments: &[E],
    residuals: &[R],
    fit: impl Fn(&[&[f64]], usize) -> Whitener + Sync,
) -> Vec<Vec<Whitener>> {
    // Rows of a table do not follow one another.
    let order = |e: &E| if e.borrow().is_table() { 0 } else { NOISE_ORDER };
    let one = |(name, order): (&str, usize)| {
        let pairs = experiments.iter().zip(residuals);
        let alike = pairs.map(|(e, r)| (e.borrow(), r)).filter(|(e, _)| e.is_table() == (order == 0));
        let channels = alike.flat_map(|(e, r)| e.channels.iter().zip(r.as_ref()));
        let alike: Vec<&[f64]> = channels.filter(|(c, _)| c.name == name).map(|(_, r)| r.as_slice()).collect();
        let found = fit(&alike, order);
        // A few rows do not tell their noise: it is at least that of the instruments.
        if order == 0 { Whitener { variance: found.variance.max(1.0), ..found } } else { found }
    };
    let names = experiments.iter().flat_map(|e| e.borrow().channels.iter().map(move |c| (c.name.as_str(), order(e))));
    let names: BTreeSet<(&str, usize)> = names.collect();
    let found: BTreeMap<(&str, usize), Whitener> = names.into_par_iter().map(|n| (n, one(n))).collect();
    let of = |e: &E| e.borrow().channels.iter().map(|c| found[&(c.name.as_str(), order(e))].clone()).collect();
    experiments.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(seed: u64, n: usize) -> Vec<f64> {
        // Sums of twelve uniforms: near enough to Gaussian here.
        let mut s = seed;
        let mut u = || {
            s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (s >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..n).map(|_| (0..12).map(|_| u()).sum::<f64>() - 6.0).collect()
    }

    #[test]
    fn white_noise_is_found_under_a_large_sine() {
        let x: Vec<f64> = noise(1, 20_000).iter().enumerate().map(|(k, e)| 0.05 * e + 20.0 * (0.0314 * k as f64).sin()).collect();
        let s = white_sigma(&x);
        assert!((s / 0.05 - 1.0).abs() < 0.03, "{s}");
    }

    /// An encoder that counts in coarse steps: from row to row nothing changes, but for rounding.
    #[test]
    fn readings_in_steps_are_off_by_a_part_of_a_step() {
        let ramp = |k: usize| 0.013 * k as f64 + 1e-14 * (k % 3) as f64;
        let coarse: Vec<f64> = (0..2000).map(|k| (ramp(k) / 0.7).round() * 0.7 + 1e-15 * (k % 5) as f64).collect();
        assert!((step_sigma(&coarse) - 0.7 / 12f64.sqrt()).abs() < 1e-9);
        assert!(white_sigma(&coarse) > 1e-3);
        // A spike was drawn over.
        let drawn = [&coarse[..], &[0.37; 3]].concat();
        assert!((step_sigma(&drawn) - 0.7 / 12f64.sqrt()).abs() < 1e-9);
        let smooth: Vec<f64> = (0..2000).map(ramp).collect();
        assert_eq!([step_sigma(&smooth), step_sigma(&noise(3, 2000)), step_sigma(&[]), step_sigma(&[1.0; 9])], [0.0; 4]);
    }

    #[test]
    fn coloured_noise_is_whitened() {
        let mut e = 0.0;
        let x: Vec<f64> = noise(2, 40_000)
            .iter()
            .map(|w| {
                e = 0.9 * e + w;
                e
            })
            .collect();
        let w = Whitener::fit(&[&x], 6);
        assert!((w.coefficients[0] - 0.9).abs() < 0.02, "{w:?}");
        let y = w.apply(&x);
        let lag1: f64 = y.windows(2).map(|p| p[0] * p[1]).sum::<f64>() / y.iter().map(|v| v * v).sum::<f64>();
        assert!(lag1.abs() < 0.02 && (w.variance - 1.0).abs() < 0.05, "{lag1} {}", w.variance);
    }

    /// Noise that a sensor can have is whitened whole; of what stays longer, as much as such a sensor could make.
    #[test]
    fn a_sensor_forgets_within_ten_samples() {
        let process = |pole: f64| {
            let mut e = 0.0;
            let next = |w: &f64| {
                e = pole * e + w;
                e
            };
            noise(4, 40_000).iter().map(next).collect::<Vec<f64>>()
        };
        for (pole, kept) in [(0.5, 0.5), (0.88, 0.88), (0.99, 0.9), (0.999, 0.9)] {
            let x = process(pole);
            let w = Whitener { coefficients: vec![pole], variance: 1.0 }.of_a_sensor(&[&x], 1);
            assert!((w.coefficients[0] - kept).abs() < 1e-12, "{pole}: {w:?}");
            // Of the innovations of a longer memory: Var(x_k − 0.9 x_{k−1}) = (1 − 1.8 ρ + 0.81)/(1 − ρ²).
            let left = (1.0 - 2.0 * kept * pole + kept * kept) / (1.0 - pole * pole);
            assert!((w.variance / left - 1.0).abs() < 0.15, "{pole}: {w:?} {left}");
        }
        let pair = Whitener { coefficients: vec![2.0 * 0.95 * 0.3f64.cos(), -0.95 * 0.95], variance: 1.0 };
        assert!((pair.longest_memory() - 0.95).abs() < 1e-9);
    }

    #[test]
    fn colouring_backwards_gives_the_quadratic_form_of_the_noise() {
        let w = Whitener { coefficients: vec![0.6, -0.2], variance: 0.3 };
        let unit = |k: usize| (0..6).map(|i| f64::from(u8::from(i == k))).collect::<Vec<f64>>();
        let columns: Vec<nalgebra::DVector<f64>> = (0..6).map(|k| w.apply(&unit(k)).into()).collect();
        let filter = nalgebra::DMatrix::from_columns(&columns);
        // Filtered noise is white: A Σ Aᵀ = I.
        let covariance = (filter.transpose() * filter).try_inverse().unwrap();
        let x = nalgebra::DVector::from_vec(vec![1.0, -2.0, 0.5, 3.0, 0.0, 1.5]);
        let coloured: f64 = w.coloured_backwards(x.as_slice()).iter().map(|y| y * y).sum();
        assert!((coloured / x.dot(&(covariance * &x)) - 1.0).abs() < 1e-12);
    }
}
