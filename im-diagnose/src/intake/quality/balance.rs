//! The balance of torques at the shaft, from what was measured and R_s alone:
//!
//!   n_p P_δ/ω_s = r τ_L + J dω/dt + D ω + C sgn ω,   P_δ = (3/2) (Re(u i*) − R_s |i|²)
//!
//! in means over whole periods of the supply, over which the energy of the fields comes and goes. r is one where load torque, voltage and current
//! are what they are taken for, −1 where the torque has the other sign; J is known to a factor where the machine speeds up.

use std::f64::consts::TAU;
use std::ops::Range;

use im_model::{Complex, MotorFile};
use nalgebra::{Matrix4, Vector4};

use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity};
use crate::statistics::median;

/// Parts of the rated voltage and frequency below which a supply says little about the torque: drops and winding resistance take the rest.
const LEAST: f64 = 0.1;
/// Least rows of a period.
const ROWS: usize = 8;
/// Iron, stray losses and harmonics: part of the rated torque that a mean over a period may be off by.
const UNKNOWN: f64 = 0.03;
/// Friction is less than this part of the rated torque, each kind of it.
const FRICTION: f64 = 0.05;
/// Rounds of weights, and periods that all count for.
const ROUNDS: usize = 8;
const FEW: f64 = 8.0;
/// So many standard deviations are no chance.
const SURE: f64 = 4.0;
/// From this factor on, a ratio of torques or of inertias is no tolerance of sensors, supplies and first guesses.
const FAR: [f64; 2] = [1.3, 5.0];
/// From this factor on a fit does not come back from the motor file.
const UNFITTED: f64 = 20.0;
/// Factors of inertias in other units or other words, and what they are.
const UNITS: [(f64, &str); 4] = [
    (1e3, "g m² read as kg m²"),
    (1e4, "kg cm² read as kg m²"),
    (1e7, "g cm² read as kg m²"),
    (4.0, "GD² in kg m², which is 4 J"),
];

/// Newton metres in units of torque that are taken for them, and how these are written.
const TORQUE_UNITS: [(f64, &str); 6] =
    [(1e3, "kNm"), (1e-3, "mNm"), (1e-2, "Ncm"), (9.81, "kgf m"), (1.356, "lbf ft"), (0.113, "lbf in")];

/// What a recording holds, row by row.
pub struct Measured<'a> {
    /// Voltage, V, peak.
    pub u: &'a [Complex<f64>],
    /// Current, A, peak.
    pub i: &'a [Complex<f64>],
    /// Speed, rad/s mechanical.
    pub speed: &'a [f64],
    /// Load torque, Nm.
    pub load: &'a [f64],
    /// Sampling time, s.
    pub sample_time_s: f64,
    /// From the instant that the voltage belongs to, to that of its row.
    pub voltage_shift_s: f64,
}

/// An estimate and its standard deviation.
type Estimate = (f64, f64);

/// Load-torque ratio and inertia that the balance asks for.
fn balance(m: &Measured<'_>, motor: &MotorFile) -> Option<[Estimate; 2]> {
    let (machine, rating) = (&motor.machine, &motor.rating);
    let (n_p, r_s) = (f64::from(machine.pole_pairs()), machine.parameters().stator_resistance_ohm);
    let rated_omega = TAU * rating.electrical_frequency_hz;
    let torque = rating.torque_nm;
    let rows = periods(m.u).into_iter().filter_map(|(rows, turns)| {
        let n = rows.len() as f64;
        let mean = |x: &dyn Fn(usize) -> f64| rows.clone().map(x).sum::<f64>() / n;
        let omega_s = TAU * turns / (n * m.sample_time_s);
        let voltage = mean(&|k| m.u[k].norm());
        let strong = voltage > LEAST * rating.phase_voltage_peak_v && omega_s.abs() > LEAST * rated_omega;
        if !strong || rows.len() < ROWS {
            return None;
        }
        let lag = Complex::from_polar(1.0, m.voltage_shift_s * omega_s);
        let power = mean(&|k| 1.5 * ((m.u[k] * lag * m.i[k].conj()).re - r_s * m.i[k].norm_sqr()));
        let speed = mean(&|k| m.speed[k]);
        let middle = 0.5 * (rows.start + rows.end - 1) as f64;
        let across: f64 = rows.clone().map(|k| (k as f64 - middle).powi(2)).sum();
        let rise: f64 = rows.clone().map(|k| (k as f64 - middle) * m.speed[k]).sum();
        let acceleration = rise / (across * m.sample_time_s);
        let row = [mean(&|k| m.load[k]), acceleration, speed, speed / (speed.abs() + 1e-3 * rated_omega / n_p)];
        row.iter().chain([&power]).all(|x| x.is_finite()).then_some((Vector4::from(row), n_p * power / omega_s))
    });
    let rows: Vec<(Vector4<f64>, f64)> = rows.collect();
    if rows.len() < 3 {
        return None;
    }
    // Known beforehand: friction is small, the inertia and the ratio within some decades.
    let inertia = machine.parameters().inertia_kg_m2;
    let known = [1e4, 1e4 * inertia, FRICTION * torque * n_p / rated_omega, FRICTION * torque];
    let prior = Matrix4::from_diagonal(&Vector4::from(known.map(|s| 1.0 / (s * s))));
    let solve = |weights: &[f64]| {
        let both = || rows.iter().zip(weights);
        let normal = both().fold(prior, |a, ((x, _), w)| a + x * x.transpose() * *w);
        let b = both().fold(Vector4::zeros(), |b, ((x, y), w)| b + x * (*y * *w));
        let covariance = normal.try_inverse()?;
        Some((covariance * b, covariance))
    };
    // Where fields come or go, the balance does not hold: such periods count little, by the law of Cauchy.
    let floor = UNKNOWN * torque;
    let mut weights = vec![1.0 / (floor * floor); rows.len()];
    for _ in 0..ROUNDS {
        let (x, _) = solve(&weights)?;
        let left: Vec<f64> = rows.iter().map(|(a, y)| (y - a.dot(&x)).abs()).collect();
        let usual = median(&mut left.clone()).max(floor);
        weights = left.iter().map(|r| 1.0 / (usual * usual + r * r)).collect();
    }
    // What is left goes on over many periods: all count as a few.
    let few = (FEW / rows.len() as f64).min(1.0);
    weights.iter_mut().for_each(|w| *w *= few);
    let (x, covariance) = solve(&weights)?;
    Some([0, 1].map(|k| (x[k], covariance[(k, k)].sqrt())))
}

/// Whole periods of the voltage, and by how many turns it turns in each.
fn periods(u: &[Complex<f64>]) -> Vec<(Range<usize>, f64)> {
    let (mut found, mut start, mut angle) = (Vec::new(), 0, 0.0);
    for k in 1..u.len() {
        let before = angle;
        angle += (u[k] * u[k - 1].conj()).arg();
        if angle.abs() >= TAU {
            // The last step may lead beyond the period: the nearer end counts.
            let over = angle.abs() - TAU > TAU - before.abs();
            let (end, turned) = if over { (k - 1, before) } else { (k, angle) };
            found.push((start..end, turned / TAU));
            (start, angle) = (end, angle - turned);
        }
    }
    found
}

/// What the balance says against load torque and inertia.
pub fn check(m: &Measured<'_>, load_column: &str, motor: &MotorFile) -> Vec<Finding> {
    let Some([(ratio, ratio_std), (inertia, inertia_std)]) = balance(m, motor) else { return Vec::new() };
    let mut out = Vec::new();
    let beyond = |value: f64, std: f64, factor: f64| value - SURE * std > factor || value + SURE * std < 1.0 / factor;
    let shown = || {
        format!(
            "Power less winding loss makes an air-gap torque of {} ± {} times the load torque ({load_column}), acceleration and friction apart",
            number(ratio, 3),
            number(2.0 * ratio_std, 1)
        )
    };
    if (ratio + 1.0).abs() < FAR[0] - 1.0 && ratio + SURE * ratio_std < 0.0 {
        let advice = "A load is positive where it brakes a shaft that turns forward: turn its sign, gain = -1 in [load].";
        out.push(Finding::new(FindingKind::LoadTorque, Severity::Serious, shown(), advice).on(load_column));
    } else if beyond(ratio, ratio_std, FAR[0]) {
        let unit = TORQUE_UNITS.iter().find(|(factor, _)| (ratio / factor).ln().abs() < 0.1);
        let unit = unit.map_or_else(String::new, |(factor, unit)| {
            format!(" Are these {unit} read as Nm? Then gain = {factor} in [load] of the mapping.")
        });
        let advice = format!(
            "It should be one: see the gain and unit of the torque sensor, and whether voltage and current are per phase, peak.{unit}"
        );
        let severity = if beyond(ratio, ratio_std, FAR[1]) { Severity::Serious } else { Severity::Warning };
        out.push(Finding::new(FindingKind::LoadTorque, severity, shown(), advice).on(load_column));
    } else {
        let given = motor.machine.parameters().inertia_kg_m2;
        let (part, std) = (inertia / given, inertia_std / given);
        if inertia > SURE * inertia_std && beyond(part, std, FAR[1]) {
            let text = format!(
                "Power less winding loss speeds the shaft up as an inertia of {} ± {} kg m² would; the motor file says {} kg m²",
                number(inertia, 3),
                number(2.0 * inertia_std, 1),
                number(given, 3)
            );
            let unit = UNITS.iter().find(|(factor, _)| (factor * part).ln().abs() < 0.5);
            let unit = unit.map_or_else(String::new, |(_, what)| format!(" Is it {what}?"));
            let advice = format!("Correct inertia_kg_m2, of rotor and load together.{unit}");
            // As far as a fit would not correct it.
            let severity = if beyond(part, 0.0, UNFITTED) { Severity::Serious } else { Severity::Warning };
            out.push(Finding::new(FindingKind::Inertia, severity, text, advice));
        }
    }
    out
}
