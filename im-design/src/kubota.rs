//! The gain of Kubota's full-order observer, over a speed range, with a decay rate.
//!
//! Error dynamics ė = (A_r(ω) − L(ω)C)e; the gain is affine in speed, L(ω) = L₀ + ωL₁, and the certificate is
//!
//! ```text
//! (A_r − LC)ᵀP + P(A_r − LC) + 2αP < 0   at both ends of the range, hence (affine in ω, common P) in between.
//! ```
//!
//! With P = I this is (3) of Kwon et al. (2005), whose feasibility "appears to be unknown". It is always feasible. On
//! the null space of C, the fluxes, the left side is −2η I < 0 whatever L; and with l₁ = ηL_m + β(η + jn_pω), the
//! complex form of the upper block of L, the off-diagonal block vanishes:
//!
//! ```text
//! (A_r − LC)ᵀ + (A_r − LC) = diag(−2η, −2η, −2γ − 2l₂, −2γ − 2l₂).
//! ```
//!
//! The same null space shows that no gain reaches a rate above η with P = I.

use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, not_negative, ordered, positive};
use crate::exact::Field;
use crate::lmi::{Affine, Problem};
use crate::machine::Constants;
use crate::matrix::Matrix;
use crate::model;
use serde::{Deserialize, Serialize};

/// A gain affine in the mechanical speed, with its proof.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KubotaDesign {
    /// Mechanical speeds the proof covers, rad/s.
    pub speed_rad_s: [f64; 2],
    /// Proven decay rate, 1/s.
    pub rate_per_s: f64,
    /// L₀, 4 × 2, rows (λ_a, λ_b, i_a, i_b), columns (i_a, i_b).
    pub gain: Matrix<f64>,
    /// L₁: the gain at speed ω is L₀ + ω L₁.
    pub gain_per_speed: Matrix<f64>,
    /// P; the identity for (3) itself.
    pub p: Matrix<f64>,
}

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KubotaRequest {
    /// Mechanical speeds to cover, rad/s.
    pub speed_rad_s: [f64; 2],
    /// Decay rate, 1/s; below η.
    pub rate_per_s: f64,
    /// w of P = diag(w, w, 1, 1): 1 is (3) itself; β² weighs a flux error by the current it drives and needs less gain.
    pub flux_weight: f64,
}

impl KubotaRequest {
    fn validate(&self, c: &Constants<f64>) -> Result<(), DesignError> {
        ordered("speed_rad_s", self.speed_rad_s)?;
        positive("flux_weight", self.flux_weight)?;
        not_negative("rate_per_s", self.rate_per_s)?;
        if self.rate_per_s >= c.eta {
            return Err(DesignError::Infeasible {
                constraint: format!("the fluxes, the null space of C, decay at η = {:.6} 1/s in this norm", c.eta),
                feasible: format!("a rate from 0 to just below {:.6} 1/s", c.eta),
            });
        }
        Ok(())
    }

    fn weights(&self) -> Matrix<f64> {
        Matrix::diagonal(&[self.flux_weight, self.flux_weight, 1.0, 1.0])
    }
}

impl KubotaDesign {
    /// L(ω).
    pub fn gain_at(&self, speed_rad_s: f64) -> Matrix<f64> {
        &self.gain + &self.gain_per_speed.scaled(&speed_rad_s)
    }

    /// A_r(ω) − L(ω)C.
    pub fn error_matrix<F: Field>(&self, c: &Constants<F>, speed: f64) -> Matrix<F> {
        let omega = F::from_f64(speed);
        let gain = &Matrix::exact(&self.gain) + &Matrix::exact(&self.gain_per_speed).scaled(&omega);
        &model::reduced(c, &omega) - &(&gain * &model::reduced_output())
    }
}

impl Claim for KubotaDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        let shapes = [&self.gain, &self.gain_per_speed].map(|m| (m.rows(), m.cols()));
        if shapes != [(4, 2); 2] || (self.p.rows(), self.p.cols()) != (4, 4) {
            return Err("the gains must be 4 × 2 and P 4 × 4".into());
        }
        let p = Matrix::<F>::exact(&self.p);
        let two_alpha = F::from_f64(2.0) * F::from_f64(self.rate_per_s);
        let mut obligations = vec![Obligation::Definite("P".into(), p.clone())];
        for speed in self.speed_rad_s {
            let flow = &p * &self.error_matrix(c, speed);
            let decay = -&(&flow.plus_transpose() + &p.scaled(&two_alpha));
            obligations.push(Obligation::Definite(format!("decay at {speed} rad/s"), decay).limit());
        }
        Ok(obligations)
    }
}

/// The closed form: feasible for every machine, every speed range and every rate below η.
///
/// With the weight w the coupling vanishes for l₁ = ηL_m + (β/w)(η + jn_pω); l₂ = max(0, 1.01 α − γ).
///
/// # Errors
/// A rate at or above η, or a range that is not one.
pub fn closed_form(plant: DesignModel, request: &KubotaRequest) -> Result<(KubotaDesign, Certificate), DesignError> {
    let c = plant.constants::<f64>();
    request.validate(&c)?;
    let k = c.beta / request.flux_weight;
    let mut gain = Matrix::zeros(4, 2);
    gain.put(0, 0, &model::complex(&(c.eta_l_m + k * c.eta), &0.0));
    gain.put(2, 0, &model::complex(&(1.01 * request.rate_per_s - c.gamma).max(0.0), &0.0));
    let mut gain_per_speed = Matrix::zeros(4, 2);
    gain_per_speed.put(0, 0, &model::complex(&0.0, &(k * c.n_p)));
    seal(plant, request, gain, gain_per_speed)
}

/// The gain of least Frobenius norm over the range (root of the sum of squares at both ends), by SDP.
///
/// # Errors
/// A rate at or above η, a range that is not one, solver failures.
pub fn least_norm(plant: DesignModel, request: &KubotaRequest) -> Result<(KubotaDesign, Certificate), DesignError> {
    let c = plant.constants::<f64>();
    request.validate(&c)?;
    let [low, high] = request.speed_rad_s;
    let ends: &[f64] = if low == high { &[low] } else { &[low, high] };
    // Currents in units where a flux error and the current it drives are of one size: condition, not meaning.
    let root = request.weights();
    let root = Matrix::from_fn(4, 4, |i, j| root[(i, j)].sqrt());
    let inverse = root.inverse_diagonal();
    let mut lmi = Problem::new("Kubota gain");
    let (size, mut at) = (lmi.scalar(), Vec::new());
    for &speed in ends {
        let gain = lmi.matrix(4, 2);
        let flow = Affine::constant(&model::reduced(&c, &speed)) - gain.right(&model::reduced_output());
        let flow = flow.left(&root).right(&inverse);
        // A rate a little above the one asked for leaves the exact proof its margin.
        let rate = request.rate_per_s + 1e-4 * (c.eta - request.rate_per_s);
        let decay = flow.plus_transpose() + &Affine::constant(&Matrix::identity(4).scaled(&(2.0 * rate)));
        lmi.negative(format!("decay at {speed} rad/s"), decay);
        at.push(gain);
    }
    let all: Vec<Vec<&Affine>> = at.iter().map(|g| vec![g]).collect();
    let all: Vec<&[&Affine]> = all.iter().map(Vec::as_slice).collect();
    lmi.norm_below("size of the gain", &Affine::blocks(&all), &size);
    lmi.minimize(size);
    let answer = lmi.solve()?;
    let first = answer.value(&at[0]);
    let (gain, gain_per_speed) = match at.get(1) {
        None => (first, Matrix::zeros(4, 2)),
        Some(second) => {
            let slope = (&answer.value(second) - &first).scaled(&(1.0 / (high - low)));
            (&first - &slope.scaled(&low), slope)
        }
    };
    // The machine does not know the direction of its axes, and observers in space vectors take gains that do not either.
    let [gain, gain_per_speed] = [gain, gain_per_speed].map(|m| m.space_vectors().without_dust());
    seal(plant, request, gain, gain_per_speed)
}

fn seal(
    plant: DesignModel,
    request: &KubotaRequest,
    gain: Matrix<f64>,
    gain_per_speed: Matrix<f64>,
) -> Result<(KubotaDesign, Certificate), DesignError> {
    let KubotaRequest { speed_rad_s, rate_per_s, .. } = *request;
    let design = KubotaDesign { speed_rad_s, rate_per_s, gain, gain_per_speed, p: request.weights() };
    let certificate = Certificate::seal(plant, design.clone())?;
    Ok((design, certificate))
}

/// The highest rate, to 0.1 %, that some P proves for a given gain, and that P.
///
/// # Errors
/// [`DesignError::Infeasible`] when no common P exists at all.
pub fn best_rate(plant: DesignModel, design: &KubotaDesign) -> Result<(KubotaDesign, Certificate), DesignError> {
    let c = plant.constants::<f64>();
    let ends = design.speed_rad_s.map(|speed| design.error_matrix(&c, speed));
    let scale = Matrix::diagonal(&[1.0 / c.beta, 1.0 / c.beta, 1.0, 1.0]);
    let (rate, p) = common_decay(&ends, &scale)?;
    // A little below the rate found, so that rounding cannot eat the margin of the exact proof.
    let design = KubotaDesign { rate_per_s: 0.999 * rate, p, ..design.clone() };
    let certificate = Certificate::seal(plant, design.clone())?;
    Ok((design, certificate))
}

/// Largest common decay rate (to 0.1 %) of several matrices in one quadratic norm, and its P.
///
/// `scale` holds the size of each state, for conditioning only.
///
/// # Errors
/// [`DesignError::Infeasible`] when not even rate zero has a common P.
pub fn common_decay(vertices: &[Matrix<f64>], scale: &Matrix<f64>) -> Result<(f64, Matrix<f64>), DesignError> {
    let n = scale.rows();
    let inverse = scale.inverse_diagonal();
    let scaled: Vec<_> = vertices.iter().map(|a| &(&inverse * a) * scale).collect();
    let at_rate = |rate: f64| -> Option<Matrix<f64>> {
        let mut lmi = Problem::new("common Lyapunov function");
        let (p, t) = (lmi.symmetric(n), lmi.scalar());
        lmi.positive("P ≥ t", &p - &t.times(&Matrix::identity(n)));
        lmi.positive("P ≤ 1", -(&p - &Matrix::identity(n)));
        for a in &scaled {
            // Normalized by the matrix's own size, so that t is a relative margin.
            let size = a.norm().max(1e-300);
            let shifted = a + &Matrix::identity(n).scaled(&rate);
            lmi.negative("decay", (p.right(&shifted) * (1.0 / size)).plus_transpose() + t.times(&Matrix::identity(n)) * 1e-3);
        }
        lmi.maximize(t.clone());
        let answer = lmi.solve().ok()?;
        let p = answer.value(&p);
        let proven = |a: &Matrix<f64>| {
            let slope = (&p * &(a + &Matrix::identity(n).scaled(&rate))).plus_transpose();
            crate::linalg::symmetric_eigenvalues(&slope)[n - 1] < 0.0
        };
        (crate::linalg::symmetric_eigenvalues(&p)[0] > 0.0 && scaled.iter().all(proven)).then_some(p)
    };
    let bound = -scaled.iter().map(crate::linalg::spectral_abscissa).fold(f64::NEG_INFINITY, f64::max);
    let infeasible = || {
        let constraint = if bound > 0.0 {
            format!("one norm for the whole region (each vertex alone is stable, the slowest at {bound:.4} 1/s)")
        } else {
            format!("an unstable vertex of the region (eigenvalue {:.4} 1/s)", -bound)
        };
        DesignError::Infeasible { constraint, feasible: "a smaller region".into() }
    };
    if bound.is_nan() || bound <= 0.0 {
        return Err(infeasible());
    }
    let (mut low, mut high) = (0.0, bound);
    let mut best = at_rate(0.0).ok_or_else(infeasible)?;
    while high - low > 1e-3 * high.max(1e-9) && high > 1e-6 * bound {
        let middle = 0.5 * (low + high);
        match at_rate(middle) {
            Some(p) => (low, best) = (middle, p),
            None => high = middle,
        }
    }
    Ok((low, (&(&inverse * &best) * &inverse).symmetrized()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;

    fn request(rate_per_s: f64) -> KubotaRequest {
        KubotaRequest { speed_rad_s: [-190.0, 190.0], rate_per_s, flux_weight: 1.0 }
    }

    /// Complex analysis of the optimum: minimize (d − r)² + l₂² with r² = 4(η−α)(γ+l₂−α), d = |ηL_m + β(η + jn_pω)|.
    fn least_norm_by_hand(c: &Constants<f64>, speed: f64, rate: f64) -> f64 {
        let d = (c.eta_l_m + c.beta * c.eta).hypot(c.beta * c.n_p * speed);
        let cost = |l2: f64| {
            let r = 2.0 * ((c.eta - rate) * (c.gamma + l2 - rate)).max(0.0).sqrt();
            (2.0 * ((d - r).max(0.0).powi(2) + l2 * l2)).sqrt()
        };
        let (mut low, mut high) = (rate - c.gamma, d * d);
        for _ in 0..300 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if cost(a) < cost(b) { high = b } else { low = a }
        }
        cost(low)
    }

    #[test]
    fn closed_form_is_feasible_and_block_diagonal() {
        let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
        let (design, certificate) = closed_form(plant, &request(1.0)).unwrap();
        certificate.check().unwrap();
        let c = plant.constants::<f64>();
        let m = design.error_matrix(&c, 123.0).plus_transpose();
        assert!((m[(0, 0)] + 2.0 * c.eta).abs() < 1e-9 && (m[(2, 2)] + 2.0 * c.gamma).abs() < 1e-9);
        assert!(m[(0, 2)].abs() + m[(0, 3)].abs() < 1e-9 * m.norm());
    }

    #[test]
    fn least_norm_agrees_with_complex_analysis() {
        let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
        let c = plant.constants::<f64>();
        for (speed, rate) in [(0.0, 0.5), (150.0, 0.5), (-60.0, 1.2)] {
            let request = KubotaRequest { speed_rad_s: [speed; 2], rate_per_s: rate, flux_weight: 1.0 };
            let (design, certificate) = least_norm(plant, &request).unwrap();
            certificate.check().unwrap();
            let by_hand = least_norm_by_hand(&c, speed, rate);
            assert!((design.gain.norm() / by_hand - 1.0).abs() < 1e-3, "{} {by_hand}", design.gain.norm());
        }
    }

    #[test]
    fn scheduled_gain_is_smaller_than_the_closed_form_and_proven() {
        let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
        let (closed, _) = closed_form(plant, &request(0.8)).unwrap();
        let (least, certificate) = least_norm(plant, &request(0.8)).unwrap();
        certificate.check().unwrap();
        assert!(least.gain_at(190.0).norm() < closed.gain_at(190.0).norm());
    }

    #[test]
    fn a_rate_of_eta_is_refused_with_what_is_feasible() {
        let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
        let error = closed_form(plant, &request(2.0)).unwrap_err();
        assert!(error.to_string().contains("1.66"), "{error}");
    }

    #[test]
    fn best_rate_improves_on_the_identity() {
        let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
        let (design, _) = closed_form(plant, &request(1.0)).unwrap();
        let (better, certificate) = best_rate(plant, &design).unwrap();
        certificate.check().unwrap();
        assert!(better.rate_per_s > 1.6, "{}", better.rate_per_s);
    }
}
