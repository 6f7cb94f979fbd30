//! Tails of χ², and angles between signals and between spans of signals.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// −log₁₀ P(χ²_k > x), also far beyond where the tail underflows.
pub fn log_p(x: f64, freedom: usize) -> f64 {
    let k = freedom as f64;
    let tail = ChiSquared::new(k).map_or(1.0, |d| d.sf(x));
    if tail > 1e-250 {
        return -tail.log10();
    }
    // Leading term of the tail: (x/2)^{k/2−1} e^{−x/2}/Γ(k/2).
    let half = 0.5 * x;
    (half - (0.5 * k - 1.0) * half.ln() + statrs::function::gamma::ln_gamma(0.5 * k)) / std::f64::consts::LN_10
}

/// The value that χ²_k exceeds with probability `p`.
pub fn threshold(freedom: usize, p: f64) -> f64 {
    ChiSquared::new(freedom as f64).map_or(f64::INFINITY, |d| d.inverse_cdf(1.0 - p))
}

/// Modified Gram-Schmidt with normalization; columns that vanish are dropped.
pub fn orthonormal(columns: Vec<Vec<f64>>) -> Vec<DVector<f64>> {
    orthonormal_with_coordinates(columns).0
}

/// The same, and the coordinates of every column in the basis.
pub fn orthonormal_with_coordinates(columns: Vec<Vec<f64>>) -> (Vec<DVector<f64>>, Vec<Vec<f64>>) {
    let mut kept: Vec<DVector<f64>> = Vec::new();
    let mut coordinates: Vec<Vec<f64>> = Vec::new();
    for c in columns {
        let mut v = DVector::from_vec(c);
        let before = v.norm();
        let mut of_column = vec![0.0; kept.len()];
        // Twice is enough for orthogonality to rounding.
        for _ in 0..2 {
            for (q, x) in kept.iter().zip(&mut of_column) {
                let d = q.dot(&v);
                v.axpy(-d, q, 1.0);
                *x += d;
            }
        }
        let norm = v.norm();
        if norm > 1e-9 * before && norm > 0.0 {
            v /= norm;
            kept.push(v);
            of_column.push(norm);
        }
        coordinates.push(of_column);
    }
    coordinates.iter_mut().for_each(|c| c.resize(kept.len(), 0.0));
    (kept, coordinates)
}

/// The orthogonal complement of some columns of so many rows.
pub fn complement(mut columns: Vec<Vec<f64>>, rows: usize) -> Vec<DVector<f64>> {
    let spanned = orthonormal(columns.clone()).len();
    columns.extend((0..rows).map(|k| (0..rows).map(|i| if i == k { 1.0 } else { 0.0 }).collect()));
    orthonormal(columns).split_off(spanned)
}

/// Cosine of the angle between two signatures, without sign.
pub fn cosine(a: &[f64], b: &[f64]) -> f64 {
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(p, q)| p * q).sum::<f64>();
    let both = (dot(a, a) * dot(b, b)).sqrt();
    if a.len() == b.len() && both > 0.0 { (dot(a, b) / both).abs() } else { 0.0 }
}

/// Largest cosine of the principal angles between two spans of columns.
pub fn closest_of(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let (a, b) = (orthonormal(a.to_vec()), orthonormal(b.to_vec()));
    let between = DMatrix::from_fn(a.len(), b.len(), |i, j| a[i].dot(&b[j]));
    if between.is_empty() { 0.0 } else { between.singular_values().max() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn effects_are_as_close_as_the_nearest_things_that_they_can_do() {
        let (x, y, z) = (vec![1.0, 0.0, 0.0], vec![0.0, 2.0, 0.0], vec![0.0, 0.0, 3.0]);
        let between = vec![0.0, 1.0, 1.0];
        let near = |a: &[&Vec<f64>], b: &[&Vec<f64>]| {
            let owned = |v: &[&Vec<f64>]| v.iter().map(|v| (*v).clone()).collect::<Vec<_>>();
            closest_of(&owned(a), &owned(b))
        };
        assert!(near(&[&x], &[&y]) < 1e-12 && (near(&[&x, &y], &[&y, &z]) - 1.0).abs() < 1e-12);
        assert!((near(&[&x, &y], &[&between]) - 0.5f64.sqrt()).abs() < 1e-12);
        assert_eq!((near(&[], &[&x]), cosine(&x, &[0.0; 3]), cosine(&y, &[0.0, -1.0, 0.0])), (0.0, 0.0, 1.0));
    }

    proptest! {
        /// Columns are what their coordinates say, and with the complement of some of them nothing is left of any vector.
        #[test]
        fn columns_have_coordinates_and_a_complement(
            columns in prop::collection::vec(prop::collection::vec(-3.0..3.0f64, 6), 1..5),
            twice in any::<bool>(),
        ) {
            let mut columns = columns;
            if twice {
                columns.push(columns[0].iter().map(|x| 2.0 * x).collect());
            }
            let (basis, coordinates) = orthonormal_with_coordinates(columns.clone());
            for (c, x) in columns.iter().zip(&coordinates) {
                let back = basis.iter().zip(x).fold(DVector::zeros(6), |sum, (q, x)| sum + q * *x);
                prop_assert!((back - DVector::from_vec(c.clone())).norm() < 1e-9);
            }
            let rest = complement(columns.clone(), 6);
            prop_assert_eq!(rest.len() + basis.len(), 6);
            prop_assert!(rest.iter().all(|c| columns.iter().all(|x| c.dot(&DVector::from_vec(x.clone())).abs() < 1e-8)));
        }
    }
}
