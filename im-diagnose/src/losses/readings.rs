//! What the instruments showed, row by row, with the resistance at the temperature of each.

use im_identify::offline::HALF_95;
use im_model::{BaseParameter, Conductor, MotorFile, ParameterId, WARMER_IN_USE};

use super::LossesError;
use crate::format::number;
use crate::intake::steady_table::{SteadyRow, SteadyTable, TableKind};
use crate::tables::decided;

/// The resistance of the stator winding as it was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resistance {
    /// Between two terminals, Ω.
    pub terminal_ohm: f64,
    /// Temperature of the winding then, °C.
    pub at_c: f64,
    /// Temperature of the winding under load, °C, where rows do not say it.
    pub warm_c: f64,
    /// What it may be off by, per cent.
    pub class_percent: f64,
}

impl Resistance {
    /// As a motor file has it, with what is to be said of it: known as far as the file says, and as warm as its winding may be in tests that say no
    /// temperature.
    fn of(motor: &MotorFile, tables: &[SteadyTable]) -> (Self, Option<String>) {
        let known = motor.known.get(&ParameterId::Base(BaseParameter::StatorResistance));
        let terminal_ohm = 2.0 * known.map_or(motor.machine.parameters().stator_resistance_ohm, |k| k.value);
        let at_c = motor.reference_c();
        let unsaid = tables.iter().flat_map(|t| &t.rows).any(|r| r.winding_c.is_none());
        let given = known.map_or(USUAL_TOLERANCE, |k| k.tolerance);
        let tolerance = if unsaid && motor.winding_c.is_some() { given.max(WARMER_IN_USE) } else { given };
        let remark = match motor.winding_c {
            Some(_) if !unsaid => None,
            Some(_) => Some(format!(
                "The stator resistance of the motor file is that at {at_c} °C, and no temperature of the winding in the tests is given: {:.0} % is \
                 allowed for. Give it row by row in a column winding_C.",
                100.0 * tolerance
            )),
            None => Some(format!(
                "The stator resistance is that of the motor file, {terminal_ohm:.4} Ω between two terminals, taken as warm as in the tests and known to \
                 {:.0} %; give the measured one with --terminal-resistance-ohm and its temperature.",
                100.0 * tolerance
            )),
        };
        // A tolerance is twice the standard deviation, a class √3 times.
        let class_percent = 100.0 * tolerance * 3f64.sqrt() / HALF_95;
        (Self { terminal_ohm, at_c, warm_c: at_c, class_percent }, remark)
    }
}

/// Of a resistance of which a motor file says nothing more.
const USUAL_TOLERANCE: f64 = 0.05;

/// From this part of the input on, the copper loss of a row is no error of its instruments.
const BEYOND_INPUT: f64 = 1.2;

/// One row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Line to line, V rms.
    pub voltage_v: f64,
    /// Line current, A rms.
    pub current_a: f64,
    /// Of three phases, W.
    pub power_w: f64,
    /// Speed, rad/s.
    pub omega_m: Option<f64>,
    /// Torque at the shaft, Nm.
    pub torque_nm: Option<f64>,
    /// Between two terminals, at the temperature of the row, Ω.
    pub resistance_ohm: f64,
    /// That temperature, °C.
    pub winding_c: f64,
    /// Class of the instruments, per cent.
    pub class_percent: f64,
}

/// All rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Readings {
    /// Without load.
    pub no_load: Vec<Reading>,
    /// Under load.
    pub load: Vec<Reading>,
    /// Rated line-to-line voltage, V rms.
    pub rated_v: f64,
    /// Synchronous speed, rad/s.
    pub synchronous_rad_s: f64,
    /// What the resistance may be off by, per cent.
    pub resistance_percent: f64,
    /// Part of the constant losses that is friction, where no voltages tell it.
    pub share: f64,
    /// What was assumed.
    pub remarks: Vec<String>,
}

impl Readings {
    /// Whether the winding takes no more than comes in.
    ///
    /// # Errors
    /// A row in which it would, by more than its instruments err.
    pub(super) fn within_the_input(&self) -> Result<(), LossesError> {
        let copper = |r: &Reading| 1.5 * r.resistance_ohm * r.current_a.powi(2);
        let rows = self.no_load.iter().chain(&self.load);
        let worst = rows.max_by(|a, b| (copper(a) / a.power_w).total_cmp(&(copper(b) / b.power_w)));
        let Some(row) = worst.filter(|r| copper(r) > BEYOND_INPUT * r.power_w) else { return Ok(()) };
        Err(LossesError(format!(
            "with {} Ω between two terminals the winding alone would take {} W at {} A, of an input of {} W: the resistance is too high (is it in mΩ?), or the power too low (in kW?)",
            number(row.resistance_ohm, 4),
            number(copper(row), 3),
            number(row.current_a, 3),
            number(row.power_w, 3)
        )))
    }

    pub(super) fn of(motor: &MotorFile, tables: &[SteadyTable], resistance: Option<Resistance>) -> Result<Self, LossesError> {
        let mut remarks = Vec::new();
        let cold = resistance.unwrap_or_else(|| {
            let (resistance, remark) = Resistance::of(motor, tables);
            remarks.extend(remark);
            resistance
        });
        let mut me = Self {
            no_load: Vec::new(),
            load: Vec::new(),
            rated_v: motor.rating.phase_voltage_peak_v * 1.5f64.sqrt(),
            synchronous_rad_s: motor.rating.synchronous_speed_rad_s(motor.machine.pole_pairs()),
            resistance_percent: cold.class_percent,
            share: 0.5,
            remarks,
        };
        for t in decided(motor, tables) {
            let reading = |r: &SteadyRow| {
                let winding_c = r.winding_c.unwrap_or(cold.warm_c);
                Reading {
                    voltage_v: 3f64.sqrt() * r.phase_voltage_rms_v,
                    current_a: r.current_rms_a,
                    power_w: r.active_power_w,
                    omega_m: r.omega_m_rad_s,
                    torque_nm: r.torque_nm,
                    resistance_ohm: cold.terminal_ohm * Conductor::Copper.warmed(cold.at_c, winding_c),
                    winding_c,
                    class_percent: t.class_percent,
                }
            };
            let rows = t.rows.iter().map(reading);
            match t.kind {
                TableKind::NoLoad => me.no_load.extend(rows),
                TableKind::Load => me.load.extend(rows),
                TableKind::Locked | TableKind::Unsaid => {}
            }
        }
        if me.no_load.is_empty() && me.load.is_empty() {
            return Err(LossesError(
                "no table is of a turning motor: give a no-load test, and load points with torque and speed".into(),
            ));
        }
        Ok(me)
    }
}
