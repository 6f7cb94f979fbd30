//! Thau's observer stepped by forward Euler: e⁺ = (I + h(A − LC))e + hB₂Δu₂, ‖Δu₂‖ ≤ κ‖e‖.
//!
//! With N = P(A − LC), V = eᵀPe falls by ρ² per sample, whatever Δu₂, if
//!
//! ```text
//! [(ρ² − 1)P/h − N − Nᵀ − κ²I   −PB₂    hNᵀ ]
//! [          −B₂ᵀP                I     hB₂ᵀP]  > 0
//! [           hN                hPB₂     hP  ]
//! ```
//!
//! (V⁺ − ρ²V + h(κ²‖e‖² − ‖Δu₂‖²) < 0, its Schur complement divided by h); h → 0 gives the continuous inequality.

use super::{image_of_the_machine, longest, longest_meaningful_s, meaningful, no_period};
use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, proportion};
use crate::exact::Field;
use crate::lmi::{Affine, Problem};
use crate::machine::Constants;
use crate::matrix::Matrix;
use crate::model;
use crate::thau::{Found, Scaled, limit, needs_friction};
use serde::{Deserialize, Serialize};

/// A gain with the Lipschitz constant it tolerates when sampled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledThauDesign {
    /// Sampling period h, s.
    pub period_s: f64,
    /// κ.
    pub lipschitz: f64,
    /// ρ, per sample, in the norm of P.
    pub contraction: f64,
    /// L, 5 × 2, of the continuous observer (it is multiplied by h in the step).
    pub gain: Matrix<f64>,
    /// P.
    pub p: Matrix<f64>,
}

impl Claim for SampledThauDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        if (self.gain.rows(), self.gain.cols(), self.p.rows(), self.p.cols()) != (5, 2, 5, 5) {
            return Err("the gain must be 5 × 2 and P 5 × 5".into());
        }
        let [h, kappa, rho] = [self.period_s, self.lipschitz, self.contraction].map(F::from_f64);
        let mut obligations = vec![
            Obligation::Positive("period".into(), h.clone()),
            image_of_the_machine(c, self.period_s),
            Obligation::Positive("Lipschitz constant".into(), kappa.clone()),
            Obligation::Positive("contraction".into(), rho.clone()),
            Obligation::Positive("1 - contraction".into(), F::one() - rho.clone()),
        ];
        if h <= F::zero() {
            return Ok(obligations);
        }
        let p = Matrix::<F>::exact(&self.p);
        let n = &p * &(&model::linear_part(c) - &(&Matrix::exact(&self.gain) * &model::output()));
        let pb = &p * &model::bilinear_input(c);
        let excess = (rho.clone() * rho - F::one()) / h.clone();
        let first = &(&p.scaled(&excess) - &n.plus_transpose()) - &Matrix::identity(5).scaled(&(kappa.clone() * kappa));
        let (hn, hpb) = (n.scaled(&h), pb.scaled(&h));
        let block = Matrix::blocks(&[
            &[&first, &-&pb, &hn.t()],
            &[&-&pb.t(), &Matrix::identity(3), &hpb.t()],
            &[&hn, &hpb, &p.scaled(&h)],
        ]);
        obligations.push(Obligation::Definite("P".into(), p));
        obligations.push(Obligation::Definite("sampled S-procedure".into(), block).limit());
        Ok(obligations)
    }
}

/// The gain of largest κ at a period, with a contraction that costs a hundredth of the friction's own.
fn at_period(plant: DesignModel, period_s: f64, slack: f64) -> Option<(SampledThauDesign, Certificate)> {
    let c = plant.constants::<f64>();
    let contraction = (-0.01 * c.friction_rate.min(c.eta) * period_s).exp();
    let (q, ..) = solve(&c, period_s, contraction, None)?;
    // Where rounding eats the proof of the largest, a little less is proven.
    [slack, 10.0 * slack, 0.1, 0.3].into_iter().find_map(|less| {
        let lipschitz = (1.0 - less) * q.max(0.0).sqrt();
        // Half of what the continuous observer tolerates, or the period is too long.
        if lipschitz < 0.5 * limit(&c) {
            return None;
        }
        let (_, p, gain) = solve(&c, period_s, contraction, Some(lipschitz * lipschitz))?;
        let design = SampledThauDesign { period_s, lipschitz, contraction, gain, p };
        let certificate = Certificate::seal(plant, design.clone()).ok()?;
        Some((design, certificate))
    })
}

/// As for the continuous observer: the largest κ², or the most strictly feasible P and gain for one.
fn solve(c: &Constants<f64>, h: f64, rho: f64, q: Option<f64>) -> Option<Found> {
    let scaled = Scaled::new(c);
    let mut lmi = Problem::new("sampled Thau observer");
    let (p, y, t) = (lmi.symmetric(5), lmi.matrix(5, 2), lmi.scalar());
    let n = p.right(&scaled.a) - y.right(&scaled.output);
    let first = &(&p * ((rho * rho - 1.0) / h)) - &n.plus_transpose() - scaled.wanted(q, &t);
    let pb = p.right(&scaled.b);
    let (n, pb_h) = (&n * h.sqrt(), &pb * h.sqrt());
    let corner = Affine::constant(&Matrix::identity(3));
    let off = -&pb;
    let rows: [&[&Affine]; 3] =
        [&[&first, &off, &n.transpose()], &[&off.transpose(), &corner, &pb_h.transpose()], &[&n, &pb_h, &p]];
    lmi.positive("sampled S-procedure", Affine::blocks(&rows));
    scaled.solve(lmi, [&p, &y, &t]).ok()
}

/// The gain of largest κ, less `slack` (relative), at a period; without one, at the largest period below 1/γ that keeps half of the limit of κ.
///
/// # Errors
/// [`DesignError::Infeasible`] without friction, or with the largest period.
pub fn thau(plant: DesignModel, slack: f64, period_s: Option<f64>) -> Result<(SampledThauDesign, Certificate), DesignError> {
    let c = plant.constants::<f64>();
    proportion("slack", slack)?;
    needs_friction(&c)?;
    let attempt = |h: f64| at_period(plant, h, slack);
    let most = 0.999 * longest_meaningful_s(&c);
    let Some(period_s) = period_s else {
        return longest(most, attempt).ok_or_else(|| no_period(0.01 * c.friction_rate, most));
    };
    meaningful(&c, period_s)?;
    attempt(period_s).ok_or_else(|| DesignError::Infeasible {
        constraint: format!("forward Euler at {period_s} s with half of the limit of κ, {:.3e}", 0.5 * limit(&c)),
        feasible: match longest(period_s, attempt) {
            Some((d, _)) => format!("a period up to {:.2} µs", 1e6 * d.period_s),
            None => "no period: use a design over a box (thau-box)".into(),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;

    /// A machine that a thousand random ones brought up: 20 us was refused though twice the period is feasible.
    #[test]
    fn what_is_feasible_is_not_refused_for_rounding() {
        let plant = DesignModel::Machine(LinearMachine {
            stator_resistance_ohm: 0.02406690028057762,
            rotor_resistance_ohm: 0.025036713882788636,
            stator_inductance_h: 0.021078431435378794,
            rotor_inductance_h: 0.021176953518904355,
            mutual_inductance_h: 0.020093210600123187,
            pole_pairs: 3,
            inertia_kg_m2: 2.0944213115001475,
            viscous_friction_n_m_s: 2.0215641819842105,
        });
        for period_s in [5e-6, 10e-6, 20e-6, 40e-6, 100e-6] {
            let (d, _) = thau(plant, 1e-3, Some(period_s)).unwrap_or_else(|e| panic!("{period_s} s: {e}"));
            assert!(d.lipschitz > 0.9 * limit(&plant.constants()), "{period_s} s: {}", d.lipschitz);
        }
    }

    #[test]
    fn short_periods_cost_little_and_no_period_passes_the_limit() {
        let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
        let c = plant.constants::<f64>();
        let (design, certificate) = thau(plant, 1e-3, Some(50e-6)).unwrap();
        certificate.check().unwrap();
        let share = design.lipschitz / limit(&c);
        assert!(share > 0.9 && share < 1.0, "{share}");
        let beyond = SampledThauDesign { lipschitz: 1.001 * limit(&c), ..design };
        assert!(Certificate::seal(plant, beyond).is_err());
    }
}
