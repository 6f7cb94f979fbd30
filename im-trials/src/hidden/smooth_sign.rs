//! Sign functions with a smooth passage through zero.

use super::chance::Chance;

/// How a sign passes through zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SmoothSign {
    /// (2/π) atan(πx/2).
    Arctangent,
    /// x / √(1 + x²).
    Algebraic,
    /// sgn(x) (1 − exp(−|x|)).
    Exponential,
}

impl SmoothSign {
    /// A random one.
    pub fn random(chance: &mut Chance) -> Self {
        [Self::Arctangent, Self::Algebraic, Self::Exponential][chance.one_of(3)]
    }

    /// The sign of `x`, smooth over about one unit.
    pub fn of(self, x: f64) -> f64 {
        use std::f64::consts::FRAC_PI_2;
        match self {
            Self::Arctangent => (FRAC_PI_2 * x).atan() / FRAC_PI_2,
            Self::Algebraic => x / (1.0 + x * x).sqrt(),
            Self::Exponential => -(-x.abs()).exp_m1() * if x < 0.0 { -1.0 } else { 1.0 },
        }
    }

    /// Name for the record of the truth.
    pub fn name(self) -> &'static str {
        match self {
            Self::Arctangent => "arctangent",
            Self::Algebraic => "algebraic",
            Self::Exponential => "exponential",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_with_unit_slope_and_unit_limits() {
        for sign in [SmoothSign::Arctangent, SmoothSign::Algebraic, SmoothSign::Exponential] {
            assert_eq!(sign.of(0.0), 0.0);
            assert!((sign.of(1e-6) / 1e-6 - 1.0).abs() < 1e-5, "{sign:?}");
            assert_eq!(sign.of(-0.7), -sign.of(0.7));
            assert!((sign.of(1e4) - 1.0).abs() < 1e-4);
        }
    }
}
