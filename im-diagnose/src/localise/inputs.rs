//! What of an input an error still holds: their cross-correlation over the lag, as the residual analysis of system identification has it.
//!
//! ρ(τ) = Σ e(t + τ) u(t) / √(Σ e² Σ u²). Of an error that has nothing to do with the input, ρ(τ) is normal with the variance
//! (1/N) Σ_k ρ_ee(k) ρ_uu(k) (Bartlett's formula; Ljung, System Identification, 16.6): what lasts, in either, widens the band.

use im_model::Complex;
use realfft::RealFftPlanner;
use serde::Serialize;

use super::correlate::{direction, longest_lag};
use super::{Row, Signals, say};
use crate::uncertainty::HALF_95;

/// An error beside an input, one shifted against the other.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InputCorrelation {
    /// The error, with its unit.
    pub error: &'static str,
    /// The input, with its unit.
    pub input: &'static str,
    /// By how much the error is later than the input, s; correlation coefficient.
    pub points: Vec<[f64; 2]>,
    /// Coefficients within ± this happen by chance in 95 of 100 cases.
    pub chance: f64,
    /// One sentence.
    pub conclusion: String,
}

/// Lags that are kept, on either side.
const LAGS: usize = 200;

type Value = fn(&Row) -> f64;

fn voltage(r: &Row) -> Complex<f64> {
    r.voltage * direction(r)
}

fn current_error(r: &Row) -> Complex<f64> {
    r.current_error.unwrap_or_default() * direction(r)
}

pub(super) fn inputs([of_current, of_speed]: [&Signals; 2]) -> Vec<InputCorrelation> {
    let speed: Value = |r| r.speed_error.unwrap_or(0.0);
    let pairs: [(&Signals, &'static str, Value, &'static str, Value); 4] = [
        (of_current, "current along the flux, A", |r| current_error(r).re, "voltage along the flux, V", |r| voltage(r).re),
        (of_current, "current across the flux, A", |r| current_error(r).im, "voltage across the flux, V", |r| voltage(r).im),
        (of_speed, "speed, rad/s", speed, "voltage across the flux, V", |r| voltage(r).im),
        (of_speed, "speed, rad/s", speed, "load torque, Nm", |r| r.load),
    ];
    pairs.into_iter().filter_map(|(s, error, e, input, u)| one(s, (error, e), (input, u))).collect()
}

fn one(s: &Signals, (error, e): (&'static str, Value), (input, u): (&'static str, Value)) -> Option<InputCorrelation> {
    let sample = s.runs.first()?.sample_time_s;
    let longest = s.runs.iter().map(|r| r.rows.len()).max()?;
    let (e, u) = (centred(s, e)?, centred(s, u)?);
    // Beyond a quarter of a run a correlation has too few products to be known.
    let (known, reach) = (longest / 4, longest_lag(sample, longest));
    let correlated = |a: &[Vec<f64>], b: &[Vec<f64>]| {
        let mut sum = vec![0.0; 2 * known + 1];
        for (a, b) in a.iter().zip(b) {
            sum.iter_mut().zip(cross(a, b, known)).for_each(|(s, x)| *s += x);
        }
        sum
    };
    let (ee, uu, eu) = (correlated(&e, &e), correlated(&u, &u), correlated(&e, &u));
    let (pe, pu) = (ee[known], uu[known]);
    let n: usize = e.iter().map(Vec::len).sum();
    // Tapered: far lags are chance themselves.
    let taper = |k: usize| 1.0 - (k as f64 - known as f64).abs() / (known + 1) as f64;
    let spread: f64 = (0..=2 * known).map(|k| taper(k) * ee[k] * uu[k]).sum::<f64>() / (pe * pu);
    let chance = HALF_95 * (spread.max(1.0) / n as f64).sqrt();
    let at = |k: usize| eu[k] / (pe * pu).sqrt();
    let stride = reach.div_ceil(LAGS);
    let lags = (0..=2 * (reach / stride)).map(|k| k as isize - (reach / stride) as isize).map(|k| k * stride as isize);
    let points: Vec<[f64; 2]> = lags.map(|lag| [lag as f64 * sample, at((known as isize + lag) as usize)]).collect();
    let most = points.iter().filter(|p| p[0] >= 0.0).max_by(|a, b| a[1].abs().total_cmp(&b[1].abs()))?;
    let outside = points.iter().filter(|p| p[1].abs() > chance).count() as f64 / points.len() as f64;
    let bare = |s: &str| s.split(',').next().unwrap_or(s).to_owned();
    let (error_word, input_word) = (bare(error), bare(input));
    // One in twenty lies outside by chance.
    let conclusion = if outside <= 0.1 || most[1].abs() <= chance {
        format!("the error in {error_word} holds nothing of the {input_word} beyond chance (±{})", say(chance))
    } else {
        format!(
            "the error in {error_word} still follows the {input_word}: {} after {} ms, where chance reaches ±{}",
            say(most[1]),
            say(most[0] * 1e3),
            say(chance)
        )
    };
    Some(InputCorrelation { error, input, points, chance, conclusion })
}

/// The values of every run without their mean over all; nothing where they do not change.
fn centred(s: &Signals, of: Value) -> Option<Vec<Vec<f64>>> {
    let mut all: Vec<Vec<f64>> = s.runs.iter().map(|r| r.rows.iter().map(of).collect()).collect();
    let n = all.iter().map(Vec::len).sum::<usize>() as f64;
    let square: f64 = all.iter().flatten().map(|x| x * x).sum();
    let mean = all.iter().flatten().sum::<f64>() / n;
    all.iter_mut().flatten().for_each(|x| *x -= mean);
    let left: f64 = all.iter().flatten().map(|x| x * x).sum();
    (left > 1e-9 * square && left.is_finite()).then_some(all)
}

/// Σ_t a(t + k) b(t) for k from −`most` to `most`.
fn cross(a: &[f64], b: &[f64], most: usize) -> Vec<f64> {
    let len = (a.len() + most + 1).next_power_of_two();
    let mut planner = RealFftPlanner::<f64>::new();
    let (forth, back) = (planner.plan_fft_forward(len), planner.plan_fft_inverse(len));
    let transformed = |x: &[f64]| {
        let mut padded = forth.make_input_vec();
        padded[..x.len()].copy_from_slice(x);
        let mut out = forth.make_output_vec();
        forth.process(&mut padded, &mut out).is_ok().then_some(out)
    };
    let nothing = vec![0.0; 2 * most + 1];
    let (Some(mut product), Some(other)) = (transformed(a), transformed(b)) else { return nothing };
    product.iter_mut().zip(&other).for_each(|(p, o)| *p *= o.conj());
    let mut sums = back.make_output_vec();
    if back.process(&mut product, &mut sums).is_err() {
        return nothing;
    }
    let at = |k: isize| sums[k.rem_euclid(len as isize) as usize] / len as f64;
    (-(most as isize)..=most as isize).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_over_the_lag_are_those_of_the_definition() {
        let (a, b) = ([1.0, -2.0, 3.0, 0.5, 4.0], [0.3, 2.0, -1.0, 1.5, 0.7]);
        let direct =
            |k: isize| -> f64 { (0..5isize).filter_map(|t| Some(a.get(usize::try_from(t + k).ok()?)? * b[t as usize])).sum() };
        for (k, sum) in (-3..=3).zip(cross(&a, &b, 3)) {
            assert!((sum - direct(k)).abs() < 1e-12, "{k}: {sum}");
        }
    }
}
