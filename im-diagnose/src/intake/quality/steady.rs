//! Stretches of steady operation, and what the motor file says about them.
//!
//! The impedance of the T circuit at slip s, Z = R_s + jωL_ls + jωL_m ∥ (R_r/s + jωL_lr), is set beside U/I. The slip that fits best
//! needs no speed sensor, so that the sensor can be checked by it.

use std::f64::consts::PI;
use std::ops::Range;

use im_model::{Complex, TParameters};

/// Steady operation on a sinusoidal supply.
#[derive(Clone, Debug, PartialEq)]
pub struct Steady {
    /// Rows: a whole number of periods.
    pub rows: Range<usize>,
    /// Electrical frequency, rad/s; negative for the negative sequence.
    pub omega: f64,
    /// Voltage phasor at the first row, V peak.
    pub u: Complex<f64>,
    /// Current phasor at the first row, A peak.
    pub i: Complex<f64>,
    /// Negative-sequence voltage and current, of the sequence against `omega`.
    pub against: [Complex<f64>; 2],
    /// Mean speed, rad/s mechanical.
    pub omega_m: Option<f64>,
}

/// Windows to look at, s, and at least this many periods and rows in one.
const WINDOW_S: f64 = 0.1;
const PERIODS: f64 = 2.0;
const ROWS: usize = 40;

/// Finds stretches in which frequency, current and speed stay as they are.
pub fn stretches(u: &[Complex<f64>], i: &[Complex<f64>], speed: Option<&[f64]>, dt: f64) -> Vec<Steady> {
    let n = u.len().min(i.len());
    let mut found = Vec::new();
    for seconds in [WINDOW_S, 5.0 * WINDOW_S] {
        let length = ((seconds / dt) as usize).max(ROWS).min(n);
        if length < ROWS {
            continue;
        }
        found.extend((0..n / length).filter_map(|w| one(w * length..(w + 1) * length, u, i, speed, dt)));
        if !found.is_empty() {
            break;
        }
    }
    found
}

fn one(rows: Range<usize>, u: &[Complex<f64>], i: &[Complex<f64>], speed: Option<&[f64]>, dt: f64) -> Option<Steady> {
    let turn = |r: Range<usize>| {
        let sum: Complex<f64> = (r.start + 1..r.end).map(|k| u[k] * u[k - 1].conj()).sum();
        sum.arg() / dt
    };
    let half = rows.len() / 2;
    let (first, second) = (rows.start..rows.start + half, rows.start + half..rows.end);
    let omega = turn(rows.clone());
    if (turn(first.clone()) - turn(second.clone())).abs() > 0.03 * omega.abs() {
        return None;
    }
    let per_period = 2.0 * PI / (omega.abs() * dt);
    let periods = (rows.len() as f64 / per_period).floor();
    if periods.is_nan() || periods < PERIODS || per_period < 4.0 {
        return None;
    }
    let whole = rows.start..rows.start + (periods * per_period).round() as usize;
    let phasor = |x: &[Complex<f64>], r: Range<usize>, w: f64| {
        let sum: Complex<f64> = r.clone().map(|k| x[k] * Complex::from_polar(1.0, -w * dt * (k - rows.start) as f64)).sum();
        sum / r.len() as f64
    };
    let periods_in_half = (periods / 2.0).floor();
    let part = (periods_in_half * per_period).round() as usize;
    // Both sequences: the phases may be exchanged.
    let size = |r: Range<usize>| phasor(i, r.clone(), omega).norm().hypot(phasor(i, r, -omega).norm());
    let (a, b) = (size(whole.start..whole.start + part), size(whole.end - part..whole.end));
    if (a - b).abs() > 0.05 * (a + b) {
        return None;
    }
    let mean = |r: Range<usize>| speed.map(|w| w[r.clone()].iter().sum::<f64>() / r.len() as f64);
    if let (Some(x), Some(y)) = (mean(first), mean(second))
        && (x - y).abs() > 0.03 * (x.abs() + y.abs())
        && x.abs().max(y.abs()) > 0.02 * omega.abs()
    {
        return None;
    }
    Some(Steady {
        omega,
        u: phasor(u, whole.clone(), omega),
        i: phasor(i, whole.clone(), omega),
        against: [phasor(u, whole.clone(), -omega), phasor(i, whole.clone(), -omega)],
        omega_m: mean(whole.clone()),
        rows: whole,
    })
}

/// How an impedance fits a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpedanceFit {
    /// The slip that fits best.
    pub slip: f64,
    /// |ln(Z/Z_model)| at it: 0.1 is ten percent or six degrees.
    pub off: f64,
    /// |Z|/|Z_model| at it.
    pub ratio: f64,
}

/// The slip at which the motor's impedance is most like `z` at ω rad/s.
pub fn fit_slip(p: &TParameters<f64>, z: Complex<f64>, omega: f64) -> ImpedanceFit {
    let j = Complex::<f64>::i();
    let model = |s: f64| {
        let rotor = p.rotor_resistance_ohm / s + j * omega * p.rotor_leakage_inductance_h;
        let main = j * omega * p.magnetizing_inductance_h;
        p.stator_resistance_ohm + j * omega * p.stator_leakage_inductance_h + main * rotor / (main + rotor)
    };
    let at = |slip: f64| {
        let q = z / model(slip);
        ImpedanceFit { slip, off: Complex::new(q.norm().ln(), q.arg()).norm(), ratio: q.norm() }
    };
    // From a hundred-thousandth of slip to plugging, generating and motoring.
    let slips = (0..240).map(|k| 10f64.powf(-5.0 + k as f64 * 5.3 / 239.0));
    let best = slips.flat_map(|s| [at(s), at(-s)]).min_by(|a, b| a.off.total_cmp(&b.off));
    best.unwrap_or(ImpedanceFit { slip: 1.0, off: f64::INFINITY, ratio: f64::INFINITY })
}
