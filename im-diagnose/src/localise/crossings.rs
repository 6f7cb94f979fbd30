//! Errors around the zero crossings of the phase currents.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use serde::Serialize;

use super::{Signals, say};

/// The error of a phase current against the angle of that current: folded so that every crossing looks like a rising one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Crossings {
    /// Angle from the zero crossing, degrees; mean error there (turned to a rising crossing), A; root mean square error, A.
    pub bins: Vec<[f64; 3]>,
    /// Root mean square error within 15° of a crossing, A.
    pub near: f64,
    /// Root mean square error farther than 45° from one, A.
    pub far: f64,
    /// The noise level, A.
    pub noise: f64,
    /// One sentence.
    pub conclusion: String,
    /// How telling.
    pub strength: f64,
}

const BINS: usize = 24;

pub(super) fn crossings(s: &Signals) -> Option<Crossings> {
    let peak = s.rows().map(|r| r.current.norm()).fold(0.0, f64::max);
    let mut sums = [[0.0; 3]; BINS];
    let (mut near, mut far) = ([0.0; 2], [0.0; 2]);
    for r in s.rows() {
        let Some(e) = r.current_error else { continue };
        // Where there is hardly a current its angle means nothing.
        if r.current.norm() < 0.05 * peak.max(20.0 * s.current_noise_a) {
            continue;
        }
        for phase in 0..3 {
            let axis = TAU * f64::from(phase) / 3.0;
            let (sin, cos) = axis.sin_cos();
            let error = e.re * cos + e.im * sin;
            // i_x = |i| sin(ζ): ζ = 0 at a rising crossing.
            let mut angle = (r.current.arg() - axis + FRAC_PI_2).rem_euclid(TAU);
            let mut sign = 1.0;
            if (FRAC_PI_2..3.0 * FRAC_PI_2).contains(&angle) {
                angle -= PI;
                sign = -1.0;
            } else if angle >= 3.0 * FRAC_PI_2 {
                angle -= TAU;
            }
            let k = (((angle + FRAC_PI_2) / PI * BINS as f64) as usize).min(BINS - 1);
            sums[k][0] += 1.0;
            sums[k][1] += sign * error;
            sums[k][2] += error * error;
            let degrees = angle.abs().to_degrees();
            let side = if degrees < 15.0 {
                Some(&mut near)
            } else if degrees > 45.0 {
                Some(&mut far)
            } else {
                None
            };
            if let Some(side) = side {
                side[0] += 1.0;
                side[1] += error * error;
            }
        }
    }
    if sums.iter().any(|b| b[0] < 10.0) || near[0] < 30.0 || far[0] < 30.0 {
        return None;
    }
    let rms = |x: [f64; 2]| (x[1] / x[0]).sqrt();
    let (near, far) = (rms(near), rms(far));
    let bins = sums
        .iter()
        .enumerate()
        .map(|(k, b)| [(k as f64 + 0.5) / BINS as f64 * 180.0 - 90.0, b[1] / b[0], (b[2] / b[0]).sqrt()])
        .collect();
    let noise = s.current_noise_a;
    let ratio = near / far;
    let conclusion = if near.max(far) < 1.15 * noise {
        format!("around the zero crossings of the phase currents the error is that of the noise ({} A)", say(noise))
    } else if ratio > 1.25 {
        format!(
            "the error of a phase current is {} times as large within 15° of its zero crossing ({} A) as away from it ({} A)",
            say(ratio),
            say(near),
            say(far)
        )
    } else if ratio < 0.8 {
        format!(
            "the error of a phase current is larger near its peak ({} A) than at its zero crossing ({} A)",
            say(far),
            say(near)
        )
    } else {
        format!(
            "the error of a phase current is about as large near its zero crossing ({} A) as away from it ({} A)",
            say(near),
            say(far)
        )
    };
    let strength = if near > 1.15 * noise && ratio > 1.25 { 1.5 * ratio.ln() } else { 0.0 };
    Some(Crossings { bins, near, far, noise, conclusion, strength })
}
