//! Positive definiteness by LDLᵀ: a symmetric matrix is positive definite exactly when every pivot of D is positive.
//!
//! Over the rationals there is no rounding, so the answer is a proof.

use super::Field;
use crate::matrix::Matrix;

/// A pivot of LDLᵀ that is not positive, or an asymmetric entry.
#[derive(Clone, Debug, PartialEq)]
pub enum NotPositive {
    /// The matrix is not symmetric at this entry.
    Asymmetric(usize, usize),
    /// Pivot number (from 0) and its value.
    Pivot(usize, f64),
}

/// Smallest pivot of LDLᵀ, relative to the diagonal entry it came from, when the matrix is positive definite.
///
/// # Errors
/// The first entry or pivot that contradicts it.
pub fn positive_definite<F: Field>(a: &Matrix<F>) -> Result<f64, NotPositive> {
    let n = a.rows();
    for i in 0..n {
        for j in 0..i {
            if a[(i, j)] != a[(j, i)] {
                return Err(NotPositive::Asymmetric(i, j));
            }
        }
    }
    // Right-looking: after step k the trailing block is the Schur complement.
    let mut s = a.clone();
    let mut smallest = f64::INFINITY;
    for k in 0..n {
        let pivot = s[(k, k)].clone();
        if pivot <= F::zero() {
            return Err(NotPositive::Pivot(k, pivot.to_f64()));
        }
        smallest = smallest.min((pivot.clone() / a[(k, k)].clone()).to_f64());
        for i in k + 1..n {
            if s[(i, k)].is_zero() {
                continue;
            }
            let l = s[(i, k)].clone() / pivot.clone();
            for j in k + 1..=i {
                if !s[(j, k)].is_zero() {
                    s[(i, j)] = s[(i, j)].clone() - l.clone() * s[(j, k)].clone();
                }
            }
        }
    }
    Ok(smallest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::{Rational, rational};

    fn matrix(rows: &[&[f64]]) -> Matrix<Rational> {
        Matrix::from_fn(rows.len(), rows.len(), |i, j| rational(rows[i][j]))
    }

    #[test]
    fn decides_where_floats_cannot() {
        // det = ε² with ε = 2⁻⁴⁰: positive definite, although 1 + ε² rounds to 1.
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
    fn refuses_asymmetry() {
        let a = matrix(&[&[2.0, 1.0], &[1.0 + f64::EPSILON, 2.0]]);
        assert_eq!(positive_definite(&a), Err(NotPositive::Asymmetric(1, 0)));
    }
}
