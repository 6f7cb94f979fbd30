//! What the change of the model means for the motor on its rated supply: its static curves, and what it does at its rated torque.

use im_chart::{Axis, Chart};
use im_model::{BaseParameter, ParameterId};
use maud::{Markup, html};

use super::super::page::{Row, Section, drawn, figure, legend, numbers, table, text, words};
use super::super::story::{Story, rests_on};
use crate::format::{number, percent_change, quantity, signed};
use crate::steady_curve::{RatedLoad, RatedSupply};
use crate::uncertainty::MachineQuantity;

/// As given and as refined.
type Motors = [RatedSupply; 2];

/// Nothing where a motor has no steady states.
pub(crate) fn section(s: &Story) -> Option<Section> {
    let motors = &s.d.rated;
    if motors.iter().any(|m| m.curve.len() < 2) {
        return None;
    }
    let supply = format!(
        "{} phase voltage, peak ({} line to line, rms), at {} Hz",
        quantity(s.d.refined.rating.phase_voltage_peak_v, "V", 3),
        quantity(s.d.refined.rating.phase_voltage_peak_v * 1.5f64.sqrt(), "V", 3),
        number(s.d.refined.rating.electrical_frequency_hz, 3)
    );
    let body = html! {
        p { "The motor as given and as refined in steady states on its rated supply, " (supply) ". Inverter, supply and sensors are not the motor's, and are left out; so is what ripples (asymmetries, slots)." }
        @if s.d.parameters.iter().any(|p| p.is_open() && !p.is_of_a_curve()) {
            p { "Parameters that are hardly determined (⚠ above) make what these figures show of them as uncertain as they are." }
        }
        @if let Some(warning) = rests_on(s) { p.warn { "⚠ " (warning) } }
        (legend(&[("base", text("as given")), ("refined", text("refined"))]))
        div.grid2 {
            (picture(motors, 1, "torque", "Nm"))
            (picture(motors, 2, "stator current, peak", "A"))
        }
        (numbers_of(s))
    };
    Some(Section { id: "meaning", short: "what it means", title: "What it means for the motor", body })
}

fn picture(motors: &Motors, part: usize, name: &str, unit: &str) -> Markup {
    let points = |c: &[[f64; 3]]| c.iter().map(|p| [p[0], p[part]]).collect::<Vec<[f64; 2]>>();
    let all = || motors.iter().flat_map(|m| &m.curve);
    let x = Axis::around(all().map(|p| p[0]), "speed, rad/s");
    let y = Axis::around(all().map(|p| p[part]).chain([0.0]), format!("{name}, {unit}"));
    let mut chart = Chart::new(format!("{name} over speed"), x, y);
    chart.level(0.0, "zero");
    for (motor, class) in motors.iter().zip(["base", "refined"]) {
        chart.line(&points(&motor.curve), class);
    }
    figure(drawn(chart), "")
}

fn numbers_of(s: &Story) -> Markup {
    let motors = s.d.rated.each_ref();
    let most = |part: usize| motors.map(|m| m.curve.iter().map(|p| p[part]).reduce(f64::max));
    let first = |part: usize| motors.map(|m| m.curve.first().filter(|p| p[0] == 0.0).map(|p| p[part]));
    let at_load = |of: &dyn Fn(&RatedLoad) -> f64| motors.map(|m| m.loaded.as_ref().map(of));
    let torque = quantity(s.d.refined.rating.torque_nm, "Nm", 3);
    let anywhere = [
        ("breakdown torque", "Nm", most(1)),
        ("torque at standstill", "Nm", first(1)),
        ("current at standstill, peak", "A", first(2)),
    ];
    let loaded = [
        ("speed", "rad/s", at_load(&|l| l.omega_m)),
        ("current, peak", "A", at_load(&|l| l.current_a)),
        ("loss in the stator winding", "W", at_load(&|l| l.powers.stator_copper)),
        ("loss in the rotor winding", "W", at_load(&|l| l.powers.rotor_copper)),
        ("loss in the iron", "W", at_load(&|l| l.powers.iron)),
    ];
    let with_friction = [
        ("friction and windage", "W", at_load(&|l| l.powers.friction)),
        ("efficiency", "%", at_load(&|l| 100.0 * l.efficiency())),
    ];
    let shown = |x: Option<f64>, unit: &str| match x {
        Some(x) if unit == "%" => format!("{}\u{a0}%", number(x, 3)),
        Some(x) => quantity(x, unit, 4),
        None => "none".into(),
    };
    let row = |(name, unit, [before, after]): &(&str, &str, [Option<f64>; 2])| {
        let change = match before.zip(*after).filter(|(b, a)| *b != *a && *b != 0.0) {
            Some((b, a)) if *unit == "%" => format!("{} points", signed(a - b, 2)),
            Some((b, a)) => percent_change(b, a),
            None => "–".into(),
        };
        Row::of([name.to_string(), shown(*before, unit), shown(*after, unit), change])
    };
    let head = [words(""), numbers("as given"), numbers("refined"), numbers("change")];
    let mut rows: Vec<Row> = anywhere.iter().map(row).collect();
    rows.push(Row::of([format!("At the rated torque, {torque}")]));
    rows.extend(loaded.iter().map(row));
    // What rests on a friction that nothing shows is no result.
    let friction = MachineQuantity::Parameter(ParameterId::Base(BaseParameter::ViscousFriction));
    let unknown = s.d.parameters.iter().any(|p| p.quantity == friction && p.is_unknown());
    rows.extend(with_friction.iter().map(|r| {
        let (name, unit, [before, _]) = r;
        if unknown { Row::of([name.to_string(), shown(*before, unit), "not determined".into(), "–".into()]) } else { row(r) }
    }));
    table(&head, &rows)
}
