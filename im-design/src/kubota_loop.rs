//! Kubota's adaptive loop: where speed estimation is unstable, and a gain that mends it.
//!
//! Linearized about steady state (rotor flux λ on the real axis of a frame at stator frequency ω_e, constant speed ω),
//! with e = x − x̂, Δω = ω̂ − ω and p = s + jω_e, the loop is ω̂ = −(K_P + K_I/s)(n_pβ|λ|)² T(s) Δω, where T is the real
//! part (the mean of the transfer function and its conjugate) of
//!
//! ```text
//! H(p) = p/(p² + (γ + l₂ + η − jn_pω)p + (η − jn_pω)(R_s/σL_s + g)),   g = l₂ + βl₁.
//! ```
//!
//! * T(0) has the sign of ω_e Im det(jω_e). Without gain it is negative exactly for 0 < ω_e/(n_pω) < (R_s/σL_s)/(γ + η),
//!   regenerating at low frequency, and there the loop is unstable for *any* K_P, K_I > 0.
//! * With g = −R_s/σL_s + (η + jn_pω)/ρ, ρ > 0, the last coefficient is κ = (η² + n_p²ω²)/ρ > 0, and
//!   1/H = D − jn_pω + p + κ/p with D = γ + l₂ + η > 0: H is positive real, so T is, and the loop is stable for every
//!   speed, every load and every K_P, K_I > 0, except at ω_e = 0 where speed is unobservable. The gain is affine in ω:
//!   l₁ = (−R_s/σL_s − l₂ + (η + jn_pω)/ρ)/β.
//!   In time domain V = |e_i|² + ρ|e_i + βe_λ|² obeys V̇ = −2D|e_i|², and Δω enters e_i only, so that V + Δω²/α needs no
//!   assumption (5), λ_aλ̂_b = λ̂_aλ_b.

use crate::cells::{covered, halve};
use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, not_negative, ordered, positive};
use crate::exact::Field;
use crate::feasible::{largest_share, range, shrunk};
use crate::kubota::{KubotaDesign, common_decay};
use crate::linalg;
use crate::machine::Constants;
use crate::matrix::Matrix;
use crate::model;
use serde::{Deserialize, Serialize};

/// The gains of the adaptive observer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopGains {
    /// L₀, 4 × 2.
    pub gain: Matrix<f64>,
    /// L₁: the gain at speed ω is L₀ + ω L₁.
    pub gain_per_speed: Matrix<f64>,
    /// K_P.
    pub proportional: f64,
    /// K_I.
    pub integral: f64,
}

/// An operating point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Mechanical speed, rad/s.
    pub speed_rad_s: f64,
    /// Slip frequency, electrical rad/s; the stator frequency is ω_e = n_p ω + slip.
    pub slip_rad_s: f64,
    /// Rotor flux linkage amplitude, Wb.
    pub flux_vs: f64,
}

/// No feedback: the pure model with adaptation.
pub fn no_feedback(proportional: f64, integral: f64) -> LoopGains {
    LoopGains { gain: Matrix::zeros(4, 2), gain_per_speed: Matrix::zeros(4, 2), proportional, integral }
}

/// The stabilizing gain for ρ > 0 and l₂ (1/s, above −γ − η).
///
/// # Errors
/// ρ or l₂ out of range.
pub fn stabilized(plant: DesignModel, rho: f64, l2: f64, proportional: f64, integral: f64) -> Result<LoopGains, DesignError> {
    let c = plant.constants::<f64>();
    if !(rho > 0.0 && rho.is_finite() && l2 > -c.gamma - c.eta && l2.is_finite()) {
        let least = -c.gamma - c.eta;
        return Err(DesignError::request(format!("rho = {rho} must be positive and l2 = {l2} above {least:.3} 1/s")));
    }
    let mut gains = no_feedback(proportional, integral);
    gains.gain.put(0, 0, &model::complex(&((c.eta / rho - c.stator_rate - l2) / c.beta), &0.0));
    gains.gain.put(2, 0, &model::complex(&l2, &0.0));
    gains.gain_per_speed.put(0, 0, &model::complex(&0.0, &(c.n_p / (rho * c.beta))));
    gains.gain = gains.gain.without_dust();
    Ok(gains)
}

impl LoopGains {
    /// Refuses matrices of other shapes than the flow of the errors has.
    pub(crate) fn shaped(&self) -> Result<(), String> {
        let shapes = [&self.gain, &self.gain_per_speed].map(|m| (m.rows(), m.cols()));
        if shapes == [(4, 2); 2] { Ok(()) } else { Err("the gains must be 4 × 2".into()) }
    }

    /// The closed loop linearized at a point: states (e_λd, e_λq, e_id, e_iq, integral of the speed law).
    pub fn closed_loop<F: Field>(&self, c: &Constants<F>, at: Point) -> Matrix<F> {
        let mut a = self.flow(c, at.speed_rad_s, at.flux_vs);
        // The frame turns at ω_e: subtract jω_e.
        let w = c.n_p.clone() * F::from_f64(at.speed_rad_s) + F::from_f64(at.slip_rad_s);
        for k in [0, 2] {
            a[(k, k + 1)] = a[(k, k + 1)].clone() + w.clone();
            a[(k + 1, k)] = a[(k + 1, k)].clone() - w.clone();
        }
        a
    }

    /// The same before the frame turns: the rates at the stator, seen from the flux.
    pub(crate) fn flow<F: Field>(&self, c: &Constants<F>, speed_rad_s: f64, flux_vs: f64) -> Matrix<F> {
        let f = F::from_f64;
        let static_design = KubotaDesign {
            speed_rad_s: [speed_rad_s; 2],
            rate_per_s: 0.0,
            gain: self.gain.clone(),
            gain_per_speed: self.gain_per_speed.clone(),
            p: Matrix::identity(4),
        };
        let mut a = Matrix::zeros(5, 5);
        a.put(0, 0, &static_design.error_matrix(c, speed_rad_s));
        // ε = n_pβ(e_ia λ_b − e_ib λ_a) = −n_pβλ e_iq; ω̂ = K_P ε + K_I z, z' = ε; ė has −Δω n_p(jλ, −βjλ).
        let flux = f(flux_vs);
        let eps = -(c.n_p.clone() * c.beta.clone() * flux.clone());
        a[(4, 3)] = eps.clone();
        for (row, push) in [(1, -(c.n_p.clone() * flux.clone())), (3, c.n_p.clone() * c.beta.clone() * flux)] {
            a[(row, 3)] = a[(row, 3)].clone() + push.clone() * f(self.proportional) * eps.clone();
            a[(row, 4)] = push * f(self.integral);
        }
        a
    }

    /// Decay rate of the linearized loop at a point, 1/s; negative where it is unstable.
    pub fn decay(&self, plant: DesignModel, at: Point) -> f64 {
        -linalg::spectral_abscissa(&self.closed_loop(&plant.constants::<f64>(), at))
    }

    /// The map: decay rate (1/s, negative is unstable) over speeds (rows) and slip frequencies (columns).
    pub fn map(&self, plant: DesignModel, speeds: &[f64], slips: &[f64], flux_vs: f64) -> Vec<Vec<f64>> {
        let point = |speed_rad_s, slip_rad_s| Point { speed_rad_s, slip_rad_s, flux_vs };
        speeds.iter().map(|&w| slips.iter().map(|&s| self.decay(plant, point(w, s))).collect()).collect()
    }
}

/// A cell of operating points with one common Lyapunov function: stable at each, and while moving between them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Mechanical speeds, rad/s.
    pub speed_rad_s: [f64; 2],
    /// Slip frequencies, electrical rad/s.
    pub slip_rad_s: [f64; 2],
    /// Proven decay rate, 1/s.
    pub rate_per_s: f64,
    /// P.
    pub p: Matrix<f64>,
}

/// The adaptive loop over a region, cell by cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopDesign {
    /// Rotor flux linkage amplitude, Wb.
    pub flux_vs: f64,
    /// Region: mechanical speeds, rad/s.
    pub speed_rad_s: [f64; 2],
    /// Region: slip frequencies, electrical rad/s.
    pub slip_rad_s: [f64; 2],
    /// The gains.
    pub gains: LoopGains,
    /// Cells that cover the region.
    pub cells: Vec<Cell>,
}

fn corners(speed: [f64; 2], slip: [f64; 2], flux_vs: f64) -> [Point; 4] {
    let point = |(i, j): (usize, usize)| Point { speed_rad_s: speed[i], slip_rad_s: slip[j], flux_vs };
    [(0, 0), (0, 1), (1, 0), (1, 1)].map(point)
}

impl Claim for LoopDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        self.gains.shaped()?;
        let cells: Vec<_> = self.cells.iter().map(|cell| [cell.speed_rad_s, cell.slip_rad_s]).collect();
        covered::<F>(&cells, [self.speed_rad_s, self.slip_rad_s])?;
        let mut obligations = Vec::new();
        for (k, cell) in self.cells.iter().enumerate() {
            if (cell.p.rows(), cell.p.cols()) != (5, 5) {
                return Err("P must be 5 × 5".into());
            }
            let p = Matrix::<F>::exact(&cell.p);
            let two_alpha = F::from_f64(2.0) * F::from_f64(cell.rate_per_s);
            obligations.push(Obligation::Definite(format!("P of cell {k}"), p.clone()));
            for (v, at) in corners(cell.speed_rad_s, cell.slip_rad_s, self.flux_vs).into_iter().enumerate() {
                let flow = (&p * &self.gains.closed_loop(c, at)).plus_transpose();
                let decay = -&(&flow + &p.scaled(&two_alpha));
                obligations.push(Obligation::Definite(format!("decay at corner {v} of cell {k}"), decay));
            }
        }
        Ok(obligations)
    }
}

/// Certify the adaptive loop over a region, halving cells up to `depth` times.
///
/// # Errors
/// [`DesignError::Infeasible`] with the first cell that stays unproven, unstable or not, and with a smaller region that is
/// not.
pub fn certify(
    plant: DesignModel,
    gains: &LoopGains,
    speed_rad_s: [f64; 2],
    slip_rad_s: [f64; 2],
    flux_vs: f64,
    depth: u32,
) -> Result<(LoopDesign, Certificate), DesignError> {
    validate(gains, speed_rad_s, slip_rad_s, flux_vs)?;
    let c = plant.constants::<f64>();
    let cells = match in_cells(&c, gains, speed_rad_s, slip_rad_s, flux_vs, depth) {
        Ok(cells) => cells,
        Err(unproven) => {
            let part = |share| (shrunk(speed_rad_s, share), shrunk(slip_rad_s, share));
            // Coarser cells answer sooner, and what they prove is proven.
            let works = |share| in_cells(&c, gains, part(share).0, part(share).1, flux_vs, depth.min(2)).is_ok();
            return Err(DesignError::Infeasible {
                constraint: unproven.describe(&c),
                feasible: match largest_share(works) {
                    Some(share) => {
                        let (speed, slip) = part(share);
                        format!("speeds of {} rad/s with slips of {} rad/s", range(speed), range(slip))
                    }
                    None => "another centre of the region, away from zero stator frequency, or the stabilizing gain".into(),
                },
            });
        }
    };
    let design = LoopDesign { flux_vs, speed_rad_s, slip_rad_s, gains: gains.clone(), cells };
    let certificate = Certificate::seal(plant, design.clone())?;
    Ok((design, certificate))
}

pub(crate) fn validate(gains: &LoopGains, speed: [f64; 2], slip: [f64; 2], flux_vs: f64) -> Result<(), DesignError> {
    positive("flux_vs", flux_vs)?;
    not_negative("proportional", gains.proportional)?;
    positive("integral", gains.integral)?;
    ordered("speed_rad_s", speed)?;
    ordered("slip_rad_s", slip)
}

/// A cell without a common Lyapunov function.
struct Unproven {
    speed: [f64; 2],
    slip: [f64; 2],
    /// Largest real part at its corners, 1/s.
    worst: f64,
}

impl Unproven {
    fn describe(&self, c: &Constants<f64>) -> String {
        let Unproven { speed, slip, worst } = self;
        let [low, high] = [0, 1].map(|k| c.n_p * speed[k] + slip[k]);
        let why = if low <= 0.0 && high >= 0.0 {
            "zero stator frequency, where the stator's signals do not show the speed,".into()
        } else if *worst > 0.0 {
            format!("an unstable corner (eigenvalue {worst:.4} 1/s)")
        } else {
            format!("no common Lyapunov function (each corner alone is stable, the slowest at {:.4} 1/s)", -worst)
        };
        format!("{why} in the cell of speeds {} rad/s and slips {} rad/s", range(*speed), range(*slip))
    }
}

/// Sizes of the states, for conditioning.
pub(crate) fn scales(c: &Constants<f64>, gains: &LoopGains, flux_vs: f64) -> Matrix<f64> {
    let push = c.n_p * c.beta * flux_vs;
    Matrix::diagonal(&[1.0 / c.beta, 1.0 / c.beta, 1.0, 1.0, push / (push * push * gains.integral).sqrt()])
}

/// Cells, each with its P.
fn in_cells(
    c: &Constants<f64>,
    gains: &LoopGains,
    speed_rad_s: [f64; 2],
    slip_rad_s: [f64; 2],
    flux_vs: f64,
    depth: u32,
) -> Result<Vec<Cell>, Unproven> {
    let scale = scales(c, gains, flux_vs);
    let vertices = |speed, slip| corners(speed, slip, flux_vs).map(|at| gains.closed_loop(c, at));
    let prove = |speed, slip| {
        let (rate, p) = common_decay(&vertices(speed, slip), &scale).ok()?;
        Some(Cell { speed_rad_s: speed, slip_rad_s: slip, rate_per_s: 0.9 * rate, p })
    };
    halve(speed_rad_s, slip_rad_s, depth, prove).map_err(|[speed, slip]| {
        let worst = vertices(speed, slip).iter().map(linalg::spectral_abscissa).fold(f64::NEG_INFINITY, f64::max);
        Unproven { speed, slip, worst }
    })
}

/// Without feedback the loop is unstable for any K_P, K_I > 0 where ω_e lies between zero and this multiple of n_pω.
pub fn unstable_fraction(c: &Constants<f64>) -> f64 {
    c.stator_rate / (c.gamma + c.eta)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;

    fn plant() -> DesignModel {
        DesignModel::Machine(LinearMachine::jadot_table_i())
    }

    fn point(speed: f64, stator_frequency: f64) -> Point {
        Point { speed_rad_s: speed, slip_rad_s: stator_frequency - 2.0 * speed, flux_vs: 0.9 }
    }

    #[test]
    fn instability_without_feedback_is_where_the_formula_says() {
        let c = plant().constants::<f64>();
        let fraction = unstable_fraction(&c);
        assert!(fraction > 0.2 && fraction < 1.0);
        for speed in [-40.0, 5.0, 20.0, 60.0] {
            for (proportional, integral) in [(0.001, 0.1), (0.5, 50.0)] {
                let gains = no_feedback(proportional, integral);
                let boundary = fraction * c.n_p * speed;
                assert!(gains.decay(plant(), point(speed, 0.9 * boundary)) < 0.0, "inside, {speed}");
                assert!(gains.decay(plant(), point(speed, 0.1 * boundary)) < 0.0, "inside, {speed}");
            }
            assert!(no_feedback(0.001, 0.1).decay(plant(), point(speed, 1.1 * boundary_of(&c, speed))) > 0.0);
            assert!(no_feedback(0.001, 0.1).decay(plant(), point(speed, -0.3 * boundary_of(&c, speed))) > 0.0);
        }
    }

    fn boundary_of(c: &Constants<f64>, speed: f64) -> f64 {
        unstable_fraction(c) * c.n_p * speed
    }

    #[test]
    fn stabilized_loop_is_stable_everywhere_but_at_zero_frequency() {
        for (proportional, integral) in [(0.0, 0.1), (0.01, 1.0), (0.5, 50.0), (50.0, 5000.0)] {
            for rho in [0.05, 1.0, 20.0] {
                let gains = stabilized(plant(), rho, 0.0, proportional, integral).unwrap();
                for speed in [-150.0, -20.0, -1.0, 0.0, 3.0, 50.0, 150.0] {
                    for frequency in [-300.0, -40.0, -3.0, -0.5, 0.5, 3.0, 40.0, 300.0] {
                        let decay = gains.decay(plant(), point(speed, frequency));
                        assert!(decay > 0.0, "{decay} at {speed} {frequency} with {proportional} {integral} {rho}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_regenerating_region_is_certified_after_mending_only() {
        // Low speed, regenerating: speed 5..10 rad/s, slip −8..−2 rad/s.
        let (speed, slip) = ([5.0, 10.0], [-8.0, -2.0]);
        let gains = stabilized(plant(), 0.2, 0.0, 0.05, 20.0).unwrap();
        let (design, certificate) = certify(plant(), &gains, speed, slip, 0.9, 4).unwrap();
        certificate.check().unwrap();
        assert!(!design.cells.is_empty());
        let refused = certify(plant(), &no_feedback(0.05, 20.0), speed, slip, 0.9, 2).unwrap_err();
        assert!(matches!(refused, DesignError::Infeasible { .. }));
        // A region with a cell removed is not covered any more.
        let mut holed = design;
        holed.cells.pop();
        assert!(Certificate::seal(plant(), holed).is_err());
    }
}
