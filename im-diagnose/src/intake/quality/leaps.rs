//! A speed that leaps: its sensor drops out, loses counts, or shows single readings that are none.
//!
//! What the inertia cannot do between two samples, the shaft has not done.

use im_model::MotorFile;

use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity};
use crate::intake::signals::Signals;
use crate::intake::trace::Trace;

/// In rated torques, what no motor and load give a shaft: three times a large breakdown torque, should the motor file's inertia be three times too large.
const TORQUES: f64 = 30.0;
/// A leap is at least this part of the synchronous speed: less may be the step of a coarse sensor.
const LEAST: f64 = 0.2;

/// A leap of the speed, from one sample to the next.
struct Leap {
    /// Row of the sample before, and of the one after.
    rows: [usize; 2],
    by: f64,
}

/// The leaps of a speed, measured at `rows`.
pub fn check(t: &Trace, rows: &[usize], s: &Signals, motor: &MotorFile) -> Option<Finding> {
    let rating = &motor.rating;
    let synchronous = rating.synchronous_speed_rad_s(motor.machine.pole_pairs());
    let fastest = TORQUES * rating.torque_nm / motor.machine.parameters().inertia_kg_m2;
    let leap = |w: &[usize]| {
        let (rows, by) = ([w[0], w[1]], t.values[w[1]] - t.values[w[0]]);
        let time_s = (w[1] - w[0]) as f64 * s.sample_time_s;
        (by.abs() > (LEAST * synchronous).max(fastest * time_s)).then_some(Leap { rows, by })
    };
    let leaps: Vec<Leap> = rows.windows(2).filter_map(leap).collect();
    let first = leaps.first()?;
    // A single reading: there and back.
    let back = |w: &[Leap]| w[0].rows[1] == w[1].rows[0] && (w[0].by + w[1].by).abs() < 0.5 * w[0].by.abs();
    let single = leaps.len().is_multiple_of(2) && leaps.chunks_exact(2).all(back);
    let at_s = s.end_before(first.rows[1]);
    let [from, to] = first.rows.map(|k| number(t.values[k], 3));
    let more = match leaps.len() {
        1 => String::new(),
        2 => ", and once more".to_owned(),
        n => format!(", and {} times more", n - 1),
    };
    let text = format!(
        "The speed {} leaps from {from} to {to} rad/s between two samples at {at_s} s{more}: no shaft of this inertia does",
        t.column
    );
    let (severity, advice) = if single {
        (Severity::Warning, "If single readings are wrong, say spikes = true in [speed].".to_owned())
    } else {
        // Of two parts the longer one.
        let after = leaps.len() == 1 && 2 * first.rows[1] < s.len();
        let part = if after { s.part_after(first.rows[1]) } else { s.part_before(first.rows[1]) };
        let rest = format!("leave [speed] out, {part}, or check the motor's inertia_kg_m2");
        (Severity::Serious, format!("Its sensor drops out or loses counts: {rest}."))
    };
    let rows = leaps.iter().map(|l| l.rows[0]..l.rows[1] + 1).collect();
    Some(Finding::new(FindingKind::Glitch, severity, text, advice).on(&t.column).at(rows))
}
