//! The speed of a run whose load is not known: a smooth unknown behind voltages and currents, and behind the noise of its sensor where it has one.
//!
//! The rotor turns at ω₀(t) + δω(t), ω₀ the smoothed measured speed or the [reference](reference) that the currents ask for, δω a line whose slope
//! [wanders](wandering). What δω does to
//! the currents is linear ([`flux`]), and Gaussian: the residual r of a run on ω₀ has the covariance σ²I + G Q Gᵀ. [`UnsureInputs::whiten`]
//! is the Kalman filter of δω; it leaves the innovations L⁻¹r, (I + G Q Gᵀ/σ²) = L Lᵀ, which are white where the machine is right. So every
//! fit, score and likelihood is that over all speeds at once: what only another speed would show counts for nothing.
//! Source: T. Kailath, An innovations approach to least-squares estimation, IEEE Trans. Autom. Control 13 (1968) 646.

mod flux;
mod inputs;
mod reference;
mod voltage;
mod wandering;

use std::iter::Peekable;
use std::slice::Iter;
use std::sync::Arc;

use im_model::Scalar;
use nalgebra::{Matrix2, SMatrix, SVector};

use super::channel::Channel;
use flux::{Electrical, Fluxes, Step};
pub use voltage::{HARMONICS, Stretch, VoltageNoise, Volts, Wander};
pub(super) use wandering::Wandering;

/// δψ_s, δψ_r (α and β each), δω and its slope; behind them, where mains may be off, what they are off by at each harmonic (α and β).
type Vector<const N: usize = MACHINE> = SVector<f64, N>;
type Matrix<const N: usize = MACHINE> = SMatrix<f64, N, N>;

const SPEED: usize = 4;
const SLOPE: usize = 5;
const MACHINE: usize = 6;
const WITH_MAINS: usize = MACHINE + 2 * HARMONICS;

/// A speed as voltages and currents ask for it, and what is not known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundSpeed {
    /// ω₀, one per row, rad/s.
    pub omega_m: Vec<f64>,
    /// Standard deviation by the noise of the current sensors, for the machine as it is, rad/s.
    pub std: Vec<f64>,
    /// How much its slope was taken to wander before the data, (rad/s²)²/s.
    before: f64,
    /// How much speed and fluxes wander where the machine that it is found by may be wrong.
    wrong: Unknown,
    pub(super) unsure: UnsureInputs,
}

/// What is not known of the speed that drives a machine, or of its voltage, and what that does to the currents.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct UnsureInputs {
    /// Fluxes in a run on that speed, one pair per row.
    psi: Vec<Fluxes>,
    electrical: Electrical,
    unknown: Unknown,
    /// What the slope of δω changes by at each row because ω₀ bends there, rad/s²; none where it is δω that wanders, not ω.
    bends: Arc<[f64]>,
    filter: Arc<Either>,
}

/// How much of the inputs is not known.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Unknown {
    /// Of the speed.
    pub speed: Wandering,
    /// Of the voltage.
    pub voltage: Volts,
    /// Whether the torque moves the rotor; else it turns as its speed is said to.
    pub shaft_is_free: bool,
    /// Variance that each row adds to each flux because the machine is not right yet, (Vs)²; 0 where it is judged.
    pub fluxes: f64,
}

impl Unknown {
    /// Of a speed that is said, at an exact voltage.
    fn of_speed(speed: Wandering) -> Self {
        Self { speed, voltage: Volts::default(), shaft_is_free: false, fluxes: 0.0 }
    }

    /// On every so many rows.
    fn every(&self, stride: usize) -> Self {
        Self {
            speed: self.speed.every(stride),
            voltage: self.voltage.every(stride),
            fluxes: self.fluxes * stride as f64,
            ..*self
        }
    }
}

/// The filter of a run.
#[derive(Debug, PartialEq)]
enum Either {
    /// With mains that are known, or no mains.
    Machine(Filter<MACHINE>),
    /// With mains that may be off.
    Mains(Filter<WITH_MAINS>),
}

/// What a filter runs over.
#[derive(Clone, Copy, Debug)]
pub(super) enum Of {
    /// What a machine leaves.
    Residuals,
    /// What something changes of it: the speed that drives the machine bends as before.
    Changes,
}

/// The Kalman filter of δω, its gains known beforehand.
#[derive(Debug, PartialEq)]
struct Filter<const N: usize> {
    /// σ of each channel for which it was made.
    sigma: Vec<f64>,
    /// What each channel shows of the state, in σ; zero where it shows none.
    shows: Vec<Vector<N>>,
    /// How the state goes on from each row.
    steps: Vec<Step>,
    /// Gain and √S of each channel, row by row; nothing where it does not count.
    gains: Vec<Vec<Option<(Vector<N>, f64)>>>,
    /// What the mains may be off by.
    mains: Vec<Stretch>,
}

impl<const N: usize> Filter<N> {
    /// Means and covariances at every row, before and after what was measured there, go to `keep`.
    fn new(
        channels: &[Channel],
        electrical: &Electrical,
        steps: Vec<Step>,
        unknown: &Unknown,
        mut keep: impl FnMut(&Matrix<N>, &Matrix<N>),
    ) -> Self {
        let shown = |c: &Channel| {
            let mut all = Vector::<N>::zeros();
            all.fixed_rows_mut::<MACHINE>(0).copy_from(&(electrical.shown_by(c) / c.sigma));
            all
        };
        let shows: Vec<Vector<N>> = channels.iter().map(shown).collect();
        let mut p = unknown_speed::<N>(&unknown.speed.first);
        let mut gains = Vec::with_capacity(steps.len());
        let mut mains = Mains::<N>::new(&unknown.voltage.mains);
        for (k, (step, sigma_v)) in steps.iter().zip(unknown.voltage.row_by_row()).enumerate() {
            mains.at(k, |n, z| {
                p.fixed_rows_mut::<2>(n).fill(0.0);
                p.fixed_columns_mut::<2>(n).fill(0.0);
                p[(n, n)] = z.first_v2;
                p[(n + 1, n + 1)] = z.first_v2;
            });
            let before = p;
            let measured = channels.iter().zip(&shows).map(|(c, h)| {
                c.is_valid(k).then(|| {
                    let ph = p * h;
                    let variance = h.dot(&ph) + 1.0;
                    p -= ph * ph.transpose() / variance;
                    (ph / variance, variance.sqrt())
                })
            });
            gains.push(measured.collect());
            keep(&before, &p);
            p = step.carried(&p, sigma_v, mains.now());
            (0..SPEED).for_each(|n| p[(n, n)] += unknown.fluxes);
        }
        let sigma = channels.iter().map(|c| c.sigma).collect();
        Self { sigma, shows, steps, gains, mains: unknown.voltage.mains.clone() }
    }

    /// Runs over residuals, or changes of them, in σ, given by channel and row, and puts the innovations in their place; `keep` sees the state after
    /// each row. Of residuals, the slope changes by these `bends`.
    fn run(&self, r: &mut [Vec<f64>], channels: &[Channel], bends: &[f64], mut keep: impl FnMut(&Vector<N>)) {
        let Some(rows) = r.first().map(Vec::len) else { return };
        let mut x = Vector::<N>::zeros();
        let mut mains = Mains::<N>::new(&self.mains);
        for k in 0..rows.min(self.steps.len()) {
            mains.at(k, |n, _| x.fixed_rows_mut::<2>(n).fill(0.0));
            for (c, (values, h)) in r.iter_mut().zip(&self.shows).enumerate() {
                if let Some((gain, deviation)) = &self.gains[k][c] {
                    // The sensors' noise may be known better by now; the filter stays that of its ratio to the wandering.
                    let scale = channels[c].sigma / self.sigma[c];
                    let innovation = values[k] * scale - h.dot(&x);
                    x += gain * innovation;
                    values[k] = innovation / (deviation * scale);
                }
            }
            keep(&x);
            x = self.steps[k].next(&x, mains.now());
            x[SLOPE] += bends.get(k).copied().unwrap_or(0.0);
        }
    }
}

/// How the errors of mains wander, row by row; nothing in a filter without them.
struct Mains<'a, const N: usize> {
    next: Peekable<Iter<'a, Stretch>>,
    now: [Wander; HARMONICS],
}

impl<'a, const N: usize> Mains<'a, N> {
    fn new(all: &'a [Stretch]) -> Self {
        Self { next: all.iter().peekable(), now: Default::default() }
    }

    /// Comes to a row; `begin` sees where each error stands in the state, where other ones begin there.
    fn at(&mut self, row: usize, mut begin: impl FnMut(usize, &Wander)) {
        let mut begun = false;
        // In longer steps, several may begin in one.
        while let Some(stretch) = self.next.next_if(|s| N > MACHINE && s.from <= row) {
            self.now = stretch.off;
            begun = true;
        }
        if begun {
            self.now.iter().enumerate().for_each(|(n, z)| begin(MACHINE + 2 * n, z));
        }
    }

    fn now(&self) -> &[Wander] {
        if N > MACHINE { &self.now } else { &[] }
    }
}

/// Before the first row: fluxes as the start has them.
fn unknown_speed<const N: usize>(first: &Matrix2<f64>) -> Matrix<N> {
    let mut p = Matrix::<N>::zeros();
    p.fixed_view_mut::<2, 2>(SPEED, SPEED).copy_from(first);
    p
}

impl UnsureInputs {
    /// Of a run on the speed `omega_m`, one per row, with these fluxes.
    fn new(
        channels: &[Channel],
        electrical: Electrical,
        (omega_m, psi): (impl Iterator<Item = f64>, Vec<Fluxes>),
        sample_time_s: f64,
        unknown: Unknown,
    ) -> Self {
        let omega_m: Vec<f64> = omega_m.collect();
        let steps = electrical.steps(&omega_m, &psi, sample_time_s, &unknown);
        let bends = unknown.speed.push.map_or_else(Vec::new, |push| electrical.bends(&omega_m, &psi, sample_time_s, push));
        let filter = if unknown.voltage.mains.is_empty() {
            Either::Machine(Filter::new(channels, &electrical, steps, &unknown, |_, _| ()))
        } else {
            Either::Mains(Filter::new(channels, &electrical, steps, &unknown, |_, _| ()))
        };
        Self { psi, electrical, unknown, bends: bends.into(), filter: Arc::new(filter) }
    }

    /// What is left of residuals in σ, per channel, when the likeliest speed and voltage up to each row are taken off: white where the machine is
    /// right.
    pub fn whiten(&self, r: &mut [Vec<f64>], channels: &[Channel], of: Of) {
        let bends = match of {
            Of::Residuals => &self.bends[..],
            Of::Changes => &[],
        };
        match &*self.filter {
            Either::Machine(filter) => filter.run(r, channels, bends, |_| ()),
            Either::Mains(filter) => filter.run(r, channels, bends, |_| ()),
        }
    }

    /// For the same run on every so many rows, whose channels and speeds these are.
    pub fn every(&self, stride: usize, channels: &[Channel], omega_m: impl Iterator<Item = f64>, sample_time_s: f64) -> Self {
        let psi = self.psi.iter().step_by(stride).copied().collect();
        Self::new(channels, self.electrical, (omega_m, psi), sample_time_s, self.unknown.every(stride))
    }
}

impl FoundSpeed {
    /// The rotor's speed at row `k`.
    #[inline(always)]
    pub(super) fn at<T: Scalar>(&self, k: usize) -> T {
        T::from_f64(self.omega_m[k.min(self.omega_m.len() - 1)])
    }

    /// For the same run on every so many rows, whose channels these are.
    pub(super) fn every(&self, stride: usize, channels: &[Channel], sample_time_s: f64) -> Self {
        let thin = |x: &[f64]| x.iter().step_by(stride).copied().collect::<Vec<f64>>();
        let omega_m = thin(&self.omega_m);
        let unsure = self.unsure.every(stride, channels, omega_m.iter().copied(), sample_time_s);
        Self { std: thin(&self.std), omega_m, before: self.before, wrong: self.wrong.every(stride), unsure }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::Complex;

    fn wander(first_v2: f64) -> Wander {
        Wander { first_v2, onward: Complex::from_polar(0.9, 0.3), added_v2: 0.2 }
    }

    /// Of errors that begin in one long step, the last goes on; a filter without mains has none.
    #[test]
    fn every_error_of_the_mains_begins() {
        let volts = Volts {
            mains: [3, 4, 9].map(|from| Stretch { from, off: [wander(from as f64); HARMONICS] }).into(),
            ..Volts::default()
        };
        let began = |all: &[Stretch]| {
            let (mut mains, mut seen) = (Mains::<WITH_MAINS>::new(all), Vec::new());
            for row in 0..10 {
                mains.at(row, |n, z| seen.push((row, n, z.first_v2)));
            }
            seen.retain(|x| x.1 == MACHINE);
            seen
        };
        assert_eq!(began(&volts.mains), [(3, MACHINE, 3.0), (4, MACHINE, 4.0), (9, MACHINE, 9.0)]);
        assert_eq!(began(&volts.every(5).mains), [(0, MACHINE, 4.0), (1, MACHINE, 9.0)]);
        let mut none = Mains::<MACHINE>::new(&volts.mains);
        none.at(9, |_, _| unreachable!());
        assert!(none.now().is_empty());
    }

    /// A step of several rows is those rows one after the other.
    #[test]
    fn an_error_of_the_mains_wanders_in_long_steps_as_in_short_ones() {
        let volts = Volts { mains: vec![Stretch { from: 0, off: [wander(1.0); HARMONICS] }], ..Volts::default() };
        let (one, long) = (volts.mains[0].off[0], volts.every(4).mains[0].off[0]);
        let variance = (0..4).fold(one.first_v2, |v, _| v * one.onward.norm_sqr() + one.added_v2);
        assert!((long.first_v2 * long.onward.norm_sqr() + long.added_v2 - variance).abs() < 1e-12);
        assert!((long.onward - one.onward.powu(4)).norm() < 1e-12);
    }
}
