//! Sampling: even, fast enough, and every row a new one.

use std::f64::consts::PI;

use im_model::{Complex, MotorFile, TParameters};
use rayon::prelude::*;

use super::steady::Steady;
use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity, ranges};
use crate::intake::resampled::{Samples, samples};
use crate::intake::signals::{Signals, SpeedTrace};
use crate::noise::white_sigma;

/// Beyond a supply frequency this many times rated, or below the inverse of the second, the unit of time is in question.
const FREQUENCIES: [f64; 2] = [20.0, 300.0];
/// A sampling time this many times the leakage's leaves nothing of what is compared.
const HOPELESS: f64 = 10.0;

/// Channels that were sampled more slowly than the rows, one finding for all of which the same is to be said; of voltages, those that are drawn
/// between their samples.
pub fn slower<'a>(s: &Signals, measured: impl Iterator<Item = (&'a str, &'a Option<Samples>)>) -> Vec<Finding> {
    let mut groups: Vec<(String, Severity, Vec<&str>)> = Vec::new();
    let mut say = |name, samples: &Samples, severity| {
        let text = how(samples);
        match groups.iter_mut().find(|g| (&g.0, g.1) == (&text, severity)) {
            Some(g) => g.2.push(name),
            None => groups.push((text, severity, vec![name])),
        }
    };
    for (name, samples) in measured {
        if let Some(samples) = samples {
            say(name, samples, Severity::Note);
        }
    }
    // A command is held until the next; what was sampled and drawn is not what acted.
    let found: Vec<Option<Samples>> = s.voltage.par_iter().map(|t| samples(&t.values).filter(|s| s.drawn)).collect();
    for (t, samples) in s.voltage.iter().zip(&found) {
        if let Some(samples) = samples {
            say(&t.column, samples, Severity::Warning);
        }
    }
    let finding = |(text, severity, names): (String, Severity, Vec<&str>)| {
        let is = if names.len() > 1 { "are" } else { "is" };
        let (then, advice) = match severity {
            Severity::Note => ("only the samples are compared", ""),
            _ => ("what drives the model there is a guess", "Record it at the rate of the currents."),
        };
        let found = Finding::new(FindingKind::SlowChannel, severity, format!("{} {is} {text}: {then}", names.join(", ")), advice);
        if let [name] = names[..] { found.on(name) } else { found }
    };
    groups.into_iter().map(finding).collect()
}

/// How a channel was sampled.
fn how(samples: &Samples) -> String {
    let between = if samples.drawn { "drawn by straight lines" } else { "held" };
    format!("sampled every {} rows and {between} in between", number(samples.distance(), 2))
}

/// A load torque that was sampled more slowly than the rows, where what acts between two samples, and is not known, may move the speed by more than
/// the noise of its sensor: such a torque drives a model to errors that no effect has made.
pub fn guessed_load(s: &Signals, slow_speed: Option<&Samples>, inertia_kg_m2: f64) -> Option<Finding> {
    let (SpeedTrace::Measured(speed), Some(load)) = (&s.speed, &s.tau_load) else { return None };
    let slow = samples(&load.values)?;
    let at = slow.of(&load.values);
    let changes: Vec<f64> = if slow.drawn {
        at.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]).collect()
    } else {
        at.windows(2).map(|w| w[1] - w[0]).collect()
    };
    let largest = changes.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    // Of a step between two samples, half is missing, or too much, for as long as it takes from one to the next.
    let moved = 0.5 * largest * slow.distance() * s.sample_time_s / inertia_kg_m2;
    let noise = slow_speed.map_or_else(|| white_sigma(&speed.values), |slow| white_sigma(&slow.of(&speed.values)));
    if moved <= noise {
        return None;
    }
    let text = format!(
        "{} is {}: what acts between two samples is not known, and may move the speed by {} rad/s, where its sensor's noise is {}. The load is taken \
         as unknown: the measured speed drives the electrical side. Inertia, friction and whatever else acts on the shaft are not determined by \
         this recording",
        load.column,
        how(&slow),
        number(moved, 2),
        number(noise, 2)
    );
    let advice = "Record the torque at the rate of the currents.";
    Some(Finding::new(FindingKind::SlowChannel, Severity::Warning, text, advice).on(&load.column))
}

/// Whether the clock can be that of the motor: against its supply and its time constants.
pub fn clock(s: &Signals, u: &[Complex<f64>], motor: &MotorFile) -> Option<Finding> {
    let (dt, p) = (s.sample_time_s, motor.machine.parameters());
    let (leakage_s, rotor_s) = (leakage_s(p), p.rotor_inductance_h() / p.rotor_resistance_ohm);
    let duration = dt * s.len() as f64;
    let serious = |text: String, advice: String| Some(Finding::new(FindingKind::TimeUnit, Severity::Serious, text, advice));
    let unit = |times_too_long: f64| {
        let named = [(1e3, "ms"), (1e6, "us"), (1e9, "ns"), (60.0, "min")];
        let close = |x: f64| (times_too_long / x).ln().abs() < 1.2;
        match named.into_iter().find(|(x, _)| close(*x)) {
            Some((_, unit)) => {
                format!("Is the time in {unit}? Say unit = \"{unit}\" in [time] of a recording.toml, or divide it in the file.")
            }
            None => "Give the time in seconds, or its unit in [time] of a recording.toml.".to_owned(),
        }
    };
    if let Some(turn) = turn_per_row(u) {
        let (found, rated) = (turn / (2.0 * PI * dt), motor.rating.electrical_frequency_hz);
        if found > FREQUENCIES[0] * rated || found * FREQUENCIES[1] < rated {
            let text = format!(
                "The voltage turns at {} Hz by the times of the rows ({} rows per period), where the motor is rated for {} Hz",
                number(found, 2),
                number(2.0 * PI / turn, 3),
                number(rated, 3)
            );
            return serious(text, unit(rated / found));
        }
    }
    if dt > HOPELESS * leakage_s {
        let text = format!(
            "Rows stand {} s apart, {} times the leakage time constant of {} ms: none of what the currents do is seen",
            number(dt, 2),
            number(dt / leakage_s, 2),
            number(1e3 * leakage_s, 2)
        );
        return serious(text, unit(dt / 1e-4));
    }
    if duration < 0.1 * leakage_s.min(rotor_s) {
        let text = format!(
            "The whole recording lasts {} s, a small part of the leakage time constant of {} ms: nothing happens in it",
            number(duration, 2),
            number(1e3 * leakage_s, 2)
        );
        return serious(text, "Give the time in seconds, or its unit in [time] of a recording.toml.".into());
    }
    None
}

/// L_σ/R of stator and rotor in series, s.
fn leakage_s(p: &TParameters<f64>) -> f64 {
    (p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h) / (p.stator_resistance_ohm + p.rotor_resistance_ohm)
}

/// The turn of the voltage from row to row where it is large, rad, where it turns by two turns and more.
///
/// Of each hundredth of the rows that of Σ u(k) u*(k−1), in which noise cancels, so that a drive's voltage may turn either way.
fn turn_per_row(u: &[Complex<f64>]) -> Option<f64> {
    let length = (u.len() / 100).max(8);
    let blocks = u.chunks(length).map(|block| {
        let products = || block.windows(2).map(|w| w[1] * w[0].conj()).filter(|p| p.is_finite());
        (products().sum::<Complex<f64>>(), products().map(|p| p.norm()).sum::<f64>())
    });
    let (mut turned, mut weighted, mut whole, mut size) = (0.0, 0.0, 0.0, 0.0);
    for (sum, sizes) in blocks {
        let turn = sum.arg().abs();
        turned += turn * length as f64;
        weighted += turn * sum.norm();
        whole += sum.norm();
        size += sizes;
    }
    // Noise alone turns by anything from row to row, and its products cancel.
    let turns = turned > 4.0 * PI && whole > 0.8 * size && whole.is_finite();
    turns.then_some(weighted / whole)
}

/// Looks at the sampling.
pub fn check(s: &Signals, steady: &[Steady], motor: &MotorFile) -> Vec<Finding> {
    let mut out = Vec::new();
    let dt = s.sample_time_s;
    let warn = |kind, text: String, advice: &str| Finding::new(kind, Severity::Warning, text, advice);
    if s.jitter > 0.05 {
        let text =
            format!("The times of the rows are off an even grid by up to {} % of the sampling time", number(100.0 * s.jitter, 2));
        out.push(warn(FindingKind::IrregularSampling, text, "Write the time with more digits, or resample evenly."));
    }
    let missing = ranges(&s.filled);
    if !missing.is_empty() {
        let count = s.filled.iter().filter(|f| **f).count();
        let text =
            format!("{count} rows are missing; the voltage is interpolated linearly, the rows are left out of the comparison");
        out.push(Finding::new(FindingKind::Gap, Severity::Warning, text, "").at(missing));
    }
    if let Some(fastest) = steady.iter().map(|s| s.omega.abs()).reduce(f64::max) {
        let per_period = 2.0 * std::f64::consts::PI / (fastest * dt);
        if per_period < 20.0 {
            let text = format!("There are only {} rows per period of the supply", number(per_period, 2));
            out.push(warn(FindingKind::SlowSampling, text, "Sample at twenty times the supply frequency at least."));
        }
    }
    let (leakage_s, rated) = (leakage_s(motor.machine.parameters()), motor.rating.electrical_frequency_hz);
    if dt > leakage_s {
        let text = format!(
            "The sampling time of {} ms, {} rows per period of {} Hz, exceeds the machine's leakage time constant of {} ms: what the \
             currents do in between is not seen",
            number(1e3 * dt, 2),
            number(1.0 / (rated * dt), 2),
            number(rated, 3),
            number(1e3 * leakage_s, 2)
        );
        let advice = "Sample faster. Or is the time in ms? Then say unit = \"ms\" in [time].";
        out.push(warn(FindingKind::SlowSampling, text, advice));
    }
    out
}
