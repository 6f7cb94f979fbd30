//! Positive definiteness by LDLᵀ: a symmetric matrix is positive definite exactly when every pivot of D is positive.
//!
//! Over the rationals there is no rounding, so the answer is a proof. The elimination is fraction-free (Bareiss): over
//! a common denominator all entries are integers, entry by entry a minor of the matrix, and pivot k of D is the ratio of
//! leading minors k + 1 and k. Every division is exact and no common factors need to be sought.
//!
//! Where the matrix is the real form of a Hermitian one, 2 × 2 blocks [x, −y; y, x], as those of space vectors are, the elimination goes over
//! complex integers of half the order: each of its pivots, real, stands for two equal ones.

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
    let pair = |i: usize, j: usize| a[(i, j)] == a[(i + 1, j + 1)] && a[(i, j + 1)] == -&a[(i + 1, j)];
    let space_vectors = n.is_multiple_of(2) && (0..n).step_by(2).all(|i| (0..=i).step_by(2).all(|j| pair(i, j)));
    let step = if space_vectors { 2 } else { 1 };
    let entry = |i: usize, j: usize| {
        let im = if space_vectors { integer(i + 1, j) } else { BigInt::zero() };
        Entry { re: integer(i, j), im }
    };
    let indices: Vec<usize> = (0..n).step_by(step).collect();
    let s = indices.iter().map(|&i| (0..=i).step_by(step).map(|j| entry(i, j)).collect()).collect();
    eliminate(s).map_err(|(k, minor, previous)| NotPositive::Pivot(k * step, ratio(minor, previous * &common)))
}

/// A complex integer.
struct Entry {
    re: BigInt,
    im: BigInt,
}

impl Entry {
    /// (self · minor − x · conj y)/previous, which has no remainder.
    fn reduced(&self, minor: &BigInt, x: &Entry, y: &Entry, previous: &BigInt) -> Entry {
        let times = |a: &BigInt, b: &BigInt| if a.is_zero() || b.is_zero() { BigInt::zero() } else { a * b };
        let re = times(&self.re, minor) - times(&x.re, &y.re) - times(&x.im, &y.im);
        let im = times(&self.im, minor) - times(&x.im, &y.re) + times(&x.re, &y.im);
        Entry { re: re / previous, im: im / previous }
    }
}

/// Elimination of a Hermitian matrix given by its lower triangle: the smallest pivot over its diagonal entry.
///
/// # Errors
/// The first pivot that is not positive, times the scale of the entries: its index, and the two minors it is the ratio of.
fn eliminate(mut s: Vec<Vec<Entry>>) -> Result<f64, (usize, BigInt, BigInt)> {
    let diagonal: Vec<BigInt> = s.iter().enumerate().map(|(k, row)| row[k].re.clone()).collect();
    let mut previous = BigInt::one();
    let mut smallest = f64::INFINITY;
    for k in 0..s.len() {
        let minor = s[k][k].re.clone();
        if !minor.is_positive() {
            return Err((k, minor, previous));
        }
        smallest = smallest.min(ratio(minor.clone(), &previous * &diagonal[k]));
        for i in k + 1..s.len() {
            for j in k + 1..=i {
                s[i][j] = s[i][j].reduced(&minor, &s[i][k], &s[j][k], &previous);
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

    /// The real form of a Hermitian matrix and a matrix that differs from it by a hair take different ways to one answer.
    #[test]
    fn space_vectors_are_decided_as_their_real_form_is() {
        let h: [[(f64, f64); 3]; 3] =
            [[(4.0, 0.0), (1.0, 2.0), (0.5, -1.0)], [(0.0, 0.0), (3.0, 0.0), (0.25, 0.5)], [(0.0, 0.0), (0.0, 0.0), (2.0, 0.0)]];
        let z = |i: usize, j: usize| if i <= j { h[i][j] } else { (h[j][i].0, -h[j][i].1) };
        let real = |shift: f64, hair: f64| {
            Matrix::from_fn(6, 6, |i, j| {
                let (x, y) = z(i / 2, j / 2);
                let entry = match (i % 2, j % 2) {
                    (0, 1) => -y,
                    (1, 0) => y,
                    _ => x,
                };
                let hair = if i == j && i == 5 { hair } else { 0.0 };
                rational(if i == j { entry - shift + hair } else { entry })
            })
        };
        for shift in [0.0, 0.5, 1.0, 1.2, 2.0] {
            let (fast, plain) = (positive_definite(&real(shift, 0.0)), positive_definite(&real(shift, 1e-13)));
            match (&fast, &plain) {
                (Ok(a), Ok(b)) => assert!((a - b).abs() < 1e-12, "{a} {b}"),
                (Err(NotPositive::Pivot(i, a)), Err(NotPositive::Pivot(j, b))) => {
                    assert!(i == j && (a - b).abs() < 1e-12, "{i} {j} {a} {b}")
                }
                _ => panic!("{shift}: {fast:?} {plain:?}"),
            }
        }
    }

    #[test]
    fn refuses_asymmetry() {
        let a = matrix(&[&[2.0, 1.0], &[1.0 + f64::EPSILON, 2.0]]);
        assert_eq!(positive_definite(&a), Err(NotPositive::Asymmetric(1, 0)));
    }
}
