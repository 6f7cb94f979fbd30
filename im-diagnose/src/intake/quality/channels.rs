//! Every channel for itself: dead, out of range, with a mean where there should be none; and what is not there at all.

use std::f64::consts::PI;

use im_model::MotorFile;

use super::clip::flat_tops;
use super::offset;
use super::steady::Steady;
use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity, ranges};
use crate::intake::load_plan::LoadPlan;
use crate::intake::mapping::{CurrentForm, VoltageForm};
use crate::intake::repair::remove_spikes;
use crate::intake::signals::{Signals, SpeedTrace};
use crate::intake::trace::Trace;
use crate::intake::unit::UNITS;

/// How far beyond the rating a value is beyond belief; and how far below it, for the largest of a recording.
const BEYOND: [f64; 3] = [4.0, 40.0, 6.0];
const BELOW: f64 = 0.01;

/// Looks at every channel.
pub fn check(s: &Signals, steady: &[Steady], motor: &MotorFile) -> Vec<Finding> {
    let mut out = Vec::new();
    let p = motor.machine.parameters();
    let r = &motor.rating;
    let n_p = f64::from(motor.machine.pole_pairs());
    let magnetizing = r.rotor_flux_vs / p.magnetizing_inductance_h;
    let active = r.torque_nm / (1.5 * n_p * r.rotor_flux_vs.max(1e-9));
    let rated = [r.phase_voltage_peak_v, magnetizing.hypot(active), r.synchronous_speed_rad_s(motor.machine.pole_pairs())];
    let duty = matches!(s.voltage_form, VoltageForm::Duty(..));
    let voltages = if duty { &[][..] } else { &s.voltage[..] };
    out.extend(range(voltages.iter(), "voltage", "V", rated[0], BEYOND[0]));
    for t in voltages {
        let flat = flat_tops(&t.values);
        // A drive's limit is the voltage it commands: only sensors clip.
        if s.instant == crate::intake::mapping::Instant::Sample && flat.contains(&true) {
            let text = format!(
                "{} is cut off at its limit in {} rows; the model is driven by it",
                t.column,
                flat.iter().filter(|f| **f).count()
            );
            let advice = "Record the voltage with a larger range.";
            out.push(Finding::new(FindingKind::ClippedSensor, Severity::Serious, text, advice).on(&t.column).at(ranges(&flat)));
        }
    }
    // In a turning field every phase has its share; along one axis at standstill the other has none.
    if !steady.is_empty() {
        out.extend(silent(voltages.iter(), "voltage", "V"));
        out.extend(silent(s.current.iter().map(|c| &c.main), "current", "A"));
    }
    let currents: Vec<&Trace> = s.current.iter().map(|c| &c.main).collect();
    out.extend(range(currents.iter().copied(), "current", "A", rated[1], BEYOND[1]));
    // Of three phases the sum shows them, and their rows are left out.
    if !matches!(s.current_form, CurrentForm::Phases(_)) {
        out.extend(currents.iter().filter_map(|t| single_readings(t)));
    }
    out.extend(offset::check(voltages, &currents, steady, p.stator_resistance_ohm));
    along_one_axis(s, &mut out);
    match &s.speed {
        SpeedTrace::Measured(t) => {
            let peak = largest(t);
            if span(t) == 0.0 {
                let text = format!("The speed {} is {} rad/s in every row", t.column, number(t.values[0], 3));
                let advice = "If the rotor was locked say locked = true in [speed]; else the sensor is dead: leave [speed] out.";
                out.push(Finding::new(FindingKind::DeadChannel, Severity::Warning, text, advice).on(&t.column));
            } else if peak > BEYOND[2] * rated[2] {
                let text = format!(
                    "The speed {} reaches {} rad/s, {} times the synchronous speed",
                    t.column,
                    number(peak, 3),
                    number(peak / rated[2], 2)
                );
                let advice = match [("rpm", PI / 30.0), ("deg/s", PI / 180.0)].iter().find(|(_, si)| peak * si < 1.3 * rated[2]) {
                    Some((unit, _)) => format!("Is it in {unit}? Say unit = \"{unit}\" in [speed], or check its gain."),
                    None => "Check its unit (rpm or rad/s) and gain.".to_owned(),
                };
                out.push(Finding::new(FindingKind::OutOfRange, Severity::Serious, text, advice).on(&t.column));
            }
        }
        SpeedTrace::Absent => out.push(Finding::new(
            FindingKind::MissingSpeed,
            Severity::Note,
            "No speed is measured: the model is compared by its currents alone",
            "",
        )),
        SpeedTrace::Locked => {}
    }
    if s.tau_load.is_none() && s.speed != SpeedTrace::Locked {
        let (text, advice) = match s.load {
            LoadPlan::Unknown => (
                "No load torque is known: the measured speed drives the electrical side. Inertia, friction and whatever else acts on the \
                 shaft are not determined",
                "Say [load] none = true if the machine drove nothing, or give a column, a constant or a fan's torque.",
            ),
            _ => (
                "Neither load torque nor speed is known: the speed that voltages and currents ask for drives the electrical side. What only \
                 another speed would show, inertia, friction and whatever else acts on the shaft cannot be told",
                "Say [load] none = true if the machine drove nothing, give a column or a law in [load], or measure the speed.",
            ),
        };
        out.push(Finding::new(FindingKind::MissingLoad, Severity::Note, text, advice));
    }
    out
}

/// Single readings that are farther off their neighbours than half of all that the others show.
fn single_readings(t: &Trace) -> Option<Finding> {
    let mut calm = t.values.clone();
    remove_spikes(&mut calm);
    let most = calm.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let far: Vec<usize> = (0..calm.len()).filter(|&k| (t.values[k] - calm[k]).abs() > 0.5 * most).collect();
    if far.is_empty() || most == 0.0 {
        return None;
    }
    let peak = far.iter().fold(0.0, |m: f64, &k| m.max(t.values[k].abs()));
    let (count, peak, most) = (far.len(), number(peak, 3), number(most, 3));
    let text = format!(
        "{} has {count} single readings far off their neighbours, up to {peak} A where the others reach {most} A",
        t.column
    );
    let advice = format!("Say {{ column = \"{}\", spikes = true }} for it in [current]: they are then replaced.", t.column);
    let rows = far.into_iter().map(|k| k..k + 1).collect();
    Some(Finding::new(FindingKind::Glitch, Severity::Warning, text, advice).on(&t.column).at(rows))
}

/// A test at standstill along one axis: nothing is applied to the other, and next to nothing flows there.
fn along_one_axis(s: &Signals, out: &mut [Finding]) {
    let ([u_a, u_b], [i_a, i_b]) = (&s.voltage[..], &s.current[..]) else { return };
    for (u, i, other) in [(u_a, i_a, i_b), (u_b, i_b, i_a)] {
        if largest(u) == 0.0 && span(&i.main) < 0.05 * span(&other.main) {
            let names = [u.column.as_str(), i.main.column.as_str()];
            let about =
                |f: &&mut Finding| f.kind == FindingKind::DeadChannel && f.channel.as_deref().is_some_and(|c| names.contains(&c));
            out.iter_mut().filter(about).for_each(|f| f.severity = Severity::Note);
        }
    }
}

/// A sensor that shows next to nothing beside the others of its kind.
fn silent<'a>(all: impl Iterator<Item = &'a Trace> + Clone, what: &str, unit: &str) -> Vec<Finding> {
    let most = all.clone().map(span).fold(0.0, f64::max);
    let dead = |t: &&Trace| span(t) > 0.0 && span(t) < 0.01 * most;
    let finding = |t: &Trace| {
        let text = format!(
            "The {what} {} stays within {} {unit}, where another reaches over {} {unit}",
            t.column,
            number(span(t), 2),
            number(most, 3)
        );
        let advice = "Its sensor is dead, not connected, or in another unit.";
        Finding::new(FindingKind::DeadChannel, Severity::Serious, text, advice).on(&t.column)
    };
    all.filter(dead).map(finding).collect()
}

fn span(t: &Trace) -> f64 {
    let (low, high) = t.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    high - low
}

fn largest(t: &Trace) -> f64 {
    t.values.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

/// From this rating on, V, A or rad/s, values near one may be shares of it.
const PER_UNIT: f64 = 20.0;

/// The unit by which the largest value would be usual: from a third of the rated to twenty times, the latter of a start. Nothing where the mapping
/// has a gain of its own.
fn unit_that_fits(unit: &str, over_rated: f64, read_with: f64) -> Option<&'static str> {
    let quantity = UNITS.iter().find(|u| u.text == unit)?.quantity;
    let of_it = || UNITS.iter().filter(|u| u.quantity == quantity);
    of_it().find(|u| u.si == read_with)?;
    of_it().find(|u| (0.3..20.0).contains(&(over_rated * u.si / read_with))).map(|u| u.text)
}

/// Columns beyond belief of which the same is to be said, with the largest value of each.
struct Off<'a> {
    large: bool,
    advice: String,
    columns: Vec<(&'a str, f64)>,
}

/// Values beyond belief; of the columns of which the same is to be said, in one sentence.
fn range<'a>(all: impl Iterator<Item = &'a Trace>, what: &str, unit: &str, rated: f64, beyond: f64) -> Vec<Finding> {
    let mut out = Vec::new();
    let mut off: Vec<Off<'_>> = Vec::new();
    for t in all {
        let peak = largest(t);
        if span(t) == 0.0 {
            let text = format!("The {what} {} is {} {unit} in every row", t.column, number(t.values[0], 3));
            let advice = "Its sensor is dead or the wrong column is named.";
            out.push(Finding::new(FindingKind::DeadChannel, Severity::Serious, text, advice).on(&t.column));
            continue;
        }
        let large = peak > beyond * rated;
        if !large && peak >= BELOW * rated {
            continue;
        }
        let advice = match unit_that_fits(unit, peak / rated, t.gain.abs()) {
            Some(better) => format!("in {better}? Say unit = \"{better}\""),
            None => format!("too {}", if large { "large" } else { "small" }),
        };
        match off.iter_mut().find(|o| (o.large, &o.advice) == (large, &advice)) {
            Some(o) => o.columns.push((&t.column, peak)),
            None => off.push(Off { large, advice, columns: vec![(&t.column, peak)] }),
        }
    }
    for Off { large, advice, columns } in off {
        let several = columns.len() > 1;
        let names = columns.iter().map(|c| c.0).collect::<Vec<_>>().join(", ");
        let peak = columns.iter().map(|c| c.1).fold(0.0, f64::max);
        let (peak, over) = (number(peak, 3), number(peak / rated, 2));
        let text = match (large, several) {
            (true, true) => format!("{names} reach {peak} {unit}, {over} times what the motor is rated for"),
            (true, false) => format!("{names} reaches {peak} {unit}, {over} times what the motor is rated for"),
            (false, true) => format!("{names} never exceed {peak} {unit}; the motor is rated for {}", number(rated, 3)),
            (false, false) => format!("{names} never exceeds {peak} {unit}; the motor is rated for {}", number(rated, 3)),
        };
        let [is, these, its, it] =
            if several { ["Are they", "these columns", "their", "they are"] } else { ["Is it", "this column", "its", "it is"] };
        let advice = if advice.starts_with("in ") {
            let share = !large && rated > PER_UNIT && columns.iter().all(|c| (0.3..20.0).contains(&c.1));
            let per_unit = if share { format!(" In per unit, say gain = {}.", number(rated, 3)) } else { String::new() };
            format!("{is} {advice} for {these} in the mapping, or check {its} gain, and the rating in the motor file.{per_unit}")
        } else {
            format!("Check {its} unit and gain: {it} {advice}.")
        };
        let found = Finding::new(FindingKind::OutOfRange, Severity::Serious, text, advice);
        out.push(if several { found } else { found.on(columns[0].0) });
    }
    out
}
