//! What feeds a machine: the mains, a drive, or nothing.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

use im_identify::offline::Experiment;
use im_model::{Complex, MotorFile};

use crate::intake::sampled::switches;
use crate::statistics::median;

/// How much the size of a supply's voltage may vary, rms, relative.
const STEADY: f64 = 0.05;

/// Frequencies of mains, and how near they are kept, relative.
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
const MAINS_WITHIN: f64 = 0.01;

/// How far a voltage may be shifted, rad, in what should be one or two turns, as by thyristors: a tenth of a turn.
const SHIFTED: f64 = 0.1 * TAU;

/// A machine that is fed takes its magnetizing current; one that takes less than this part of it is not.
const FED: f64 = 0.1;

/// A supply over two rated periods in which the voltage keeps its size and turns evenly.
struct Supply {
    /// Electrical frequency, rad/s.
    omega: f64,
    /// |U|, V peak.
    size: f64,
}

/// Rows, over a rated period or more each, in which nothing feeds the machine: its voltage, if any, is its own.
pub fn unfed(motor: &MotorFile, e: &Experiment) -> Vec<Range<usize>> {
    let (p, rated) = (motor.machine.parameters(), TAU * motor.rating.electrical_frequency_hz);
    let stator_inductance_h = p.stator_leakage_inductance_h + p.magnetizing_inductance_h;
    let magnetizing_a = motor.rating.phase_voltage_peak_v / (rated * stator_inductance_h);
    let is_fed = |k: usize| e.current_vector(k, |c| e.channels[c].values[k]).is_none_or(|i| i.norm() > FED * magnetizing_a);
    let fed = (0..e.len()).filter(|k| is_fed(*k)).chain([e.len()]);
    let mut from = 0;
    let before = fed.map(|k| std::mem::replace(&mut from, k + 1)..k);
    before.filter(|rows| rows.len() as f64 * e.sample_time_s * rated > TAU).collect()
}

/// The supply over each two rated periods in which there is one and nothing is switched; `None` where its voltage keeps no size, or turns unevenly.
fn supplies(motor: &MotorFile, e: &Experiment) -> Vec<Option<Supply>> {
    let rated = TAU * motor.rating.electrical_frequency_hz;
    let rows = (2.0 * TAU / (rated * e.sample_time_s)) as usize;
    if e.is_table() || rows < 4 {
        return Vec::new();
    }
    let over = |u: &[Complex<f64>]| {
        let n = u.len() as f64;
        let size = u.iter().map(|u| u.norm()).sum::<f64>() / n;
        let spread = (u.iter().map(|u| (u.norm() - size).powi(2)).sum::<f64>() / n).sqrt();
        let turned = |u: &[Complex<f64>]| u.windows(2).map(|w| (w[1] * w[0].conj()).arg()).sum::<f64>();
        let middle = u.len() / 2;
        let is_even = (turned(&u[..=middle]) - turned(&u[u.len() - middle - 1..])).abs() < SHIFTED;
        (spread < STEADY * size && is_even).then(|| Supply { omega: turned(u).abs() / ((n - 1.0) * e.sample_time_s), size })
    };
    let unfed = unfed(motor, e);
    let is_fed = |from: usize| !unfed.iter().any(|r| r.start <= from && from + rows <= r.end);
    let switched: BTreeSet<usize> = switches(&e.u_s).into_iter().map(|s| s.row / rows).collect();
    let windows = e.u_s.chunks_exact(rows).enumerate().filter(|(n, _)| is_fed(n * rows) && !switched.contains(n));
    windows.map(|(_, u)| over(u)).collect()
}

/// |U| of a supply over that of the rating at its frequency, from half the rated frequency on; of all such, where it turns fastest. The machine
/// need not have settled.
pub fn of_rated(motor: &MotorFile, e: &Experiment) -> Option<f64> {
    let rated = 2.0 * PI * motor.rating.electrical_frequency_hz;
    let usual = supplies(motor, e).into_iter().flatten().filter(|s| (0.5..1.03).contains(&(s.omega / rated)));
    let fastest = usual.max_by(|a, b| a.omega.total_cmp(&b.omega))?;
    Some(fastest.size / (motor.rating.phase_voltage_peak_v * (fastest.omega / rated).min(1.0)))
}

/// Whether the voltage is that of the mains.
pub fn is_mains(motor: &MotorFile, e: &Experiment) -> bool {
    mains_frequency(motor, e).is_some()
}

/// The frequency of the mains, rad/s, where the voltage is theirs: mostly of one size at 50 or 60 Hz, and steady at no other. They may sag, be
/// switched, also to the other direction, and be cut by thyristors.
pub fn mains_frequency(motor: &MotorFile, e: &Experiment) -> Option<f64> {
    let all = supplies(motor, e);
    let is_near = |s: &Supply, within: f64| MAINS_HZ.iter().any(|hz| (s.omega / (2.0 * PI * hz) - 1.0).abs() < within);
    // Over two turns.
    let shifted = SHIFTED / (2.0 * TAU);
    let largest = all.iter().flatten().map(|s| s.size).fold(0.0, f64::max);
    let is_other = |s: &Supply| s.size > 0.1 * largest && !is_near(s, shifted);
    let is_alike = |s: &&Supply| s.size > 0.9 * largest && is_near(s, MAINS_WITHIN);
    let mut alike: Vec<f64> = all.iter().flatten().filter(is_alike).map(|s| s.omega).collect();
    // The switch closes in one of them, and may open in another.
    let is_theirs = !all.iter().flatten().any(is_other) && 2 * alike.len() > all.len().saturating_sub(2);
    is_theirs.then(|| median(&mut alike))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A start on the rated supply, which has not settled; and a voltage that keeps no size.
    #[test]
    fn a_supply_is_as_large_as_it_is_before_the_machine_has_settled() {
        let motor = MotorFile::parse(include_str!("../../../../examples/motor.toml"), "motor.toml").unwrap();
        let omega = 2.0 * PI * motor.rating.electrical_frequency_hz;
        let run = |size: &dyn Fn(f64) -> f64| {
            let (rows, h) = (2000, 1e-4);
            let u_s = (0..rows).map(|k| f64::from(k) * h).map(|t| Complex::from_polar(size(t), omega * t)).collect();
            let n = rows as usize;
            let i_s = vec![Complex::from(5.0); n];
            let (omega_m, tau_load) = (vec![0.0; n], None);
            let r = im_model::Recording { name: "r".into(), start_s: 0.0, sample_time_s: h, u_s, i_s, omega_m, tau_load };
            let e = Experiment::from_recording(&r, [0.1; 2], 0.1);
            (of_rated(&motor, &e), is_mains(&motor, &e))
        };
        let rated = motor.rating.phase_voltage_peak_v;
        let (size, mains) = run(&|_| 1.2247 * rated);
        assert!(size.is_some_and(|u| (u - 1.2247).abs() < 1e-3) && mains);
        assert!(run(&|t| if t < 0.03 { 0.0 } else { rated }).1);
        assert_eq!(run(&|t| 5.0 * t * rated * (1.0 + 0.3 * (900.0 * t).sin())), (None, false));
        assert!(!run(&|t| 5.0 * t * rated).1);
        // A drive that runs up in 0.3 s, and at 50 Hz ever after.
        let at = |k: i32| {
            let t = f64::from(k) * 1e-4;
            let (part, turns) = if t < 0.3 { (t / 0.3, t * t / 0.6) } else { (1.0, t - 0.15) };
            Complex::from_polar(part * rated, omega * turns)
        };
        let u_s: Vec<Complex<f64>> = (0..30_000).map(at).collect();
        let (i_s, omega_m) = (vec![Complex::from(5.0); u_s.len()], vec![0.0; u_s.len()]);
        let r = im_model::Recording { name: "r".into(), start_s: 0.0, sample_time_s: 1e-4, u_s, i_s, omega_m, tau_load: None };
        assert!(!is_mains(&motor, &Experiment::from_recording(&r, [0.1; 2], 0.1)));
        assert_eq!(run(&|_| 0.0), (None, false));
    }

    /// A machine on the mains whose phase sequence is exchanged, and whose switch opens: then its voltage is its own, slower and smaller every period.
    #[test]
    fn what_a_machine_makes_unfed_is_no_supply() {
        let motor = MotorFile::parse(include_str!("../../../../examples/motor.toml"), "motor.toml").unwrap();
        let (rows, h) = (6000, 2e-4);
        // Exchanged where phase a is at its peak: the voltage does not jump.
        let (on, reversed, opened) = (150, 1500, 3000);
        let u = |k: usize| {
            let (t, since) = (k as f64 * h, (k.max(opened) - opened) as f64 * h);
            let size = if k < on { 0.0 } else { 327.0 * (-8.0 * since).exp() };
            let phi = TAU * (50.0 * t - 20.0 * since * since);
            Complex::from_polar(size, if k < reversed { phi } else { -phi })
        };
        let i_s = |k: usize| if (on..opened).contains(&k) { u(k) * 0.02 } else { Complex::from(0.03) };
        let r = im_model::Recording {
            name: "r".into(),
            start_s: 0.0,
            sample_time_s: h,
            u_s: (0..rows).map(u).collect(),
            i_s: (0..rows).map(i_s).collect(),
            omega_m: vec![0.0; rows],
            tau_load: None,
        };
        let e = Experiment::from_recording(&r, [0.1; 2], 0.1);
        assert_eq!(unfed(&motor, &e), [0..on, opened..rows]);
        let omega = mains_frequency(&motor, &e).unwrap();
        assert!((omega / (100.0 * PI) - 1.0).abs() < 1e-3, "{omega}");
        // With a current, all of it is a drive.
        let driven = im_model::Recording { i_s: vec![Complex::from(5.0); rows], ..r };
        assert_eq!(mains_frequency(&motor, &Experiment::from_recording(&driven, [0.1; 2], 0.1)), None);
    }
}
