//! Jadot's loops with the controller's part held over each sample, on the machine in continuous time.
//!
//! x' = A x + A₁x(t_k) for t_k ≤ t < t_k+1 ≤ t_k + h, exactly, however the region's parameters move. With τ = t − t_k, w = x − x(t_k) and
//!
//! ```text
//! V = xᵀPx + h(h − τ)∫ e^(2α(s−t)) ẋᵀYẋ ds  over the sample so far,   V ≥ xᵀPx, equal at every t_k
//! V' + 2αV ≤ 2xᵀP(A + A₁)x − 2xᵀPA₁w + 2αxᵀPx + h²ẋᵀYẋ − q wᵀYw,     ẋ = (A + A₁)x − A₁w,   q = 1 − 2αh ≤ e^(−2αh)
//! ```
//!
//! (Jensen: τ∫ẋᵀYẋ ≥ wᵀYw, and τ ≤ h) the error falls like e^(−αt) at the samples if at every vertex
//!
//! ```text
//! [−P(A + A₁) − (A + A₁)ᵀP − 2αP    PA₁    −h(A + A₁)ᵀY]
//! [            A₁ᵀP                  qY        hA₁ᵀY    ]  > 0.
//! [        −hY(A + A₁)              hYA₁         Y      ]
//! ```
//!
//! Electrical errors (Δφ, Δi, η), K_P and v_r being the controller's: A₁ holds −(R_req + λ(T_r⁻¹ + jω_r)) in Δφ, the voltage
//! −(K_P/L_f)e^(jψ)((1 + hK_I)Δi + η) in Δi, K_I in η. The voltage is held at the stator, turned ahead to the middle of the sample, so that
//! |ψ| ≤ m = ½h|ω_s|; e^(jψ) lies in the triangle 1 + m², 1 − ½m² ± 2jm. Outer loop: δω_g = −k_p(Δω + ξ) and ξ' = k_iΔω are held.
//!
//! The electrical errors are proven cell by cell: no P serves all speeds at long periods. What is left out: the references of (17), (20), which the controller steps implicitly, are taken as continuous in the outer loop; a
//! delay of the voltage; what holding the feedforward over a sample does, which is a disturbance and no error dynamics.

use super::{longest_from, usual};
use crate::cells::{covered, halve};
use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::DesignError;
use crate::exact::Field;
use crate::jadot::{JadotDesign, JadotRequest};
use crate::linalg;
use crate::lmi::{Affine, Problem};
use crate::machine::Constants;
use crate::matrix::Matrix;
use crate::model::complex;
use serde::{Deserialize, Serialize};

/// A cell of speeds and slips with the proof of the electrical errors in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldCell {
    /// Electrical rotor speeds, rad/s.
    pub electrical_speed_rad_s: [f64; 2],
    /// Slips, electrical rad/s.
    pub slip_rad_s: [f64; 2],
    /// Its proof.
    pub proof: HeldProof,
}

/// The proof of one loop, or of one cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldProof {
    /// α, 1/s, at the samples.
    pub rate_per_s: f64,
    /// P, 6 × 6.
    pub p: Matrix<f64>,
    /// Y, 6 × 6.
    pub y: Matrix<f64>,
}

/// The gains with their proof for a period.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledJadotDesign {
    /// Gains and region, with the proof of the continuous loops.
    pub continuous: JadotDesign,
    /// Sampling period h, s: the longest time between two samples.
    pub period_s: f64,
    /// Of the electrical errors, in cells that cover the region.
    pub electrical: Vec<HeldCell>,
    /// Of the loop of speed, flux and current reference.
    pub outer: HeldProof,
}

/// A loop's [A, A₁].
type Loop<F> = [Matrix<F>; 2];

impl SampledJadotDesign {
    /// The electrical errors at a speed and slip, the voltage turned by `turn`, a complex number.
    fn electrical<F: Field>(&self, c: &Constants<F>, speed: f64, slip: f64, turn: [F; 2]) -> Loop<F> {
        let d = &self.continuous;
        let all = d.electrical(c, speed, slip);
        let f = F::from_f64;
        let (k_i, h) = (f(d.current_integral_per_s), f(self.period_s));
        let resistance = c.eta_l_m.clone() * c.beta.clone() / c.inverse_sigma_l_s.clone();
        let push = f(d.current_proportional_ohm) * c.inverse_sigma_l_s.clone();
        // What acts at once: all that the controller has no part in.
        let mut at_once = all.clone();
        at_once.put(0, 2, &complex(&resistance, &F::zero()));
        for k in [2, 3] {
            at_once[(k, k)] = at_once[(k, k)].clone() + push.clone();
        }
        at_once.put(2, 4, &Matrix::zeros(2, 2));
        at_once.put(4, 2, &Matrix::zeros(2, 2));
        let mut held = Matrix::zeros(6, 6);
        for (row, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            held[(row, 2 + k)] = all[(row, 2 + k)].clone() - at_once[(row, 2 + k)].clone();
        }
        let voltage = complex(&-(push.clone() * turn[0].clone()), &-(push * turn[1].clone()));
        held.put(2, 2, &voltage.scaled(&(F::one() + h * k_i.clone())));
        held.put(2, 4, &voltage);
        held.put(4, 2, &complex(&k_i, &F::zero()));
        [at_once, held]
    }

    /// The outer loop at a slip.
    fn outer<F: Field>(&self, c: &Constants<F>, slip: f64) -> Loop<F> {
        let all = self.continuous.outer(c, slip);
        let held = |i: usize, j: usize| (i, j) == (0, 1) || (j < 2 && (i == 3 || i == 5));
        let part =
            |wanted: bool| Matrix::from_fn(6, 6, |i, j| if held(i, j) == wanted { all[(i, j)].clone() } else { F::zero() });
        [part(false), part(true)]
    }

    /// The electrical errors at the vertices of a cell.
    fn corners<F: Field>(&self, c: &Constants<F>, [speed, slip]: [[f64; 2]; 2]) -> Vec<Loop<F>> {
        let f = F::from_f64;
        let points: Vec<_> = speed.into_iter().flat_map(|w| slip.map(|g| (w, g))).collect();
        let magnitude = |x: F| if x < F::zero() { -x } else { x };
        let most = points.iter().map(|(w, g)| magnitude(f(*w) + f(*g))).fold(F::zero(), |m, x| if x > m { x } else { m });
        let m = f(0.5) * f(self.period_s) * most;
        let (square, side) = (m.clone() * m.clone(), m.clone() + m);
        let low = F::one() - f(0.5) * square.clone();
        let turns = [[F::one() + square, F::zero()], [low.clone(), side.clone()], [low, -side]];
        points.iter().flat_map(|(w, g)| turns.clone().map(|turn| self.electrical(c, *w, *g, turn))).collect()
    }

    /// The outer loop at both ends of the slip.
    fn ends<F: Field>(&self, c: &Constants<F>) -> Vec<Loop<F>> {
        self.continuous.slip_rad_s.map(|slip| self.outer(c, slip)).into()
    }
}

/// The matrix of the header.
fn slack<F: Field>([a, a1]: &Loop<F>, p: &Matrix<F>, y: &Matrix<F>, h: &F, rate: &F) -> Matrix<F> {
    let two = F::one() + F::one();
    let closed = a + a1;
    let first = -&(&(p * &closed).plus_transpose() + &p.scaled(&(two.clone() * rate.clone())));
    let (held, fast, slow) = (p * a1, (y * &closed).scaled(&-h.clone()), (y * a1).scaled(h));
    let q = F::one() - two * rate.clone() * h.clone();
    Matrix::blocks(&[&[&first, &held, &fast.t()], &[&held.t(), &y.scaled(&q), &slow.t()], &[&fast, &slow, y]])
}

impl HeldProof {
    fn obligations<F: Field>(&self, of: &str, vertices: &[Loop<F>], h: &F) -> Result<Vec<Obligation<F>>, String> {
        if [&self.p, &self.y].iter().any(|m| (m.rows(), m.cols()) != (6, 6)) {
            return Err("P and Y must be 6 × 6".into());
        }
        let (p, y, rate) = (Matrix::exact(&self.p), Matrix::exact(&self.y), F::from_f64(self.rate_per_s));
        let mut obligations = vec![
            Obligation::Positive(format!("rate of {of}"), rate.clone()),
            Obligation::Definite(format!("P of {of}"), p.clone()),
        ];
        let at = |(k, vertex)| Obligation::Definite(format!("{of} held, vertex {k}"), slack(vertex, &p, &y, h, &rate));
        obligations.extend(vertices.iter().enumerate().map(at));
        Ok(obligations)
    }
}

impl Claim for SampledJadotDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        let cells: Vec<_> = self.electrical.iter().map(|cell| [cell.electrical_speed_rad_s, cell.slip_rad_s]).collect();
        covered::<F>(&cells, [self.continuous.electrical_speed_rad_s, self.continuous.slip_rad_s])?;
        let mut obligations = self.continuous.obligations(c)?;
        let h = F::from_f64(self.period_s);
        obligations.push(Obligation::Positive("period".into(), h.clone()));
        for (k, (cell, region)) in self.electrical.iter().zip(cells).enumerate() {
            obligations.extend(cell.proof.obligations(&format!("electrical cell {k}"), &self.corners(c, region), &h)?);
        }
        obligations.extend(self.outer.obligations("the outer loop", &self.ends(c), &h)?);
        Ok(obligations)
    }
}

/// P and Y for one loop at a rate, if there are any.
fn prove(vertices: &[Loop<f64>], scale: &[f64; 6], h: f64, rate: f64) -> Option<HeldProof> {
    let scale = Matrix::diagonal(scale);
    let inverse = scale.inverse_diagonal();
    let scaled: Vec<Loop<f64>> = vertices.iter().map(|v| [0, 1].map(|k| &(&inverse * &v[k]) * &scale)).collect();
    let unit = scaled.iter().map(|[a, a1]| (a + a1).norm()).fold(1e-9, f64::max);
    let mut lmi = Problem::new("loop with held control");
    // y = Y/unit, of the size of P.
    let (p, y, t) = (lmi.symmetric(6), lmi.symmetric(6), lmi.scalar());
    lmi.positive("P ≥ t", &p - &t.times(&Matrix::identity(6)));
    lmi.positive("P ≤ 1", -(&p - &Matrix::identity(6)));
    for [a, a1] in &scaled {
        let closed = a + a1;
        let first = -(p.right(&closed).plus_transpose() + &p * (2.0 * rate)) * (1.0 / unit);
        let held = p.right(a1) * (1.0 / unit);
        let (fast, slow) = (y.right(&closed) * -h, y.right(a1) * h);
        let rows: [&[&Affine]; 3] = [
            &[&first, &held, &fast.transpose()],
            &[&held.transpose(), &(&y * (1.0 - 2.0 * rate * h)), &slow.transpose()],
            &[&fast, &slow, &y],
        ];
        lmi.positive("decay with held control", Affine::blocks(&rows) - t.times(&Matrix::identity(18)) * 1e-3);
    }
    lmi.maximize(t.clone());
    let answer = lmi.solve().ok()?;
    // What the solver calls feasible by less than this does not survive rounding.
    if answer.scalar(&t) <= 1e-5 {
        return None;
    }
    // Where the loop is one of space vectors, a turn of P and Y by 90° proves the same, and so does the mean of both.
    let j = Matrix::from_fn(6, 6, |i, k| f64::from(i + 1 == k && i % 2 == 0) - f64::from(k + 1 == i && k % 2 == 0));
    let turns = |m: &Matrix<f64>| (&(&j * m) - &(m * &j)).norm() == 0.0;
    let of_vectors = scaled.iter().flatten().all(turns);
    let round = |m: Matrix<f64>| if of_vectors { m.symmetrized().space_vectors() } else { m.symmetrized() };
    let back = |x: &Affine, size: f64| round(&(&inverse * &answer.value(x)) * &inverse).scaled(&size);
    Some(HeldProof { rate_per_s: rate, p: back(&p, 1.0), y: back(&y, unit) })
}

/// The proof at the highest rate, to 10 %, between two.
fn fastest(vertices: &[Loop<f64>], scale: &[f64; 6], h: f64, least: f64, most: f64) -> Option<HeldProof> {
    let mut best = prove(vertices, scale, h, least)?;
    let (mut low, mut high) = (least, most);
    while high - low > 0.1 * high {
        let middle = 0.5 * (low + high);
        match prove(vertices, scale, h, middle) {
            Some(found) => (low, best) = (middle, found),
            None => high = middle,
        }
    }
    // A little slower than found, so that the exact proof has room.
    best.rate_per_s *= 0.98;
    Some(best)
}

/// How often cells of the electrical errors may be halved.
const DEPTH: u32 = 2;

/// Gains for wanted bandwidths, proven for a period; without one, for the largest, to 3 %, at which both loops keep half of the rates that
/// the continuous ones are proven for.
///
/// # Errors
/// As [`crate::jadot::design`]; [`DesignError::Infeasible`] with the largest period.
pub fn regulation(
    plant: DesignModel,
    request: &JadotRequest,
    period_s: Option<f64>,
) -> Result<(SampledJadotDesign, Certificate), DesignError> {
    period_s.map_or(Ok(()), usual)?;
    let (continuous, _) = crate::jadot::design(plant, request)?;
    let c = plant.constants::<f64>();
    let [inner_scale, outer_scale] = continuous.scales(&c, request.speed_bandwidth_rad_s);
    let (inner_rate, outer_rate) = (0.5 * continuous.electrical_rate_per_s, 0.5 * continuous.outer_rate_per_s);
    let (speeds, slips) = (continuous.electrical_speed_rad_s, continuous.slip_rad_s);
    let attempt = |h: f64| {
        let none = HeldProof { rate_per_s: 0.0, p: Matrix::identity(6), y: Matrix::identity(6) };
        let mut d = SampledJadotDesign { continuous: continuous.clone(), period_s: h, electrical: Vec::new(), outer: none };
        d.outer = prove(&d.ends(&c), &outer_scale, h, outer_rate)?;
        let cell = |speed, slip| {
            let proof = prove(&d.corners(&c, [speed, slip]), &inner_scale, h, inner_rate)?;
            Some(HeldCell { electrical_speed_rad_s: speed, slip_rad_s: slip, proof })
        };
        d.electrical = halve(speeds, slips, DEPTH, cell).ok()?;
        Some(d)
    };
    // Beyond K_P h = L_f the current turns its error round.
    let most = 1.0 / (continuous.current_proportional_ohm * c.inverse_sigma_l_s);
    let mut design = match period_s {
        Some(h) => attempt(h).ok_or_else(|| DesignError::Infeasible {
            constraint: format!("half of the rates of the continuous loops, sampled every {h} s"),
            feasible: longest_from(1e-3 * most, h.min(most), attempt)
                .map_or("other bandwidths".into(), |d| format!("these gains at periods up to {:.2} µs", 1e6 * d.period_s)),
        })?,
        None => longest_from(1e-3 * most, most, attempt).ok_or_else(|| super::no_period(inner_rate.min(outer_rate), most))?,
    };
    let h = design.period_s;
    let highest = |vertices: &[Loop<f64>]| {
        let abscissa = vertices.iter().map(|[a, a1]| linalg::spectral_abscissa(&(a + a1)));
        -abscissa.fold(f64::NEG_INFINITY, f64::max)
    };
    let faster = |vertices: &[Loop<f64>], scale, least| {
        let unproven = || DesignError::Solver { problem: "loop with held control", status: "no proof on the second try".into() };
        fastest(vertices, scale, h, least, highest(vertices)).ok_or_else(unproven)
    };
    for k in 0..design.electrical.len() {
        let cell = &design.electrical[k];
        let corners = design.corners(&c, [cell.electrical_speed_rad_s, cell.slip_rad_s]);
        design.electrical[k].proof = faster(&corners, &inner_scale, inner_rate)?;
    }
    design.outer = faster(&design.ends(&c), &outer_scale, outer_rate)?;
    let certificate = Certificate::seal(plant, design.clone())?;
    Ok((design, certificate))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;

    fn request() -> JadotRequest {
        JadotRequest {
            electrical_speed_rad_s: [-320.0, 320.0],
            slip_rad_s: [-12.0, 12.0],
            flux_vs: 0.9,
            current_bandwidth_rad_s: 837.0,
            speed_bandwidth_rad_s: 20.0,
            damping: std::f64::consts::FRAC_1_SQRT_2,
        }
    }

    /// x(t_k + h) = (e^{Ah} + ∫e^{As}ds A₁)x(t_k), by the series of the augmented matrix.
    fn over_a_sample([a, a1]: &Loop<f64>, h: f64) -> Matrix<f64> {
        let augmented = Matrix::blocks(&[&[a, a1], &[&Matrix::zeros(6, 6), &Matrix::zeros(6, 6)]]).scaled(&h);
        let mut term = Matrix::identity(12);
        let mut sum = Matrix::identity(12);
        for k in 1..30 {
            term = (&term * &augmented).scaled(&(1.0 / f64::from(k)));
            sum = &sum + &term;
        }
        Matrix::from_fn(6, 6, |i, j| sum[(i, j)] + sum[(i, j + 6)])
    }

    #[test]
    fn held_control_is_proven_and_its_parts_are_those_of_the_continuous_loops() {
        let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
        let c = plant.constants::<f64>();
        let (d, certificate) = regulation(plant, &request(), Some(4e-5)).unwrap();
        certificate.check().unwrap();
        // Without a period nothing is held: A + A₁ is the continuous loop.
        let still = SampledJadotDesign { period_s: 0.0, ..d.clone() };
        let [a, a1] = still.electrical(&c, 200.0, 5.0, [1.0, 0.0]);
        assert!((&(&a + &a1) - &d.continuous.electrical(&c, 200.0, 5.0)).norm() < 1e-9 * a.norm());
        let [a, a1] = still.outer(&c, 5.0);
        assert!((&(&a + &a1) - &d.continuous.outer(&c, 5.0)).norm() == 0.0);
        // The exact step of a sample contracts in the norm of P, at vertices and with any turn of the voltage in the triangle.
        let contracts = |proof: &HeldProof, vertex: &Loop<f64>| {
            let m = over_a_sample(vertex, d.period_s);
            let rho = (-2.0 * proof.rate_per_s * d.period_s).exp();
            let slack = &proof.p.scaled(&rho) - &(&(&m.t() * &proof.p) * &m);
            linalg::symmetric_eigenvalues(&slack)[0] > -1e-12 * proof.p.norm()
        };
        for cell in &d.electrical {
            let corners = d.corners(&c, [cell.electrical_speed_rad_s, cell.slip_rad_s]);
            assert!(corners.iter().all(|v| contracts(&cell.proof, v)));
        }
        assert!(d.ends(&c).iter().all(|v| contracts(&d.outer, v)));
        let long = SampledJadotDesign { period_s: 1e-3, ..d };
        assert!(Certificate::seal(plant, long).is_err());
    }

    #[test]
    fn a_period_too_long_is_refused_with_one_that_is_not() {
        let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
        let fast = JadotRequest { electrical_speed_rad_s: [280.0, 320.0], slip_rad_s: [-1.0, 1.0], ..request() };
        let own = 1.0 / fast.current_bandwidth_rad_s;
        let error = regulation(plant, &fast, Some(own)).unwrap_err().to_string();
        let largest = error.split("periods up to ").nth(1).and_then(|t| t.split(' ').next()?.parse::<f64>().ok());
        let largest = 1e-6 * largest.unwrap_or_else(|| panic!("{error}"));
        assert!(largest > 0.1 * own && largest < own, "{largest} s against {own} s");
        regulation(plant, &fast, Some(0.9 * largest)).unwrap().1.check().unwrap();
    }
}
