//! An observer certified over a box of speed, slip and flux, without a Lipschitz bound.
//!
//! The machine is quadratic in its state, so for any two states f(x̂) − f(x) = F(x̄)(x̂ − x) *exactly*, with the Jacobian
//! F at their mean x̄. In a frame that turns at ω_f with the estimated flux, e = x̂ − x obeys ė = (F − L(ω_f)C)e with
//!
//! ```text
//! ė_ω = −(D/J)e_ω [+ μ(e_λd i_q − e_λq i_d)]
//! ė_λ = −(η + ω_s J)e_λ + n_p J λ̄ e_ω + ηL_m e_i                 J = [0 −1; 1 0], ω_s = ω_f − n_p ω̄
//! ė_i = β(η − (ω_f − ω_s)J)e_λ − βn_p J λ̄ e_ω − (γ + ω_f J)e_i
//! ```
//!
//! which is affine in (ω_f, ω_s, λ̄_d, λ̄_q, i_d, i_q) with L affine in ω_f. One P at all vertices of the box,
//!
//! ```text
//! (F − LC)ᵀP + P(F − LC) + 2αP < 0,
//! ```
//!
//! therefore makes the error contract at rate α while both states and the frame stay in the box. The bracket is the
//! machine's own torque computed with the *measured* current; without it (current ranges zero) the observer takes the
//! load torque equal to the estimated torque, as the paper's second study does, and any acceleration is a disturbance.
//!
//! In a frame at rest whose flux box contains zero, speed is undetectable at λ̄ = 0 and no rate above D/J exists; below
//! it every box, however large, is feasible without the torque term ([`any_box`]): the speed error is autonomous.

mod region;

use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, not_negative, positive};
use crate::exact::Field;
use crate::feasible::range;
use crate::linalg;
use crate::lmi::Problem;
use crate::machine::Constants;
use crate::matrix::Matrix;
use crate::model;
pub use region::BoxRegion;
use serde::{Deserialize, Serialize};

/// F at a vertex.
pub fn jacobian<F: Field>(c: &Constants<F>, vertex: &[f64; 6]) -> Matrix<F> {
    let [frame, slip, flux_d, flux_q, current_d, current_q] = vertex.map(F::from_f64);
    let mut m = Matrix::zeros(5, 5);
    m[(0, 0)] = -c.friction_rate.clone();
    m[(0, 1)] = c.mu.clone() * current_q;
    m[(0, 2)] = -(c.mu.clone() * current_d);
    m.put(1, 1, &model::complex(&-c.eta.clone(), &-slip.clone()));
    m.put(1, 3, &model::complex(&c.eta_l_m, &F::zero()));
    let speed = c.beta.clone() * (frame.clone() - slip);
    m.put(3, 1, &model::complex(&(c.beta.clone() * c.eta.clone()), &-speed));
    m.put(3, 3, &model::complex(&-c.gamma.clone(), &-frame));
    // n_p J λ̄ = n_p (−λ_q, λ_d), and −β times that on the current.
    for (k, push) in [(1, -flux_q), (2, flux_d)] {
        let push = c.n_p.clone() * push;
        m[(k, 0)] = push.clone();
        m[(k + 2, 0)] = -(c.beta.clone() * push);
    }
    m
}

/// A gain affine in the frame's speed, with its proof over a box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxDesign {
    /// The box.
    pub region: BoxRegion,
    /// Proven decay rate, 1/s.
    pub rate_per_s: f64,
    /// L₀, 5 × 2, rows (ω, λ_d, λ_q, i_d, i_q), columns (i_d, i_q), in the turning frame.
    pub gain: Matrix<f64>,
    /// L₁: the gain is L₀ + ω_f L₁.
    pub gain_per_frame_speed: Matrix<f64>,
    /// P.
    pub p: Matrix<f64>,
}

impl Claim for BoxDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        let shapes = [&self.gain, &self.gain_per_frame_speed].map(|m| (m.rows(), m.cols()));
        if shapes != [(5, 2); 2] || (self.p.rows(), self.p.cols()) != (5, 5) {
            return Err("the gains must be 5 × 2 and P 5 × 5".into());
        }
        self.region.validate().map_err(|e| e.to_string())?;
        let p = Matrix::<F>::exact(&self.p);
        let two_alpha = F::from_f64(2.0) * F::from_f64(self.rate_per_s);
        let mut obligations = vec![Obligation::Definite("P".into(), p.clone())];
        for vertex in self.region.vertices() {
            let frame = F::from_f64(vertex[0]);
            let gain = &Matrix::exact(&self.gain) + &Matrix::exact(&self.gain_per_frame_speed).scaled(&frame);
            let closed = &jacobian(c, &vertex) - &(&gain * &model::output());
            let decay = -&(&(&p * &closed).plus_transpose() + &p.scaled(&two_alpha));
            obligations.push(Obligation::Definite(format!("decay at {vertex:?}"), decay));
        }
        Ok(obligations)
    }
}

/// Size of each state, for conditioning: a flux error, the current it drives, the speed error that drives it.
pub(crate) fn scales(c: &Constants<f64>, region: &BoxRegion) -> [f64; 5] {
    let flux = region.flux_d_vs.iter().chain(&region.flux_q_vs).fold(0.0f64, |m, x| m.max(x.abs())).max(1e-6);
    let speed = c.eta.max(region.slip_rad_s.iter().fold(0.0f64, |m, x| m.max(x.abs()))) / c.n_p;
    [speed, flux, flux, c.beta * flux, c.beta * flux]
}

/// P, L₀, L₁.
type Found = (Matrix<f64>, Matrix<f64>, Matrix<f64>);

/// Solve for P and the gain at a fixed rate; the gain in scaled states stays below `gain_limit` (1/s).
pub(crate) fn at_rate(c: &Constants<f64>, region: &BoxRegion, rate: f64, gain_limit: f64) -> Option<Found> {
    let s = scales(c, region);
    let scale = Matrix::diagonal(&s);
    let inverse = scale.inverse_diagonal();
    let out_scale = s[3];
    let mut lmi = Problem::new("observer over a box");
    let (p, t) = (lmi.symmetric(5), lmi.scalar());
    let frame_unit = region.frame_rad_s.iter().fold(1.0f64, |m, x| m.max(x.abs()));
    let (y0, y1) = (lmi.matrix(5, 2), lmi.matrix(5, 2));
    lmi.positive("P ≥ 1", &p - &Matrix::identity(5));
    let limit = crate::lmi::Affine::constant(&Matrix::from_rows(&[[gain_limit]]));
    for end in region.frame_rad_s {
        lmi.norm_below("gain limit", &(&y0 + &(&y1 * (end / frame_unit))), &limit);
    }
    for vertex in region.vertices() {
        let f = &(&inverse * &jacobian(c, &vertex)) * &scale;
        let f = &f + &Matrix::identity(5).scaled(&rate);
        let y = &y0 + &(&y1 * (vertex[0] / frame_unit));
        let decay = (p.right(&f) - y.right(&model::output())).plus_transpose();
        lmi.negative(format!("decay at {vertex:?}"), decay + t.times(&Matrix::identity(5)));
    }
    let cap = crate::lmi::Affine::constant(&Matrix::from_rows(&[[1.0 + rate]]));
    lmi.positive("bounded margin", cap - &t);
    lmi.maximize(t.clone());
    let answer = lmi.solve().ok()?;
    if answer.scalar(&t) < 1e-6 * (1.0 + rate) {
        return None; // the margin would not survive rounding
    }
    let p = answer.value(&p);
    let gain = |y: &Matrix<f64>| (&scale * &linalg::solve(&p, y)).scaled(&(1.0 / out_scale));
    let (l0, l1) = (gain(&answer.value(&y0)), gain(&answer.value(&y1)).scaled(&(1.0 / frame_unit)));
    Some(((&(&inverse * &p) * &inverse).symmetrized(), l0, l1))
}

/// A gain for a box at a wanted rate.
///
/// # Errors
/// [`DesignError::Infeasible`] with the highest feasible rate for that box, to 2 %.
pub fn design(
    plant: DesignModel,
    region: &BoxRegion,
    rate_per_s: f64,
    gain_limit_per_s: f64,
) -> Result<(BoxDesign, Certificate), DesignError> {
    region.validate()?;
    not_negative("rate_per_s", rate_per_s)?;
    positive("gain_limit_per_s", gain_limit_per_s)?;
    proven(plant, region, rate_per_s, gain_limit_per_s).ok_or_else(|| DesignError::Infeasible {
        constraint: format!("a rate of {rate_per_s} 1/s at every vertex of the box"),
        feasible: match highest_rate(plant, region, rate_per_s, gain_limit_per_s) {
            Some((d, _)) => format!("up to {:.4} 1/s over this box with this gain limit", d.rate_per_s),
            None => format!("no rate over this box, but some over {}", smaller(plant, region, gain_limit_per_s)),
        },
    })
}

type Sealed = (BoxDesign, Certificate);

/// A gain at a rate, if there is one that the exact check confirms.
fn proven(plant: DesignModel, region: &BoxRegion, rate_per_s: f64, gain_limit: f64) -> Option<Sealed> {
    seal(plant, region, rate_per_s, at_rate(&plant.constants(), region, rate_per_s, gain_limit)?).ok()
}

fn seal(
    plant: DesignModel,
    region: &BoxRegion,
    rate_per_s: f64,
    (p, gain, gain_per_frame_speed): Found,
) -> Result<Sealed, DesignError> {
    let design = BoxDesign { region: *region, rate_per_s, gain, gain_per_frame_speed, p };
    let certificate = Certificate::seal(plant, design.clone())?;
    Ok((design, certificate))
}

/// A box about the same centre over which some rate is feasible, for people.
fn smaller(plant: DesignModel, region: &BoxRegion, gain_limit: f64) -> String {
    match crate::feasible::largest_share(|share| proven(plant, &region.scaled(share), 0.0, gain_limit).is_some()) {
        Some(share) => {
            let r = region.scaled(share);
            let [frame, slip, d, q] = [r.frame_rad_s, r.slip_rad_s, r.flux_d_vs, r.flux_q_vs].map(range);
            format!("frame {frame} rad/s, slip {slip} rad/s, flux d {d} Wb, flux q {q} Wb")
        }
        None => "a box with another centre: away from zero frame speed and zero flux".into(),
    }
}

/// A gain at the highest provable rate below `upper`, to 2 %.
fn highest_rate(plant: DesignModel, region: &BoxRegion, upper: f64, gain_limit: f64) -> Option<Sealed> {
    let (mut low, mut high) = (0.0, upper);
    let mut best = proven(plant, region, 0.0, gain_limit)?;
    while high - low > 0.02 * high && high > 1e-3 {
        let middle = 0.5 * (low + high);
        match proven(plant, region, middle, gain_limit) {
            Some(found) => (low, best) = (middle, found),
            None => high = middle,
        }
    }
    Some(best)
}

/// The fastest gain for a box, to 2 %, up to `upper_rate` 1/s.
///
/// # Errors
/// [`DesignError::Infeasible`] when no rate is feasible.
pub fn fastest(
    plant: DesignModel,
    region: &BoxRegion,
    upper_rate_per_s: f64,
    gain_limit_per_s: f64,
) -> Result<(BoxDesign, Certificate), DesignError> {
    region.validate()?;
    positive("gain_limit_per_s", gain_limit_per_s)?;
    highest_rate(plant, region, upper_rate_per_s, gain_limit_per_s).ok_or_else(|| DesignError::Infeasible {
        constraint: "some decay at every vertex of the box".into(),
        feasible: smaller(plant, region, gain_limit_per_s),
    })
}

/// The largest box about the centre of `region` (widths scaled by up to `most`) that still has the rate, to 1 %.
///
/// # Errors
/// [`DesignError::Infeasible`] when not even the centre has the rate.
pub fn largest_box(
    plant: DesignModel,
    region: &BoxRegion,
    most: f64,
    rate_per_s: f64,
    gain_limit_per_s: f64,
) -> Result<(BoxDesign, Certificate), DesignError> {
    region.validate()?;
    let attempt = |factor: f64| proven(plant, &region.scaled(factor), rate_per_s, gain_limit_per_s);
    let mut best = attempt(0.0).ok_or_else(|| DesignError::Infeasible {
        constraint: format!("a rate of {rate_per_s} 1/s even at the centre of the box"),
        feasible: "a lower rate, a higher gain limit, or another centre".into(),
    })?;
    let (mut low, mut high) = (0.0, most);
    if let Some(found) = attempt(most) {
        (low, best) = (most, found);
    }
    while high - low > 0.01 * high {
        let middle = 0.5 * (low + high);
        match attempt(middle) {
            Some(found) => (low, best) = (middle, found),
            None => high = middle,
        }
    }
    Ok(best)
}

/// In a frame at rest, any box of speed |ω̄| ≤ `speed` and flux |λ̄| ≤ `flux` at a rate below min(D/J, η), in closed form.
///
/// The speed error is autonomous (ė_ω = −(D/J)e_ω), fluxes and currents have the closed form of Kubota's gain at rate
/// just below η in the norm diag(β²,β²,1,1), and a large enough weight on the speed error covers the cascade.
///
/// # Errors
/// [`DesignError::Infeasible`] without friction, or a rate above the limit.
pub fn any_box(
    plant: DesignModel,
    speed_rad_s: f64,
    flux_vs: f64,
    rate_per_s: f64,
) -> Result<(BoxDesign, Certificate), DesignError> {
    let c = plant.constants::<f64>();
    let limit = c.friction_rate.min(c.eta);
    if rate_per_s.is_nan() || rate_per_s >= limit {
        return Err(DesignError::Infeasible {
            constraint: format!("at λ̄ = 0 the speed error decays at D/J = {:.6} 1/s whatever the gain", c.friction_rate),
            feasible: format!("a rate below {limit:.6} 1/s, or a box in the turning frame away from zero flux"),
        });
    }
    // In the frame at rest ω_s = −n_p ω̄; the gain may not depend on ω̄, so it cancels the coupling at rest only and
    // the current gain l₂ dominates the rest: |βn_pω̄| ≤ 2·√((η−α)(γ+l₂−α)) in these units.
    let w = c.n_p * speed_rad_s;
    let slack = c.eta - rate_per_s;
    let l2 = (w * w / slack).max(1.0) - c.gamma + rate_per_s + 1.0;
    let mut gain = Matrix::zeros(5, 2);
    gain.put(1, 0, &model::complex(&(c.eta_l_m + c.eta / c.beta), &0.0));
    gain.put(3, 0, &model::complex(&l2, &0.0));
    let slowest = (c.friction_rate - rate_per_s).min(slack).min(1.0);
    let push = c.n_p * c.beta * flux_vs;
    let weight = 64.0 * push * push / (slowest * slowest).max(1e-300);
    let b2 = c.beta * c.beta;
    let p = Matrix::diagonal(&[weight.max(1.0), b2, b2, 1.0, 1.0]);
    let region = BoxRegion {
        frame_rad_s: [0.0; 2],
        slip_rad_s: [-w, w],
        flux_d_vs: [-flux_vs, flux_vs],
        flux_q_vs: [-flux_vs, flux_vs],
        current_d_a: [0.0; 2],
        current_q_a: [0.0; 2],
    };
    seal(plant, &region, rate_per_s, (p, gain, Matrix::zeros(5, 2)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;

    /// From 30 % to 100 % speed, ±10 % flux, ±rated slip and some misalignment.
    pub(crate) fn region() -> BoxRegion {
        BoxRegion {
            frame_rad_s: [100.0, 314.0],
            slip_rad_s: [-8.0, 8.0],
            flux_d_vs: [0.85, 1.05],
            flux_q_vs: [-0.05, 0.05],
            current_d_a: [0.0; 2],
            current_q_a: [0.0; 2],
        }
    }

    #[test]
    fn jacobian_at_the_mean_is_the_exact_difference() {
        let c = LinearMachine::jadot_table_i().constants::<f64>();
        let (x, y) = ([80.0, 0.9, 0.1, 5.0, 12.0], [95.0, 0.7, -0.2, 9.0, -3.0]);
        let (fx, fy) = (model::derivative(&c, &x, [0.0; 2], 0.0), model::derivative(&c, &y, [0.0; 2], 0.0));
        let mean: Vec<f64> = (0..5).map(|k| 0.5 * (x[k] + y[k])).collect();
        // Frame at rest: ω_s = −n_p ω̄.
        let f = jacobian(&c, &[0.0, -c.n_p * mean[0], mean[1], mean[2], 0.0, 0.0]);
        let e = Matrix::from_fn(5, 1, |i, _| y[i] - x[i]);
        let fe = &f * &e;
        (1..5).for_each(|k| assert!((fe[(k, 0)] - (fy[k] - fx[k])).abs() < 1e-9 * fy[k].abs().max(1.0)));
    }

    #[test]
    fn a_wide_box_beats_friction_by_orders_of_magnitude() {
        let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
        let (design, certificate) = fastest(plant, &region(), 100.0, 1e5).unwrap();
        certificate.check().unwrap();
        assert!(design.rate_per_s > 1.0, "{}", design.rate_per_s);
    }

    #[test]
    fn any_box_is_feasible_below_friction() {
        let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
        let (_, certificate) = any_box(plant, 200.0, 1.5, 0.2).unwrap();
        certificate.check().unwrap();
        let (_, certificate) = any_box(plant, 2000.0, 50.0, 0.23).unwrap();
        certificate.check().unwrap();
        assert!(matches!(any_box(plant, 1.0, 0.1, 0.24), Err(DesignError::Infeasible { .. })));
    }

    #[test]
    fn the_largest_box_at_a_rate_is_wider_than_the_one_asked_for() {
        let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
        let small = region().scaled(0.2);
        let (design, certificate) = largest_box(plant, &small, 20.0, 1.0, 1e5).unwrap();
        certificate.check().unwrap();
        let width = |[low, high]: [f64; 2]| high - low;
        assert!(width(design.region.frame_rad_s) > 2.0 * width(small.frame_rad_s));
    }

    #[test]
    fn the_torque_may_be_modelled_with_the_measured_current() {
        let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
        let region = BoxRegion {
            frame_rad_s: [200.0, 300.0],
            slip_rad_s: [-4.0, 4.0],
            flux_d_vs: [0.9, 1.0],
            flux_q_vs: [-0.02, 0.02],
            current_d_a: [5.0, 7.0],
            current_q_a: [-4.0, 4.0],
        };
        assert_eq!(region.vertices().len(), 64);
        let (design, certificate) = fastest(plant, &region, 50.0, 1e5).unwrap();
        certificate.check().unwrap();
        assert!(design.rate_per_s > 0.5, "{}", design.rate_per_s);
    }

    #[test]
    fn an_impossible_rate_says_what_is_possible() {
        let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
        let error = design(plant, &region(), 1e4, 1e5).unwrap_err();
        assert!(error.to_string().contains("up to"), "{error}");
    }
}
