//! The observer over a box, stepped by forward Euler in its turning frame.
//!
//! In the frame z⁺ = z + h(ż − jω_f z), in the frame at rest e^{jhω_f} times that. For the machine and the observer stepped alike, e⁺ = (I + h(F − LC))e
//! holds exactly with the Jacobian F at the mean state, and the block inequality of [`super`] at the vertices of the box, affine in all
//! six coordinates, proves contraction. `Thau::in_box_discretized` of im-observers steps so, with the ω_f that keeps its flux on the d axis:
//! the frame of one sample ends where that of the next begins.

use super::{Polytope, image_of_the_machine, longest, longest_meaningful_s, meaningful, no_period};
use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, positive};
use crate::exact::Field;
use crate::machine::Constants;
use crate::matrix::Matrix;
use crate::model;
use crate::thau_box::{BoxRegion, at_rate, jacobian, scales};
use serde::{Deserialize, Serialize};

/// A gain affine in the frame's speed, proven for forward Euler at a period.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledBoxDesign {
    /// The box.
    pub region: BoxRegion,
    /// Sampling period h, s.
    pub period_s: f64,
    /// ρ: the error shrinks at least by this factor per sample, in the norm of P.
    pub contraction: f64,
    /// L₀, 5 × 2, of the continuous observer (it is multiplied by h in the step).
    pub gain: Matrix<f64>,
    /// L₁: the gain is L₀ + ω_f L₁.
    pub gain_per_frame_speed: Matrix<f64>,
    /// P.
    pub p: Matrix<f64>,
}

impl SampledBoxDesign {
    /// I + h(F − LC) at a point of the box (as [`BoxRegion::vertices`] lists them).
    pub fn step_matrix<F: Field>(&self, c: &Constants<F>, at: &[f64; 6]) -> Matrix<F> {
        let frame = F::from_f64(at[0]);
        let gain = &Matrix::exact(&self.gain) + &Matrix::exact(&self.gain_per_frame_speed).scaled(&frame);
        let closed = &jacobian(c, at) - &(&gain * &model::output());
        &Matrix::identity(5) + &closed.scaled(&F::from_f64(self.period_s))
    }
}

impl Claim for SampledBoxDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        let shapes = [&self.gain, &self.gain_per_frame_speed].map(|m| (m.rows(), m.cols()));
        if shapes != [(5, 2); 2] || (self.p.rows(), self.p.cols()) != (5, 5) {
            return Err("the gains must be 5 × 2 and P 5 × 5".into());
        }
        self.region.validate().map_err(|e| e.to_string())?;
        let f = F::from_f64;
        let p = Matrix::<F>::exact(&self.p);
        let rho = f(self.contraction);
        let mut obligations = vec![
            Obligation::Positive("period".into(), f(self.period_s)),
            image_of_the_machine(c, self.period_s),
            Obligation::Positive("1 - contraction".into(), F::one() - rho.clone()),
            Obligation::Positive("contraction".into(), rho.clone()),
            Obligation::Definite("P".into(), p.clone()),
        ];
        for vertex in self.region.vertices() {
            let pm = &p * &self.step_matrix(c, &vertex);
            let block = Matrix::blocks(&[&[&p.scaled(&(rho.clone() * rho.clone())), &pm.t()], &[&pm, &p]]);
            obligations.push(Obligation::Definite(format!("contraction at {vertex:?}"), block));
        }
        Ok(obligations)
    }
}

/// A gain for a box that contracts by e^(−αh) per sample at period h; without a period, for the largest below 1/γ.
///
/// # Errors
/// [`DesignError::Infeasible`] with the largest period at which the rate can be had.
pub fn over_box(
    plant: DesignModel,
    region: &BoxRegion,
    period_s: Option<f64>,
    rate_per_s: f64,
) -> Result<(SampledBoxDesign, Certificate), DesignError> {
    region.validate()?;
    positive("rate_per_s", rate_per_s)?;
    let c = plant.constants::<f64>();
    let polytope = Polytope {
        vertices: region.vertices().iter().map(|v| (jacobian(&c, v), v[0])).collect(),
        output: model::output(),
        scale: scales(&c, region).into(),
        rate_unit: c.eta,
    };
    let attempt = |period_s: f64| {
        let contraction = (-rate_per_s * period_s).exp();
        let seal = |(p, gain, gain_per_frame_speed)| {
            let design = SampledBoxDesign { region: *region, period_s, contraction, gain, gain_per_frame_speed, p };
            let certificate = Certificate::seal(plant, design.clone()).ok()?;
            Some((design, certificate))
        };
        // At short periods a continuous gain with rate to spare may be the better conditioned answer.
        let continuous = || at_rate(&c, region, 1.5 * rate_per_s, 0.1 / period_s);
        polytope.at_period(period_s, contraction, None).and_then(seal).or_else(|| continuous().and_then(seal))
    };
    let most = 0.999 * longest_meaningful_s(&c);
    let Some(period_s) = period_s else {
        return longest(most, attempt).ok_or_else(|| no_period(rate_per_s, most));
    };
    meaningful(&c, period_s)?;
    attempt(period_s).ok_or_else(|| DesignError::Infeasible {
        constraint: format!("forward Euler at {period_s} s over the whole box"),
        feasible: match longest(period_s, attempt) {
            Some((d, _)) => format!("this rate at periods up to {:.2} µs", 1e6 * d.period_s),
            None => "a lower rate or a smaller box".into(),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LinearMachine, linalg};

    #[test]
    fn a_gain_for_the_largest_period_contracts_and_longer_ones_are_refused() {
        let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
        let region = BoxRegion {
            frame_rad_s: [150.0, 250.0],
            slip_rad_s: [-5.0, 5.0],
            flux_d_vs: [0.85, 0.95],
            flux_q_vs: [-0.02, 0.02],
            current_d_a: [0.0; 2],
            current_q_a: [0.0; 2],
        };
        let (design, certificate) = over_box(plant, &region, None, 2.0).unwrap();
        certificate.check().unwrap();
        let c = plant.constants::<f64>();
        assert!(design.period_s > 0.5 / c.gamma, "{}", design.period_s);
        for vertex in region.vertices() {
            assert!(linalg::spectral_radius(&design.step_matrix(&c, &vertex)) <= design.contraction);
        }
        let error = over_box(plant, &region, Some(1.1 / c.gamma), 2.0).unwrap_err().to_string();
        assert!(error.contains("periods up to"), "{error}");
    }
}
