//! What is said of a certificate where one is made and where one is checked.

use im_design::Certificate;
use im_design::certificate::{Design, Margin};
use im_design::mtpa::TCircuit;
use im_model::{EffectId, MotorFile};

/// What was proven, in a sentence.
pub fn proven(kind: &str, margins: &[Margin]) -> String {
    let n = margins.len();
    format!("{kind}: {n} {} decided in exact arithmetic.", if n == 1 { "obligation" } else { "obligations" })
}

/// Effects of the motor that a proof leaves out.
pub fn left_out(motor: &MotorFile, certificate: &Certificate) -> Vec<&'static str> {
    let taken_in = |id: &EffectId| matches!(certificate.design, Design::Mtpa(_)) && TCircuit::EFFECTS.contains(id);
    motor.machine.effects().active().filter(|id| !taken_in(id)).map(|id| id.name()).collect()
}

/// That a proof leaves effects out.
pub fn without(effects: &[&str]) -> String {
    format!("Effects of the motor that the proof leaves out: {}.", effects.join(", "))
}
