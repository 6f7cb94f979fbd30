//! What gain design asks of faer besides the solver, in double precision: here, so that one crate compiles it, once.

pub use faer::Mat;
use faer::Side;
use faer::linalg::solvers::Solve;

/// Eigenvalues (real part, imaginary part) of a square matrix; empty when they do not converge.
pub fn eigenvalues(a: &Mat<f64>) -> Vec<(f64, f64)> {
    a.eigenvalues().map(|v| v.iter().map(|z| (z.re, z.im)).collect()).unwrap_or_default()
}

/// Eigenvalues of a symmetric matrix in ascending order (its lower triangle is read); none when they do not converge.
pub fn symmetric_eigenvalues(a: &Mat<f64>) -> Option<Vec<f64>> {
    a.self_adjoint_eigenvalues(Side::Lower).ok()
}

/// Largest singular value, zero of an empty matrix; none when they do not converge.
pub fn norm2(a: &Mat<f64>) -> Option<f64> {
    a.singular_values().ok().map(|s| s.first().copied().unwrap_or(0.0))
}

/// Solution of A X = B.
pub fn solve(a: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    a.partial_piv_lu().solve(b)
}
