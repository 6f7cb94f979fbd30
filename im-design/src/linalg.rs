//! Dense numerics: eigenvalues, norms, linear and Lyapunov equations.

use crate::matrix::Matrix;
use im_lapack::dense::{self, Mat};

fn mat(a: &Matrix<f64>) -> Mat<f64> {
    Mat::from_fn(a.rows(), a.cols(), |i, j| a[(i, j)])
}

/// Eigenvalues (real part, imaginary part) of a square matrix; empty when they do not converge.
pub fn eigenvalues(a: &Matrix<f64>) -> Vec<(f64, f64)> {
    dense::eigenvalues(&mat(a))
}

/// Largest real part of the eigenvalues; NaN when they do not converge.
pub fn spectral_abscissa(a: &Matrix<f64>) -> f64 {
    eigenvalues(a).iter().map(|z| z.0).reduce(f64::max).unwrap_or(f64::NAN)
}

/// Largest modulus of the eigenvalues; NaN when they do not converge.
pub fn spectral_radius(a: &Matrix<f64>) -> f64 {
    eigenvalues(a).iter().map(|z| z.0.hypot(z.1)).reduce(f64::max).unwrap_or(f64::NAN)
}

/// Eigenvalues of a symmetric matrix in ascending order (its lower triangle is read).
pub fn symmetric_eigenvalues(a: &Matrix<f64>) -> Vec<f64> {
    dense::symmetric_eigenvalues(&mat(a)).unwrap_or_else(|| vec![f64::NAN; a.rows()])
}

/// Induced 2-norm.
pub fn norm2(a: &Matrix<f64>) -> f64 {
    dense::norm2(&mat(a)).unwrap_or(f64::NAN)
}

/// Solution of A x = b, both square systems of any right-hand width.
pub fn solve(a: &Matrix<f64>, b: &Matrix<f64>) -> Matrix<f64> {
    let x = dense::solve(&mat(a), &mat(b));
    Matrix::from_fn(b.rows(), b.cols(), |i, j| x[(i, j)])
}

/// P of AᵀP + PA = −Q, by Kronecker products; None when A and −Aᵀ share an eigenvalue.
pub fn lyapunov(a: &Matrix<f64>, q: &Matrix<f64>) -> Option<Matrix<f64>> {
    let n = a.rows();
    let mut k = Matrix::zeros(n * n, n * n);
    for i in 0..n {
        for j in 0..n {
            for l in 0..n {
                k[(i * n + j, l * n + j)] += a[(l, i)];
                k[(i * n + j, i * n + l)] += a[(l, j)];
            }
        }
    }
    let rhs = Matrix::from_fn(n * n, 1, |r, _| -q[(r / n, r % n)]);
    let x = solve(&k, &rhs);
    x.is_finite().then(|| Matrix::from_fn(n, n, |i, j| x[(i * n + j, 0)]).symmetrized())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lyapunov_equation_is_satisfied() {
        let a = Matrix::from_rows(&[[-1.0, 2.0, 0.0], [0.5, -3.0, 1.0], [0.0, -4.0, -0.2]]);
        let q = Matrix::identity(3);
        let p = lyapunov(&a, &q).unwrap();
        assert!((&(&(&a.t() * &p) + &(&p * &a)) + &q).norm() < 1e-12);
        assert!(symmetric_eigenvalues(&p)[0] > 0.0);
    }

    #[test]
    fn eigenvalues_of_a_rotation() {
        let a = Matrix::from_rows(&[[-0.5, -3.0], [3.0, -0.5]]);
        assert!((spectral_abscissa(&a) + 0.5).abs() < 1e-12);
        assert!((spectral_radius(&a) - 9.25f64.sqrt()).abs() < 1e-12);
        assert!((norm2(&a) - 9.25f64.sqrt()).abs() < 1e-12);
    }
}
