//! The mains as they are behind the noise of a voltmeter: sines whose sizes and phases wander a little, found from the voltage alone.
//!
//! u_k = Σ_h z_h e^{jhωkT} + noise
//!
//! Each z_h is a random walk whose steps are in proportion to the harmonic's size: one Kalman filter forward, one backward, both together at each row.

use std::f64::consts::PI;
use std::ops::Range;

use im_identify::offline::{HARMONICS, Wander};
use im_model::Complex;
use nalgebra::{DMatrix, DVector};

/// Harmonics looked for, of both directions, and a constant.
const MAINS: [i32; 8] = [1, 3, 5, 7, 11, 13, 17, 19];

/// Those of which an error counts: they are there always, however small.
const COUNTED: [f64; HARMONICS] = [0.0, 1.0, -1.0];

/// Variance of a harmonic's walk in a second, over the square of its size: the likeliest of these.
const WANDERS: [f64; 8] = [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0];

/// A row that is left so far out, in standard deviations of the noise, is no noise of that size.
const FARTHEST: f64 = 6.0;

/// So many standard deviations more than noise makes of a mean square is no noise alone.
const ALONE: f64 = 4.0;

/// Times that the frequency is found anew.
const TURNS: usize = 4;

/// What is not known of a harmonic of which nothing is expected, over the square of its size.
const UNKNOWN: f64 = 1e3;

/// A voltage in rows `sample_time_s` apart, of the mains of about `omega` rad/s, with white noise of `sigma_v` per axis.
pub struct Mains<'a> {
    pub u: &'a [Complex<f64>],
    pub omega: f64,
    pub sample_time_s: f64,
    pub sigma_v: f64,
}

impl Mains<'_> {
    /// Whether this is no more than noise, none at all too.
    pub fn is_noise<'u>(&self, u: impl IntoIterator<Item = &'u Complex<f64>>) -> bool {
        let (count, sum) = u.into_iter().fold((0.0, 0.0), |(count, sum), u| (count + 1.0, sum + u.norm_sqr()));
        sum <= (count + ALONE * f64::sqrt(count)) * 2.0 * self.sigma_v * self.sigma_v
    }

    /// The mains in some rows between which nothing was switched; `None` where what is not the mains is no noise of this size.
    pub fn behind(&self, rows: Range<usize>) -> Option<Behind> {
        let u = &self.u[rows];
        let about = self.omega * self.sample_time_s;
        let most = (PI / about) as i32;
        let both = MAINS.iter().filter(|h| **h < most).flat_map(|h| [*h, -*h]);
        let orders: Vec<f64> = std::iter::once(0).chain(both).map(f64::from).collect();
        let variance = 2.0 * self.sigma_v * self.sigma_v;
        let (angle, sizes) = steady(u, about, &orders)?;
        // What noise makes of each. Of another harmonic, no more is expected than is there beside it.
        let of_noise = variance / u.len() as f64;
        let expected = |h: f64, size: f64| if COUNTED.contains(&h) { UNKNOWN * size } else { size - of_noise };
        let all = orders.into_iter().zip(sizes).map(|(order, size)| Harmonic { order, size, first: expected(order, size) });
        let harmonics: Vec<Harmonic> = all.filter(|h| h.first > 0.0).collect();
        let filter = |wanders: f64| Filter { angle, harmonics: &harmonics, wanders: wanders * self.sample_time_s, variance };
        let forward = |wanders: f64| (filter(wanders), filter(wanders).pass(u.iter()));
        let (filter, forward) = WANDERS.into_iter().map(forward).max_by(|a, b| a.1.log_l.total_cmp(&b.1.log_l))?;
        // Backward in time the harmonics turn the other way, and what was expected of them counts once.
        let as_seen: Vec<Harmonic> = harmonics.iter().map(|h| Harmonic { first: UNKNOWN * h.size, ..*h }).collect();
        let backward = Filter { angle: -angle, harmonics: &as_seen, ..filter }.pass(u.iter().rev());
        let of = |((u, f), b): ((&Complex<f64>, &Expected), &Expected)| {
            let sides = [(f.mean, 1.0 / f.variance), (b.mean, 1.0 / b.variance)];
            let weight = sides.iter().map(|x| x.1).sum::<f64>();
            let mean = sides.iter().map(|x| x.0 * x.1).sum::<Complex<f64>>() / weight;
            let rough = (u - mean) / (1.0 + 1.0 / (weight * variance));
            (!is_far(u - mean, 1.0 / weight + variance)).then_some(rough)
        };
        let rough: Vec<Option<Complex<f64>>> = u.iter().zip(&forward.rows).zip(backward.rows.iter().rev()).map(of).collect();
        // Rows beside a spike have part of it.
        let spoilt = |k: usize| rough[k.saturating_sub(1)..(k + 2).min(u.len())].contains(&None);
        let rough: Vec<Option<Complex<f64>>> = (0..u.len()).map(|k| rough[k].filter(|_| !spoilt(k))).collect();
        self.is_noise(rough.iter().flatten()).then(|| Behind { rough, off: COUNTED.map(|h| filter.left_of(h, u.len())) })
    }
}

/// Whether a row is too far from what is expected for an error of this variance.
fn is_far(off: Complex<f64>, variance: f64) -> bool {
    off.norm_sqr() > 0.5 * FARTHEST * FARTHEST * variance
}

/// Mains found behind noise.
pub struct Behind {
    /// What of each row is not the mains, where it tells.
    pub rough: Vec<Option<Complex<f64>>>,
    /// What they may be off by.
    pub off: [Wander; HARMONICS],
}

/// The angle that the fundamental turns by from row to row, from about `angle`, and |z_h|², where neither wanders: least squares, with a column for
/// what another frequency changes, as k e^{jφk} times j δφ z_1.
fn steady(u: &[Complex<f64>], mut angle: f64, orders: &[f64]) -> Option<(f64, Vec<f64>)> {
    let (n, one) = (orders.len(), Complex::new(1.0, 0.0));
    let fundamental = orders.iter().position(|h| *h == 1.0)?;
    let middle = 0.5 * u.len() as f64;
    let mut sizes = Vec::new();
    for _ in 0..TURNS {
        let (mut normal, mut right) = (DMatrix::zeros(n + 1, n + 1), DVector::zeros(n + 1));
        for (k, u) in u.iter().enumerate() {
            let at = k as f64 - middle;
            let turned = |h: f64| Complex::from_polar(1.0, -h * angle * at);
            let row = DVector::from_iterator(n + 1, orders.iter().map(|h| turned(*h)).chain([turned(1.0) * (at / middle)]));
            right.axpy(*u, &row, one);
            normal.gerc(one, &row, &row, one);
        }
        let z = normal.lu().solve(&right)?;
        angle += (z[n] / z[fundamental]).im / middle;
        sizes = z.iter().take(n).map(Complex::norm_sqr).collect();
    }
    angle.is_finite().then_some((angle, sizes))
}

#[derive(Clone, Copy)]
struct Harmonic {
    order: f64,
    /// |z|², V².
    size: f64,
    /// Variance before the first row, V².
    first: f64,
}

struct Filter<'a> {
    /// Of the fundamental, from row to row.
    angle: f64,
    harmonics: &'a [Harmonic],
    /// Variance of the steps over the squares of their sizes.
    wanders: f64,
    /// Of the noise, both axes together.
    variance: f64,
}

/// What a filter expects of a row before it sees it.
#[derive(Clone, Copy)]
struct Expected {
    mean: Complex<f64>,
    variance: f64,
}

/// What a filter expects of all rows, and how likely it finds them.
struct Passed {
    rows: Vec<Expected>,
    log_l: f64,
}

impl Filter<'_> {
    /// What is not known of a harmonic after so many rows have been seen: by all that come after a row, the error there is again a chain, of the
    /// information Λ in them: Λ_k = 1/R + Λ_{k+1}/(1 + QΛ_{k+1}).
    fn left_of(&self, order: f64, rows: usize) -> Wander {
        let Some(of) = self.harmonics.iter().find(|h| h.order == order) else { return Wander::default() };
        let step = self.wanders * of.size;
        let information = (0..rows).fold(0.0, |later, _| 1.0 / self.variance + later / (1.0 + step * later));
        let kept = 1.0 / (1.0 + step * information);
        // Half of it on either axis.
        Wander { first_v2: 0.5 / information, onward: Complex::from_polar(kept, order * self.angle), added_v2: 0.5 * step * kept }
    }

    fn pass<'u>(&self, u: impl Iterator<Item = &'u Complex<f64>>) -> Passed {
        let (n, one) = (self.harmonics.len(), Complex::new(1.0, 0.0));
        let mut z = DVector::<Complex<f64>>::zeros(n);
        let first = self.harmonics.iter().map(|h| Complex::new(h.first, 0.0));
        let mut p = DMatrix::from_diagonal(&DVector::from_iterator(n, first));
        let mut passed = Passed { rows: Vec::new(), log_l: 0.0 };
        for (k, u) in u.enumerate() {
            // z turned to this row: the voltage is their sum.
            let turned = |h: &Harmonic| Complex::from_polar(1.0, -h.order * self.angle * k as f64);
            let h = DVector::from_iterator(n, self.harmonics.iter().map(turned));
            let seen = &p * &h;
            let (expected, unsure) = (h.dotc(&z), h.dotc(&seen).re);
            passed.rows.push(Expected { mean: expected, variance: unsure });
            let (off, total) = (u - expected, unsure + self.variance);
            if is_far(off, total) {
                passed.log_l -= 0.5 * FARTHEST * FARTHEST + total.ln();
            } else {
                passed.log_l -= off.norm_sqr() / total + total.ln();
                z.axpy(off / total, &seen, one);
                p.gerc(-one / total, &seen, &seen, one);
            }
            for (i, h) in self.harmonics.iter().enumerate() {
                p[(i, i)] += self.wanders * h.size;
            }
        }
        passed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt, SeedableRng};

    prop_compose! {
        /// Noise, in V; wandering, per second; rows per second; of the rows, seconds; how far the frequency is off, of itself; chance.
        fn cases()(
            sigma_v in 0.2..5.0f64,
            wanders in prop::sample::select(vec![0.0, 1e-4, 1e-2]),
            rate in prop::sample::select(vec![1e3, 2e3, 5e3]),
            length_s in 0.3..1.0f64,
            off in -2e-3..2e-3f64,
            seed in any::<u64>(),
        ) -> (f64, f64, f64, f64, f64, u64) {
            (sigma_v, wanders, rate, length_s, off, seed)
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        /// Whatever the mains do that sines which wander a little do: they are found as exactly as is said, and a spike is no part of them.
        #[test]
        fn the_mains_are_found_as_well_as_is_said((sigma_v, wanders, rate, length_s, off, seed) in cases()) {
            let mut chance = Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut draw = move || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
            let mut vector = |size: f64| Complex::new(size * draw(), size * draw());
            let (t, omega, n) = (1.0 / rate, 314.16, (length_s * rate) as usize);
            let mut parts = [(1.0, 320.0), (-1.0, 2.0), (-5.0, 6.0), (7.0, 4.0)].map(|(h, size)| (h, vector(size), size));
            parts[0].1 = Complex::new(320.0, 0.0);
            let mut clean = Vec::with_capacity(n);
            for k in 0..n {
                clean.push(parts.iter().map(|(h, z, _)| z * Complex::from_polar(1.0, h * omega * t * k as f64)).sum::<Complex<f64>>());
                parts.iter_mut().for_each(|(_, z, size)| *z += vector(*size * (0.5 * wanders * t).sqrt()));
            }
            let mut u: Vec<Complex<f64>> = clean.iter().map(|u| u + vector(sigma_v)).collect();
            let spike = n / 3;
            u[spike] += Complex::new(40.0 * sigma_v, 0.0);
            let mains = Mains { u: &u, omega: omega * (1.0 + off), sample_time_s: t, sigma_v };
            let Some(Behind { rough, off }) = mains.behind(0..n) else { return Err(TestCaseError::fail("no mains")) };
            prop_assert!(rough[spike].is_none() && rough.iter().flatten().count() + 4 > n);
            // Within the rows, where both filters have settled, and away from the spike.
            let inside = (n / 10..9 * n / 10).filter(|k| k.abs_diff(spike) as f64 * omega * t > PI);
            let wrong: Vec<f64> = inside.map(|k| (u[k] - rough[k].unwrap_or_default() - clean[k]).norm_sqr()).collect();
            let rms = (wrong.iter().sum::<f64>() / (2.0 * wrong.len() as f64)).sqrt();
            // Each of seventeen harmonics has an error as large as the fundamental's at most.
            let said = off[1].first_v2.sqrt();
            prop_assert!(off[1].first_v2 > 0.0 && rms < 6.0 * said, "{rms} {said}");
            prop_assert!((off[1].onward.arg() / (omega * t) - 1.0).abs() < 1e-2 && rms < 1.2 * sigma_v);
        }
    }

    #[test]
    fn no_voltage_is_no_mains_and_a_smaller_noise_is_none_of_this_size() {
        let mut chance = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut draw = move || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
        let off: Vec<Complex<f64>> = (0..500).map(|_| Complex::new(draw(), draw())).collect();
        let mains = |sigma_v: f64| Mains { u: &off, omega: 314.0, sample_time_s: 1e-3, sigma_v };
        assert!(mains(1.0).is_noise(&off) && !mains(0.8).is_noise(&off) && mains(1.0).is_noise(&[]));
        assert!(mains(0.8).behind(0..500).is_none());
    }
}
