//! Losses segregated from tests, as IEC 60034-2-1 (method 2-1-1B) and IEEE 112 (method B) do it.
//!
//! With U, I line to line and line, rms; R between two terminals at the temperature of the reading; P₁ input, s slip, cos φ = P₁/(√3 U I):
//!
//!   stator copper       P_s = (3/2) R I²
//!   no load             P₀ − P_s − Tω = P_fw + P_fe(U), T where one was measured; P_fw is the intercept of a line over U² at low voltages
//!   iron under load     P_fe(U_r),   U_r = √((U − (√3/2) I R cos φ)² + ((√3/2) I R sin φ)²)
//!   rotor               P_r = (P₁ − P_s − P_fe) s
//!   friction, windage   P_fw (1 − s)^2.5
//!   additional load     P_Lr = P₁ − P_s − P_fe − P_r − P_fw − Tω;   P_Lr = A T² + B over the load points, P_LL = A T²
//!
//! Where one is missing: without torques P_LL is the allowance of the standard (8.2.2.5.3), with no load at one voltage only P_fw + P_fe is known and its
//! share is open, without a no-load test it is B.

pub mod by_model;
mod line;
mod readings;
mod uncertainty;

use serde::Serialize;

pub use by_model::{ByModel, ModelPoint};
use line::Line;
pub use readings::{Readings, Resistance};
pub use uncertainty::Estimate;

use crate::intake::SteadyTable;
use crate::table_balance::fault;
use crate::tables::{corrected, decided};
use im_model::MotorFile;

/// How the additional load loss was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StrayBy {
    /// By the regression of the residual loss over the square of the torque.
    Regression,
    /// The allowance of the standard: no torques were measured, or their residual loss does not follow their square.
    Allowance,
}

/// What parts friction and windage from iron loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ConstantBy {
    /// A no-load test at several voltages.
    Voltages,
    /// Nothing: their sum is known from a no-load test at one voltage.
    OneVoltage,
    /// Nothing: their sum is what the load points leave without torque.
    LoadPoints,
}

/// Losses of one load point, W.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadPoint {
    /// Torque at the shaft, Nm, where it was measured.
    pub torque_nm: Option<f64>,
    /// Slip.
    pub slip: f64,
    /// Temperature of the stator winding, °C.
    pub winding_c: f64,
    /// Input.
    pub input_w: f64,
    /// Stator copper.
    pub stator_w: Estimate,
    /// Rotor.
    pub rotor_w: Estimate,
    /// Iron.
    pub iron_w: Estimate,
    /// Friction and windage.
    pub friction_windage_w: Estimate,
    /// Additional load loss.
    pub stray_w: Estimate,
    /// Sum.
    pub total_w: Estimate,
    /// 1 − losses/input.
    pub efficiency: Estimate,
    /// Output over input, where the torque was measured.
    pub direct_efficiency: Option<Estimate>,
}

/// Segregated losses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Losses {
    /// What parts friction and windage from iron.
    pub constant_by: ConstantBy,
    /// P_fw + P_fe at rated voltage.
    pub constant_w: Estimate,
    /// Friction and windage at synchronous speed.
    pub friction_windage_w: Estimate,
    /// Iron at rated voltage, no load.
    pub iron_w: Estimate,
    /// How the additional load loss was found.
    pub stray_by: StrayBy,
    /// A, W/(Nm)².
    pub stray_w_per_nm2: Estimate,
    /// B, W: what the readings miss by where all is right.
    pub intercept_w: Estimate,
    /// Correlation of residual loss and torque squared; the standard asks for 0.95.
    pub correlation: Option<f64>,
    /// The load point that was left out for it, from 0.
    pub left_out: Option<usize>,
    /// Load points, in the order of the rows.
    pub points: Vec<LoadPoint>,
    /// What could not be told and what would settle it; what was assumed.
    pub remarks: Vec<String>,
}

/// What the standard asks of the regression.
const CORRELATION: f64 = 0.95;
/// Up to this part of the rated voltage saturation shows little in the iron loss: the points of the straight line.
const LOW_VOLTAGE: f64 = 0.62;
/// Points that a line needs.
const LINE_POINTS: usize = 3;

/// Why losses cannot be segregated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct LossesError(String);

/// The losses of a motor from its tables, with 95-% intervals by the class of the instruments.
///
/// # Errors
/// No rows under load and none without, or rows that no motor gives.
pub fn segregate(motor: &MotorFile, tables: &[SteadyTable], resistance: Option<Resistance>) -> Result<Losses, LossesError> {
    if let Some(fault) = decided(motor, tables).iter().find_map(|t| fault(motor, t)) {
        return Err(LossesError(format!("{}: {}. {}", fault.recording, fault.sentence, fault.advice)));
    }
    // A speed that no machine has at no load leaves a slip that is none.
    let (tables, wrong_speed) = corrected(motor, tables).unwrap_or_else(|_| (tables.to_vec(), None));
    let readings = Readings::of(motor, &tables, resistance)?;
    readings.within_the_input()?;
    let mut losses = of(&readings)?;
    uncertainty::fill(&mut losses, &readings);
    losses.remarks = wrong_speed.map(|f| format!("{}. {}.", f.sentence, f.advice)).into_iter().collect();
    losses.remarks.extend(readings.remarks.clone());
    losses.remarks.extend(remarks(&losses, &readings));
    Ok(losses)
}

/// P_fw + P_fe at no load over the line voltage.
struct Constant {
    by: ConstantBy,
    /// Voltage squared and loss, rising.
    points: Vec<(f64, f64)>,
    friction: f64,
}

impl Constant {
    fn of(r: &Readings) -> Option<Self> {
        let constant = |p: &readings::Reading| {
            let output = p.torque_nm.zip(p.omega_m).map_or(0.0, |(t, w)| t * w);
            (p.voltage_v.powi(2), p.power_w - 1.5 * p.resistance_ohm * p.current_a.powi(2) - output)
        };
        let mut points: Vec<(f64, f64)> = r.no_load.iter().map(constant).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (first, last) = (points.first()?, points.last()?);
        // Voltages that are nearly the same are one.
        if last.0 < 1.5 * first.0 {
            let n = points.len() as f64;
            let mean = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
            return Some(Self { by: ConstantBy::OneVoltage, friction: r.share * mean.1, points: vec![mean] });
        }
        let low = points.iter().filter(|p| p.0 <= (LOW_VOLTAGE * r.rated_v).powi(2)).count();
        let used = &points[..low.max(LINE_POINTS.min(points.len()))];
        let friction = Line::through(used)?.intercept;
        Some(Self { by: ConstantBy::Voltages, friction, points })
    }

    /// P_fe at a line voltage: by straight lines over U² between the points, in proportion to it beyond them.
    fn iron(&self, voltage_v: f64) -> f64 {
        let x = voltage_v * voltage_v;
        let iron = |k: usize| self.points[k].1 - self.friction;
        let after = self.points.partition_point(|p| p.0 < x);
        if after == 0 || after == self.points.len() {
            let end = after.min(self.points.len() - 1);
            return iron(end) * x / self.points[end].0;
        }
        let (a, b) = (self.points[after - 1].0, self.points[after].0);
        iron(after - 1) + (iron(after) - iron(after - 1)) * (x - a) / (b - a)
    }
}

fn of(r: &Readings) -> Result<Losses, LossesError> {
    let constant = match Constant::of(r) {
        Some(c) => c,
        None => by_load_points(r)?,
    };
    let mut points: Vec<LoadPoint> = r.load.iter().map(|p| point(r, p, &constant)).collect();
    let residual: Vec<(usize, f64, f64)> = points
        .iter()
        .zip(&r.load)
        .enumerate()
        .filter_map(|(k, (x, p))| Some((k, p.torque_nm?.powi(2), p.power_w - p.torque_nm? * p.omega_m? - x.total_w.value)))
        .collect();
    let (line, left_out) = regression(&residual);
    let correlation = line.as_ref().map(|l| l.correlation);
    // What falls with the torque is no loss that the torque makes.
    let by_line = line.filter(|l| l.slope > 0.0);
    let slope = by_line.as_ref().map_or(0.0, |l| l.slope);
    let stray_by = if by_line.is_some() { StrayBy::Regression } else { StrayBy::Allowance };
    for (x, p) in points.iter_mut().zip(&r.load) {
        let without = x.total_w.value;
        let stray = match (stray_by, p.torque_nm) {
            (StrayBy::Regression, Some(t)) => slope * t * t,
            _ => allowance(p.power_w, p.power_w - without),
        };
        x.stray_w = stray.into();
        x.total_w = (without + stray).into();
        x.efficiency = (1.0 - x.total_w.value / p.power_w).into();
    }
    let rated = constant.iron(r.rated_v);
    Ok(Losses {
        constant_by: constant.by,
        constant_w: (constant.friction + rated).into(),
        friction_windage_w: constant.friction.into(),
        iron_w: rated.into(),
        stray_by,
        stray_w_per_nm2: slope.into(),
        intercept_w: by_line.as_ref().map_or(0.0, |l| l.intercept).into(),
        correlation,
        left_out,
        points,
        remarks: Vec::new(),
    })
}

/// A load point without its additional loss.
fn point(r: &Readings, p: &readings::Reading, constant: &Constant) -> LoadPoint {
    let slip = p.omega_m.map_or(0.0, |w| 1.0 - w / r.synchronous_rad_s);
    let (i, resistance) = (p.current_a, p.resistance_ohm);
    let stator = 1.5 * resistance * i * i;
    let cos = (p.power_w / (3f64.sqrt() * p.voltage_v * i)).clamp(-1.0, 1.0);
    let drop = 0.5 * 3f64.sqrt() * i * resistance;
    let inner = (p.voltage_v - drop * cos).hypot(drop * (1.0 - cos * cos).sqrt());
    let iron = constant.iron(inner);
    let rotor = (p.power_w - stator - iron) * slip;
    let friction = constant.friction * (1.0 - slip).max(0.0).powf(2.5);
    let total = stator + iron + rotor + friction;
    LoadPoint {
        torque_nm: p.torque_nm,
        slip,
        winding_c: p.winding_c,
        input_w: p.power_w,
        stator_w: stator.into(),
        rotor_w: rotor.into(),
        iron_w: iron.into(),
        friction_windage_w: friction.into(),
        stray_w: 0.0.into(),
        total_w: total.into(),
        efficiency: 0.0.into(),
        direct_efficiency: p.torque_nm.zip(p.omega_m).map(|(t, w)| (t * w / p.power_w).into()),
    }
}

/// The line of residual loss over torque squared; where it correlates too little, without the point that is worst for it.
fn regression(residual: &[(usize, f64, f64)]) -> (Option<Line>, Option<usize>) {
    let line = |without: Option<usize>| {
        let used: Vec<(f64, f64)> = residual.iter().filter(|x| Some(x.0) != without).map(|x| (x.1, x.2)).collect();
        (used.len() >= LINE_POINTS).then(|| Line::through(&used)).flatten()
    };
    let all = line(None);
    if all.as_ref().is_none_or(|l| l.correlation >= CORRELATION) || residual.len() <= LINE_POINTS {
        return (all, None);
    }
    let one_less = residual.iter().filter_map(|x| Some((x.0, line(Some(x.0))?)));
    match one_less.max_by(|a, b| a.1.correlation.total_cmp(&b.1.correlation)) {
        Some((k, better)) if better.correlation >= CORRELATION => (Some(better), Some(k)),
        _ => (all, None),
    }
}

/// What load points leave at no torque, where there is no no-load test; the share of the iron in it is open.
fn by_load_points(r: &Readings) -> Result<Constant, LossesError> {
    let needs = || {
        LossesError(
            "no rows without load, and fewer than three under load with torque and speed: give a no-load test, or more load points".into(),
        )
    };
    let mut constant = Constant { by: ConstantBy::LoadPoints, points: vec![(r.rated_v.powi(2), 0.0)], friction: 0.0 };
    // The iron's part weighs in the rotor loss by the slip only: a few rounds settle it.
    for _ in 0..20 {
        let left: Vec<(f64, f64)> = r
            .load
            .iter()
            .filter_map(|p| {
                let x = point(r, p, &constant);
                let known = x.stator_w.value + x.rotor_w.value;
                Some((p.torque_nm?.powi(2), p.power_w - p.torque_nm? * p.omega_m? - known))
            })
            .collect();
        if left.len() < LINE_POINTS {
            return Err(needs());
        }
        let sum = Line::through(&left).ok_or_else(needs)?.intercept;
        constant.points[0].1 = sum;
        constant.friction = r.share * sum;
    }
    Ok(constant)
}

/// Additional load loss where it is not measured: 2.5 % of the input up to 1 kW, 0.5 % from 10 MW on (IEC 60034-2-1, 8.2.2.5.3).
fn allowance(input_w: f64, output_w: f64) -> f64 {
    let decades = (output_w / 1000.0).max(1.0).log10().min(4.0);
    input_w * (0.025 - 0.005 * decades)
}

fn remarks(l: &Losses, r: &Readings) -> Vec<String> {
    let mut out = Vec::new();
    match l.constant_by {
        ConstantBy::Voltages => {}
        ConstantBy::OneVoltage => out.push(
            "One voltage cannot tell iron loss from friction and windage: their sum is known, and either may be all of it. A no-load reading at half \
             the voltage settles it."
                .into(),
        ),
        ConstantBy::LoadPoints => out.push(
            "There is no no-load test: iron loss, friction and windage together are what the load points leave without torque, and either may be all \
             of it. No-load readings at rated and at half the voltage settle it."
                .into(),
        ),
    }
    if l.stray_by == StrayBy::Allowance && !l.points.is_empty() {
        let why = if l.correlation.is_some_and(|c| c <= 0.0) {
            "the residual loss of the load points does not rise with the torque"
        } else {
            "the residual loss of at least three load points with torque and speed would measure it"
        };
        out.push(format!("The additional load loss is the allowance of the standard: {why}."));
    }
    if let Some(c) = l.correlation.filter(|c| *c < CORRELATION) {
        out.push(format!(
            "Residual loss and torque squared correlate by {c:.3}; the standard asks for {CORRELATION}. Check torque and speed, or their zero."
        ));
    }
    if let Some(k) = l.left_out {
        out.push(format!(
            "Load point {} does not fit the others: it was left out of the regression, as the standard allows once.",
            k + 1
        ));
    }
    if l.friction_windage_w.value < 0.0 {
        out.push("Friction and windage come out negative: the resistance is too high, or the low voltages slip too much.".into());
    }
    if r.load.iter().any(|p| p.omega_m.is_none()) {
        out.push("Load points without a speed have no slip: their rotor loss is not counted.".into());
    }
    out
}

#[cfg(test)]
mod tests;
