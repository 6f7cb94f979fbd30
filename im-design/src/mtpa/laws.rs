//! Control laws over torque: (27) and (29), fitted under (28), and series in the logarithm that hold everywhere.

use super::air_gap::AirGap;
use super::optimum::{Optimum, for_current, for_torque};
use crate::error::DesignError;
use crate::linalg;
use crate::matrix::Matrix;
use argmin::core::{CostFunction, Executor, State};
use argmin::solver::neldermead::NelderMead;

/// (27): I_s = a₁T + a₂T^b₁ + a₃T^b₂, rms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentLaw {
    /// a₁, a₂, a₃.
    pub a: [f64; 3],
    /// b₁, b₂.
    pub b: [f64; 2],
}

/// (29): ω_s = c₀ + c₁T + c₂T² + c₃T³ + c₄T⁴, electrical rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipLaw {
    /// c₀ … c₄.
    pub c: [f64; 5],
}

impl CurrentLaw {
    /// (30), as printed.
    pub const KWON: CurrentLaw = CurrentLaw { a: [0.109, -17.0, 18.5], b: [0.0177, 0.0799] };

    /// Rms current for a torque.
    pub fn at(&self, torque_n_m: f64) -> f64 {
        let [a1, a2, a3] = self.a;
        a1 * torque_n_m + a2 * torque_n_m.powf(self.b[0]) + a3 * torque_n_m.powf(self.b[1])
    }
}

impl SlipLaw {
    /// (31), as printed.
    pub const KWON: SlipLaw = SlipLaw { c: [1.4, -2.4e-3, 176e-6, -933e-9, 1.74e-9] };

    /// Slip frequency for a torque.
    pub fn at(&self, torque_n_m: f64) -> f64 {
        self.c.iter().rev().fold(0.0, |sum, c| sum * torque_n_m + c)
    }
}

/// The fitness (28) over absolute deviations.
pub fn fitness(deviations: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = deviations.len() as f64;
    1.0 / (1e-3 + (deviations.map(f64::abs).sum::<f64>() / n).sqrt())
}

/// Points of the optimum at equally spaced currents up to `current_max_a`, as Section VIII takes them.
///
/// # Errors
/// A current the circuit cannot carry.
pub fn data(circuit: &impl AirGap, current_max_a: f64, points: u32) -> Result<Vec<Optimum>, DesignError> {
    (1..=points).map(|k| for_current(circuit, current_max_a * f64::from(k) / f64::from(points))).collect()
}

struct Deviation<'a, L> {
    points: &'a [Optimum],
    law: L,
}

impl<L: Fn(&[f64], &Optimum) -> f64> CostFunction for Deviation<'_, L> {
    type Param = Vec<f64>;
    type Output = f64;
    fn cost(&self, x: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        let value = 1.0 / fitness(self.points.iter().map(|p| (self.law)(x, p)));
        Ok(if value.is_finite() { value } else { f64::MAX })
    }
}

/// Nelder-Mead, restarted from where it stopped: (28) has corners where a simplex collapses early.
fn maximize_fitness(
    points: &[Optimum],
    start: Vec<f64>,
    law: impl Fn(&[f64], &Optimum) -> f64 + Copy,
) -> Result<Vec<f64>, DesignError> {
    let fail = |e: argmin::core::Error| DesignError::Solver { problem: "fit of a law", status: e.to_string() };
    let mut best = start;
    for round in 0..12u32 {
        let step = 0.2 * 0.6f64.powi(round as i32);
        let mut simplex = vec![best.clone()];
        for k in 0..best.len() {
            let mut x = best.clone();
            x[k] += step * x[k].abs().max(1e-2);
            simplex.push(x);
        }
        let solver = NelderMead::new(simplex).with_sd_tolerance(1e-12).map_err(fail)?;
        let run = Executor::new(Deviation { points, law }, solver).configure(|s| s.max_iters(3000)).run().map_err(fail)?;
        if let Some(x) = run.state().get_best_param() {
            best.clone_from(x);
        }
    }
    Ok(best)
}

/// Coefficients of least squares for given basis functions, each row weighted.
fn least_squares(rows: &[(Vec<f64>, f64)]) -> Vec<f64> {
    let n = rows[0].0.len();
    let normal = Matrix::from_fn(n, n, |i, j| rows.iter().map(|(x, _)| x[i] * x[j]).sum());
    let rhs = Matrix::from_fn(n, 1, |i, _| rows.iter().map(|(x, y)| x[i] * y).sum());
    let x = linalg::solve(&normal, &rhs);
    (0..n).map(|i| x[(i, 0)]).collect()
}

/// (27) fitted under (28).
///
/// # Errors
/// [`DesignError::Solver`] when the search fails.
pub fn fit_current(points: &[Optimum]) -> Result<CurrentLaw, DesignError> {
    let [b1, b2] = CurrentLaw::KWON.b;
    // Start: the printed exponents, amplitudes by least squares.
    let row = |p: &Optimum| (vec![p.torque_n_m, p.torque_n_m.powf(b1), p.torque_n_m.powf(b2)], p.current_rms_a);
    let mut start = least_squares(&points.iter().map(row).collect::<Vec<_>>());
    start.extend([b1, b2]);
    let law = |x: &[f64]| CurrentLaw { a: [x[0], x[1], x[2]], b: [x[3], x[4]] };
    let x = maximize_fitness(points, start, move |x, p| law(x).at(p.torque_n_m) - p.current_rms_a)?;
    Ok(law(&x))
}

/// (29) fitted under (28).
///
/// # Errors
/// [`DesignError::Solver`] when the search fails.
pub fn fit_slip(points: &[Optimum]) -> Result<SlipLaw, DesignError> {
    let top = points.iter().fold(0.0f64, |m, p| m.max(p.torque_n_m));
    // Coefficients of T/T_max, so that they are of one size.
    let row = |p: &Optimum| ((0..5).map(|k| (p.torque_n_m / top).powi(k)).collect::<Vec<_>>(), p.slip_rad_s);
    let start = least_squares(&points.iter().map(row).collect::<Vec<_>>());
    let law = |x: &[f64]| SlipLaw { c: std::array::from_fn(|k| x[k] / top.powi(k as i32)) };
    let x = maximize_fitness(points, start, move |x, p| law(x).at(p.torque_n_m) - p.slip_rad_s)?;
    Ok(law(&x))
}

/// Current and slip as exponentials of Chebyshev series in the logarithm of torque.
///
/// With x = (2 ln T − ln T_lo − ln T_hi)/(ln T_hi − ln T_lo): I_s = exp Σ i_k T_k(x), ω_s = exp Σ w_k T_k(x).
#[derive(Clone, Debug, PartialEq)]
pub struct LogLaw {
    /// Torques the law was fitted over, N m.
    pub torque_n_m: [f64; 2],
    /// Coefficients of ln I_s (rms A).
    pub current: Vec<f64>,
    /// Coefficients of ln ω_s (electrical rad/s).
    pub slip: Vec<f64>,
    /// Largest relative errors of current and slip found against the optimum.
    pub worst: [f64; 2],
}

pub(super) fn chebyshev(coefficients: &[f64], x: f64) -> f64 {
    // Clenshaw.
    let (mut b1, mut b2) = (0.0, 0.0);
    for c in coefficients.iter().skip(1).rev() {
        (b1, b2) = (2.0 * x * b1 - b2 + c, b1);
    }
    x * b1 - b2 + coefficients.first().copied().unwrap_or(0.0)
}

impl LogLaw {
    fn x(&self, torque_n_m: f64) -> f64 {
        let [low, high] = self.torque_n_m.map(f64::ln);
        (2.0 * torque_n_m.ln() - low - high) / (high - low)
    }

    /// Rms current for a torque within the range.
    pub fn current_at(&self, torque_n_m: f64) -> f64 {
        chebyshev(&self.current, self.x(torque_n_m)).exp()
    }

    /// Slip frequency for a torque within the range.
    pub fn slip_at(&self, torque_n_m: f64) -> f64 {
        chebyshev(&self.slip, self.x(torque_n_m)).exp()
    }
}

/// The law with which a drive follows a motor's torque: least current, from its circuit with its main-flux saturation, from 2 % of the rated
/// torque to half above it, within 1 %.
///
/// # Errors
/// As [`fit_log`].
pub fn for_drive(motor: &im_model::MotorFile) -> Result<LogLaw, DesignError> {
    fit_log(&super::Circuit::of(&motor.machine), [0.02, 1.5].map(|x| x * motor.rating.torque_nm), 0.01)
}

/// The shortest series whose current and slip stay within `tolerance` (relative) of the optimum over a range of torque.
///
/// # Errors
/// [`DesignError::Infeasible`] with the best tolerance 24 terms reach; torques out of reach.
pub fn fit_log(circuit: &impl AirGap, torque_n_m: [f64; 2], tolerance: f64) -> Result<LogLaw, DesignError> {
    let [low, high] = torque_n_m.map(f64::ln);
    if !(low < high && low.is_finite() && high.is_finite()) {
        return Err(DesignError::request(format!("torques {torque_n_m:?} must be positive and ordered")));
    }
    let n = 33;
    let node = |k: usize| (std::f64::consts::PI * (k as f64 + 0.5) / n as f64).cos();
    let torque = |x: f64| (0.5 * (low + high) + 0.5 * (high - low) * x).exp();
    let samples: Vec<Optimum> = (0..n).map(|k| for_torque(circuit, torque(node(k)))).collect::<Result<_, _>>()?;
    // A finer set, shifted, to judge by.
    let judged = (0..=2 * n).map(|k| for_torque(circuit, torque(-1.0 + 2.0 * k as f64 / (2 * n) as f64)));
    let judged: Vec<Optimum> = judged.collect::<Result<_, _>>()?;
    let series = |value: &dyn Fn(&Optimum) -> f64| -> Vec<f64> {
        let term = |j: usize, k: usize| (j as f64 * std::f64::consts::PI * (k as f64 + 0.5) / n as f64).cos();
        let sum = |j: usize| (0..n).map(|k| value(&samples[k]).ln() * term(j, k)).sum::<f64>();
        (0..24).map(|j| sum(j) * if j == 0 { 1.0 } else { 2.0 } / n as f64).collect()
    };
    let mut law =
        LogLaw { torque_n_m, current: series(&|o| o.current_rms_a), slip: series(&|o| o.slip_rad_s), worst: [f64::INFINITY; 2] };
    let full = law.clone();
    let current = |law: &LogLaw, o: &Optimum| law.current_at(o.torque_n_m) / o.current_rms_a;
    let slip = |law: &LogLaw, o: &Optimum| law.slip_at(o.torque_n_m) / o.slip_rad_s;
    let worst = |law: &LogLaw, ratio: &dyn Fn(&LogLaw, &Optimum) -> f64| {
        judged.iter().map(|o| (ratio(law, o) - 1.0).abs()).fold(0.0, f64::max)
    };
    for terms in 2..=24 {
        if law.worst[0] > tolerance {
            law.current = full.current[..terms].to_vec();
            law.worst[0] = worst(&law, &current);
        }
        if law.worst[1] > tolerance {
            law.slip = full.slip[..terms].to_vec();
            law.worst[1] = worst(&law, &slip);
        }
    }
    if law.worst.iter().all(|w| *w <= tolerance) {
        return Ok(law);
    }
    Err(DesignError::Infeasible {
        constraint: format!("laws within {tolerance} of the optimum by 24 terms"),
        feasible: format!("within {:.2e} in current and {:.2e} in slip", law.worst[0], law.worst[1]),
    })
}

#[cfg(test)]
mod tests {
    use super::super::circuit::Aqdm;
    use super::super::t_circuit::TCircuit;
    use super::*;

    fn torques(low: f64, high: f64) -> impl Iterator<Item = f64> {
        (0..40).map(move |k| (low.ln() + (high / low).ln() * f64::from(k) / 39.0).exp())
    }

    #[test]
    fn printed_laws_meet_the_optimum_where_they_are_good_and_leave_it_elsewhere() {
        let circuit = Aqdm::kwon_table_v();
        for torque in torques(19.0, 510.0) {
            let o = for_torque(&circuit, torque).unwrap();
            let error = CurrentLaw::KWON.at(torque) / o.current_rms_a - 1.0;
            assert!(error.abs() < 0.02, "current {error} at {torque}");
        }
        for torque in torques(19.0, 215.0) {
            let o = for_torque(&circuit, torque).unwrap();
            let error = SlipLaw::KWON.at(torque) / o.slip_rad_s - 1.0;
            assert!(error.abs() < 0.035, "slip {error} at {torque}");
        }
        let light = for_torque(&circuit, 9.0).unwrap();
        assert!(CurrentLaw::KWON.at(9.0) / light.current_rms_a > 1.05);
        let heavy = for_torque(&circuit, 450.0).unwrap();
        assert!(SlipLaw::KWON.at(450.0) / heavy.slip_rad_s > 2.0);
    }

    /// A machine model with main-flux saturation: the same laws from its `motor.toml`.
    #[test]
    fn a_saturated_machine_model_has_its_own_laws() {
        let named = im_model::machines::MOTULATOR_2_2_KW;
        let mut effects = im_model::Effects::none();
        effects.main_flux_saturation.excess = 0.4;
        let base = im_model::Machine::base(named.parameters(), named.pole_pairs).unwrap();
        let saturated = base.with_effects(effects).unwrap();
        let (linear, curved) = (TCircuit::from(&base), TCircuit::from(&saturated));
        let torque = 20.0;
        let (a, b) = (for_torque(&linear, torque).unwrap(), for_torque(&curved, torque).unwrap());
        assert!(b.current_rms_a > a.current_rms_a && b.slip_rad_s > a.slip_rad_s && b.flux_vs < a.flux_vs);
        let law = fit_log(&curved, [0.1, 30.0], 0.01).unwrap();
        assert!((law.current_at(torque) / b.current_rms_a - 1.0).abs() < 0.01);
    }

    #[test]
    fn fitted_laws_are_fitter_than_the_printed_ones() {
        let points = data(&Aqdm::kwon_table_v(), 70.0, 70).unwrap();
        let of_current = |l: &CurrentLaw| fitness(points.iter().map(|p| l.at(p.torque_n_m) - p.current_rms_a));
        let of_slip = |l: &SlipLaw| fitness(points.iter().map(|p| l.at(p.torque_n_m) - p.slip_rad_s));
        let (current, slip) = (fit_current(&points).unwrap(), fit_slip(&points).unwrap());
        assert!(of_current(&current) > of_current(&CurrentLaw::KWON), "{current:?}");
        assert!(of_slip(&slip) > of_slip(&SlipLaw::KWON), "{slip:?}");
    }

    #[test]
    fn logarithmic_laws_stay_within_one_percent_from_1_to_510_newton_metres() {
        let circuit = Aqdm::kwon_table_v();
        let law = fit_log(&circuit, [1.0, 510.0], 0.01).unwrap();
        for torque in torques(1.0, 510.0) {
            let o = for_torque(&circuit, torque).unwrap();
            assert!((law.current_at(torque) / o.current_rms_a - 1.0).abs() < 0.01);
            assert!((law.slip_at(torque) / o.slip_rad_s - 1.0).abs() < 0.01);
        }
        assert!(law.current.len() <= 10 && law.slip.len() <= 12, "{} {}", law.current.len(), law.slip.len());
    }
}
