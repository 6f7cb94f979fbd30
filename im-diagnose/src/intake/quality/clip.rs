//! Current sensors that do not follow the current: hard limits, saturating transformers and Hall sensors, single spikes.
//!
//! The star point floats, so that i_a + i_b + i_c = 0: the sum shows when a sensor errs, though not which. A saturated sensor shows too
//! little, never too much; while it recovers it decays on its own and is right again at the latest when its reading passes zero, or when
//! the sum says so. A second sensor on a phase decides for that phase, and through the sum for the others.

use crate::intake::finding::ranges;
use crate::statistics::median;

/// A row counts as wrong when the sum exceeds so many of its standard deviations and this share of the largest current.
const SIGMAS: f64 = 6.0;
const SHARE: f64 = 0.02;
/// Rows in a row whose sum vanishes before a sensor is believed again: two errors of opposite sign may cancel in passing.
const TRUST: usize = 3;
/// Rows in a row whose sum vanishes before a large reading proves its sensor right.
const PROOF: usize = 5;
/// Readings from this share of the smallest known limit are suspect.
const NEAR: f64 = 0.9;

/// Which rows of three phase currents are wrong.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clipped {
    /// Rows per phase during which the sensor is saturated or recovers.
    pub saturated: [Vec<bool>; 3],
    /// Rows in which no phase is to be believed.
    pub glitch: Vec<bool>,
    /// Reading from which a sensor was found wrong, A; infinite where it never was.
    pub limit_a: [f64; 3],
    /// Standard deviation of the sum where all is well, A.
    pub sum_sigma_a: f64,
    /// Mean of the sum, A.
    pub sum_mean_a: f64,
    /// The sum is wrong so often that no saturation explains it.
    pub hopeless: bool,
}

/// Looks through three phase currents; `trusted` phases have a second sensor that vouches for them.
#[allow(clippy::needless_range_loop)] // Phases are counted through several arrays at once.
pub fn saturation(i: [&[f64]; 3], trusted: [bool; 3]) -> Clipped {
    let n = i[0].len();
    let raw = |k: usize| i[0][k] + i[1][k] + i[2][k];
    let mut sums: Vec<f64> = (0..n).map(raw).collect();
    let mean = median(&mut sums.clone());
    sums.iter_mut().for_each(|s| *s -= mean);
    let sigma = median(&mut sums.iter().map(|s| s.abs()).collect::<Vec<_>>()) / 0.6745;
    let largest: [f64; 3] = std::array::from_fn(|x| i[x].iter().fold(0.0, |m: f64, v| m.max(v.abs())));
    // Where readings are rounded the sum is off by up to half a digit of each, and by nothing in most rows.
    let floor =
        1e-6 * largest.iter().fold(0.0, |m: f64, v| m.max(*v)) + 0.51 * i.iter().map(|phase| last_digit(phase)).sum::<f64>();
    let size = |k: usize| i.iter().fold(0.0, |m: f64, p| m.max(p[k].abs()));
    let wrong: Vec<bool> = (0..n).map(|k| sums[k].abs() > SIGMAS * sigma + SHARE * size(k) + floor).collect();
    let mut found = Clipped {
        saturated: std::array::from_fn(|_| vec![false; n]),
        glitch: vec![false; n],
        limit_a: [f64::INFINITY; 3],
        sum_sigma_a: sigma,
        sum_mean_a: mean,
        hopeless: false,
    };
    let count = wrong.iter().filter(|w| **w).count();
    if count == 0 {
        return found;
    }
    if count * 2 > n {
        found.hopeless = true;
        return found;
    }
    // The limit: what the sensor that must be the one showed when the sum began to be wrong.
    let culprit = |k: usize| {
        (0..3)
            .filter(|&x| !trusted[x] && i[x][k] * sums[k] < 0.0)
            .max_by(|&x, &y| i[x][k].abs().total_cmp(&i[y][k].abs()))
            .filter(|&x| i[x][k].abs() > 0.6 * largest[x])
    };
    let begin = |k: &usize| wrong[*k] && !wrong[k - 1] && (*k..n.min(k + TRUST)).all(|j| wrong[j]);
    let begins: Vec<usize> = (1..n).filter(begin).collect();
    let mut knees: Vec<f64> = begins.iter().copied().filter_map(|k| culprit(k).map(|x| i[x][k].abs())).collect();
    let knee = if knees.is_empty() { f64::INFINITY } else { NEAR * median(&mut knees) };
    for (x, phase) in i.iter().enumerate().filter(|(x, _)| !trusted[*x]) {
        let proven = phase
            .windows(PROOF)
            .enumerate()
            .filter(|(k, _)| wrong[*k..*k + PROOF].iter().all(|w| !w))
            .fold(0.0, |m: f64, (_, w)| m.max(w.iter().fold(f64::INFINITY, |m, v| m.min(v.abs()))));
        found.limit_a[x] = if largest[x] > knee { knee.max(proven) } else { f64::INFINITY };
    }
    // First only the sensors that were seen to begin it; the others when these do not explain every row.
    let begun = begins.iter().filter_map(|&k| culprit(k)).fold([false; 3], |mut c, x| {
        c[x] = true;
        c
    });
    for accused in [begun, [true; 3]] {
        if follow(i, &sums, &wrong, accused, &mut found) * 10 <= count {
            break;
        }
    }
    // The knee is soft: back to where the sum begins to leave its noise.
    for x in 0..3 {
        for r in ranges(&found.saturated[x]) {
            let before = (r.start.saturating_sub(TRUST)..r.start).rev();
            for k in before.take_while(|&k| sums[k].abs() > 3.0 * sigma || i[x][k].abs() >= found.limit_a[x]) {
                found.saturated[x][k] = true;
                found.glitch[k] = false;
            }
        }
        if found.saturated[x].iter().all(|s| !s) {
            found.limit_a[x] = f64::INFINITY;
        }
    }
    found
}

/// The least change of readings from row to row: a unit of the last digit of rounded ones, next to nothing of others.
fn last_digit(readings: &[f64]) -> f64 {
    let changes = readings.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0);
    let least = changes.fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}

/// Follows the accused sensors into saturation and out of it; the number of rows that they do not explain.
fn follow(i: [&[f64]; 3], sums: &[f64], wrong: &[bool], accused: [bool; 3], found: &mut Clipped) -> usize {
    let n = wrong.len();
    let mut since: [Option<f64>; 3] = [None; 3];
    let mut unexplained = 0;
    for k in 0..n {
        let well = (k..n.min(k + TRUST)).all(|j| !wrong[j]);
        for x in 0..3 {
            match since[x] {
                None if accused[x] && wrong[k] && i[x][k].abs() >= found.limit_a[x] => since[x] = Some(i[x][k].signum()),
                Some(sign) if well || i[x][k] * sign <= 0.0 => since[x] = None,
                _ => {}
            }
            found.saturated[x][k] = since[x].is_some();
        }
        // A saturated sensor shows too little: the sum errs against its sign.
        let explained = (0..3).any(|x| since[x].is_some_and(|sign| sign * sums[k] < 0.0));
        unexplained += usize::from(wrong[k] && !explained);
        found.glitch[k] = wrong[k] && since.iter().all(Option::is_none);
    }
    unexplained
}

/// Where two sensors of one current part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Redundant {
    /// Rows where the first shows less than the second.
    pub first_short: Vec<bool>,
    /// Rows where the second shows less than the first.
    pub second_short: Vec<bool>,
    /// Second over first where both are small.
    pub ratio: f64,
}

/// Compares two sensors of one current.
pub fn redundant(first: &[f64], second: &[f64]) -> Redundant {
    let n = first.len();
    let largest = first.iter().chain(second).fold(0.0, |m: f64, v| m.max(v.abs()));
    let small: Vec<usize> = (0..n).filter(|&k| first[k].abs().max(second[k].abs()) < 0.4 * largest).collect();
    let (xy, xx) = small.iter().fold((0.0, 0.0), |(xy, xx), &k| (xy + first[k] * second[k], xx + first[k] * first[k]));
    let ratio = if xx > 0.0 { xy / xx } else { 1.0 };
    let gap = |k: usize| second[k] - ratio * first[k];
    let middle = median(&mut small.iter().map(|&k| gap(k)).collect::<Vec<_>>());
    let sigma = median(&mut small.iter().map(|&k| (gap(k) - middle).abs()).collect::<Vec<_>>()) / 0.6745;
    // Sensors are not sampled at quite the same instant: half a sample of slope is no disagreement.
    let slope = |k: usize| (second[(k + 1).min(n - 1)] - second[k.saturating_sub(1)]).abs() / 2.0;
    let part = |k: usize| (gap(k) - middle).abs() > SIGMAS * sigma + SHARE * second[k].abs() + slope(k);
    let less = |k: usize| part(k) && (ratio * first[k]).abs() < second[k].abs();
    let more = |k: usize| part(k) && (ratio * first[k]).abs() > second[k].abs();
    Redundant { first_short: (0..n).map(less).collect(), second_short: (0..n).map(more).collect(), ratio }
}

/// Rows in which a signal stands still at its largest or smallest value though it came there fast: a hard limit.
pub fn flat_tops(x: &[f64]) -> Vec<bool> {
    let mut marked = vec![false; x.len()];
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let span = high - low;
    if span <= 0.0 || span.is_nan() {
        return marked;
    }
    // Converters repeat their end code exactly; a hundred-thousandth allows for a gain taken out in between.
    let at = |v: f64, end: f64| (v - end).abs() <= 1e-5 * span;
    for end in [low, high] {
        let tops: Vec<_> = ranges(&x.iter().map(|v| at(*v, end)).collect::<Vec<_>>());
        let cut: Vec<_> = tops
            .into_iter()
            .filter(|r| r.len() >= 3 && r.start >= 2)
            .filter(|r| {
                // Coming on at this slope the signal would have gone on by more than rounding.
                let slope = (x[r.start - 1] - x[r.start - 2]).abs();
                slope > 2e-3 * span && slope * r.len() as f64 > 0.02 * span
            })
            .collect();
        cut.into_iter().flatten().for_each(|k| marked[k] = true);
    }
    marked
}
