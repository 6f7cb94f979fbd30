//! The twelve routines over matrix views. Matrices are column-major views with any stride; a triangle that BLAS says is
//! not referenced is neither read nor written.
//!
//! Single precision is computed in double: the solver links its symbols and nobody here calls them, so that faer need not be compiled twice.

use core::ops::{Mul, Sub};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};

/// Scalars of both precisions.
pub trait Real: Copy + PartialOrd + Mul<Output = Self> + Sub<Output = Self> {
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// In double precision.
    fn double(self) -> f64;
    /// From double precision.
    fn from_double(x: f64) -> Self;
    /// C ← C + α A B.
    fn add_product(c: MatMut<'_, Self>, alpha: Self, a: MatRef<'_, Self>, b: MatRef<'_, Self>);
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    fn double(self) -> f64 {
        self.into()
    }
    fn from_double(x: f64) -> Self {
        x as Self
    }
    fn add_product(c: MatMut<'_, Self>, alpha: Self, a: MatRef<'_, Self>, b: MatRef<'_, Self>) {
        in_double(c, |c| f64::add_product(c, alpha.double(), double(a).as_ref(), double(b).as_ref()));
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    fn double(self) -> f64 {
        self
    }
    fn from_double(x: f64) -> Self {
        x
    }
    fn add_product(c: MatMut<'_, Self>, alpha: Self, a: MatRef<'_, Self>, b: MatRef<'_, Self>) {
        matmul(c, Accum::Add, a, b, alpha, Par::Seq);
    }
}

/// The matrix in double precision.
fn double<T: Real>(a: MatRef<'_, T>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)].double())
}

/// The matrix from double precision.
fn from_double<T: Real>(a: MatRef<'_, f64>) -> Mat<T> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| T::from_double(a[(i, j)]))
}

/// Changes a matrix in double precision.
fn in_double<T: Real, R>(mut a: MatMut<'_, T>, change: impl FnOnce(MatMut<'_, f64>) -> R) -> R {
    let mut wide = double(a.as_ref());
    let result = change(wide.as_mut());
    for j in 0..a.ncols() {
        for i in 0..a.nrows() {
            a[(i, j)] = T::from_double(wide[(i, j)]);
        }
    }
    result
}

/// Which triangle of a symmetric matrix is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Triangle {
    /// `'L'`
    Lower,
    /// `'U'`
    Upper,
}

impl Triangle {
    fn side(self) -> Side {
        match self {
            Triangle::Lower => Side::Lower,
            Triangle::Upper => Side::Upper,
        }
    }

    /// Rows of column `j` that are stored, of `n`.
    fn rows(self, j: usize, n: usize) -> core::ops::Range<usize> {
        match self {
            Triangle::Lower => j..n,
            Triangle::Upper => 0..j + 1,
        }
    }
}

/// C ← βC, where β = 0 clears C whatever it holds.
fn scale<T: Real>(beta: T, mut c: MatMut<'_, T>) {
    for j in 0..c.ncols() {
        for i in 0..c.nrows() {
            c[(i, j)] = if beta == T::ZERO { T::ZERO } else { beta * c[(i, j)] };
        }
    }
}

/// C ← α A B + β C.
pub fn gemm<T: Real>(alpha: T, a: MatRef<'_, T>, b: MatRef<'_, T>, beta: T, mut c: MatMut<'_, T>) {
    scale(beta, c.as_mut());
    if c.nrows() > 0 && c.ncols() > 0 && a.ncols() > 0 {
        T::add_product(c, alpha, a, b);
    }
}

/// The stored triangle of C ← α (A Bᵀ) + β C.
fn rank_update<T: Real>(uplo: Triangle, alpha: T, a: MatRef<'_, T>, b: MatRef<'_, T>, beta: T, mut c: MatMut<'_, T>) {
    let n = c.nrows();
    let mut product = Mat::from_fn(n, n, |_, _| T::ZERO);
    gemm(alpha, a, b.transpose(), T::ZERO, product.as_mut());
    for j in 0..n {
        for i in uplo.rows(j, n) {
            let old = if beta == T::ZERO { T::ZERO } else { beta * c[(i, j)] };
            c[(i, j)] = old - (T::ZERO - product[(i, j)]);
        }
    }
}

/// C ← α A Aᵀ + β C, one triangle of C.
pub fn syrk<T: Real>(uplo: Triangle, alpha: T, a: MatRef<'_, T>, beta: T, c: MatMut<'_, T>) {
    rank_update(uplo, alpha, a, a, beta, c);
}

/// C ← α (A Bᵀ + B Aᵀ) + β C, one triangle of C.
pub fn syr2k<T: Real>(uplo: Triangle, alpha: T, a: MatRef<'_, T>, b: MatRef<'_, T>, beta: T, mut c: MatMut<'_, T>) {
    rank_update(uplo, alpha, a, b, beta, c.as_mut());
    rank_update(uplo, alpha, b, a, T::ONE, c);
}

/// The full symmetric matrix of which `a` stores a triangle.
pub fn symmetric<T: Real>(uplo: Triangle, a: MatRef<'_, T>) -> Mat<T> {
    Mat::from_fn(a.nrows(), a.nrows(), |i, j| {
        let stored = match uplo {
            Triangle::Lower => i >= j,
            Triangle::Upper => i <= j,
        };
        if stored { a[(i, j)] } else { a[(j, i)] }
    })
}

/// Cholesky factor in the stored triangle: A = L Lᵀ or Uᵀ U.
///
/// # Errors
/// The order of the first leading minor that is not positive, from 1.
pub fn potrf<T: Real>(uplo: Triangle, mut a: MatMut<'_, T>) -> Result<(), usize> {
    let n = a.nrows();
    let factor = double(a.as_ref()).llt(uplo.side()).map_err(|error| match error {
        faer::linalg::cholesky::llt::factor::LltError::NonPositivePivot { index } => index + 1,
    })?;
    let lower = factor.L();
    for j in 0..n {
        for i in uplo.rows(j, n) {
            a[(i, j)] = T::from_double(match uplo {
                Triangle::Lower => lower[(i, j)],
                Triangle::Upper => lower[(j, i)],
            });
        }
    }
    Ok(())
}

/// Solve A X = B in place of B from the factor [`potrf`] left.
pub fn potrs<T: Real>(uplo: Triangle, factor: MatRef<'_, T>, b: MatMut<'_, T>) {
    let lower = match uplo {
        Triangle::Lower => double(factor),
        Triangle::Upper => double(factor.transpose()),
    };
    in_double(b, |mut b| {
        solve_lower_triangular_in_place(lower.as_ref(), b.as_mut(), Par::Seq);
        solve_upper_triangular_in_place(lower.transpose(), b, Par::Seq);
    });
}

/// Solve A X = B in place of B by Gaussian elimination with partial pivoting; leaves L and U in A and the row exchanges,
/// from 0, in `pivots`.
///
/// # Errors
/// The index, from 1, of the first exactly zero pivot; B is then unchanged but for row exchanges.
pub fn gesv<T: Real>(mut a: MatMut<'_, T>, pivots: &mut [usize], mut b: MatMut<'_, T>) -> Result<(), usize> {
    let n = a.nrows();
    let magnitude = |x: T| if x < T::ZERO { T::ZERO - x } else { x };
    let mut singular = None;
    for k in 0..n {
        let mut p = k;
        for i in k + 1..n {
            if magnitude(a[(i, k)]) > magnitude(a[(p, k)]) {
                p = i;
            }
        }
        pivots[k] = p;
        if a[(p, k)] == T::ZERO {
            singular.get_or_insert(k + 1);
            continue;
        }
        if p != k {
            for j in 0..n {
                (a[(k, j)], a[(p, j)]) = (a[(p, j)], a[(k, j)]);
            }
            for j in 0..b.ncols() {
                (b[(k, j)], b[(p, j)]) = (b[(p, j)], b[(k, j)]);
            }
        }
        let inverse = T::from_double(1.0 / a[(k, k)].double());
        for i in k + 1..n {
            let l = a[(i, k)] * inverse;
            a[(i, k)] = l;
            for j in k + 1..n {
                a[(i, j)] = a[(i, j)] - l * a[(k, j)];
            }
        }
    }
    if let Some(index) = singular {
        return Err(index);
    }
    let factors = double(a.as_ref());
    in_double(b, |mut b| {
        faer::linalg::triangular_solve::solve_unit_lower_triangular_in_place(factors.as_ref(), b.as_mut(), Par::Seq);
        solve_upper_triangular_in_place(factors.as_ref(), b, Par::Seq);
    });
    Ok(())
}

/// Eigenvalues in ascending order and orthonormal eigenvectors of a symmetric matrix.
///
/// # Errors
/// `()` when the iteration does not converge (a matrix with NaN or infinity).
#[allow(clippy::result_unit_err)]
pub fn syevr<T: Real>(uplo: Triangle, a: MatRef<'_, T>) -> Result<(Vec<T>, Mat<T>), ()> {
    let eigen = double(a).self_adjoint_eigen(uplo.side()).map_err(|_| ())?;
    let values = eigen.S().column_vector().iter().map(|x| T::from_double(*x)).collect();
    Ok((values, from_double(eigen.U())))
}

/// Singular values in descending order, left vectors (m × m or m × min) and right vectors, transposed.
///
/// # Errors
/// `()` when the iteration does not converge (a matrix with NaN or infinity).
#[allow(clippy::result_unit_err, clippy::type_complexity)]
pub fn svd<T: Real>(a: MatRef<'_, T>, full: bool) -> Result<(Vec<T>, Mat<T>, Mat<T>), ()> {
    let a = double(a);
    let svd = if full { a.svd() } else { a.thin_svd() }.map_err(|_| ())?;
    let values = svd.S().column_vector().iter().map(|x| T::from_double(*x)).collect();
    Ok((values, from_double(svd.U()), from_double(svd.V().transpose())))
}
