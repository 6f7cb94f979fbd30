//! Positive definiteness by LDLᵀ: a symmetric matrix is positive definite exactly when every pivot of D is positive.
//!
//! Over the rationals there is no rounding, so the answer is a proof. The elimination is fraction-free (Bareiss): over
//! a common denominator all entries are integers, entry by entry a minor of the matrix, and pivot k of D is the ratio of
//! leading minors k + 1 and k. Every division is exact and no common factors need to be sought.

use super::Rational;
use crate::matrix::Matrix;
use num_bigint::BigInt;
use num_integer::Integer;
use num_traits::{One, Signed, ToPrimitive, Zero};

/// A pivot of LDLᵀ that is not positive, or an asymmetric entry.
#[derive(Clone, Debug, PartialEq)]
pub enum NotPositive {
    /// The matrix is not symmetric at this entry.
    Asymmetric(usize, usize),
    /// Pivot number (from 0) and its value.
    Pivot(usize, f64),
}

/// n/d to the nearest float or so.
fn ratio(n: BigInt, d: BigInt) -> f64 {
    Rational::new_raw(n, d).to_f64().unwrap_or(f64::NAN)
}

/// Smallest pivot of LDLᵀ, relative to the diagonal entry it came from, when the matrix is positive definite.
///
/// # Errors
/// The first entry or pivot that contradicts it.
pub fn positive_definite(a: &Matrix<Rational>) -> Result<f64, NotPositive> {
    let n = a.rows();
    let mut common = BigInt::one();
    for i in 0..n {
        for j in 0..n {
            if a[(i, j)] != a[(j, i)] {
                return Err(NotPositive::Asymmetric(i.max(j), i.min(j)));
            }
            common = common.lcm(a[(i, j)].denom());
        }
    }
    let integer = |i: usize, j: usize| a[(i, j)].numer() * (&common / a[(i, j)].denom());
    let mut s: Vec<Vec<BigInt>> = (0..n).map(|i| (0..=i).map(|j| integer(i, j)).collect()).collect();
    let mut previous = BigInt::one();
    let mut smallest = f64::INFINITY;
    for k in 0..n {
        let minor = s[k][k].clone();
        if !minor.is_positive() {
            return Err(NotPositive::Pivot(k, ratio(minor, &previous * &common)));
        }
        smallest = smallest.min(ratio(minor.clone(), &previous * integer(k, k)));
        for i in k + 1..n {
            for j in k + 1..=i {
                let (x, y) = (&s[i][k], &s[j][k]);
                let cross = if x.is_zero() || y.is_zero() { BigInt::zero() } else { x * y };
                s[i][j] = (&s[i][j] * &minor - cross) / &previous;
            }
        }
        previous = minor;
    }
    Ok(smallest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::rational;

    fn matrix(rows: &[&[f64]]) -> Matrix<Rational> {
        Matrix::from_fn(rows.len(), rows.len(), |i, j| rational(rows[i][j]))
    }

    #[test]
    fn decides_where_floats_cannot() {
        // det = ±ε² with ε = 2⁻⁴⁰, although 1 ± ε² rounds to 1.
        let e = 2f64.powi(-40);
        let one = rational(1.0);
        let mut a = matrix(&[&[1.0, 1.0], &[1.0, 1.0]]);
        a[(1, 1)] = one.clone() + rational(e) * rational(e);
        assert!(positive_definite(&a).is_ok());
        a[(1, 1)] = one.clone() - rational(e) * rational(e);
        assert!(matches!(positive_definite(&a), Err(NotPositive::Pivot(1, p)) if p < 0.0));
        a[(1, 1)] = one;
        assert_eq!(positive_definite(&a), Err(NotPositive::Pivot(1, 0.0)));
    }

    #[test]
    fn pivots_are_those_of_elimination_by_hand() {
        // Pivots 4, 3 − 1/4, …: the relative ones 1, 11/12, then (2 − 0.25 − …)/2.
        let a = matrix(&[&[4.0, 1.0, 0.5], &[1.0, 3.0, 0.25], &[0.5, 0.25, 2.0]]);
        let (p1, l) = (3.0 - 0.25, 0.25 - 0.125);
        let p2 = 2.0 - 0.0625 - l * l / p1;
        assert!((positive_definite(&a).unwrap() - (p1 / 3.0f64).min(p2 / 2.0)).abs() < 1e-15);
        let fifth = Matrix::from_fn(2, 2, |i, j| rational(if i == j { 1.0 } else { 0.5 }) / rational(5.0));
        assert!((positive_definite(&fifth).unwrap() - 0.75).abs() < 1e-15);
    }

    #[test]
    fn refuses_asymmetry() {
        let a = matrix(&[&[2.0, 1.0], &[1.0 + f64::EPSILON, 2.0]]);
        assert_eq!(positive_definite(&a), Err(NotPositive::Asymmetric(1, 0)));
    }
}
