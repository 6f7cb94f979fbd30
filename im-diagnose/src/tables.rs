//! A case from tables of steady states: no-load, locked-rotor and load tests.

use std::f64::consts::SQRT_2;

use im_identify::offline::{
    Channel, ChannelKind, Experiment, FitError, FitOptions, Load, Start, base_parameters_in, fit, predict,
};
use im_model::effects::SteadyState;
use im_model::{Complex, EffectId, MotorFile, State};

use crate::case::Case;
use crate::format::number;
use crate::intake::steady_table::{SteadyRow, SteadyTable, TableKind};
use crate::intake::{Finding, FindingKind, Severity};
use crate::table_balance::fault;

/// The effects that a sinusoidal steady state shows.
pub fn candidates() -> Vec<EffectId> {
    EffectId::ALL.iter().copied().filter(|id| id.about().steady_state == SteadyState::Shows).collect()
}

/// The same of a speed sensor, of synchronous speed.
const TACHOMETER: f64 = 0.002;
/// Least wrong scale of a speed sensor that is worth mending.
const WRONG_SCALE: f64 = 0.004;

/// From so many times the input on, a copper loss by the motor file's resistance is no matter of that resistance.
const COPPER_BEYOND: f64 = 3.0;

/// Different rows that tables need between them: fewer leave parameters undetermined.
const ROWS: usize = 5;

/// What is wrong with tables before anything is fitted to them.
pub fn look(motor: &MotorFile, tables: &[SteadyTable]) -> Vec<Finding> {
    let tables = &decided(motor, tables)[..];
    let mut out: Vec<Finding> = tables.iter().flat_map(|t| look_at(motor, t).into_iter().chain(fault(motor, t))).collect();
    let count = tables.iter().map(|t| distinct(t).len()).sum::<usize>();
    if count < ROWS {
        let text = format!("{count} different rows in all do not determine a machine");
        let advice = "Measure at least five points: voltages without load, currents with the rotor locked, torques.";
        let finding = Finding::new(FindingKind::TooFewRows, Severity::Serious, text, advice);
        let names: Vec<&str> = tables.iter().map(|t| t.name.as_str()).collect();
        out.push(Finding { recording: names.join(", "), ..finding });
    }
    out.extend(one_voltage(tables));
    out
}

/// Rows that turn at nearly one voltage: what leaves through the iron and what through the shaft is one sum there.
fn one_voltage(tables: &[SteadyTable]) -> Option<Finding> {
    let turning: Vec<&SteadyTable> = tables.iter().filter(|t| t.kind != TableKind::Locked).collect();
    let voltages = || turning.iter().flat_map(|t| &t.rows).map(|r| r.phase_voltage_rms_v);
    let (low, high) = voltages().fold((f64::INFINITY, 0.0f64), |(l, h), u| (l.min(u), h.max(u)));
    (low < high || voltages().count() > 1).then_some(())?;
    (high < 1.15 * low).then(|| {
        let text = "All turning rows are at one voltage: iron loss cannot be told from friction and windage, and friction may hold either".to_owned();
        let advice = "A no-load row at half the voltage settles it.";
        let names: Vec<&str> = turning.iter().map(|t| t.name.as_str()).collect();
        Finding { recording: names.join(", "), ..Finding::new(FindingKind::OneVoltage, Severity::Note, text, advice) }
    })
}

fn distinct(t: &SteadyTable) -> Vec<&SteadyRow> {
    let mut rows: Vec<&SteadyRow> = Vec::new();
    for row in &t.rows {
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    rows
}

fn look_at(motor: &MotorFile, t: &SteadyTable) -> Vec<Finding> {
    let mut out = Vec::new();
    let mut say = |kind, severity, text: String, advice: &str| {
        let finding = Finding::new(kind, severity, text, advice);
        out.push(Finding { recording: t.name.clone(), ..finding });
    };
    let twice = t.rows.len() - distinct(t).len();
    if twice > 0 {
        let text = format!("{twice} rows stand twice; they count twice");
        say(FindingKind::RepeatedRows, Severity::Warning, text, "Leave one of each out.");
    }
    let torque: Vec<f64> = t.rows.iter().filter_map(|r| r.torque_nm).collect();
    let rated = motor.rating.torque_nm;
    let loaded = t.kind == TableKind::Load || varied(t);
    // Without a torque the speed says what the rotor does.
    let driven = t.kind == TableKind::Load && torque.is_empty() && t.rows.iter().all(|r| r.omega_m_rad_s.is_some());
    if loaded && !driven && torque.iter().all(|x| x.abs() < 1e-3 * rated) {
        let text = match torque.is_empty() {
            true => "The power varies at one voltage as under load, and there is no torque".to_owned(),
            false => "The power varies at one voltage as under load, and the torque is zero in every row".to_owned(),
        };
        say(FindingKind::MissingLoad, Severity::Serious, text, "Give the column of the torque at the shaft, T_Nm.");
    }
    // The winding takes less than the input in every row, whatever the motor file's resistance is off by.
    let r_s = motor.machine.parameters().stator_resistance_ohm;
    let copper = |r: &SteadyRow| 3.0 * r_s * r.current_rms_a.powi(2);
    let least =
        t.rows.iter().min_by(|a, b| (copper(a) / a.active_power_w.abs()).total_cmp(&(copper(b) / b.active_power_w.abs())));
    if let Some(r) = least.filter(|r| copper(r) > COPPER_BEYOND * r.active_power_w.abs()) {
        let text = format!(
            "In every row the winding alone would take several times the input, at {} A {} W of {} W",
            number(r.current_rms_a, 3),
            number(copper(r), 3),
            number(r.active_power_w, 3)
        );
        say(
            FindingKind::OutOfRange,
            Severity::Serious,
            text,
            "Check the unit of the power in [table] (kW read as W?), then that of the current.",
        );
    }
    let current = motor.rating.current_peak_a(motor.machine.parameters(), motor.machine.pole_pairs()) / SQRT_2;
    let voltage = motor.rating.phase_voltage_peak_v / SQRT_2;
    for (what, unit, rated, largest) in [
        ("current", "A", current, t.rows.iter().map(|r| r.current_rms_a).fold(0.0, f64::max)),
        ("phase voltage", "V", voltage, t.rows.iter().map(|r| r.phase_voltage_rms_v).fold(0.0, f64::max)),
    ] {
        if largest > 40.0 * rated || largest < 1e-3 * rated {
            let text = format!("The {what} reaches {largest:.3} {unit} rms, where the motor is rated for {rated:.3}");
            say(FindingKind::OutOfRange, Severity::Serious, text, "Check its unit in [table].");
        }
    }
    out
}

/// Whether the machine works harder in some rows than in others, at one voltage and turning as far as anybody says.
fn varied(t: &SteadyTable) -> bool {
    let turning: Vec<&SteadyRow> = t.rows.iter().filter(|r| t.kind != TableKind::Locked && !r.stands()).collect();
    let spread = |f: &dyn Fn(&SteadyRow) -> f64| {
        let (low, high) = turning.iter().fold((f64::INFINITY, 0.0f64), |(l, h), r| (l.min(f(r)), h.max(f(r))));
        high / low.max(1e-9)
    };
    turning.len() > 1 && spread(&|r| r.phase_voltage_rms_v) < 1.1 && spread(&|r| r.active_power_w.abs()) > 2.0
}

/// The tables with the scale of the speed sensor checked against the no-load test, where the slip is next to nothing, and corrected where it is
/// wrong.
///
/// # Errors
/// As [`fit`] says.
pub fn corrected(motor: &MotorFile, tables: &[SteadyTable]) -> Result<(Vec<SteadyTable>, Option<Finding>), FitError> {
    let mut tables = decided(motor, tables);
    let train: Vec<Experiment> = tables.iter().flat_map(|t| experiments(motor, t)).collect();
    let wrong = speed_scale(motor, &tables, &train)?.filter(|scale| (scale - 1.0).abs() > WRONG_SCALE);
    let Some(scale) = wrong else { return Ok((tables, None)) };
    tables.iter_mut().flat_map(|t| &mut t.rows).filter_map(|r| r.omega_m_rad_s.as_mut()).for_each(|w| *w /= scale);
    let sentence = format!(
        "The speed without load is {:.1} % {} than a machine on {} Hz can run: the sensor's scale was taken as {scale:.4} and corrected",
        100.0 * (scale - 1.0).abs(),
        if scale < 1.0 { "lower" } else { "higher" },
        motor.rating.electrical_frequency_hz
    );
    let advice = "Calibrate the speed sensor, or check the supply frequency";
    let names: Vec<&str> = tables.iter().filter(|t| t.kind != TableKind::Locked).map(|t| t.name.as_str()).collect();
    let finding = Finding::new(FindingKind::SpeedScale, Severity::Warning, sentence, advice).on("speed");
    let finding = Finding { recording: names.join(", "), ..finding };
    Ok((tables, Some(finding)))
}

/// The tables as a case, at the rated frequency of the motor, the speed [`corrected`].
///
/// # Errors
/// As [`fit`] says.
pub fn case(motor: MotorFile, tables: &[SteadyTable]) -> Result<(Case, Vec<Finding>), FitError> {
    let (tables, finding) = corrected(&motor, tables)?;
    let train = tables.iter().flat_map(|t| experiments(&motor, t)).collect();
    Ok((Case { motor, train, holdout: None }, finding.into_iter().collect()))
}

/// The impedance of one phase with the rotor free and with it held, as the motor file has it, Ω.
fn impedances(motor: &MotorFile) -> [f64; 2] {
    let p = motor.machine.parameters();
    let omega = std::f64::consts::TAU * motor.rating.electrical_frequency_hz;
    let free = p.stator_resistance_ohm.hypot(omega * (p.stator_leakage_inductance_h + p.magnetizing_inductance_h));
    let leakage = p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h;
    [free, (p.stator_resistance_ohm + p.rotor_resistance_ohm).hypot(omega * leakage)]
}

/// The tables with the rotor free or held where nobody said: by which of the two impedances theirs is nearer to.
pub(crate) fn decided(motor: &MotorFile, tables: &[SteadyTable]) -> Vec<SteadyTable> {
    let [free, held] = impedances(motor);
    let of = |t: &SteadyTable| {
        if t.kind != TableKind::Unsaid {
            return t.clone();
        }
        // Saturation lowers the impedance of a free rotor: the largest of the rows shows best which it is.
        let seen = t.rows.iter().map(|r| r.phase_voltage_rms_v / r.current_rms_a).fold(0.0, f64::max);
        let off = |z: f64| (seen / z).ln().abs();
        let kind = if off(free) < off(held) { TableKind::NoLoad } else { TableKind::Locked };
        SteadyTable { kind, ..t.clone() }
    };
    tables.iter().map(of).collect()
}

/// What imposes the speed of a row.
#[derive(Clone, Copy, PartialEq)]
enum Speed {
    /// The torque on the shaft.
    Torque,
    /// The load machine, as the speed sensor shows it.
    Shown,
    /// The rotor is held.
    Held,
}

/// The rows whose torque is known as steady states under it; those of a load test without a torque as such at the speed that they show; and those
/// that stand as locked, whatever their torque says: a type test in one table has rows of each kind.
pub(crate) fn experiments(motor: &MotorFile, t: &SteadyTable) -> Vec<Experiment> {
    // A row without a temperature is as warm as the last before it, whichever kind that is of.
    let mut winding_c = t.rows.iter().find_map(|r| r.winding_c);
    let warm = |r: &SteadyRow| {
        winding_c = r.winding_c.or(winding_c);
        SteadyRow { winding_c, ..*r }
    };
    let rows: Vec<SteadyRow> = t.rows.iter().map(warm).collect();
    let of = |r: &SteadyRow| {
        if t.kind == TableKind::Locked || r.stands() {
            Speed::Held
        } else if t.kind == TableKind::Load && r.torque_nm.is_none() && r.omega_m_rad_s.is_some() {
            Speed::Shown
        } else {
            Speed::Torque
        }
    };
    let part = |speed: Speed| {
        let rows: Vec<SteadyRow> = rows.iter().filter(|r| of(r) == speed).copied().collect();
        (!rows.is_empty()).then(|| experiment(motor, t, &rows, speed))
    };
    [Speed::Torque, Speed::Shown, Speed::Held].into_iter().filter_map(part).collect()
}

fn experiment(motor: &MotorFile, t: &SteadyTable, rows: &[SteadyRow], speed: Speed) -> Experiment {
    let mut channels = Vec::new();
    let mut add = |name: &str, kind, value: &dyn Fn(&SteadyRow) -> Option<f64>, sigma: Option<f64>| {
        let values: Vec<Option<f64>> = rows.iter().map(value).collect();
        let count = values.iter().flatten().count();
        if count == 0 {
            return;
        }
        // Of the largest reading of the table, of whichever rows.
        let largest = || t.rows.iter().filter_map(value).fold(0.0f64, |m, v| m.max(v.abs()));
        let sigma = sigma.unwrap_or_else(|| 0.01 * t.class_percent * largest());
        let valid = (count < values.len()).then(|| values.iter().map(Option::is_some).collect());
        let values = values.into_iter().map(Option::unwrap_or_default).collect();
        channels.push(Channel { name: name.into(), kind, values, valid, sigma: sigma.max(1e-9) });
    };
    let synchronous = motor.rating.synchronous_speed_rad_s(motor.machine.pole_pairs());
    add("i_rms_A", ChannelKind::RmsCurrent, &|r| Some(r.current_rms_a), None);
    add("p_W", ChannelKind::ActivePower, &|r| Some(r.active_power_w), None);
    add("q_var", ChannelKind::ReactivePower, &|r| r.reactive_power_var, None);
    if speed == Speed::Torque {
        add("omega_m_rad_s", ChannelKind::Speed, &|r| r.omega_m_rad_s, Some(TACHOMETER * synchronous));
    }
    let imposed = |r: &SteadyRow| if speed == Speed::Shown { r.omega_m_rad_s.unwrap_or_default() } else { 0.0 };
    Experiment {
        name: t.name.clone(),
        sample_time_s: 1.0,
        supply_frequency_hz: Some(motor.rating.electrical_frequency_hz),
        u_s: rows.iter().map(|r| Complex::new(SQRT_2 * r.phase_voltage_rms_v, 0.0)).collect(),
        is_smooth: false,
        voltage_noise: Default::default(),
        tau_load: rows.iter().map(|r| r.torque_nm.unwrap_or(0.0)).collect(),
        load: Load::Known,
        imposed_speed: (speed != Speed::Torque).then(|| rows.iter().map(imposed).collect()),
        speed_nudge: None,
        warmth: warmth(motor, rows),
        inert: None,
        nudge_part: 1.0,
        channels,
        start: Start::Rest,
    }
}

/// What the temperatures make of the resistances, row by row, of rows that all have one or none has. Empty where none has.
fn warmth(motor: &MotorFile, rows: &[SteadyRow]) -> Vec<[f64; 2]> {
    let of = |r: &SteadyRow| r.winding_c.map(|winding_c| motor.warmth(winding_c, r.rotor_c.unwrap_or(winding_c)));
    rows.iter().filter_map(of).collect()
}

/// Speed shown over speed predicted without load, at the voltages from half the largest on; `None` without such rows. A fit without speeds may
/// end anywhere, but no machine runs without load above the speed of its field, or slips by more than if all that crosses the air gap, the power
/// less the copper of the stator, drove the shaft: s ≤ R_r P_δ/(3U²), some thousandths.
fn speed_scale(motor: &MotorFile, tables: &[SteadyTable], train: &[Experiment]) -> Result<Option<f64>, FitError> {
    let mut blind = train.to_vec();
    for e in &mut blind {
        e.channels.retain(|c| c.kind != ChannelKind::Speed);
    }
    let fitted = fit(&motor.machine, &blind, &base_parameters_in(&motor.machine, &blind), &FitOptions::near())?;
    let (mut shown, mut true_) = (0.0, 0.0);
    let free = tables.iter().filter(|t| t.kind == TableKind::NoLoad).map(|t| &t.name);
    let free: Vec<&String> = free.collect();
    let p = motor.machine.parameters();
    let synchronous = motor.rating.synchronous_speed_rad_s(motor.machine.pole_pairs());
    let slowest = |r: &SteadyRow| {
        let across = (r.active_power_w - 3.0 * p.stator_resistance_ohm * r.current_rms_a.powi(2)).max(0.0);
        synchronous * (1.0 - p.rotor_resistance_ohm * across / (3.0 * r.phase_voltage_rms_v.powi(2))).max(0.0)
    };
    for e in train.iter().filter(|e| free.contains(&&e.name)) {
        let Some(t) = tables.iter().find(|t| t.name == e.name && t.rows.len() == e.len()) else { continue };
        let Some(c) = e.channels.iter().position(|c| c.kind == ChannelKind::Speed) else { continue };
        let predicted = predict(&fitted.machine, e, &State::default());
        let largest = e.u_s.iter().map(|u| u.norm()).fold(0.0, f64::max);
        for k in (0..e.len()).filter(|&k| e.u_s[k].norm() > 0.5 * largest && predicted[c][k].is_finite()) {
            shown += e.channels[c].values[k];
            true_ += predicted[c][k].clamp(slowest(&t.rows[k]), synchronous);
        }
    }
    Ok((true_ > 0.0).then(|| shown / true_))
}
