//! Tables of steady states that no machine makes: what goes in, what leaves at the shaft, and how fast it turns.

use im_model::MotorFile;

use crate::format::number;
use crate::intake::steady_table::{SteadyRow, SteadyTable, TableKind};
use crate::intake::unit::SPEEDS_MISREAD;
use crate::intake::{Finding, FindingKind, Severity};

/// Speeds at which a machine works, as parts of the synchronous one.
const AT_WORK: [f64; 2] = [0.6, 1.1];

/// Part of one watt more at the terminals that comes out at the shaft, between no load and beyond rated load.
const PASSED_ON: [f64; 2] = [0.5, 1.05];

/// Beyond this, more comes out than goes in, whatever the instruments err by.
const IMPOSSIBLE: f64 = 1.15;

/// Rows within this part of the largest voltage are at one.
const ONE_VOLTAGE: f64 = 0.9;

/// Part of the rated power that rows must differ by to say anything.
const LOADED: f64 = 0.2;

/// What stops a table: a speed in another unit, and a torque that the power contradicts.
pub(crate) fn fault(motor: &MotorFile, t: &SteadyTable) -> Option<Finding> {
    let largest = t.rows.iter().map(|r| r.phase_voltage_rms_v).fold(0.0, f64::max);
    let rows: Vec<&SteadyRow> = t.rows.iter().filter(|r| !r.stands() && r.phase_voltage_rms_v > ONE_VOLTAGE * largest).collect();
    if t.kind == TableKind::Locked || rows.is_empty() {
        return None;
    }
    let found = speed(motor, &rows).or_else(|| torque(motor, &rows))?;
    Some(Finding { recording: t.name.clone(), ..found })
}

/// A speed that is that of a machine at work in another unit, or with other pole pairs.
fn speed(motor: &MotorFile, rows: &[&SteadyRow]) -> Option<Finding> {
    let n_p = f64::from(motor.machine.pole_pairs());
    let synchronous = motor.rating.synchronous_speed_rad_s(motor.machine.pole_pairs());
    let speeds: Vec<f64> = rows.iter().filter_map(|r| r.omega_m_rad_s).map(f64::abs).collect();
    let works = |factor: f64| speeds.iter().all(|w| (AT_WORK[0]..AT_WORK[1]).contains(&(factor * w / synchronous)));
    if speeds.is_empty() || works(1.0) {
        return None;
    }
    let misread = SPEEDS_MISREAD.iter().find(|(factor, ..)| works(1.0 / factor));
    let misread = misread.map(|(_, is, read)| format!("It is in {is} and read as {read}: say so in [table]."));
    let advice = misread.or_else(|| {
        let pairs = (1..=12u32).find(|&p| f64::from(p) != n_p && works(f64::from(p) / n_p))?;
        Some(format!("Check the pole pairs of the motor file, {n_p}, and its frequency: {pairs} pole pairs would fit."))
    })?;
    let of = |size: fn(f64, f64) -> f64, from: f64| number(speeds.iter().copied().fold(from, size), 3);
    let (least, most) = (of(f64::min, f64::INFINITY), of(f64::max, 0.0));
    let range = if least == most { least } else { format!("{least} to {most}") };
    let text = format!(
        "The speed is {range} rad/s, where a machine with {n_p} pole pairs runs near {} rad/s on {} Hz",
        number(synchronous, 3),
        number(motor.rating.electrical_frequency_hz, 3)
    );
    Some(Finding::new(FindingKind::SpeedScale, Severity::Serious, text, advice).on("speed"))
}

/// A torque that does not go with the power: one watt more at the terminals is nearly one watt more at the shaft.
fn torque(motor: &MotorFile, rows: &[&SteadyRow]) -> Option<Finding> {
    let synchronous = motor.rating.synchronous_speed_rad_s(motor.machine.pole_pairs());
    // Without a speed it is near the synchronous one.
    let shaft = |r: &SteadyRow| Some(r.torque_nm? * r.omega_m_rad_s.unwrap_or(synchronous).abs());
    let all: Vec<(f64, &SteadyRow)> = rows.iter().filter_map(|r| Some((shaft(r)?, *r))).collect();
    let passed_on = |from: &dyn Fn(&SteadyRow) -> Option<f64>| {
        let points: Vec<(f64, f64)> = all.iter().filter_map(|(out, r)| Some((from(r)?, *out))).collect();
        let n = points.len() as f64;
        let (x, y) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
        let (xy, xx) = points.iter().fold((0.0, 0.0), |(a, b), (p, q)| (a + (p - x) * (q - y), b + (p - x).powi(2)));
        (xx > 0.0).then(|| xy / xx)
    };
    let spread = |of: &dyn Fn(&(f64, &SteadyRow)) -> f64| {
        let (low, high) = all.iter().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        high - low
    };
    let rated = motor.rating.torque_nm * synchronous;
    let part = passed_on(&|r| Some(r.active_power_w))?;
    if spread(&|(_, r)| r.active_power_w).max(spread(&|(out, _)| *out)) < LOADED * rated || usual(part) {
        return None;
    }
    let causes = [
        (-1.0, "The torque has the other sign: turn it."),
        (1.0 / 3.0, "The power is that of one phase: give that of all three."),
        (-1.0 / 3.0, "The torque has the other sign, and the power is that of one phase."),
        (
            1.0 / 9.0,
            "The torque is nine times too large: in lbf in, or turned from kgf m into Nm twice? Say its unit in [table].",
        ),
        (9.81, "The torque is in kgf m: say so in [table]."),
        (1e-2, "The torque is in Ncm: say so in [table]."),
        (1e-3, "The torque is in mNm, or the power in kW: say so in [table]."),
        (1e3, "The torque is in kNm, or the power in mW: say so in [table]."),
    ];
    let exchanged = passed_on(&|r| r.reactive_power_var).is_some_and(usual).then_some("Active and reactive power are exchanged.");
    let cause = exchanged.or_else(|| causes.iter().find(|(factor, _)| usual(factor * part)).map(|(_, advice)| *advice));
    let advice = cause.or((part > IMPOSSIBLE).then_some("Check the units of torque, speed and power."))?;
    let (out, most) = all.iter().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
    let text = format!(
        "Of one watt more at the terminals {} W would come out at the shaft; at {} Nm it gives {} W, of {} W that go in",
        number(part, 2),
        number(most.torque_nm.unwrap_or_default(), 3),
        number(*out, 3),
        number(most.active_power_w, 3)
    );
    Some(Finding::new(FindingKind::LoadTorque, Severity::Serious, text, advice).on("torque"))
}

fn usual(part: f64) -> bool {
    (PASSED_ON[0]..PASSED_ON[1]).contains(&part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::machines::MOTULATOR_2_2_KW as M;
    use std::f64::consts::PI;

    /// A load test of a machine with usual losses, as its columns are taken for what they are not.
    #[test]
    fn what_no_machine_makes_is_said_with_its_cause() {
        let mut motor = MotorFile::parse(include_str!("../../examples/motor.toml"), "motor.toml").unwrap();
        motor.rating = M.rating;
        let synchronous = motor.rating.synchronous_speed_rad_s(motor.machine.pole_pairs());
        let row = |part: f64| {
            let (omega, torque) = (synchronous * (1.0 - 0.05 * part), motor.rating.torque_nm * part);
            let power = torque * omega + 120.0 + 300.0 * part * part;
            SteadyRow {
                phase_voltage_rms_v: 230.0,
                current_rms_a: 2.5 + 2.5 * part,
                active_power_w: power,
                reactive_power_var: Some(1500.0 + 200.0 * part),
                omega_m_rad_s: Some(omega),
                torque_nm: Some(torque),
                ..SteadyRow::default()
            }
        };
        let seen = |change: &dyn Fn(&mut SteadyRow)| {
            let mut rows: Vec<SteadyRow> = [0.0, 0.25, 0.5, 0.75, 1.0, 1.25].map(row).to_vec();
            rows.iter_mut().for_each(change);
            let t = SteadyTable { name: "load".into(), kind: TableKind::Load, class_percent: 0.5, rows };
            fault(&motor, &t).map(|f| f.advice).unwrap_or_default()
        };
        assert_eq!(seen(&|_| {}), "");
        let torque = |by: f64| seen(&move |r| r.torque_nm = r.torque_nm.map(|t| by * t));
        let speed = |by: f64| seen(&move |r| r.omega_m_rad_s = r.omega_m_rad_s.map(|w| by * w));
        for (advice, part) in [
            (torque(-1.0), "other sign"),
            (torque(9.81), "kgf m into Nm twice"),
            (torque(1.0 / 9.81), "in kgf m: say"),
            (torque(1e-3), "in kNm"),
            (seen(&|r| r.active_power_w /= 3.0), "one phase"),
            (
                seen(&|r| {
                    let p = r.active_power_w;
                    (r.active_power_w, r.reactive_power_var) = (r.reactive_power_var.unwrap(), Some(p));
                }),
                "exchanged",
            ),
            (speed(PI / 30.0), "in rad/s and read as rpm"),
            (speed(1.0 / 60.0), "in Hz and read as rpm"),
            (speed(2.0), "pole pairs"),
        ] {
            assert!(advice.contains(part), "{part}: {advice:?}");
        }
    }
}
