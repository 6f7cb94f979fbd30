//! Observer gains for a sampling period.
//!
//! Under forward Euler e⁺ = (I + h(A_r(ω) − L(ω)C))e, and the certificate is, at both ends of the speed range,
//!
//! ```text
//! [ρ²P          (P + hP(A_r − LC))ᵀ]
//! [P + hP(A_r − LC)               P]  > 0,   ρ < 1,
//! ```
//!
//! affine in ω with a common P: eᵀPe falls at least by ρ² per sample. For the trapezoidal rule nothing is needed:
//! with M = (I − hA/2)⁻¹(I + hA/2), MᵀPM − P = h(I − hA/2)⁻ᵀ(AᵀP + PA)(I − hA/2)⁻¹, so a continuous certificate
//! (kubota, thau_box) holds for the sampled observer at *every* period; the implicit Euler rule likewise.

mod adaptive;
mod boundary_layer;
mod lipschitz;
mod regulation;
mod switching;
mod turning;
mod utkin;

pub use adaptive::{SampledCell, SampledLoopDesign, adaptive};
pub use boundary_layer::{SampledDerdiyokDesign, derdiyok};
pub use lipschitz::{SampledThauDesign, thau};
pub use regulation::{HeldProof, SampledJadotDesign, regulation};
pub use switching::{SampledKenneDesign, switching};
pub use turning::{SampledBoxDesign, over_box};
pub use utkin::{SampledUtkinDesign, utkin};

use crate::certificate::validity;
use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, ordered, positive};
use crate::exact::Field;
use crate::kubota::KubotaDesign;
use crate::linalg;
use crate::lmi::{Affine, Problem};
use crate::machine::Constants;
use crate::matrix::Matrix;
use crate::model;
use serde::{Deserialize, Serialize};

/// A gain affine in the mechanical speed, proven for forward Euler at a period.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledDesign {
    /// Mechanical speeds the proof covers, rad/s.
    pub speed_rad_s: [f64; 2],
    /// Sampling period h, s.
    pub period_s: f64,
    /// ρ: the error shrinks at least by this factor per sample, in the norm of P.
    pub contraction: f64,
    /// L₀, 4 × 2, of the continuous observer (it is multiplied by h in the step).
    pub gain: Matrix<f64>,
    /// L₁: the gain at speed ω is L₀ + ω L₁.
    pub gain_per_speed: Matrix<f64>,
    /// P.
    pub p: Matrix<f64>,
}

impl SampledDesign {
    fn continuous(&self) -> KubotaDesign {
        KubotaDesign {
            speed_rad_s: self.speed_rad_s,
            rate_per_s: 0.0,
            gain: self.gain.clone(),
            gain_per_speed: self.gain_per_speed.clone(),
            p: self.p.clone(),
        }
    }

    /// I + h(A_r(ω) − L(ω)C).
    pub fn step_matrix<F: Field>(&self, c: &Constants<F>, speed: f64) -> Matrix<F> {
        &Matrix::identity(4) + &self.continuous().error_matrix(c, speed).scaled(&F::from_f64(self.period_s))
    }
}

impl Claim for SampledDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        let shapes = [&self.gain, &self.gain_per_speed].map(|m| (m.rows(), m.cols()));
        if shapes != [(4, 2); 2] || (self.p.rows(), self.p.cols()) != (4, 4) {
            return Err("the gains must be 4 × 2 and P 4 × 4".into());
        }
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
        for speed in self.speed_rad_s {
            let pm = &p * &self.step_matrix(c, speed);
            let block = Matrix::blocks(&[&[&p.scaled(&(rho.clone() * rho.clone())), &pm.t()], &[&pm, &p]]);
            obligations.push(Obligation::Definite(format!("contraction at {speed} rad/s"), block));
        }
        Ok(obligations)
    }
}

/// P, L₀, L₁.
pub(crate) type Found = (Matrix<f64>, Matrix<f64>, Matrix<f64>);
type Sealed = (SampledDesign, Certificate);

/// An observer's error dynamics over a polytope: A at its vertices, and the number that schedules L₀ + s L₁ there.
pub(crate) struct Polytope {
    /// A and s.
    pub vertices: Vec<(Matrix<f64>, f64)>,
    /// C.
    pub output: Matrix<f64>,
    /// Size of each state, for conditioning only.
    pub scale: Vec<f64>,
    /// A typical rate, 1/s, likewise.
    pub rate_unit: f64,
}

impl Polytope {
    /// P and, when it is not given, the gain for one period and contraction.
    pub fn at_period(&self, period: f64, contraction: f64, fixed: Option<(&Matrix<f64>, &Matrix<f64>)>) -> Option<Found> {
        let n = self.scale.len();
        let scale = Matrix::diagonal(&self.scale);
        let inverse = scale.inverse_diagonal();
        let output = &self.output * &scale;
        // The measured outputs are of one size.
        let output = output.scaled(&(1.0 / output.norm()));
        let mut lmi = Problem::new("sampled observer");
        let (p, t) = (lmi.symmetric(n), lmi.scalar());
        let unit = self.vertices.iter().fold(1.0f64, |m, (_, s)| m.max(s.abs()));
        let (y0, y1) = (lmi.matrix(n, output.rows()), lmi.matrix(n, output.rows()));
        lmi.positive("P ≤ 1", -(&p - &Matrix::identity(n)));
        lmi.positive("P ≥ t", &p - &t.times(&Matrix::identity(n)));
        // Subtracting the second block row and column from the first, and scaling by h, leaves the continuous inequality
        // with a correction of order h, well conditioned however short the period:
        // [(ρ²−1)P/h − N − Nᵀ   √h Nᵀ; √h N   P] > 0 with N = P(A − LC).
        let excess = (contraction * contraction - 1.0) / period;
        for (k, (a, schedule)) in self.vertices.iter().enumerate() {
            let flow = match fixed {
                Some((l0, l1)) => {
                    let closed = a - &(&(l0 + &l1.scaled(schedule)) * &self.output);
                    p.right(&(&(&inverse * &closed) * &scale))
                }
                None => {
                    let y = &y0 + &(&y1 * (schedule / unit));
                    p.right(&(&(&inverse * a) * &scale)) - y.right(&output)
                }
            };
            let first = &(&p * excess) - &flow.plus_transpose() - t.times(&Matrix::identity(n)) * self.rate_unit;
            let coupling = &flow * period.sqrt();
            lmi.positive(
                format!("contraction at vertex {k}"),
                Affine::blocks(&[&[&first, &coupling.transpose()], &[&coupling, &p]]),
            );
        }
        if fixed.is_some() {
            // The unknown gain is not used: pin it.
            let zero = Affine::constant(&Matrix::from_rows(&[[1.0]]));
            lmi.norm_below("unused", &Affine::blocks(&[&[&y0, &y1]]), &zero);
        }
        lmi.maximize(t.clone());
        let answer = lmi.solve().ok()?;
        if answer.scalar(&t) <= 0.0 {
            return None;
        }
        let p = answer.value(&p);
        let (gain, slope) = match fixed {
            Some((l0, l1)) => (l0.clone(), l1.clone()),
            None => {
                let size = (&self.output * &scale).norm();
                let solve = |y: &Matrix<f64>| (&scale * &linalg::solve(&p, y)).scaled(&(1.0 / size));
                (solve(&answer.value(&y0)), solve(&answer.value(&y1)).scaled(&(1.0 / unit)))
            }
        };
        Some(((&(&inverse * &p) * &inverse).symmetrized(), gain, slope))
    }
}

/// Error dynamics of the flux observer over a range of speeds.
fn full_order(c: &Constants<f64>, speeds: [f64; 2]) -> Polytope {
    Polytope {
        vertices: speeds.map(|speed| (model::reduced(c, &speed), speed)).into(),
        output: model::reduced_output(),
        scale: vec![1.0 / c.beta, 1.0 / c.beta, 1.0, 1.0],
        rate_unit: c.eta,
    }
}

/// The largest period up to `most_s` at which an attempt succeeds, to 1 %, with what it gives.
pub(crate) fn longest<T>(most_s: f64, attempt: impl Fn(f64) -> Option<T>) -> Option<T> {
    let mut low = most_s;
    let mut best = attempt(low);
    while best.is_none() {
        low *= 0.5;
        if low < 1e-6 * most_s {
            return None;
        }
        best = attempt(low);
    }
    let mut top = (2.0 * low).min(most_s);
    while top - low > 0.01 * top {
        let middle = 0.5 * (low + top);
        match attempt(middle) {
            Some(found) => (low, best) = (middle, Some(found)),
            None => top = middle,
        }
    }
    best
}

/// The same to 3 %, between two periods, where an attempt costs more: when the shortest fails, so do all.
pub(crate) fn longest_from<T>(least_s: f64, most_s: f64, attempt: impl Fn(f64) -> Option<T>) -> Option<T> {
    if let Some(found) = attempt(most_s) {
        return Some(found);
    }
    let mut best = attempt(least_s)?;
    let (mut low, mut high) = (least_s, most_s);
    while high > 1.03 * low {
        let middle = (low * high).sqrt();
        match attempt(middle) {
            Some(found) => (low, best) = (middle, found),
            None => high = middle,
        }
    }
    Some(best)
}

/// A proven design for one period and rate, if there is one.
fn attempt(
    plant: DesignModel,
    speed_rad_s: [f64; 2],
    period_s: f64,
    rate_per_s: f64,
    fixed: Option<&KubotaDesign>,
) -> Option<Sealed> {
    let contraction = (-rate_per_s * period_s).exp();
    let fixed = fixed.map(|d| (&d.gain, &d.gain_per_speed));
    let polytope = full_order(&plant.constants::<f64>(), speed_rad_s);
    // The machine does not know the direction of its axes, and observers in space vectors take gains that do not either.
    let (p, gain, gain_per_speed) = polytope.at_period(period_s, contraction, fixed)?;
    let [p, gain, gain_per_speed] = [p, gain, gain_per_speed].map(|m| m.space_vectors().without_dust());
    let design = SampledDesign { speed_rad_s, period_s, contraction, gain, gain_per_speed, p };
    let certificate = Certificate::seal(plant, design.clone()).ok()?;
    Some((design, certificate))
}

/// A gain that contracts by e^(−αh) per sample of forward Euler at period h.
///
/// # Errors
/// [`DesignError::Infeasible`] with the largest period at which the rate can be had.
pub fn design(plant: DesignModel, speed_rad_s: [f64; 2], period_s: f64, rate_per_s: f64) -> Result<Sealed, DesignError> {
    meaningful(&plant.constants(), period_s)?;
    positive("rate_per_s", rate_per_s)?;
    ordered("speed_rad_s", speed_rad_s)?;
    let attempt = |h: f64| attempt(plant, speed_rad_s, h, rate_per_s, None);
    if let Some(found) = attempt(period_s) {
        return Ok(found);
    }
    let feasible = match longest(period_s, attempt) {
        Some((d, _)) => format!("this rate at periods up to {:.2} µs, or the trapezoidal rule at any period", 1e6 * d.period_s),
        None => "a lower rate, or a narrower range of speeds".into(),
    };
    Err(DesignError::Infeasible { constraint: format!("forward Euler at {period_s} s over the whole speed range"), feasible })
}

/// A gain for the largest period, to 1 %, at which forward Euler contracts by e^(−αh) per sample.
///
/// # Errors
/// [`DesignError::Infeasible`] when none is found from `most_s` down to a millionth of it.
pub fn design_for_largest_period(
    plant: DesignModel,
    speed_rad_s: [f64; 2],
    rate_per_s: f64,
    most_s: f64,
) -> Result<Sealed, DesignError> {
    positive("rate_per_s", rate_per_s)?;
    ordered("speed_rad_s", speed_rad_s)?;
    let most_s = most_s.min(0.999 * longest_meaningful_s(&plant.constants()));
    longest(most_s, |h| attempt(plant, speed_rad_s, h, rate_per_s, None)).ok_or_else(|| no_period(rate_per_s, most_s))
}

/// Longest period at which a step of forward Euler is an image of the machine: from hγ = 1 on the currents' own decay turns
/// round, and what is proven of the steps says nothing of the machine.
pub(crate) fn longest_meaningful_s(c: &Constants<f64>) -> f64 {
    1.0 / c.gamma
}

/// That hγ < 1, of a proof by forward Euler.
fn image_of_the_machine<F: Field>(c: &Constants<F>, period_s: f64) -> Obligation<F> {
    Obligation::Exceeds("1 over period times gamma".into(), F::one(), F::from_f64(period_s) * c.gamma.clone())
}

/// A period must be one that a drive may have.
pub(crate) fn usual(period_s: f64) -> Result<(), DesignError> {
    if validity::PERIODS_S.contains(&period_s) {
        return Ok(());
    }
    let (low, high) = (validity::PERIODS_S.start, validity::PERIODS_S.end);
    Err(DesignError::request(format!("a period of {period_s:e} s is not between {low:e} and {high} s; usual are 20 to 500 µs")))
}

/// A period must be usual, and meaningful.
pub(crate) fn meaningful(c: &Constants<f64>, period_s: f64) -> Result<(), DesignError> {
    usual(period_s)?;
    let most = longest_meaningful_s(c);
    if period_s < most {
        return Ok(());
    }
    Err(DesignError::Infeasible {
        constraint: format!("forward Euler at {period_s} s against γ = {:.1} 1/s", c.gamma),
        feasible: format!("periods up to {:.2} µs", 1e6 * most),
    })
}

/// No period works.
pub(crate) fn no_period(rate_per_s: f64, most_s: f64) -> DesignError {
    DesignError::Infeasible {
        constraint: format!(
            "a rate of {rate_per_s} 1/s under forward Euler at any period from {:e} to {most_s:e} s",
            1e-6 * most_s
        ),
        feasible: "a lower rate, or the trapezoidal rule, which keeps the continuous rate at any period".into(),
    }
}

/// The largest period, to 1 %, at which forward Euler keeps a given gain contracting by e^(−αh).
///
/// # Errors
/// [`DesignError::Infeasible`] when no period up to `most_s` down to a millionth of it works.
pub fn largest_period(plant: DesignModel, design: &KubotaDesign, rate_per_s: f64, most_s: f64) -> Result<Sealed, DesignError> {
    positive("most_s", most_s)?;
    positive("rate_per_s", rate_per_s)?;
    let most_s = most_s.min(0.999 * longest_meaningful_s(&plant.constants()));
    longest(most_s, |h| attempt(plant, design.speed_rad_s, h, rate_per_s, Some(design)))
        .ok_or_else(|| no_period(rate_per_s, most_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;
    use crate::kubota::{KubotaRequest, closed_form};

    fn plant() -> DesignModel {
        DesignModel::Machine(LinearMachine::jadot_table_i())
    }

    #[test]
    fn a_gain_made_for_the_period_is_certified_and_contracts() {
        let (design, certificate) = design(plant(), [-160.0, 160.0], 50e-6, 2.0).unwrap();
        certificate.check().unwrap();
        let c = plant().constants::<f64>();
        for speed in [-160.0, -30.0, 0.0, 90.0, 160.0] {
            let radius = linalg::spectral_radius(&design.step_matrix(&c, speed));
            assert!(radius <= design.contraction, "{radius} {}", design.contraction);
        }
    }

    #[test]
    fn largest_period_of_the_closed_form_is_where_euler_fails() {
        let c = plant().constants::<f64>();
        let largest = |speed_rad_s: [f64; 2], flux_weight: f64| {
            let request = KubotaRequest { speed_rad_s, rate_per_s: 3.0, flux_weight };
            let (continuous, _) = closed_form(plant(), &request).unwrap();
            let (sampled, certificate) = largest_period(plant(), &continuous, 1.0, 1e-3).unwrap();
            certificate.check().unwrap();
            (sampled.period_s, continuous)
        };
        // No P can beat the spectrum at one speed: |1 + hs| < 1 for every eigenvalue s.
        let (narrow, continuous) = largest([155.0, 160.0], c.beta * c.beta);
        let spectrum = linalg::eigenvalues(&continuous.error_matrix(&c, 160.0));
        let bound = spectrum.iter().map(|(x, y)| -2.0 * x / (x * x + y * y)).fold(f64::INFINITY, f64::min);
        assert!(narrow > 0.5 * bound && narrow < bound, "{narrow} {bound}");
        // One P for any change of speed over the whole range costs an order of magnitude.
        let (wide, _) = largest([-160.0, 160.0], c.beta * c.beta);
        assert!(wide > 20e-6 && wide < narrow, "{wide}");
        // (3) itself, in SI units, is out of any processor's reach.
        let (plain, _) = largest([-160.0, 160.0], 1.0);
        assert!(plain < 1e-6 && plain > 1e-8, "{plain}");
    }
}
