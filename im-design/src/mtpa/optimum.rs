//! Least current for a torque.

use super::air_gap::AirGap;
use crate::error::{DesignError, positive};

/// A point of the maximum-torque-per-ampere curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optimum {
    /// Torque, N m.
    pub torque_n_m: f64,
    /// Rms stator current, A.
    pub current_rms_a: f64,
    /// Slip frequency, electrical rad/s.
    pub slip_rad_s: f64,
    /// Peak air-gap flux linkage, Wb.
    pub flux_vs: f64,
    /// Where: in the circuit's own coordinates ([`AirGap::coordinates_of`]).
    pub at: [f64; 2],
}

/// Slip frequencies searched, electrical rad/s.
const SLIP: [f64; 2] = [0.02, 500.0];
/// Largest peak air-gap flux linkage searched, Wb.
const FLUX_MAX: f64 = 50.0;

/// Currents searched, A rms.
const CURRENT_MAX: f64 = 1e7;

/// The level at a current and slip, (26), and its torque: those of largest torque when saturation allows several.
fn level_at(circuit: &impl AirGap, current: f64, slip: f64) -> Option<(f64, f64)> {
    // In logarithms, as the current grows with a power of the level.
    let excess = |log_level: f64| (circuit.operate(log_level.exp(), slip).0 / current).ln();
    let [low, high] = circuit.levels().map(f64::ln);
    let steps = 48;
    let at = |k: u32| low + (high - low) * f64::from(k) / f64::from(steps);
    let mut best: Option<(f64, f64)> = None;
    let mut left = excess(low);
    for k in 0..steps {
        let right = excess(at(k + 1));
        if left <= 0.0 && right > 0.0 {
            let level = zero(at(k), at(k + 1), excess).exp();
            let torque = circuit.operate(level, slip).1;
            if circuit.flux_vs(level, slip) <= FLUX_MAX && best.is_none_or(|(_, t)| torque > t) {
                best = Some((level, torque));
            }
        }
        left = right;
    }
    best
}

/// Zero, to 10⁻¹⁴, of a function that is negative at one end and positive at the other, by regula falsi (Illinois).
fn zero(mut a: f64, mut b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut fa, mut fb) = (f(a), f(b));
    let mut x = b;
    for _ in 0..100 {
        if fb == fa || (b - a).abs() < 1e-14 * b.abs().max(1.0) {
            break;
        }
        x = (a * fb - b * fa) / (fb - fa);
        let fx = f(x);
        if fx * fb < 0.0 {
            (a, fa) = (b, fb);
        } else {
            fa *= 0.5;
        }
        (b, fb) = (x, fx);
        if fx.abs() < 1e-14 {
            break;
        }
    }
    x
}

/// The slip of largest torque at an rms current.
///
/// # Errors
/// [`DesignError::Infeasible`] when the circuit carries no such current at any flux.
pub fn for_current(circuit: &impl AirGap, current_rms_a: f64) -> Result<Optimum, DesignError> {
    positive("current_rms_a", current_rms_a)?;
    let torque = |log_slip: f64| level_at(circuit, current_rms_a, log_slip.exp()).map_or(f64::NEG_INFINITY, |(_, t)| t);
    let (low, high) = (SLIP[0].ln(), SLIP[1].ln());
    let steps = 40;
    let at = |k: i32| low + (high - low) * f64::from(k) / f64::from(steps);
    let scan = (0..=steps).map(|k| (k, torque(at(k))));
    let best = scan.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(k, _)| k);
    // Golden section around the best of the scan.
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut a, mut b) = (at((best - 1).max(0)), at((best + 1).min(steps)));
    let (mut c, mut d) = (b - golden * (b - a), a + golden * (b - a));
    let (mut fc, mut fd) = (torque(c), torque(d));
    while b - a > 1e-7 {
        if fc > fd {
            (b, d, fd) = (d, c, fc);
            c = b - golden * (b - a);
            fc = torque(c);
        } else {
            (a, c, fc) = (c, d, fd);
            d = a + golden * (b - a);
            fd = torque(d);
        }
    }
    let slip_rad_s = (0.5 * (a + b)).exp();
    let (level, torque_n_m) = level_at(circuit, current_rms_a, slip_rad_s).ok_or_else(|| DesignError::Infeasible {
        constraint: format!("a current of {current_rms_a} A in this circuit"),
        feasible: "a smaller current".into(),
    })?;
    let (flux_vs, at) = (circuit.flux_vs(level, slip_rad_s), circuit.coordinates_of(level, slip_rad_s));
    Ok(Optimum { torque_n_m, current_rms_a, slip_rad_s, flux_vs, at })
}

/// A torque that no current gives: `low` is carried by the circuit, `high` is not, or is the largest looked at.
fn out_of_reach(torque_n_m: f64, mut low: f64, mut high: f64, torque_at: impl Fn(f64) -> Option<f64>) -> DesignError {
    for _ in 0..20 {
        let middle = (low * high).sqrt();
        if torque_at(middle).is_some() { low = middle } else { high = middle }
    }
    let most = torque_at(low).unwrap_or(0.0);
    DesignError::Infeasible {
        constraint: format!(
            "{torque_n_m} N m from this circuit, with air-gap fluxes to {FLUX_MAX} Wb and currents to {CURRENT_MAX:e} A"
        ),
        // The search is coarse where the flux ends.
        feasible: format!("torques up to {:.4} N m", 0.9 * most),
    }
}

/// The least current for a torque.
///
/// # Errors
/// [`DesignError::Infeasible`] with the largest torque the circuit gives when this one is out of reach.
pub fn for_torque(circuit: &impl AirGap, torque_n_m: f64) -> Result<Optimum, DesignError> {
    positive("torque_n_m", torque_n_m)?;
    // Torque goes about with the square of the current.
    let guess = (torque_n_m / for_current(circuit, 1.0)?.torque_n_m).sqrt();
    let torque_at = |current: f64| for_current(circuit, current).ok().map(|o| o.torque_n_m);
    let (mut low, mut high) = (guess / 1.3, guess * 1.3);
    while torque_at(low).is_none_or(|torque| torque > torque_n_m) {
        (low, high) = (low / 2.0, low);
    }
    loop {
        match torque_at(high) {
            Some(torque) if torque >= torque_n_m => break,
            Some(_) if high < CURRENT_MAX => (low, high) = (high, high * 2.0),
            _ => return Err(out_of_reach(torque_n_m, low, high, torque_at)),
        }
    }
    // Torque over current is smooth and close to a power: regula falsi (Illinois) on logarithms converges in a few steps.
    let gap = |log_current: f64| -> Result<f64, DesignError> {
        let current = log_current.exp();
        let torque = torque_at(current).ok_or_else(|| out_of_reach(torque_n_m, low, current, torque_at))?;
        Ok((torque / torque_n_m).ln())
    };
    let (mut a, mut b) = (low.ln(), high.ln());
    let (mut fa, mut fb) = (gap(a)?, gap(b)?);
    let mut x = b;
    for _ in 0..60 {
        x = (a * fb - b * fa) / (fb - fa);
        let fx = gap(x)?;
        if fx.abs() < 1e-11 {
            break;
        }
        if fx * fb < 0.0 {
            (a, fa) = (b, fb);
        } else {
            fa *= 0.5;
        }
        (b, fb) = (x, fx);
    }
    for_current(circuit, x.exp())
}

#[cfg(test)]
mod tests {
    use super::super::t_circuit::TCircuit;
    use super::*;

    /// Linear T circuit: at constant current torque peaks at ω_s = R_r/L_r, with T = (3/2)n_p (L_m²/L_r) I_s².
    #[test]
    fn linear_machine_peaks_at_the_rotor_corner() {
        let (l_m, l_lr, r_r) = (0.0915, 0.0042, 0.159);
        let circuit = TCircuit::linear(r_r, l_lr, l_m, 2);
        let o = for_current(&circuit, 12.0).unwrap();
        assert!((o.slip_rad_s * (l_m + l_lr) / r_r - 1.0).abs() < 1e-5);
        let torque = 1.5 * 2.0 * l_m * l_m / (l_m + l_lr) * 144.0;
        assert!((o.torque_n_m / torque - 1.0).abs() < 1e-9);
        let back = for_torque(&circuit, torque).unwrap();
        assert!((back.current_rms_a / 12.0 - 1.0).abs() < 1e-9);
    }
}
