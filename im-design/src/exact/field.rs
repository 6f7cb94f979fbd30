//! Equations of the machine are written once, over a field that is either `f64` or the rationals.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Num, One, Zero};
use std::cmp::Ordering;
use std::ops::Neg;

/// Exact rational numbers.
pub type Rational = BigRational;

/// A number the equations work with: `f64` to design, [`Rational`] to prove.
pub trait Field: Clone + Num + Neg<Output = Self> + PartialOrd + std::fmt::Debug {
    /// The value of a float, exactly. A value that is not finite becomes zero (callers validate before).
    fn from_f64(x: f64) -> Self;
    /// Nearest float, to show.
    fn to_f64(&self) -> f64;
    /// Sum of products, the inner loop of every matrix product.
    fn dot<'a>(pairs: impl Iterator<Item = (&'a Self, &'a Self)>) -> Self
    where
        Self: 'a,
    {
        let mut sum = Self::zero();
        for (a, b) in pairs {
            if !a.is_zero() && !b.is_zero() {
                sum = sum + a.clone() * b.clone();
            }
        }
        sum
    }
}

impl Field for f64 {
    fn from_f64(x: f64) -> Self {
        x
    }
    fn to_f64(&self) -> f64 {
        *self
    }
}

impl Field for Rational {
    fn from_f64(x: f64) -> Self {
        BigRational::from_float(x).unwrap_or_else(Rational::zero)
    }
    fn to_f64(&self) -> f64 {
        num_traits::ToPrimitive::to_f64(self).unwrap_or(f64::NAN)
    }
    /// Common factors are sought once, at the end; powers of two, which floats bring, are kept apart.
    fn dot<'a>(pairs: impl Iterator<Item = (&'a Self, &'a Self)>) -> Self {
        // numerator / (odd · 2^shift)
        let (mut numerator, mut odd, mut shift) = (BigInt::zero(), BigInt::one(), 0u64);
        for (a, b) in pairs.filter(|(a, b)| !a.is_zero() && !b.is_zero()) {
            let denominator = a.denom() * b.denom();
            let twos = denominator.trailing_zeros().unwrap_or(0);
            let rest = denominator >> twos;
            let mut term = a.numer() * b.numer();
            if rest != odd {
                term *= &odd;
                numerator *= &rest;
                odd *= rest;
            }
            match twos.cmp(&shift) {
                Ordering::Less => term <<= shift - twos,
                Ordering::Greater => {
                    numerator <<= twos - shift;
                    shift = twos;
                }
                Ordering::Equal => {}
            }
            numerator += term;
        }
        BigRational::new(numerator, odd << shift)
    }
}

/// The rational number a float stands for.
pub fn rational(x: f64) -> Rational {
    Field::from_f64(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_become_rationals_without_rounding() {
        assert_eq!(rational(0.1).to_string(), "3602879701896397/36028797018963968");
        assert_eq!(rational(-2.5e-300).to_f64(), -2.5e-300);
    }

    #[test]
    fn sums_of_products_are_exact() {
        let third = |x: f64| rational(x) / rational(3.0);
        let a = [third(1.0), rational(0.1), third(7.0), rational(0.0), rational(-1e-20)];
        let b = [rational(0.7), third(0.3), third(1.0), rational(5.0), rational(1e30)];
        let plain = a.iter().zip(&b).fold(rational(0.0), |sum, (x, y)| sum + x * y);
        assert_eq!(Rational::dot(a.iter().zip(&b)), plain);
    }
}
