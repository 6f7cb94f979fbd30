//! Noise of a measured voltage, from the data: on the mains, whose voltage is smooth, what is rough, as far as the currents do not follow it.
//!
//! What a drive puts out may be rough, too, and nobody knows what of that is voltage: there, a measured voltage is taken for exact.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use im_identify::offline::{Experiment, Stretch, VoltageNoise, Volts, Wander, residuals};
use im_model::{Complex, Machine, MotorFile, State};

use super::smooth_mains::{Mains, ORDERS};
use super::supply::{mains_frequency, unfed};
use crate::intake::sampled::{Switch, size, switches};
use crate::statistics::median;

/// On both sides of each harmonic so much is taken out with it, Hz.
const WIDTH_HZ: f64 = 20.0;

/// What is farther out, in standard deviations, was switched; the filter rings from it for so many of its time constants.
const SWITCHED: f64 = 5.0;
const RINGS: f64 = 10.0;

/// What lasts for less than this part of a period, rad, is too short to tell what is rough.
const TURN: f64 = TAU;

/// Part of its size that a voltage may be rough by because it is written in digits.
const ROUNDING: f64 = 1e-9;

/// Part of its size that the noise of a voltmeter exceeds, and the digits in which a voltage is written do not.
const METERED: f64 = 1e-4;

/// Whether a voltage, as it stands in its rows, is the mains with a voltmeter's noise.
pub fn is_metered(motor: &MotorFile, e: &Experiment) -> bool {
    noise_of_mains(motor, e, &e.u_s).is_some_and(|sigma_v| sigma_v > METERED * size(&e.u_s))
}

/// Of a recording, whose voltage stands in `rows` as it was measured, switched between them.
pub fn of_recording(motor: &MotorFile, e: &Experiment, rows: &[Complex<f64>], switches: &[Switch]) -> VoltageNoise {
    let sigma_v = noise_of_mains(motor, e, rows).unwrap_or(0.0);
    let switched = switches.iter().map(|s| (s.row, s.sigma_v())).collect();
    VoltageNoise::of(Volts { sigma_v, switched, ..Volts::default() })
}

/// Standard deviation of the noise of the mains, V, while they feed the machine and nothing is switched.
fn noise_of_mains(motor: &MotorFile, e: &Experiment, rows: &[Complex<f64>]) -> Option<f64> {
    let notches = Notches::new(mains_frequency(motor, e)?, e.sample_time_s);
    let rings = notches.rings() as usize;
    let mut counts = vec![true; rows.len()];
    let switched = switches(rows).into_iter().map(|s| s.row..s.row + rings);
    for others in unfed(motor, e).into_iter().chain(switched) {
        counts[others.start..others.end.min(rows.len())].fill(false);
    }
    Some(notches.sigma(rows, |k| counts[k]))
}

/// What of a voltage, as it drives a machine, is rough.
pub struct Rough {
    /// Of the mains, rad/s.
    omega: f64,
    /// In every row where it can be told.
    u: Vec<Option<Complex<f64>>>,
    /// What the rest may be off by, where that is the mains and nothing else: not where more than noise of one size is rough.
    rest: Option<Vec<Stretch>>,
}

impl Rough {
    /// Of the mains with noise, once somebody said of what size.
    pub fn of(motor: &MotorFile, e: &Experiment) -> Option<Self> {
        let sigma_v = e.voltage_noise.volts.sigma_v;
        let omega = mains_frequency(motor, e).filter(|_| sigma_v > 0.0)?;
        let measured = |k: usize| e.current_vector(k, |c| e.channels[c].values[k]);
        let i = bridged((0..e.len()).map(measured));
        let mains = Mains { u: &e.u_s, i: &i, omega, sample_time_s: e.sample_time_s, sigma_v };
        let notched = || {
            let notches = Notches::new(omega, e.sample_time_s);
            let u = notches.pass(&e.u_s);
            let quiet = notches.quiet(&u, sigma_v);
            Self { omega, u: u.into_iter().zip(quiet).map(|(u, quiet)| quiet.then_some(u)).collect(), rest: None }
        };
        Some(Self::beside(&mains, &gaps(e), &unfed(motor, e)).unwrap_or_else(notched))
    }

    /// What is neither the mains nor, where nothing feeds it, the machine's own voltage.
    fn beside(mains: &Mains<'_>, switched: &[Range<usize>], unfed: &[Range<usize>]) -> Option<Self> {
        let (u, angle) = (mains.u, mains.omega * mains.sample_time_s);
        // The phases of a switch open one after the other, each where its current is zero, and it closes within a row.
        let half_a_period = (PI / angle).ceil() as usize;
        let opens = unfed.iter().filter(|r| r.start > 0).map(|r| r.start.saturating_sub(half_a_period)..r.start);
        let closes = unfed.iter().map(|r| r.end.saturating_sub(2)..r.end);
        let mut gaps: Vec<Range<usize>> = switched.iter().cloned().chain(opens).chain(closes).collect();
        gaps.sort_by_key(|r| r.start);
        let (mut rough, mut rest) = (vec![None; u.len()], Vec::new());
        let mut from = 0;
        for gap in gaps.into_iter().chain(std::iter::once(u.len()..u.len())) {
            let rows = from..gap.start.max(from);
            from = gap.end.max(from);
            if rows.is_empty() {
                continue;
            }
            let is_fed = !unfed.iter().any(|r| r.start <= rows.start && rows.end <= r.end);
            let is_long = rows.len() as f64 * angle >= TURN;
            let behind = || if is_long { mains.behind(rows.clone(), is_fed) } else { None };
            let told = mains.switched_off(rows.clone()).or_else(behind);
            if is_fed && is_long && told.is_none() {
                return None;
            }
            let off = told.map_or_else(Default::default, |behind| {
                rough[rows.clone()].copy_from_slice(&behind.rough);
                behind.off
            });
            rest.push(Stretch { from: rows.start, off });
        }
        // Where most rows do not tell, nothing is known of the noise of the others.
        (2 * rough.iter().flatten().count() > u.len()).then_some(Self { omega: mains.omega, u: rough, rest: Some(rest) })
    }

    /// Takes it out of a voltage as far as it is noise: so much of it, mean square. What is left is likeliest, with the variance that both parts share;
    /// where it cannot be told, all noise stays.
    pub fn leave(&self, e: &mut Experiment, part: f64) {
        let noise_v = e.voltage_noise.volts.sigma_v * part.sqrt();
        e.voltage_noise.volts.sigma_v = noise_v;
        let Some(rest) = &self.rest else { return };
        e.voltage_noise.volts.taken_v = noise_v;
        // What noise makes of the mains that are found is of noise alone.
        let of_noise = |z: Wander| Wander { first_v2: part * z.first_v2, added_v2: part * z.added_v2, ..z };
        e.voltage_noise.volts.mains = rest.iter().map(|s| Stretch { off: s.off.map(of_noise), ..*s }).collect();
        e.voltage_noise.volts.sigma_v *= (1.0 - part).sqrt();
        let rows = e.u_s.iter_mut().zip(&self.u);
        rows.for_each(|(u, rough)| *u -= rough.unwrap_or_default() * part);
        let as_measured = self.u.iter().enumerate().filter(|x| x.1.is_none());
        e.voltage_noise.volts.as_measured = as_measured.map(|x| (x.0, noise_v)).collect();
    }
}

/// Rows in which something was switched that makes other mains. The mean of the one that it falls into is on neither side: of a voltage that was
/// sampled, that row is known; of means, it is one of two.
fn gaps(e: &Experiment) -> Vec<Range<usize>> {
    if e.is_smooth {
        e.voltage_noise.volts.switched.iter().map(|x| x.0..x.0 + 1).collect()
    } else {
        switches(&e.u_s).into_iter().map(|s| s.row..s.row + 2).collect()
    }
}

/// What was not measured is as the last that was.
fn bridged(values: impl Iterator<Item = Option<Complex<f64>>>) -> Vec<Complex<f64>> {
    let hold = |last: &mut Complex<f64>, x: Option<Complex<f64>>| {
        *last = x.unwrap_or(*last);
        Some(*last)
    };
    values.scan(Complex::new(0.0, 0.0), hold).collect()
}

/// A filter that all passes but the mains: of each harmonic in reach (1 − 2 cos φ z + z²)/(1 − 2 ρ cos φ z + ρ² z²), z the row before.
struct Notches {
    cosines: Vec<f64>,
    /// Radius of the poles.
    rho: f64,
}

impl Notches {
    fn new(omega: f64, t: f64) -> Self {
        let angles = std::iter::once(0).chain(ORDERS).map(|n| f64::from(n) * omega * t).filter(|a| *a < PI);
        Self { cosines: angles.map(f64::cos).collect(), rho: (-TAU * WIDTH_HZ * t).exp() }
    }

    fn pass(&self, x: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let zero = Complex::new(0.0, 0.0);
        let mut y = x.to_vec();
        for cos in &self.cosines {
            let (mut x1, mut x2, mut y1, mut y2) = (zero, zero, zero, zero);
            for y in &mut y {
                let x0 = *y;
                *y = x0 - x1 * (2.0 * cos) + x2 + y1 * (2.0 * self.rho * cos) - y2 * (self.rho * self.rho);
                (x2, x1, y2, y1) = (x1, x0, y1, *y);
            }
        }
        y
    }

    /// So many rows it rings.
    fn rings(&self) -> f64 {
        RINGS / -self.rho.ln()
    }

    /// The rows, of what has passed, at which it does not ring: noise of it has this standard deviation.
    fn quiet(&self, passed: &[Complex<f64>], sigma: f64) -> Vec<bool> {
        let rings = self.rings();
        let mut since = f64::INFINITY;
        let at = |u: &Complex<f64>| {
            since = if u.norm() < SWITCHED * sigma { since + 1.0 } else { 0.0 };
            since > rings
        };
        passed.iter().map(at).collect()
    }

    /// Standard deviation of white noise on a voltage, per axis, from the rows that count: median-based, so that switching does not.
    fn sigma(&self, u: &[Complex<f64>], counts: impl Fn(usize) -> bool) -> f64 {
        if u.is_empty() {
            return 0.0;
        }
        // White noise of 1 that passes, by what an impulse leaves.
        let impulse: Vec<Complex<f64>> = (0..u.len()).map(|k| Complex::new(if k == 0 { 1.0 } else { 0.0 }, 0.0)).collect();
        let gain = self.pass(&impulse).iter().map(|u| u.norm_sqr()).sum::<f64>().sqrt();
        let rough = self.pass(u);
        // The median of the length of two axes of N(0, 1) is √(2 ln 2).
        let sigma_of = |mut all: Vec<f64>| median(&mut all) / (2.0 * std::f64::consts::LN_2).sqrt();
        let counted = || rough.iter().enumerate().filter(|x| counts(x.0));
        let all: Vec<f64> = counted().map(|x| x.1.norm()).collect();
        if all.is_empty() {
            return 0.0;
        }
        let first = sigma_of(all);
        let is_quiet = self.quiet(&rough, first);
        let quiet: Vec<f64> = counted().filter(|x| is_quiet[x.0]).map(|x| x.1.norm()).collect();
        let sigma = if quiet.is_empty() { first } else { sigma_of(quiet) } / gain;
        if sigma > ROUNDING * size(u) { sigma } else { 0.0 }
    }
}

/// What is compared goes faster than this, as no slip and no speed of a rotor do.
const FAST_HZ: f64 = 300.0;

/// Which part (mean square) of what is rough in the voltages, in every row of each run, the currents do not follow, 0 to 1: that is noise, the rest
/// voltage. The machine is simulated with all of it, from these starts: where it is noise, what it makes is missing in what was measured; where it is
/// voltage, nothing is.
pub fn noise_part(
    machine: &Machine<f64>,
    (runs, starts): (&[Experiment], &[State<f64>]),
    left: &[Vec<Vec<f64>>],
    rough: &[Option<Rough>],
) -> f64 {
    let of = |k: usize| {
        let (e, left, Rough { omega, u: rough, .. }) = (&runs[k], &left[k], rough[k].as_ref()?);
        let u_s = e.u_s.iter().zip(rough).map(|(u, rough)| u - rough.unwrap_or_default()).collect();
        let smooth = residuals(machine, &Experiment { u_s, ..e.clone() }, &starts[k]);
        let (notches, t) = (Notches::new(*omega, e.sample_time_s), e.sample_time_s);
        let rho = (-TAU * FAST_HZ * t).exp();
        let fast = |of: &dyn Fn(usize, usize) -> f64| {
            let zero = Complex::new(0.0, 0.0);
            let at = |k: usize| e.current_vector(k, |c| of(c, k) * e.channels[c].sigma).unwrap_or(zero);
            let all = notches.pass(&(0..e.len()).map(at).collect::<Vec<_>>());
            let step = |sum: &mut Complex<f64>, w: &[Complex<f64>]| {
                *sum = *sum * rho + (w[1] - w[0]);
                Some(*sum)
            };
            all.windows(2).scan(zero, step).collect::<Vec<_>>()
        };
        let missing = fast(&|c, k| left[c][k]);
        let made = fast(&|c, k| left[c][k] - smooth[c][k]);
        let rows: Vec<_> = missing.into_iter().zip(made).zip(rough).filter(|x| x.1.is_some()).map(|x| x.0).collect();
        // Where much else is missing, as beside a switch, it tells little.
        let turn = (TURN / (omega * t)).ceil() as usize;
        let of_turn = |rows: &[(Complex<f64>, Complex<f64>)]| {
            let sum = |each: &mut dyn Iterator<Item = f64>| each.sum::<f64>();
            let size = sum(&mut rows.iter().map(|x| x.0.norm_sqr())).max(f64::MIN_POSITIVE) / rows.len() as f64;
            [sum(&mut rows.iter().map(|x| (x.1.conj() * x.0).re)) / size, sum(&mut rows.iter().map(|x| x.1.norm_sqr())) / size]
        };
        Some(rows.chunks(turn).map(of_turn).fold([0.0, 0.0], |sum, x| [sum[0] + x[0], sum[1] + x[1]]))
    };
    let [both, alone] = (0..runs.len()).filter_map(of).fold([0.0, 0.0], |sum, x| [sum[0] + x[0], sum[1] + x[1]]);
    // Without noise there is nothing to divide; a machine that diverges says nothing.
    if alone > 0.0 && both.is_finite() { (both / alone).clamp(0.0, 1.0) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_identify::offline::predict;
    use im_model::Recording;
    use im_model::machines::MOTULATOR_2_2_KW as M;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt, SeedableRng};

    fn noise(sigma: f64, seed: u64) -> impl FnMut() -> f64 {
        let mut chance = Xoshiro256PlusPlus::seed_from_u64(seed);
        move || sigma * ((0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0)
    }

    fn mains(rows: usize, t: f64, harmonics: f64) -> Vec<Complex<f64>> {
        let at = |k: usize| {
            let phi = 314.159 * t * k as f64;
            326.6
                * (Complex::from_polar(1.0, phi)
                    + Complex::from_polar(0.02 * harmonics, -5.0 * phi)
                    + Complex::new(0.01 * harmonics, 0.0))
        };
        (0..rows).map(at).collect()
    }

    #[test]
    fn the_noise_of_the_mains_is_found_beside_its_harmonics_at_any_rate() {
        for (t, harmonics) in [(1e-4, 1.0), (2.5e-4, 1.0), (1e-3, 1.0), (1e-3, 0.0)] {
            let mut draw = noise(0.5, 1);
            let clean = mains(8000, t, harmonics);
            let noisy: Vec<Complex<f64>> = clean.iter().map(|u| u + Complex::new(draw(), draw())).collect();
            let notches = Notches::new(314.159, t);
            let found = notches.sigma(&noisy, |_| true);
            assert!((found / 0.5 - 1.0).abs() < 0.05, "{t}: {found}");
            assert!(notches.sigma(&clean, |_| true) < 1e-3, "{}", notches.sigma(&clean, |_| true));
        }
        assert_eq!(Notches::new(314.159, 1e-4).sigma(&[], |_| true), 0.0);
    }

    /// Noise of a voltmeter, and a voltage that is rough itself: the machine follows only that, and only noise is taken off.
    #[test]
    fn roughness_that_the_currents_follow_is_voltage() {
        let machine = Machine::base(M.parameters(), M.pole_pairs).unwrap();
        let motor = MotorFile::new("2.2 kW", machine, M.rating);
        let zero = Complex::new(0.0, 0.0);
        for (seed, (rows, t, sigma_v)) in
            [(10_000, 1e-4, 0.8), (10_000, 1e-4, 2.0), (2_000, 5e-4, 1.5), (4_000, 2.5e-4, 0.5)].into_iter().enumerate()
        {
            let seed = seed as u64;
            let (clean, mut draw) = (mains(rows, t, 0.0), noise(sigma_v, seed));
            let rough: Vec<_> = clean.iter().map(|u| u + Complex::new(draw(), draw())).collect();
            let run = |u_s: &[Complex<f64>]| Recording {
                name: "start".into(),
                start_s: 0.0,
                sample_time_s: t,
                u_s: u_s.to_vec(),
                i_s: vec![zero; rows],
                omega_m: vec![0.0; rows],
                tau_load: Some(vec![0.0; rows]),
            };
            for (there, wanted) in [(&clean, 1.0), (&rough, 0.0)] {
                let mut e = Experiment::from_recording(&run(there), [0.03; 2], 0.1);
                let mut sensor = noise(0.03, 100 + seed);
                let predicted = predict(&machine, &e, &State::default());
                for (c, y) in e.channels.iter_mut().zip(predicted) {
                    c.values = y.iter().map(|y| y + sensor()).collect();
                }
                e.u_s.clone_from(&rough);
                e.voltage_noise = of_recording(&motor, &e, &rough, &[]);
                let start = State::default();
                let (left, found) = (residuals(&machine, &e, &start), Rough::of(&motor, &e));
                let part = noise_part(&machine, (&[e.clone()], &[start]), &[left], std::slice::from_ref(&found));
                assert!((part - wanted).abs() < 0.1, "{seed}: {part} {wanted}");
                found.unwrap().leave(&mut e, part);
                let off = e.u_s.iter().zip(there).map(|(u, there)| (u - there).norm_sqr()).sum::<f64>();
                let rms = (off / (2.0 * rows as f64)).sqrt();
                assert!(rms < 0.15 * sigma_v && e.voltage_noise.volts.sigma_v < 0.4 * sigma_v, "{seed}: {rms}");
                assert!(part < 0.5 || (e.voltage_noise.volts.taken_v / sigma_v - 1.0).abs() < 0.1);
            }
        }
    }
}
