//! The observer of Kwon et al. (2005), Section VI: x̂' = A x̂ + B₁u₁ + L(y − C x̂) + B₂u₂(x̂), ‖Δu₂‖ ≤ κ‖e‖.
//!
//! Two bounds on the Lipschitz constant κ: the paper's (15), κ < λ_min(Q)/(2‖B₂‖λ_max(P)), and the S-procedure
//!
//! ```text
//! [(A−LC)ᵀP + P(A−LC) + κ²I   PB₂]
//! [          B₂ᵀP              −I ]  < 0,
//! ```
//!
//! No gain tolerates more than min((D/J)/μ, η/n_p), whatever the proof:
//!
//! * with e = (s, 0, 0, 0, 0), Ce = 0 and Δu₂ = ((D/J)/μ·s, 0, 0) give ė = 0: a speed error stays for ever, unseen;
//! * with e = (0, s, 0, 0, 0), Ce = 0 and Δu₂ = (0, −(η/n_p)s, 0) give λ̇ error −ηs + ηs = 0 and i̇ error βηs − βηs = 0:
//!   a flux error stays for ever, unseen.
//!
//! The SDP reaches this limit. For the machine of Kwon et al. the speed binds: (D/J)/μ = 0.0485.

use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, proportion};
use crate::exact::Field;
use crate::linalg;
use crate::lmi::{Affine, Problem};
use crate::machine::Constants;
use crate::matrix::Matrix;
use crate::model;
use serde::{Deserialize, Serialize};

/// The paper's bound (15) with Q = I.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperBound {
    /// P of (14).
    pub p: Matrix<f64>,
    /// The bound on κ.
    pub kappa: f64,
}

/// κ of (15) for L = 0, Q = I and any printed B₂.
///
/// # Errors
/// [`DesignError::Request`] when A is not stable (friction zero).
pub fn paper_bound(a: &Matrix<f64>, b2: &Matrix<f64>) -> Result<PaperBound, DesignError> {
    let unstable = || DesignError::request("(15) needs a stable A: the friction must be positive");
    let p = linalg::lyapunov(a, &Matrix::identity(a.rows())).ok_or_else(unstable)?;
    let eigenvalues = linalg::symmetric_eigenvalues(&p);
    if eigenvalues[0].is_nan() || eigenvalues[0] <= 0.0 {
        return Err(unstable());
    }
    let kappa = 1.0 / (2.0 * linalg::norm2(b2) * eigenvalues[eigenvalues.len() - 1]);
    Ok(PaperBound { p, kappa })
}

/// B₂ exactly as Kwon et al. print it, two misprinted entries included; the norm, and with it (15), is not affected.
pub fn printed_b2() -> Matrix<f64> {
    Matrix::from_rows(&[[4.907, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, 0.020], [0.0, 195.861, 0.0], [0.0, 0.0, -1.959]])
}

/// A gain with the Lipschitz constant it tolerates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThauDesign {
    /// κ: any u₂ with ‖Δu₂‖ ≤ κ‖e‖ (SI units) leaves the error exponentially stable.
    pub lipschitz: f64,
    /// L, 5 × 2, rows (ω, λ_a, λ_b, i_a, i_b), columns (i_a, i_b).
    pub gain: Matrix<f64>,
    /// P of the Lyapunov function eᵀPe.
    pub p: Matrix<f64>,
}

/// −1 times the block matrix above.
fn slack<F: Field>(c: &Constants<F>, gain: &Matrix<F>, p: &Matrix<F>, kappa: &F) -> Matrix<F> {
    let closed = &model::linear_part(c) - &(gain * &model::output());
    let pb = p * &model::bilinear_input(c);
    let decay = &(p * &closed).plus_transpose() + &Matrix::identity(5).scaled(&(kappa.clone() * kappa.clone()));
    Matrix::blocks(&[&[&-&decay, &-&pb], &[&-&pb.t(), &Matrix::identity(3)]])
}

impl Claim for ThauDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        if (self.gain.rows(), self.gain.cols(), self.p.rows(), self.p.cols()) != (5, 2, 5, 5) {
            return Err("the gain must be 5 × 2 and P 5 × 5".into());
        }
        let p = Matrix::exact(&self.p);
        let kappa = F::from_f64(self.lipschitz);
        Ok(vec![
            Obligation::Positive("Lipschitz constant".into(), kappa.clone()),
            Obligation::Definite("P".into(), p.clone()),
            Obligation::Definite("S-procedure".into(), slack(c, &Matrix::exact(&self.gain), &p, &kappa)).limit(),
        ])
    }
}

/// min((D/J)/μ, η/n_p), from which on no gain can work.
pub fn limit(c: &Constants<f64>) -> f64 {
    (c.friction_rate / c.mu).min(c.eta / c.n_p)
}

/// The gain of largest κ by SDP, less `slack` (relative, e.g. 0.001) so that the proof is strict.
///
/// # Errors
/// [`DesignError::Infeasible`] without friction (the limit is then zero); solver failures.
pub fn maximize(plant: DesignModel, slack: f64) -> Result<(ThauDesign, Certificate), DesignError> {
    let c = plant.constants::<f64>();
    proportion("slack", slack)?;
    needs_friction(&c)?;
    let best = solve(&c, None)?.0;
    let kappa = (1.0 - slack) * best.max(0.0).sqrt();
    let (_, p, gain) = solve(&c, Some(kappa * kappa))?;
    let design = ThauDesign { lipschitz: kappa, gain, p };
    let certificate = Certificate::seal(plant, design.clone())?;
    Ok((design, certificate))
}

/// Without friction the limit of κ is zero.
pub(crate) fn needs_friction(c: &Constants<f64>) -> Result<(), DesignError> {
    if c.friction_rate > 0.0 {
        return Ok(());
    }
    Err(DesignError::Infeasible {
        constraint: "the speed error along C e = 0 decays at D/J, which is zero".into(),
        feasible: "a machine with viscous friction; without, a gain over a box (thau-box)".into(),
    })
}

/// q = κ², P and the gain.
pub(crate) type Found = (f64, Matrix<f64>, Matrix<f64>);

/// The observer's problem with q of order one: errors e = Sẽ, and P by `unit`, so that P B₂ B₂ᵀ P ≤ … keeps its form.
pub(crate) struct Scaled {
    scale: Matrix<f64>,
    unit: f64,
    /// A.
    pub a: Matrix<f64>,
    /// B₂.
    pub b: Matrix<f64>,
    /// C.
    pub output: Matrix<f64>,
}

impl Scaled {
    pub(crate) fn new(c: &Constants<f64>) -> Self {
        let unit = limit(c) * limit(c);
        let scale = Matrix::diagonal(&[1.0, 1.0, 1.0, c.beta.sqrt(), c.beta.sqrt()]);
        let inverse = scale.inverse_diagonal();
        let a = &(&inverse * &model::linear_part(c)) * &scale;
        let b = (&inverse * &model::bilinear_input(c)).scaled(&unit.sqrt());
        Scaled { output: &model::output() * &scale, scale, unit, a, b }
    }

    /// What decay must be left: with `q` none t is q itself; with `q` given, how strictly P and the gain are feasible.
    pub(crate) fn wanted(&self, q: Option<f64>, t: &Affine) -> Affine {
        let weight = &self.scale * &self.scale;
        match q {
            None => t.times(&weight),
            Some(q) => Affine::constant(&weight.scaled(&(q / self.unit))) + t.times(&Matrix::identity(5)),
        }
    }

    /// Solves for the largest t with P of moderate size.
    pub(crate) fn solve(&self, mut lmi: Problem, [p, y, t]: [&Affine; 3]) -> Result<Found, DesignError> {
        lmi.positive("P", p - &Matrix::identity(5).scaled(&1e-6));
        lmi.positive("bound on P", -(p - &Matrix::identity(5).scaled(&1e6)));
        lmi.maximize(t.clone());
        let answer = lmi.solve()?;
        let (found, inverse) = (answer.value(p), self.scale.inverse_diagonal());
        let gain = &self.scale * &linalg::solve(&found, &answer.value(y));
        let p = (&(&inverse * &found) * &inverse).scaled(&self.unit).symmetrized();
        Ok((answer.scalar(t) * self.unit, p, gain.without_dust()))
    }
}

/// With `q` none: the largest q = κ². With `q` given: the most strictly feasible P and gain.
fn solve(c: &Constants<f64>, q: Option<f64>) -> Result<Found, DesignError> {
    let scaled = Scaled::new(c);
    let mut lmi = Problem::new("Thau observer");
    let (p, y, t) = (lmi.symmetric(5), lmi.matrix(5, 2), lmi.scalar());
    let decay = (p.right(&scaled.a) - y.right(&scaled.output)).plus_transpose() + &scaled.wanted(q, &t);
    let pb = p.right(&scaled.b);
    let corner = Affine::constant(&Matrix::identity(3).scaled(&-1.0));
    lmi.negative("S-procedure", Affine::blocks(&[&[&decay, &pb], &[&pb.transpose(), &corner]]));
    scaled.solve(lmi, [&p, &y, &t])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paper_bound_from_the_printed_matrices() {
        let a = Matrix::from_rows(&[
            [-0.238, 0.0, 0.0, 0.0, 0.0],
            [0.0, -11.946, 0.0, 0.109, 0.0],
            [0.0, 0.0, -11.946, 0.0, 0.109],
            [0.0, 1169.869, 0.0, -42.044, 0.0],
            [0.0, 0.0, 1169.869, 0.0, -42.044],
        ]);
        let bound = paper_bound(&a, &printed_b2()).unwrap();
        // "κ < 7.5348 × 10⁻⁵"; the last digit is at the mercy of the three printed decimals of A.
        assert!((bound.kappa - 7.5348e-5).abs() < 5e-9, "{}", bound.kappa);
    }

    #[test]
    fn lmi_reaches_the_limit_and_cannot_pass_it() {
        let c = Constants::kwon_printed();
        let (design, certificate) = maximize(DesignModel::Constants(c), 1e-3).unwrap();
        assert!((limit(&c) - 0.0485).abs() < 5e-5);
        assert!(design.lipschitz > 0.995 * limit(&c) && design.lipschitz < limit(&c), "{}", design.lipschitz);
        certificate.check().unwrap();
        let beyond = ThauDesign { lipschitz: 1.0001 * limit(&c), ..design };
        assert!(Certificate::seal(DesignModel::Constants(c), beyond).is_err());
    }
}
