//! Small dense matrices over any [`Field`], row by row; serialized as nested arrays.

use crate::exact::Field;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::ops::{Add, Index, IndexMut, Mul, Neg, Sub};

/// A dense matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix<F> {
    rows: usize,
    cols: usize,
    data: Vec<F>,
}

impl<F: Field> Matrix<F> {
    /// Matrix of zeros.
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Matrix { rows, cols, data: vec![F::zero(); rows * cols] }
    }

    /// Entry by entry.
    pub fn from_fn(rows: usize, cols: usize, mut entry: impl FnMut(usize, usize) -> F) -> Self {
        let mut m = Self::zeros(rows, cols);
        for i in 0..rows {
            for j in 0..cols {
                m[(i, j)] = entry(i, j);
            }
        }
        m
    }

    /// Identity.
    pub fn identity(n: usize) -> Self {
        Self::diagonal(&vec![F::one(); n])
    }

    /// Diagonal matrix.
    pub fn diagonal(entries: &[F]) -> Self {
        let n = entries.len();
        Self::from_fn(n, n, |i, j| if i == j { entries[i].clone() } else { F::zero() })
    }

    /// Exact copy of a matrix of floats.
    pub fn exact(of: &Matrix<f64>) -> Self {
        Self::from_fn(of.rows, of.cols, |i, j| F::from_f64(of[(i, j)]))
    }

    /// All entries.
    pub fn entries_mut(&mut self) -> impl Iterator<Item = &mut F> {
        self.data.iter_mut()
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// Transpose.
    pub fn t(&self) -> Self {
        Self::from_fn(self.cols, self.rows, |i, j| self[(j, i)].clone())
    }

    /// Multiple.
    pub fn scaled(&self, by: &F) -> Self {
        Self::from_fn(self.rows, self.cols, |i, j| self[(i, j)].clone() * by.clone())
    }

    /// A + Aᵀ.
    pub fn plus_transpose(&self) -> Self {
        self + &self.t()
    }

    /// Put `block` with its upper left corner at (row, col).
    pub fn put(&mut self, row: usize, col: usize, block: &Matrix<F>) {
        for i in 0..block.rows {
            for j in 0..block.cols {
                self[(row + i, col + j)] = block[(i, j)].clone();
            }
        }
    }

    /// Block matrix; blocks of one row share their height, of one column their width.
    pub fn blocks(rows: &[&[&Matrix<F>]]) -> Self {
        let height = rows.iter().map(|r| r[0].rows).sum();
        let width = rows[0].iter().map(|b| b.cols).sum();
        let mut m = Self::zeros(height, width);
        let mut row = 0;
        for r in rows {
            let mut col = 0;
            for block in *r {
                m.put(row, col, block);
                col += block.cols;
            }
            row += r[0].rows;
        }
        m
    }

    /// Nearest floats.
    pub fn to_f64(&self) -> Matrix<f64> {
        Matrix::from_fn(self.rows, self.cols, |i, j| self[(i, j)].to_f64())
    }
}

impl Matrix<f64> {
    /// From rows of equal length.
    pub fn from_rows<const C: usize>(rows: &[[f64; C]]) -> Self {
        Self::from_fn(rows.len(), C, |i, j| rows[i][j])
    }

    /// Frobenius norm.
    pub fn norm(&self) -> f64 {
        self.data.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// Inverse of a diagonal matrix.
    pub fn inverse_diagonal(&self) -> Self {
        Self::from_fn(self.rows, self.cols, |i, j| if i == j { 1.0 / self[(i, j)] } else { 0.0 })
    }

    /// (A + Aᵀ)/2, symmetric to the last bit.
    pub fn symmetrized(&self) -> Self {
        Self::from_fn(self.rows, self.cols, |i, j| 0.5 * (self[(i.max(j), i.min(j))] + self[(i.min(j), i.max(j))]))
    }

    /// The nearest matrix of 2 × 2 blocks [x, −y; y, x], to the last bit: what is left when the mean is taken with the matrix seen from a frame
    /// turned by 90°. Where a problem does not know the direction of its axes, this is a solution too.
    pub fn space_vectors(&self) -> Self {
        Self::from_fn(self.rows, self.cols, |i, j| {
            let (r, c) = (i & !1, j & !1);
            let re = 0.5 * (self[(r, c)] + self[(r + 1, c + 1)]);
            let im = 0.5 * (self[(r + 1, c)] - self[(r, c + 1)]);
            match (i & 1, j & 1) {
                (0, 1) => -im,
                (1, 0) => im,
                _ => re,
            }
        })
    }

    /// Without what solvers leave where a zero belongs: entries below 10⁻¹² of the largest, −0 too.
    pub fn without_dust(&self) -> Self {
        let least = 1e-12 * self.data.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        Self::from_fn(self.rows, self.cols, |i, j| if self[(i, j)].abs() > least { self[(i, j)] } else { 0.0 })
    }

    /// Whether every entry is finite.
    pub fn is_finite(&self) -> bool {
        self.data.iter().all(|x| x.is_finite())
    }
}

impl<F> Index<(usize, usize)> for Matrix<F> {
    type Output = F;
    fn index(&self, (i, j): (usize, usize)) -> &F {
        &self.data[i * self.cols + j]
    }
}

impl<F> IndexMut<(usize, usize)> for Matrix<F> {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut F {
        &mut self.data[i * self.cols + j]
    }
}

impl<F: Field> Add for &Matrix<F> {
    type Output = Matrix<F>;
    fn add(self, other: &Matrix<F>) -> Matrix<F> {
        Matrix::from_fn(self.rows, self.cols, |i, j| self[(i, j)].clone() + other[(i, j)].clone())
    }
}

impl<F: Field> Sub for &Matrix<F> {
    type Output = Matrix<F>;
    fn sub(self, other: &Matrix<F>) -> Matrix<F> {
        Matrix::from_fn(self.rows, self.cols, |i, j| self[(i, j)].clone() - other[(i, j)].clone())
    }
}

impl<F: Field> Neg for &Matrix<F> {
    type Output = Matrix<F>;
    fn neg(self) -> Matrix<F> {
        Matrix::from_fn(self.rows, self.cols, |i, j| -self[(i, j)].clone())
    }
}

impl<F: Field> Mul for &Matrix<F> {
    type Output = Matrix<F>;
    fn mul(self, other: &Matrix<F>) -> Matrix<F> {
        Matrix::from_fn(self.rows, other.cols, |i, j| F::dot((0..self.cols).map(|k| (&self[(i, k)], &other[(k, j)]))))
    }
}

impl Serialize for Matrix<f64> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.data.chunks(self.cols.max(1)))
    }
}

impl<'de> Deserialize<'de> for Matrix<f64> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let rows = Vec::<Vec<f64>>::deserialize(deserializer)?;
        let cols = rows.first().map_or(0, Vec::len);
        if rows.iter().any(|r| r.len() != cols) {
            return Err(serde::de::Error::custom("the rows of a matrix must have equal length"));
        }
        if rows.iter().flatten().any(|x| !x.is_finite()) {
            return Err(serde::de::Error::custom("a matrix entry is not a finite number"));
        }
        Ok(Matrix { rows: rows.len(), cols, data: rows.concat() })
    }
}
