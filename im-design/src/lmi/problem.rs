//! Unknowns, constraints and objective; the translation to Clarabel's standard form.

use super::expression::{Affine, Term};
use crate::error::DesignError;
use crate::matrix::Matrix;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT,
    SupportedConeT::{NonnegativeConeT, PSDTriangleConeT, SecondOrderConeT},
};
use std::f64::consts::SQRT_2;

/// A convex problem in the making.
pub struct Problem {
    name: &'static str,
    unknowns: usize,
    objective: Option<Affine>,
    constraints: Vec<Constraint>,
}

struct Constraint {
    name: String,
    cone: SupportedConeT<f64>,
    /// One affine expression per row of the cone.
    rows: Vec<(f64, Vec<(usize, f64)>)>,
}

/// Values of the unknowns at the optimum.
#[derive(Clone, Debug)]
pub struct Solution {
    x: Vec<f64>,
    /// The objective, as stated.
    pub objective: f64,
}

impl Solution {
    /// Value of an expression.
    pub fn value(&self, of: &Affine) -> Matrix<f64> {
        let mut m = of.constant.clone();
        for t in &of.terms {
            m[(t.row, t.col)] += t.factor * self.x[t.unknown];
        }
        m
    }

    /// Value of a 1 × 1 expression.
    pub fn scalar(&self, of: &Affine) -> f64 {
        self.value(of)[(0, 0)]
    }
}

impl Problem {
    /// An empty problem; the name appears in errors.
    pub fn new(name: &'static str) -> Self {
        Problem { name, unknowns: 0, objective: None, constraints: Vec::new() }
    }

    fn unknown(&mut self, row: usize, col: usize) -> Term {
        self.unknowns += 1;
        Term { row, col, unknown: self.unknowns - 1, factor: 1.0 }
    }

    /// Unknown number, 1 × 1.
    pub fn scalar(&mut self) -> Affine {
        self.matrix(1, 1)
    }

    /// Unknown matrix.
    pub fn matrix(&mut self, rows: usize, cols: usize) -> Affine {
        let terms = (0..rows * cols).map(|k| self.unknown(k / cols, k % cols)).collect();
        Affine { constant: Matrix::zeros(rows, cols), terms }
    }

    /// Unknown symmetric matrix.
    pub fn symmetric(&mut self, n: usize) -> Affine {
        let mut terms = Vec::new();
        for i in 0..n {
            for j in 0..=i {
                let t = self.unknown(i, j);
                terms.push(t);
                if i != j {
                    terms.push(Term { row: j, col: i, ..t });
                }
            }
        }
        Affine { constant: Matrix::zeros(n, n), terms }
    }

    /// Require X ≥ 0 for a symmetric expression (its upper triangle is used).
    pub fn positive(&mut self, name: impl Into<String>, x: Affine) {
        let n = x.size().0;
        let index = |i: usize, j: usize| j * (j + 1) / 2 + i;
        let weight = |i: usize, j: usize| if i == j { 1.0 } else { SQRT_2 };
        let mut rows = vec![(0.0, Vec::new()); n * (n + 1) / 2];
        for j in 0..n {
            for i in 0..=j {
                rows[index(i, j)].0 = weight(i, j) * x.constant[(i, j)];
            }
        }
        for t in x.terms.iter().filter(|t| t.row <= t.col) {
            rows[index(t.row, t.col)].1.push((t.unknown, weight(t.row, t.col) * t.factor));
        }
        let cone = if n == 1 { NonnegativeConeT(1) } else { PSDTriangleConeT(n) };
        self.constraints.push(Constraint { name: name.into(), cone, rows });
    }

    /// Require X ≤ 0.
    pub fn negative(&mut self, name: impl Into<String>, x: Affine) {
        self.positive(name, -x);
    }

    /// Require t ≥ ‖X‖, the Frobenius norm.
    pub fn norm_below(&mut self, name: impl Into<String>, x: &Affine, t: &Affine) {
        let (height, width) = x.size();
        let mut rows = vec![(0.0, Vec::new()); 1 + height * width];
        rows[0] = (t.constant[(0, 0)], t.terms.iter().map(|t| (t.unknown, t.factor)).collect());
        for i in 0..height {
            for j in 0..width {
                rows[1 + i * width + j].0 = x.constant[(i, j)];
            }
        }
        for t in &x.terms {
            rows[1 + t.row * width + t.col].1.push((t.unknown, t.factor));
        }
        let cone = SecondOrderConeT(rows.len());
        self.constraints.push(Constraint { name: name.into(), cone, rows });
    }

    /// Minimize a 1 × 1 expression.
    pub fn minimize(&mut self, x: Affine) {
        self.objective = Some(x);
    }

    /// Maximize a 1 × 1 expression.
    pub fn maximize(&mut self, x: Affine) {
        self.objective = Some(-x);
    }

    /// Solve.
    ///
    /// # Errors
    /// [`DesignError::Infeasible`] names the constraint with the greatest weight in the proof of infeasibility;
    /// [`DesignError::Solver`] when there is no answer at all.
    pub fn solve(&self) -> Result<Solution, DesignError> {
        let mut q = vec![0.0; self.unknowns];
        for t in self.objective.iter().flat_map(|o| &o.terms) {
            q[t.unknown] += t.factor;
        }
        // Clarabel: A x + s = b, s in the cone; here s = b − A x is the expression.
        let (mut i, mut j, mut v, mut b) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (constant, terms) in self.constraints.iter().flat_map(|c| &c.rows) {
            for (unknown, factor) in terms {
                i.push(b.len());
                j.push(*unknown);
                v.push(-factor);
            }
            b.push(*constant);
        }
        let a = CscMatrix::new_from_triplets(b.len(), self.unknowns, i, j, v);
        let p = CscMatrix::zeros((self.unknowns, self.unknowns));
        let cones: Vec<_> = self.constraints.iter().map(|c| c.cone.clone()).collect();
        let fail = |status: String| DesignError::Solver { problem: self.name, status };
        let settings = DefaultSettingsBuilder::default().verbose(false).build().map_err(|e| fail(e.to_string()))?;
        let mut solver = DefaultSolver::new(&p, &q, &a, &b, &cones, settings).map_err(|e| fail(e.to_string()))?;
        // Clarabel panics where a singular value decomposition does not converge; to us that is a solver without an answer.
        let solve = std::panic::AssertUnwindSafe(|| solver.solve());
        std::panic::catch_unwind(solve).map_err(|_| fail("a numerical breakdown".into()))?;
        let solution = &solver.solution;
        match solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => {
                let constant = self.objective.as_ref().map_or(0.0, |o| o.constant[(0, 0)]);
                Ok(Solution { x: solution.x.clone(), objective: solution.obj_val + constant })
            }
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
                Err(DesignError::Infeasible { constraint: self.binding(&solution.z), feasible: "relax it".into() })
            }
            status => Err(fail(format!("{status:?}"))),
        }
    }

    /// The constraint with the greatest multiplier in a proof of infeasibility.
    fn binding(&self, z: &[f64]) -> String {
        let mut start = 0;
        let mut best = (0.0, "no constraint".to_string());
        for c in &self.constraints {
            let weight = z[start..start + c.rows.len()].iter().map(|x| x * x).sum::<f64>();
            start += c.rows.len();
            if weight > best.0 {
                best = (weight, c.name.clone());
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smallest_eigenvalue_by_sdp() {
        // max t with S − t I ≥ 0.
        let s = Matrix::from_rows(&[[4.0, 1.0, 0.0, 2.0], [1.0, 3.0, 1.0, 0.0], [0.0, 1.0, 5.0, 1.0], [2.0, 0.0, 1.0, 2.0]]);
        let mut lmi = Problem::new("test");
        let t = lmi.scalar();
        lmi.positive("eigenvalue", Affine::constant(&s) - t.times(&Matrix::identity(4)));
        lmi.maximize(t.clone());
        let solution = lmi.solve().unwrap();
        let exact = crate::linalg::symmetric_eigenvalues(&s)[0];
        assert!((solution.scalar(&t) - exact).abs() < 1e-6, "{} {exact}", solution.scalar(&t));
    }

    #[test]
    fn infeasibility_names_a_constraint() {
        let mut lmi = Problem::new("test");
        let p = lmi.symmetric(2);
        lmi.positive("P ≥ I", &p - &Matrix::identity(2));
        let unstable = Matrix::from_rows(&[[1.0, 0.0], [0.0, -1.0]]);
        lmi.negative("decay", p.right(&unstable).plus_transpose());
        let Err(DesignError::Infeasible { constraint, .. }) = lmi.solve() else { panic!("must be infeasible") };
        assert!(["P ≥ I", "decay"].contains(&constraint.as_str()));
    }

    #[test]
    fn norms_are_second_order_cones() {
        // The point of x + y = 2 nearest to the origin.
        let mut lmi = Problem::new("test");
        let (x, t) = (lmi.matrix(2, 1), lmi.scalar());
        let sum = x.left(&Matrix::from_rows(&[[1.0, 1.0]]));
        lmi.positive("half plane", &sum - &Matrix::from_rows(&[[2.0]]));
        lmi.norm_below("norm", &x, &t);
        lmi.minimize(t.clone());
        let solution = lmi.solve().unwrap();
        assert!((solution.scalar(&t) - SQRT_2).abs() < 1e-6);
        assert!((solution.value(&x)[(0, 0)] - 1.0).abs() < 1e-6);
    }
}
