//! The losses that a fitted machine has in the steady states of tables, with the intervals of the fit.
//!
//! The parts are those of the circuit: P_s = (3/2) R_s(θ) |i_s|², P_r = (3/2) R_r(θ) |i_r|², P_fe = (3/2) G |dψ_m/dt|², what brakes the shaft, and
//! of that the part of `stray_load_torque`. Unlike the standard's they are behind the leakage, and add up to P₁ − Tω by themselves.

use im_identify::offline::{Experiment, FitError};
use im_model::{BaseParameter, Complex, EffectId, Held, Known, Machine, MotorFile, ParameterId, Plant, PlantInput, steady_state};
use serde::Serialize;

use super::Resistance;
use super::uncertainty::Estimate;
use crate::case::Case;
use crate::fitted::Fitted;
use crate::intake::SteadyTable;
use crate::intake::steady_table::TableKind;
use crate::search::Options;
use crate::tables;
use crate::uncertainty::{Estimates, HALF_95};
use crate::winding;

/// A torque below it is one of rounding.
const NO_TORQUE_NM: f64 = 1e-9;

/// Losses of one row, W.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelPoint {
    /// The table.
    pub table: String,
    /// Torque at the shaft, Nm.
    pub torque_nm: f64,
    /// Slip.
    pub slip: f64,
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
}

/// What has an interval: the parts, their sum, the efficiency.
const SHOWN: usize = 7;

/// A steady state: torque at the shaft, slip and input, and what has an interval.
struct Point([f64; 3], [f64; SHOWN]);

impl Point {
    /// Of row `k`; `None` where the machine has no such state.
    fn of(machine: &Machine<f64>, e: &Experiment, k: usize) -> Option<Self> {
        let frequency_hz = e.supply_frequency_hz?;
        let warm = e.machine_of(machine, k);
        let u = e.u_s[k].norm();
        let held = e.imposed_speed.as_ref().map_or(Held::Load(e.tau_load[k]), |w| Held::Speed(w[k]));
        let x = steady_state(&warm, u, frequency_hz, held).ok()?;
        let powers = |m: &Machine<f64>| Plant::new(m).evaluate(&x, &PlantInput::new(Complex::new(u, 0.0), 0.0)).powers;
        let with = powers(&warm);
        let friction = powers(&warm.without([EffectId::StrayLoadTorque]).ok()?).friction;
        let parts = [with.stator_copper, with.rotor_copper, with.iron, friction, with.friction - friction];
        let (input, total) = (with.electrical_input, parts.iter().sum::<f64>());
        let slip = 1.0 - f64::from(machine.pole_pairs()) * x.omega_m / (std::f64::consts::TAU * frequency_hz);
        let [a, b, c, d, s] = parts;
        Some(Self([(input - total) / x.omega_m, slip, input], [a, b, c, d, s, total, 1.0 - total / input]))
    }
}

/// The losses of a machine in every row of tables that turns; `estimates` are those of its fit.
pub fn points(estimates: &Estimates, machine: &Machine<f64>, experiments: &[Experiment]) -> Vec<ModelPoint> {
    let turns = |e: &Experiment, k: usize| e.is_table() && e.imposed_speed.as_ref().is_none_or(|w| w[k].abs() > 1.0);
    let rows = experiments.iter().flat_map(|e| (0..e.len()).filter(move |&k| turns(e, k)).map(move |k| (e, k)));
    rows.filter_map(|(e, k)| point(estimates, machine, e, k)).collect()
}

fn point(estimates: &Estimates, machine: &Machine<f64>, e: &Experiment, k: usize) -> Option<ModelPoint> {
    let Point([torque_nm, slip, input_w], values) = Point::of(machine, e, k)?;
    let std = estimates.std_of(machine, &values, |m| Point::of(m, e, k).map(|p| p.1.to_vec()));
    let estimate = |j: usize| Estimate { value: values[j], half_95: HALF_95 * std[j] };
    let [stator_w, rotor_w, iron_w, friction_windage_w, stray_w, total_w, efficiency] = std::array::from_fn(estimate);
    let table = e.name.clone();
    Some(ModelPoint {
        table,
        // One of rounding is none.
        torque_nm: if torque_nm.abs() < NO_TORQUE_NM { 0.0 } else { torque_nm },
        slip,
        input_w,
        stator_w,
        rotor_w,
        iron_w,
        friction_windage_w,
        stray_w,
        total_w,
        efficiency,
    })
}

/// The effects that the standards count beside copper and friction.
pub const COUNTED: [EffectId; 2] = [EffectId::IronLoss, EffectId::StrayLoadTorque];

/// The losses of the load points by the model that has the standards' losses, fitted to all tables.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ByModel {
    /// Rms residual of the fit, in σ of the instruments.
    pub error: f64,
    /// Load points, in the order of the rows; a row that the machine cannot run in is left out.
    pub points: Vec<ModelPoint>,
}

impl ByModel {
    /// Fits the model.
    ///
    /// # Errors
    /// As of a fit.
    pub fn of(motor: &MotorFile, given: &[SteadyTable], resistance: Option<Resistance>) -> Result<Self, FitError> {
        let mut motor = motor.clone();
        let mut given = tables::decided(&motor, given);
        if let Some(r) = resistance {
            let id = ParameterId::Base(BaseParameter::StatorResistance);
            let value = 0.5 * r.terminal_ohm;
            motor.machine = motor.machine.with(&[(id, value)])?;
            motor.known.insert(id, Known { value, tolerance: 0.01 * r.class_percent * HALF_95 / 3f64.sqrt() });
            motor.winding_c = Some(r.at_c);
            for row in given.iter_mut().flat_map(|t| &mut t.rows) {
                row.winding_c.get_or_insert(r.warm_c);
            }
        }
        for effect in COUNTED {
            if !motor.machine.effects().is_on(effect) {
                motor = motor.with_usual(effect)?;
            }
        }
        let (Case { mut motor, train, .. }, _) = tables::case(motor, &given)?;
        winding::settle(&mut motor, &train);
        let case = Case { motor: motor.clone(), train, holdout: None };
        let fitted = Fitted::new(case, Options::default())?;
        let load = given.iter().filter(|t| t.kind == TableKind::Load);
        let one = |t: &SteadyTable| -> Vec<SteadyTable> {
            t.rows.iter().map(|r| SteadyTable { rows: vec![*r], ..t.clone() }).collect()
        };
        let rows: Vec<Experiment> = load.flat_map(one).flat_map(|t| tables::experiments(&motor, &t)).collect();
        let points = points(&fitted.estimates, &fitted.after.machine, &rows);
        Ok(Self { error: fitted.train.chi2_per_sample.sqrt(), points })
    }
}
