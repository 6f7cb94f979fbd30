//! Matrices that are affine in the unknowns.

use crate::matrix::Matrix;
use std::ops::{Add, Mul, Neg, Sub};

/// One coefficient: entry (row, col) holds `factor` times unknown number `unknown`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Term {
    pub row: usize,
    pub col: usize,
    pub unknown: usize,
    pub factor: f64,
}

/// A matrix whose entries are affine in the unknowns of a problem.
#[derive(Clone, Debug)]
pub struct Affine {
    pub(crate) constant: Matrix<f64>,
    pub(crate) terms: Vec<Term>,
}

impl Affine {
    /// A matrix without unknowns.
    pub fn constant(of: &Matrix<f64>) -> Self {
        Affine { constant: of.clone(), terms: Vec::new() }
    }

    /// Height and width.
    pub fn size(&self) -> (usize, usize) {
        (self.constant.rows(), self.constant.cols())
    }

    /// A X.
    pub fn left(&self, a: &Matrix<f64>) -> Self {
        let spread = |t: &Term| {
            let t = *t;
            (0..a.rows()).filter(move |&i| a[(i, t.row)] != 0.0).map(move |i| (i, t))
        };
        let terms = self.terms.iter().flat_map(spread);
        let terms = terms.map(|(i, t)| Term { row: i, factor: a[(i, t.row)] * t.factor, ..t }).collect();
        Affine { constant: a * &self.constant, terms }
    }

    /// X A.
    pub fn right(&self, a: &Matrix<f64>) -> Self {
        self.transpose().left(&a.t()).transpose()
    }

    /// Xᵀ.
    pub fn transpose(&self) -> Self {
        let terms = self.terms.iter().map(|t| Term { row: t.col, col: t.row, ..*t }).collect();
        Affine { constant: self.constant.t(), terms }
    }

    /// X + Xᵀ.
    pub fn plus_transpose(&self) -> Self {
        self + &self.transpose()
    }

    /// Sum of the diagonal, 1 × 1.
    pub fn trace(&self) -> Self {
        let diagonal = (0..self.constant.rows()).map(|i| self.constant[(i, i)]).sum();
        let terms = self.terms.iter().filter(|t| t.row == t.col).map(|t| Term { row: 0, col: 0, ..*t }).collect();
        Affine { constant: Matrix::from_fn(1, 1, |_, _| diagonal), terms }
    }

    /// x M for a 1 × 1 expression x.
    pub fn times(&self, m: &Matrix<f64>) -> Self {
        let mut terms = Vec::new();
        for i in 0..m.rows() {
            for j in 0..m.cols() {
                let scaled = |t: &Term| Term { row: i, col: j, factor: t.factor * m[(i, j)], ..*t };
                if m[(i, j)] != 0.0 {
                    terms.extend(self.terms.iter().map(scaled));
                }
            }
        }
        Affine { constant: m.scaled(&self.constant[(0, 0)]), terms }
    }

    /// Block matrix; blocks of one row share their height, of one column their width.
    pub fn blocks(rows: &[&[&Affine]]) -> Self {
        let constants: Vec<Vec<&Matrix<f64>>> = rows.iter().map(|r| r.iter().map(|b| &b.constant).collect()).collect();
        let constants: Vec<&[&Matrix<f64>]> = constants.iter().map(Vec::as_slice).collect();
        let mut terms = Vec::new();
        let mut row = 0;
        for r in rows {
            let mut col = 0;
            for block in *r {
                terms.extend(block.terms.iter().map(|t| Term { row: row + t.row, col: col + t.col, ..*t }));
                col += block.size().1;
            }
            row += r[0].size().0;
        }
        Affine { constant: Matrix::blocks(&constants), terms }
    }
}

impl Add for &Affine {
    type Output = Affine;
    fn add(self, other: &Affine) -> Affine {
        let terms = self.terms.iter().chain(&other.terms).copied().collect();
        Affine { constant: &self.constant + &other.constant, terms }
    }
}

impl Neg for &Affine {
    type Output = Affine;
    fn neg(self) -> Affine {
        self * -1.0
    }
}

impl Sub for &Affine {
    type Output = Affine;
    fn sub(self, other: &Affine) -> Affine {
        self + &-other
    }
}

impl Mul<f64> for &Affine {
    type Output = Affine;
    fn mul(self, by: f64) -> Affine {
        let terms = self.terms.iter().map(|t| Term { factor: by * t.factor, ..*t }).collect();
        Affine { constant: self.constant.scaled(&by), terms }
    }
}

impl Add<&Matrix<f64>> for &Affine {
    type Output = Affine;
    fn add(self, other: &Matrix<f64>) -> Affine {
        Affine { constant: &self.constant + other, terms: self.terms.clone() }
    }
}

impl Sub<&Matrix<f64>> for &Affine {
    type Output = Affine;
    fn sub(self, other: &Matrix<f64>) -> Affine {
        Affine { constant: &self.constant - other, terms: self.terms.clone() }
    }
}

/// Owned operands, so that sums chain as on paper.
macro_rules! owned {
    ($($op:ident $f:ident),*) => {$(
        impl $op for Affine {
            type Output = Affine;
            fn $f(self, other: Affine) -> Affine { (&self).$f(&other) }
        }
        impl $op<&Affine> for Affine {
            type Output = Affine;
            fn $f(self, other: &Affine) -> Affine { (&self).$f(other) }
        }
    )*};
}
owned!(Add add, Sub sub);

impl Mul<f64> for Affine {
    type Output = Affine;
    fn mul(self, by: f64) -> Affine {
        &self * by
    }
}

impl Neg for Affine {
    type Output = Affine;
    fn neg(self) -> Affine {
        -&self
    }
}
