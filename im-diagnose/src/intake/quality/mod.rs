//! What is wrong with a recording, told before anything is fitted to it, and mended where that is safe.

pub mod clip;
mod currents;

use im_model::MotorFile;

use super::finding::Finding;
use super::signals::Signals;

/// What the checks leave of the currents.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checked {
    /// Rows that may be used, per column of the current; empty: all.
    pub valid: Vec<Vec<bool>>,
    /// Whether the second sensor of a column takes its place.
    pub second: Vec<bool>,
    /// What was found.
    pub findings: Vec<Finding>,
}

/// Checks a recording against itself and against the motor.
pub fn check(signals: &Signals, motor: &MotorFile) -> Checked {
    let _ = motor;
    let mut checked = currents::check(signals);
    for f in &mut checked.findings {
        f.recording.clone_from(&signals.name);
        if let (None, Some(first), Some(last)) = (f.span_s, f.rows.first(), f.rows.last()) {
            f.span_s = Some([signals.time_s(first.start), signals.time_s(last.end)]);
        }
    }
    checked
}
