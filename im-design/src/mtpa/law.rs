//! The laws a certificate can hold: the series of [`super::laws::LogLaw`], or (27) with (29).

use super::laws::{CurrentLaw, SlipLaw};
use crate::exact::Interval;
use serde::{Deserialize, Serialize};

/// Current and slip over torque.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Law {
    /// Exponentials of Chebyshev series in the logarithm of torque over its range.
    Series {
        /// Coefficients of ln I_s (rms A).
        current: Vec<f64>,
        /// Coefficients of ln ω_s (electrical rad/s).
        slip: Vec<f64>,
    },
    /// (27) and (29) of Kwon et al.
    Kwon {
        /// a₁, a₂, a₃ of (27).
        a: [f64; 3],
        /// b₁, b₂ of (27).
        b: [f64; 2],
        /// c₀ … c₄ of (29).
        c: [f64; 5],
    },
}

impl Law {
    /// Rms current and slip for a torque.
    pub fn at(&self, range: [f64; 2], torque_n_m: f64) -> [f64; 2] {
        match self {
            Law::Series { current, slip } => {
                let [low, high] = range.map(f64::ln);
                let x = (2.0 * torque_n_m.ln() - low - high) / (high - low);
                [current, slip].map(|c| super::laws::chebyshev(c, x).exp())
            }
            Law::Kwon { a, b, c } => [CurrentLaw { a: *a, b: *b }.at(torque_n_m), SlipLaw { c: *c }.at(torque_n_m)],
        }
    }

    /// Intervals that contain rms current and slip for every torque of one.
    pub(super) fn enclose(&self, range: [f64; 2], t: Interval) -> [Interval; 2] {
        let p = Interval::point;
        match self {
            Law::Series { current, slip } => {
                let [low, high] = range.map(|x| p(x).ln());
                let x = (p(2.0) * t.ln() - low - high).over(high - low);
                [current, slip].map(|coefficients| {
                    // Clenshaw.
                    let (mut b1, mut b2) = (p(0.0), p(0.0));
                    for c in coefficients.iter().skip(1).rev() {
                        (b1, b2) = (p(2.0) * x * b1 - b2 + p(*c), b1);
                    }
                    (x * b1 - b2 + p(coefficients.first().copied().unwrap_or(0.0))).exp()
                })
            }
            Law::Kwon { a, b, c } => {
                let current = p(a[0]) * t + p(a[1]) * t.power(b[0]) + p(a[2]) * t.power(b[1]);
                [current, c.iter().rev().fold(p(0.0), |sum, c| sum * t + p(*c))]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enclosures_contain_the_laws() {
        let series = Law::Series { current: vec![1.0, 0.7, -0.1, 0.02], slip: vec![0.5, 0.3] };
        let kwon = Law::Kwon { a: CurrentLaw::KWON.a, b: CurrentLaw::KWON.b, c: SlipLaw::KWON.c };
        for law in [series, kwon] {
            for torque in [1.0, 7.3, 100.0, 510.0] {
                let range = [1.0, 510.0];
                for (x, i) in law.at(range, torque).into_iter().zip(law.enclose(range, Interval::point(torque))) {
                    assert!(i.low <= x && x <= i.high && i.high - i.low < 1e-11 * x.abs().max(1.0), "{x} {i:?}");
                }
                let wide = law.enclose(range, Interval::new(0.999 * torque, 1.001 * torque));
                for share in [0.999, 0.9995, 1.0, 1.001] {
                    for (x, i) in law.at(range, share * torque).into_iter().zip(wide) {
                        assert!(i.low <= x && x <= i.high && i.high - i.low < 0.02 * x.abs(), "{x} {i:?}");
                    }
                }
            }
        }
    }
}
