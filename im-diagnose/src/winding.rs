//! Temperatures of the windings: what a motor file and its evidence say of them between them, and what follows where one of them does not.

use im_identify::offline::Experiment;
use im_model::{BaseParameter, MotorFile, ParameterId, WARMER_IN_USE};

use crate::intake::{Finding, FindingKind, Severity};

const ADVICE: &str =
    "Give the winding's temperature: a column winding_C in tables, winding_c in [table] or at the top of recording.toml.";

/// Settles at which temperature R_s and R_r of a motor hold, and widens what is known of R_s where evidence may be of a warmer winding.
pub fn settle(motor: &mut MotorFile, train: &[Experiment]) -> Vec<Finding> {
    let mut out = Vec::new();
    let mut say = |severity, of: Vec<&str>, text: String, advice: &str| {
        let finding = Finding::new(FindingKind::WindingTemperature, severity, text, advice);
        out.push(Finding { recording: of.join(", "), ..finding });
    };
    let names = |warm: bool| -> Vec<&str> {
        let mut all: Vec<&str> = train.iter().filter(|e| e.warmth.is_empty() != warm).map(|e| e.name.as_str()).collect();
        all.dedup();
        all
    };
    let (warm, unsaid) = (names(true), names(false));
    if motor.winding_c.is_none() && !warm.is_empty() {
        let reference = motor.reference_c();
        motor.winding_c = Some(reference);
        let text = format!(
            "R_s and R_r are refitted as those at {reference} °C: the motor file does not say at which temperature its own hold"
        );
        say(Severity::Note, warm.clone(), text, "Say winding_c in [machine].");
    }
    let Some(reference) = motor.winding_c else { return out };
    if unsaid.is_empty() {
        return out;
    }
    let resistance = motor.known.get_mut(&ParameterId::Base(BaseParameter::StatorResistance));
    if let Some(known) = resistance.filter(|k| k.tolerance > 0.0 && k.tolerance < WARMER_IN_USE) {
        let text = format!(
            "R_s is known to {:.0} % at {reference} °C, and the temperature of the winding here is not known: {:.0} % is allowed for",
            100.0 * known.tolerance,
            100.0 * WARMER_IN_USE
        );
        known.tolerance = WARMER_IN_USE;
        say(Severity::Warning, unsaid, text, ADVICE);
    } else if !warm.is_empty() {
        let text = format!("No temperature of the winding is given: it is taken as {reference} °C, as in the motor file");
        say(Severity::Warning, unsaid, text, ADVICE);
    }
    out
}
