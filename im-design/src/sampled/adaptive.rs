//! Kubota's adaptive loop in sampled time: the observer by forward Euler, then the speed law with the new error.
//!
//! ```text
//! e⁺ = (I + hB(ω))e − h jn_pΔω (λ, −βλ),   z⁺ = z + hε⁺,   ω̂ = K_Pε + K_I z,   ε = −n_pβ λ × e_i
//! ```
//!
//! linearized about steady state as the continuous loop, in a frame that turns with the flux by θ = hω_e per sample. Exact numbers have no
//! sine; with τ = tan ½θ = ½hω' the turn is (1 + jτ)/(1 − jτ), and with e⁺ = e + hv, B with the speed law's own rows,
//!
//! ```text
//! E v = F e:   (1 + jτ)v = −jω'e + (1 − jτ)B e,   v_z = ε(e + hv);   ω' = n_pω + slip'.
//! ```
//!
//! E and F are affine in speed, sampled slip, and the speed in (jτB) taken for itself. So one P and one multiplier G at the eight vertices,
//!
//! ```text
//! [(ρ² − 1)P/h  −P ]
//! [    −P      −hP ] + G[F −E] + [F −E]ᵀGᵀ  > 0,
//! ```
//!
//! prove eᵀPe to fall by ρ² per sample over the cell: the multiplier's terms vanish on E v = F e (Finsler). h → 0 is the continuous cell.
//! As tan x lies between x and x/(1 − ½x²), the sampled slip ω' − n_pω exceeds the slip by at most |ω_e| q/(1 − q), q = (hω_e)²/8,
//! in the direction of ω_e; the cells cover that.

use super::{image_of_the_machine, longest_from, longest_meaningful_s, meaningful, no_period};
use crate::cells::{covered, halve};
use crate::certificate::{Certificate, Claim, DesignModel, Obligation, decide};
use crate::error::{DesignError, positive};
use crate::exact::Field;
use crate::kubota_loop::{LoopGains, scales, validate};
use crate::linalg;
use crate::lmi::{Affine, Problem};
use crate::machine::Constants;
use crate::matrix::Matrix;
use serde::{Deserialize, Serialize};

/// A cell of operating points with its proof.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledCell {
    /// Mechanical speeds, rad/s.
    pub speed_rad_s: [f64; 2],
    /// Sampled slips ω' − n_pω, electrical rad/s.
    pub sampled_slip_rad_s: [f64; 2],
    /// ρ, per sample, in the norm of P.
    pub contraction: f64,
    /// P.
    pub p: Matrix<f64>,
    /// G, 10 × 5.
    pub multiplier: Matrix<f64>,
}

/// The adaptive loop at a sampling period, cell by cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledLoopDesign {
    /// Rotor flux linkage amplitude, Wb.
    pub flux_vs: f64,
    /// Region: mechanical speeds, rad/s.
    pub speed_rad_s: [f64; 2],
    /// Region: slip frequencies, electrical rad/s.
    pub slip_rad_s: [f64; 2],
    /// Sampling period h, s.
    pub period_s: f64,
    /// The gains.
    pub gains: LoopGains,
    /// What the sampled slips of the region lie in, electrical rad/s.
    pub sampled_slip_rad_s: [f64; 2],
    /// Cells that cover speeds and sampled slips.
    pub cells: Vec<SampledCell>,
}

/// [F, E] at (speed, sampled slip, speed in jτB).
fn step<F: Field>(c: &Constants<F>, d: &SampledLoopDesign, [speed, slip, other]: [f64; 3]) -> [Matrix<F>; 2] {
    let f = F::from_f64;
    let h = f(d.period_s);
    let w = c.n_p.clone() * f(speed) + f(slip);
    let tau = f(0.5) * h.clone() * w.clone();
    // j on the four electrical states.
    let mut j = Matrix::zeros(5, 5);
    for k in [0, 2] {
        (j[(k, k + 1)], j[(k + 1, k)]) = (-F::one(), F::one());
    }
    let [here, there] = [speed, other].map(|x| d.gains.flow(c, x, d.flux_vs));
    let rates = &(&here - &j.scaled(&w)) - &(&j * &there).scaled(&tau);
    let mut implicit = &Matrix::identity(5) + &j.scaled(&tau);
    implicit[(4, 3)] = -(h * here[(4, 3)].clone());
    [rates, implicit]
}

fn vertices(speed: [f64; 2], slip: [f64; 2]) -> impl Iterator<Item = [f64; 3]> {
    (0..8).map(move |k| [speed[k & 1], slip[(k >> 1) & 1], speed[k >> 2]])
}

impl Claim for SampledLoopDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        self.gains.shaped()?;
        let cells: Vec<_> = self.cells.iter().map(|cell| [cell.speed_rad_s, cell.sampled_slip_rad_s]).collect();
        covered::<F>(&cells, [self.speed_rad_s, self.sampled_slip_rad_s])?;
        let f = F::from_f64;
        let h = f(self.period_s);
        let [less, room, more] = slip_room(c, self);
        let mut obligations = vec![
            Obligation::Positive("period".into(), h.clone()),
            image_of_the_machine(c, self.period_s),
            Obligation::Positive("flux".into(), f(self.flux_vs)),
            Obligation::Positive("eight less the squared turn per sample".into(), room),
            Obligation::Positive("sampled slips below the region's".into(), less),
            Obligation::Positive("sampled slips above the region's".into(), more),
        ];
        if self.period_s <= 0.0 {
            return Ok(obligations);
        }
        for (k, cell) in self.cells.iter().enumerate() {
            obligations.extend(cell.obligations(c, self, k)?);
        }
        Ok(obligations)
    }
}

impl SampledCell {
    /// What must hold for the claim of cell `k` to be true.
    fn obligations<F: Field>(&self, c: &Constants<F>, d: &SampledLoopDesign, k: usize) -> Result<Vec<Obligation<F>>, String> {
        if (self.p.rows(), self.p.cols(), self.multiplier.rows(), self.multiplier.cols()) != (5, 5, 10, 5) {
            return Err("P must be 5 × 5 and the multiplier 10 × 5".into());
        }
        let (p, g) = (Matrix::<F>::exact(&self.p), Matrix::<F>::exact(&self.multiplier));
        let [h, rho] = [d.period_s, self.contraction].map(F::from_f64);
        let excess = (rho.clone() * rho.clone() - F::one()) / h.clone();
        let form = Matrix::blocks(&[&[&p.scaled(&excess), &-&p], &[&-&p, &-&p.scaled(&h)]]);
        let mut obligations = vec![
            Obligation::Positive(format!("contraction of cell {k}"), rho.clone()),
            Obligation::Positive(format!("1 - contraction of cell {k}"), F::one() - rho),
            Obligation::Definite(format!("P of cell {k}"), p),
        ];
        for (v, at) in vertices(self.speed_rad_s, self.sampled_slip_rad_s).enumerate() {
            let [rates, implicit] = step(c, d, at);
            let zero = &g * &Matrix::blocks(&[&[&rates, &-&implicit]]);
            let name = format!("sampled decay at vertex {v} of cell {k}");
            obligations.push(Obligation::Definite(name, &form + &zero.plus_transpose()));
        }
        Ok(obligations)
    }

    /// Whether the exact check confirms the cell.
    fn holds(&self, plant: DesignModel, d: &SampledLoopDesign) -> bool {
        self.obligations(&plant.constants(), d, 0).is_ok_and(|obligations| decide(&obligations).is_ok())
    }
}

/// What the sampled slips have to spare below and above the region's, and 8 − (hω_e)² between them.
fn slip_room<F: Field>(c: &Constants<F>, d: &SampledLoopDesign) -> [F; 3] {
    let f = F::from_f64;
    let mut most = F::zero();
    for (w, s) in d.speed_rad_s.into_iter().flat_map(|w| d.slip_rad_s.map(|s| (w, s))) {
        let x = c.n_p.clone() * f(w) + f(s);
        let x = if x < F::zero() { -x } else { x };
        most = if x > most { x } else { most };
    }
    let turn = f(d.period_s) * most.clone();
    let square = turn.clone() * turn;
    let room = f(8.0) - square.clone();
    let beyond = if room > F::zero() { most * square / room.clone() } else { F::zero() };
    let [low, high] = d.slip_rad_s.map(f);
    let [covered_low, covered_high] = d.sampled_slip_rad_s.map(f);
    [low - beyond.clone() - covered_low, room, covered_high - high - beyond]
}

/// P and G of a cell that contracts by e^(−αh), if there are any.
fn prove(plant: DesignModel, d: &SampledLoopDesign, speed: [f64; 2], slip: [f64; 2], rate: f64) -> Option<SampledCell> {
    let c = plant.constants::<f64>();
    let (h, scale) = (d.period_s, scales(&c, &d.gains, d.flux_vs));
    let inverse = scale.inverse_diagonal();
    let rho = (-rate * h).exp();
    let steps: Vec<[Matrix<f64>; 2]> =
        vertices(speed, slip).map(|at| step(&c, d, at).map(|m| &(&inverse * &m) * &scale)).collect();
    // v in units of the fastest rate.
    let unit = steps.iter().map(|[rates, _]| rates.norm()).fold(1.0, f64::max);
    let mut lmi = Problem::new("sampled adaptive loop");
    let (p, g1, g2, t) = (lmi.symmetric(5), lmi.matrix(5, 5), lmi.matrix(5, 5), lmi.scalar());
    lmi.positive("P ≥ t", &p - &t.times(&Matrix::identity(5)));
    lmi.positive("P ≤ 1", -(&p - &Matrix::identity(5)));
    for [rates, implicit] in &steps {
        let first = (&p * ((rho * rho - 1.0) / h) + g1.right(rates).plus_transpose()) * (1.0 / unit);
        let cross = -(&p + &g1.right(implicit)) + g2.right(rates).transpose() * (1.0 / unit);
        let last = -(&p * (h * unit)) - g2.right(implicit).plus_transpose();
        let block = Affine::blocks(&[&[&first, &cross], &[&cross.transpose(), &last]]);
        lmi.positive("sampled decay", block - t.times(&Matrix::identity(10)) * 1e-3);
    }
    lmi.maximize(t.clone());
    let answer = lmi.solve().ok()?;
    if answer.scalar(&t) <= 0.0 {
        return None;
    }
    let back = |m: Matrix<f64>| &(&inverse * &m) * &inverse;
    let (upper, lower) = (back(answer.value(&g1)), back(answer.value(&g2)).scaled(&(1.0 / unit)));
    let cell = SampledCell {
        speed_rad_s: speed,
        sampled_slip_rad_s: slip,
        contraction: rho,
        p: back(answer.value(&p)).symmetrized(),
        multiplier: Matrix::blocks(&[&[&upper], &[&lower]]),
    };
    cell.holds(plant, d).then_some(cell)
}

/// The cell's proof at the fastest rate, to a tenth.
fn fastest(plant: DesignModel, d: &SampledLoopDesign, cell: SampledCell) -> SampledCell {
    let c = plant.constants::<f64>();
    let (speed, slip, h) = (cell.speed_rad_s, cell.sampled_slip_rad_s, d.period_s);
    let pole = |at| {
        let [rates, implicit] = step(&c, d, at);
        linalg::spectral_radius(&(&Matrix::identity(5) + &linalg::solve(&implicit, &rates).scaled(&h)))
    };
    let slowest = vertices(speed, slip).map(pole).fold(0.0, f64::max);
    let (mut low, mut high, mut best) = (-cell.contraction.ln() / h, -slowest.ln() / h, cell);
    while high - low > 0.1 * high {
        let middle = 0.5 * (low + high);
        match prove(plant, d, speed, slip, middle) {
            Some(found) => (low, best) = (middle, found),
            None => high = middle,
        }
    }
    best
}

/// Certify the adaptive loop for a sampling period; without one, for the largest, to 3 %, up to 1/γ.
///
/// Every cell contracts at least at `rate_per_s`.
///
/// # Errors
/// [`DesignError::Infeasible`] with the largest period.
#[allow(clippy::too_many_arguments)] // the region, the gains, what is wanted
pub fn adaptive(
    plant: DesignModel,
    gains: &LoopGains,
    speed_rad_s: [f64; 2],
    slip_rad_s: [f64; 2],
    flux_vs: f64,
    depth: u32,
    rate_per_s: f64,
    period_s: Option<f64>,
) -> Result<(SampledLoopDesign, Certificate), DesignError> {
    validate(gains, speed_rad_s, slip_rad_s, flux_vs)?;
    positive("rate_per_s", rate_per_s)?;
    let c = plant.constants::<f64>();
    let certified = |h: f64| -> Option<SampledLoopDesign> {
        let mut d = SampledLoopDesign {
            flux_vs,
            speed_rad_s,
            slip_rad_s,
            period_s: h,
            gains: gains.clone(),
            sampled_slip_rad_s: slip_rad_s,
            cells: Vec::new(),
        };
        let [below, room, _] = slip_room(&c, &d);
        if room <= 0.0 {
            return None;
        }
        let beyond = -below * (1.0 + 1e-9) + 1e-9;
        d.sampled_slip_rad_s = [slip_rad_s[0] - beyond, slip_rad_s[1] + beyond];
        let cell = |speed, slip| prove(plant, &d, speed, slip, rate_per_s);
        d.cells = halve(speed_rad_s, d.sampled_slip_rad_s, depth, cell).ok()?;
        Some(d)
    };
    let most = 0.999 * longest_meaningful_s(&c);
    let found = match period_s {
        Some(h) => {
            meaningful(&c, h)?;
            certified(h).ok_or_else(|| DesignError::Infeasible {
                constraint: format!("{rate_per_s} 1/s in every cell, sampled every {h} s"),
                feasible: match longest_from(1e-3 * most, h.min(most), certified) {
                    Some(d) => format!("this rate at periods up to {:.2} µs", 1e6 * d.period_s),
                    None => "a lower rate, or a smaller region away from zero stator frequency".into(),
                },
            })?
        }
        None => longest_from(1e-3 * most, most, certified).ok_or_else(|| no_period(rate_per_s, most))?,
    };
    let cells = found.cells.iter().map(|cell| fastest(plant, &found, cell.clone())).collect();
    let design = SampledLoopDesign { cells, ..found };
    let certificate = Certificate::seal(plant, design.clone())?;
    Ok((design, certificate))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;
    use crate::kubota_loop::{no_feedback, stabilized};

    const REGION: ([f64; 2], [f64; 2]) = ([5.0, 10.0], [-8.0, -2.0]);

    #[test]
    fn a_regenerating_region_is_certified_sampled_and_only_stabilized() {
        let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
        let gains = stabilized(plant, 0.2, 0.0, 0.05, 20.0).unwrap();
        let at = |gains: &LoopGains, depth| adaptive(plant, gains, REGION.0, REGION.1, 0.9, depth, 0.2, Some(1e-4));
        let (d, certificate) = at(&gains, 2).unwrap();
        certificate.check().unwrap();
        // In one step of its own: the matrix of e⁺ at points inside has no larger modulus.
        let c = plant.constants::<f64>();
        let slowest = d.cells.iter().map(|cell| cell.contraction).fold(0.0, f64::max);
        for at in [[7.0, -3.0, 7.0], [5.5, -7.5, 5.5], [9.9, -2.1, 9.9]] {
            let [rates, implicit] = step(&c, &d, at);
            let next = &Matrix::identity(5) + &linalg::solve(&implicit, &rates).scaled(&d.period_s);
            assert!(linalg::spectral_radius(&next) < slowest, "{at:?}");
        }
        // Unstable inside: cells of any size would be refused.
        assert!(matches!(at(&no_feedback(0.05, 20.0), 0), Err(DesignError::Infeasible { .. })));
        let faster = |cell: &SampledCell| SampledCell { contraction: cell.contraction.powi(3), ..cell.clone() };
        let forged = SampledLoopDesign { cells: d.cells.iter().map(faster).collect(), ..d.clone() };
        assert!(Certificate::seal(plant, forged).is_err());
        let longer = SampledLoopDesign { period_s: 20.0 * d.period_s, ..d };
        assert!(Certificate::seal(plant, longer).is_err());
    }
}
