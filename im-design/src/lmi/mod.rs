//! Linear matrix inequalities, stated as on paper and solved by Clarabel.
//!
//! ```
//! use im_design::{lmi::Problem, matrix::Matrix};
//! // The decay rate of x' = A x in one quadratic norm: P ≥ 1, AᵀP + PA + 2αP ≤ 0, smallest trace.
//! let a = Matrix::from_rows(&[[-1.0, 3.0], [0.0, -2.0]]);
//! let mut lmi = Problem::new("example");
//! let p = lmi.symmetric(2);
//! lmi.positive("P", &p - &Matrix::identity(2));
//! lmi.negative("decay", p.right(&a).plus_transpose() + &p * 1.0);
//! lmi.minimize(p.trace());
//! let answer = lmi.solve().unwrap();
//! assert!(answer.value(&p)[(0, 0)] >= 1.0 - 1e-6);
//! ```

mod expression;
mod problem;

pub use expression::Affine;
pub use problem::{Problem, Solution};
