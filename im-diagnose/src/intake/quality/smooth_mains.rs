//! The mains as they are behind the noise of a voltmeter: sines whose sizes and phases wander a little, found from the voltage alone.
//!
//! u_k = Σ_h z_h e^{jhωkT} + noise
//!
//! and behind the impedance of their supply, −(R + L d/dt) i, where that stands out: a start draws the voltage down. What a machine makes that nothing
//! feeds is such a voltage, too, of sines that wander more.
//!
//! Each z_h is a random walk whose steps are in proportion to the harmonic's size: one Kalman filter forward, one backward, both together at each row.

use std::f64::consts::PI;
use std::ops::Range;

use im_identify::offline::{HARMONICS, Wander};
use im_model::Complex;
use nalgebra::{DMatrix, DVector};

use crate::intake::sampled::turn;

/// Harmonics of the mains, in both directions; a constant is looked for beside them.
pub const ORDERS: [i32; 8] = [1, 3, 5, 7, 11, 13, 17, 19];

/// Those of which an error counts: they are there always, however small.
const COUNTED: [f64; HARMONICS] = [0.0, 1.0, -1.0];

/// The impedance of the supply is seen where its square is so many times what noise makes of it: in a steady state it looks like the mains themselves.
const SUPPLY: f64 = 16.0;

/// Variance of a harmonic's walk in a second, over the square of its size: the likeliest of these.
const WANDERS: [f64; 9] = [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0];

/// A row that is left so far out, in standard deviations of the noise, is no noise of that size.
const FARTHEST: f64 = 6.0;

/// So many standard deviations more than noise makes of a mean square is no noise alone.
const ALONE: f64 = 4.0;

/// Times that the harmonics are fitted, their frequency found anew in between.
const TURNS: usize = 5;

/// What is not known of a harmonic of which nothing is expected, over the square of its size.
const UNKNOWN: f64 = 1e3;

/// A voltage in rows `sample_time_s` apart, of the mains of about `omega` rad/s, with white noise of `sigma_v` per axis, and the current that it drives.
pub struct Mains<'a> {
    pub u: &'a [Complex<f64>],
    /// At the beginning of each row, A.
    pub i: &'a [Complex<f64>],
    pub omega: f64,
    pub sample_time_s: f64,
    pub sigma_v: f64,
}

/// Mains found behind noise.
pub struct Behind {
    /// What of each row is not the mains, where it tells.
    pub rough: Vec<Option<Complex<f64>>>,
    /// What they may be off by.
    pub off: [Wander; HARMONICS],
}

impl Mains<'_> {
    /// Whether this is no more than noise, none at all too.
    fn is_noise<'u>(&self, u: impl IntoIterator<Item = &'u Complex<f64>>) -> bool {
        let (count, sum) = u.into_iter().fold((0.0, 0.0), |(count, sum), u| (count + 1.0, sum + u.norm_sqr()));
        sum <= (count + ALONE * f64::sqrt(count)) * 2.0 * self.sigma_v * self.sigma_v
    }

    /// The voltage where none is on, but what its sensor shows then: a constant.
    pub fn switched_off(&self, rows: Range<usize>) -> Option<Behind> {
        let (u, count) = (&self.u[rows.clone()], rows.len().max(1) as f64);
        let mean = u.iter().sum::<Complex<f64>>() / count;
        let rough: Vec<Complex<f64>> = u.iter().map(|u| u - mean).collect();
        let constant = Wander { first_v2: self.sigma_v * self.sigma_v / count, onward: Complex::new(1.0, 0.0), added_v2: 0.0 };
        let off = COUNTED.map(|h| if h == 0.0 { constant } else { Wander::default() });
        self.is_noise(&rough).then(|| Behind { rough: rough.into_iter().map(Some).collect(), off })
    }

    /// The mains in some rows between which nothing was switched, or the machine's own voltage; `None` where what is neither is no noise of this size.
    pub fn behind(&self, rows: Range<usize>, is_fed: bool) -> Option<Behind> {
        let (u, i) = (&self.u[rows.clone()], &self.i[rows]);
        // A phase sequence either way.
        let angle = if is_fed { (self.omega * self.sample_time_s).copysign(turn(u)) } else { turn(u) };
        let most = (PI / angle.abs()) as i32;
        let both = ORDERS.iter().filter(|h| **h < most).flat_map(|h| [*h, -*h]);
        let harmonics = std::iter::once(0).chain(both).map(|h| Shape::Turns(f64::from(h)));
        // A machine that slows down has no one frequency.
        let (supply, turns): (&[Shape], usize) = if is_fed { (&[Shape::Current, Shape::Rise], TURNS) } else { (&[], 1) };
        let shapes: Vec<Shape> = harmonics.chain(supply.iter().copied()).collect();
        let variance = 2.0 * self.sigma_v * self.sigma_v;
        let (of, parts) = steady(u, Rows { i, angle }, &shapes, (variance, turns))?;
        let filter = |wanders: f64| Filter { of, parts: &parts, wanders: wanders * self.sample_time_s, variance };
        let forward = |wanders: f64| (filter(wanders), filter(wanders).pass(u, 0..u.len()));
        let (filter, forward) = WANDERS.into_iter().map(forward).max_by(|a, b| a.1.log_l.total_cmp(&b.1.log_l))?;
        // What was expected of them counts once.
        let as_seen: Vec<Part> = parts.iter().map(|p| Part { first: UNKNOWN * p.size, ..*p }).collect();
        let backward = Filter { parts: &as_seen, ..filter }.pass(u, (0..u.len()).rev());
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

/// What a part of the voltage is in proportion to.
#[derive(Clone, Copy, PartialEq)]
enum Shape {
    /// A harmonic of the mains.
    Turns(f64),
    /// The current, through the resistance of the supply.
    Current,
    /// How much it rises, through its inductance.
    Rise,
}

impl Shape {
    fn is_counted(self) -> bool {
        COUNTED.iter().any(|h| self == Self::Turns(*h))
    }
}

/// What the parts are in proportion to is known of these rows.
#[derive(Clone, Copy)]
struct Rows<'a> {
    i: &'a [Complex<f64>],
    /// That the fundamental turns by from row to row.
    angle: f64,
}

impl Rows<'_> {
    /// The part of size 1 in a row, conjugate. Over a row, the current goes from that at its beginning to that at the next.
    fn at(self, k: usize, shape: Shape) -> Complex<f64> {
        let (here, next) = (self.i[k], self.i[(k + 1).min(self.i.len() - 1)]);
        match shape {
            Shape::Turns(h) => Complex::from_polar(1.0, -h * self.angle * k as f64),
            Shape::Current => (here + next).conj() * 0.5,
            Shape::Rise => (next - here).conj(),
        }
    }
}

/// A part of the voltage.
#[derive(Clone, Copy)]
struct Part {
    shape: Shape,
    /// |z|².
    size: f64,
    /// Variance before the first row.
    first: f64,
}

/// The parts that are there, where they do not wander, and the angle that the fundamental turns by: least squares, with a column for what another
/// frequency changes, as k e^{jφk} times j δφ z_1.
fn steady<'a>(
    u: &[Complex<f64>],
    mut of: Rows<'a>,
    shapes: &[Shape],
    (variance, turns): (f64, usize),
) -> Option<(Rows<'a>, Vec<Part>)> {
    let (n, one) = (shapes.len(), Complex::new(1.0, 0.0));
    let fundamental = shapes.iter().position(|s| *s == Shape::Turns(1.0))?;
    let middle = 0.5 * u.len() as f64;
    // All but the fundamental is little, and so does one that wanders far keep its size.
    let all = u.iter().map(|u| u.norm_sqr()).sum::<f64>() / u.len() as f64;
    let mut parts = Vec::new();
    for round in 1..=turns {
        let (mut normal, mut right) = (DMatrix::zeros(n + 1, n + 1), DVector::zeros(n + 1));
        for (k, u) in u.iter().enumerate() {
            let faster = of.at(k, Shape::Turns(1.0)) * (k as f64 / middle - 1.0);
            let row = DVector::from_iterator(n + 1, shapes.iter().map(|s| of.at(k, *s)).chain([faster]));
            right.axpy(*u, &row, one);
            normal.gerc(one, &row, &row, one);
        }
        let inverse = normal.try_inverse()?;
        let z = &inverse * right;
        let part = |(n, shape): (usize, &Shape)| {
            // What noise makes of it. Of what need not be there, no more is expected than stands out of that.
            let (size, of_noise) = (z[n].norm_sqr(), variance * inverse[(n, n)].re);
            let size = if n == fundamental { all } else { size };
            let first = match shape {
                _ if shape.is_counted() => UNKNOWN * size,
                Shape::Turns(_) => size - of_noise,
                // A supply draws the voltage down. Where the current follows what is rough, it rises with it.
                Shape::Current | Shape::Rise if z[n].re < 0.0 => size - SUPPLY * of_noise,
                Shape::Current | Shape::Rise => 0.0,
            };
            Part { shape: *shape, size, first }
        };
        parts = shapes.iter().enumerate().map(part).filter(|p| p.first > 0.0).collect();
        if round < turns {
            of.angle += (z[n] / z[fundamental]).im / middle;
        }
    }
    of.angle.is_finite().then_some((of, parts))
}

struct Filter<'a> {
    of: Rows<'a>,
    parts: &'a [Part],
    /// Variance of the steps of harmonics over the squares of their sizes.
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
    /// Variance of a part's step. A supply does not change.
    fn step(&self, part: &Part) -> f64 {
        if let Shape::Turns(_) = part.shape { self.wanders * part.size } else { 0.0 }
    }

    /// What is not known of a harmonic after so many rows have been seen: by all that come after a row, the error there is again a chain, of the
    /// information Λ in them: Λ_k = 1/R + Λ_{k+1}/(1 + QΛ_{k+1}).
    fn left_of(&self, order: f64, rows: usize) -> Wander {
        let Some(part) = self.parts.iter().find(|p| p.shape == Shape::Turns(order)) else { return Wander::default() };
        let step = self.step(part);
        let information = (0..rows).fold(0.0, |later, _| 1.0 / self.variance + later / (1.0 + step * later));
        let kept = 1.0 / (1.0 + step * information);
        // Half of it on either axis.
        let onward = Complex::from_polar(kept, order * self.of.angle);
        Wander { first_v2: 0.5 / information, onward, added_v2: 0.5 * step * kept }
    }

    /// Over the rows in this order.
    fn pass(&self, u: &[Complex<f64>], order: impl Iterator<Item = usize>) -> Passed {
        let (n, one) = (self.parts.len(), Complex::new(1.0, 0.0));
        let mut z = DVector::<Complex<f64>>::zeros(n);
        let first = self.parts.iter().map(|p| Complex::new(p.first, 0.0));
        let mut p = DMatrix::from_diagonal(&DVector::from_iterator(n, first));
        let mut passed = Passed { rows: Vec::new(), log_l: 0.0 };
        for k in order {
            let h = DVector::from_iterator(n, self.parts.iter().map(|p| self.of.at(k, p.shape)));
            let seen = &p * &h;
            let (expected, unsure) = (h.dotc(&z), h.dotc(&seen).re);
            passed.rows.push(Expected { mean: expected, variance: unsure });
            let (off, total) = (u[k] - expected, unsure + self.variance);
            if is_far(off, total) {
                passed.log_l -= 0.5 * FARTHEST * FARTHEST + total.ln();
            } else {
                passed.log_l -= off.norm_sqr() / total + total.ln();
                z.axpy(off / total, &seen, one);
                p.gerc(-one / total, &seen, &seen, one);
            }
            for (i, part) in self.parts.iter().enumerate() {
                p[(i, i)] += self.step(part);
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
        /// Noise, in V; wandering, per second; rows per second; of the rows, seconds; how far the frequency is off, of itself; resistance and reactance of
        /// the supply; chance.
        fn cases()(
            sigma_v in 0.2..5.0f64,
            wanders in prop::sample::select(vec![0.0, 1e-4, 1e-2]),
            rate in prop::sample::select(vec![1e3, 2e3, 5e3]),
            length_s in 0.3..1.0f64,
            off in -2e-3..2e-3f64,
            supply_ohm in prop::sample::select(vec![0.0, 0.05, 0.3]),
            seed in any::<u64>(),
        ) -> (f64, f64, f64, f64, f64, f64, u64) {
            (sigma_v, wanders, rate, length_s, off, supply_ohm, seed)
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        /// Whatever the mains do that sines which wander a little do: they are found as exactly as is said, and a spike is no part of them.
        #[test]
        fn the_mains_are_found_as_well_as_is_said((sigma_v, wanders, rate, length_s, off, supply_ohm, seed) in cases()) {
            let mut chance = Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut draw = move || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
            let mut vector = |size: f64| Complex::new(size * draw(), size * draw());
            let (t, omega, n) = (1.0 / rate, 314.16, (length_s * rate) as usize);
            let mut parts = [(1.0, 320.0), (-1.0, 2.0), (-5.0, 6.0), (7.0, 4.0)].map(|(h, size)| (h, vector(size), size));
            parts[0].1 = Complex::new(320.0, 0.0);
            // A start: a current that dies away, and a constant one that dies away sooner.
            let current = |k: usize| {
                let s = t * k as f64;
                Complex::from_polar(5.0 + 40.0 * (-s / 0.1).exp(), omega * s - 1.0) - Complex::from_polar(40.0 * (-s / 0.02).exp(), -1.0)
            };
            let i: Vec<Complex<f64>> = (0..n).map(current).collect();
            let mut clean = Vec::with_capacity(n);
            for k in 0..n {
                let (here, next) = (current(k), current(k + 1));
                let drop = ((here + next) * 0.5 + (next - here) / (omega * t)) * supply_ohm;
                clean.push(-drop + parts.iter().map(|(h, z, _)| z * Complex::from_polar(1.0, h * omega * t * k as f64)).sum::<Complex<f64>>());
                parts.iter_mut().for_each(|(_, z, size)| *z += vector(*size * (0.5 * wanders * t).sqrt()));
            }
            let mut u: Vec<Complex<f64>> = clean.iter().map(|u| u + vector(sigma_v)).collect();
            let spike = n / 3;
            u[spike] += Complex::new(40.0 * sigma_v, 0.0);
            let mains = Mains { u: &u, i: &i, omega: omega * (1.0 + off), sample_time_s: t, sigma_v };
            let Some(Behind { rough, off }) = mains.behind(0..n, true) else { return Err(TestCaseError::fail("no mains")) };
            prop_assert!(rough[spike].is_none() && rough.iter().flatten().count() + 4 > n);
            // Within the rows, where both filters have settled, and away from the spike.
            let inside = (n / 10..9 * n / 10).filter(|k| k.abs_diff(spike) as f64 * omega * t > PI);
            let wrong: Vec<f64> = inside.map(|k| (u[k] - rough[k].unwrap_or_default() - clean[k]).norm_sqr()).collect();
            let rms = (wrong.iter().sum::<f64>() / (2.0 * wrong.len() as f64)).sqrt();
            // Each of seventeen harmonics has an error as large as the fundamental's at most.
            let said = off[1].first_v2.sqrt();
            prop_assert!(off[1].first_v2 > 0.0 && rms < 7.0 * said, "{rms} {said}");
            prop_assert!((off[1].onward.arg() / (omega * t) - 1.0).abs() < 1e-2 && rms < 1.2 * sigma_v);
        }
    }

    #[test]
    fn a_constant_is_no_mains_and_a_smaller_noise_is_none_of_this_size() {
        let mut chance = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut draw = move || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
        let u: Vec<Complex<f64>> = (0..500).map(|_| Complex::new(0.7 + draw(), draw())).collect();
        let i = vec![Complex::new(0.0, 0.0); 500];
        let mains = |sigma_v: f64| Mains { u: &u, i: &i, omega: 314.0, sample_time_s: 1e-3, sigma_v };
        assert!(mains(0.8).switched_off(0..500).is_none() && mains(0.8).behind(0..500, true).is_none());
        let Behind { rough, off } = mains(1.0).switched_off(0..500).unwrap();
        let constant = u[7] - rough[7].unwrap();
        assert!((constant.re - 0.7).abs() < 0.2 && (off[0].first_v2 - 1.0 / 500.0).abs() < 1e-12, "{constant}");
        assert!(mains(1.0).switched_off(0..0).unwrap().rough.is_empty());
    }
}
