//! Machines that a test must be safe for: the motor as given, as refined, at the ends of what is known of it, and with each effect that is
//! in question.

use im_model::effects::Role;
use im_model::{BaseParameter, EffectId, InverseGammaParameters, Machine, MotorFile, ParameterId, TParameters};
use serde_json::Value;

use crate::uncertainty::MachineQuantity;

/// How far a motor may be from its file: two standard deviations as a part of each value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Doubt {
    /// R_s.
    pub stator_resistance: f64,
    /// R_R of the inverse-Γ circuit.
    pub rotor_resistance: f64,
    /// L_σ.
    pub leakage_inductance: f64,
    /// L_M.
    pub magnetizing_inductance: f64,
    /// J.
    pub inertia: f64,
}

impl Doubt {
    /// Of a motor that nothing has been fitted to: nameplates and catalogues are good for that.
    pub const NAMEPLATE: Self = Self {
        stator_resistance: 0.2,
        rotor_resistance: 0.2,
        leakage_inductance: 0.2,
        magnetizing_inductance: 0.2,
        inertia: 0.2,
    };

    /// What a `diagnosis.json` leaves in doubt, at least 5 %; that of a nameplate where it says nothing.
    pub fn of_diagnosis(diagnosis: &Value) -> Self {
        let part = |q: MachineQuantity| {
            let p = &diagnosis["parameters"][q.key()];
            let (value, std) = (p["after"].as_f64(), p["std"].as_f64());
            value.zip(std).map_or(0.2, |(value, std)| (2.0 * std / value).abs().clamp(0.05, 0.5))
        };
        let base = |p: BaseParameter| part(MachineQuantity::Parameter(ParameterId::Base(p)));
        Self {
            stator_resistance: base(BaseParameter::StatorResistance),
            rotor_resistance: part(MachineQuantity::RotorResistance),
            leakage_inductance: part(MachineQuantity::LeakageInductance),
            magnetizing_inductance: part(MachineQuantity::MagnetizingInductance),
            inertia: base(BaseParameter::Inertia),
        }
    }

    /// The circuit with every resistance and inductance off by this in one direction, the inertia in another.
    fn moved(&self, p: &TParameters<f64>, circuit: f64, inertia: f64) -> TParameters<f64> {
        let g = p.inverse_gamma();
        let moved = InverseGammaParameters {
            stator_resistance_ohm: g.stator_resistance_ohm * (1.0 + circuit * self.stator_resistance),
            rotor_resistance_ohm: g.rotor_resistance_ohm * (1.0 + circuit * self.rotor_resistance),
            leakage_inductance_h: g.leakage_inductance_h * (1.0 + circuit * self.leakage_inductance),
            magnetizing_inductance_h: g.magnetizing_inductance_h * (1.0 + circuit * self.magnetizing_inductance),
        };
        moved.to_t(p.leakage_ratio(), p.inertia_kg_m2 * (1.0 + inertia * self.inertia), p.viscous_friction_nm_s_per_rad)
    }
}

/// The machines for a motor that a `diagnosis.json` has refined, or for one that nothing has been fitted to.
pub fn machines_after(motor: &MotorFile, diagnosis: Option<&Value>, open: &[EffectId]) -> Vec<Machine<f64>> {
    let doubt = diagnosis.map_or(Doubt::NAMEPLATE, Doubt::of_diagnosis);
    let given = diagnosis.and_then(|d| as_given(motor, d));
    machines(motor, given.as_ref(), &doubt, open)
}

/// The motor as it was given, from the values before in a `diagnosis.json`.
fn as_given(refined: &MotorFile, diagnosis: &Value) -> Option<Machine<f64>> {
    let found = diagnosis["effects"].as_array().into_iter().flatten();
    let found: Option<Vec<EffectId>> = found.map(|name| EffectId::from_name(name.as_str()?)).collect();
    let before = |p: BaseParameter| Some((ParameterId::Base(p), diagnosis["parameters"][p.key()]["before"].as_f64()?));
    let values: Vec<_> = BaseParameter::ALL.into_iter().filter_map(before).collect();
    refined.machine.without(found?).ok()?.with(&values).ok()
}

/// All machines that a test must be safe for; `given` is the motor before it was refined, `open` are the effects in question.
pub fn machines(motor: &MotorFile, given: Option<&Machine<f64>>, doubt: &Doubt, open: &[EffectId]) -> Vec<Machine<f64>> {
    let refined = motor.machine;
    let at = |circuit: f64, inertia: f64| refined.with_parameters(doubt.moved(refined.parameters(), circuit, inertia)).ok();
    let mut all: Vec<Machine<f64>> = vec![refined];
    all.extend(given.copied());
    all.extend([(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)].into_iter().filter_map(|(c, j)| at(c, j)));
    let weakest = at(-1.0, 1.0).unwrap_or(refined);
    all.extend(open.iter().filter_map(|&e| with_largest(&weakest, motor, e)));
    all
}

/// A machine with an effect at its largest usual size, where it has not the effect yet.
fn with_largest(machine: &Machine<f64>, motor: &MotorFile, effect: EffectId) -> Option<Machine<f64>> {
    if machine.effects().is_on(effect) {
        return None;
    }
    let strengths = effect.parameters().iter().enumerate().filter(|(_, p)| p.role == Role::Strength);
    let unit = |scale| motor.rating.unit_of(scale, machine.parameters(), machine.pole_pairs());
    let set: Vec<_> = strengths.map(|(k, p)| (ParameterId::Effect(effect, k), p.typical.1 * unit(p.scale))).collect();
    machine.with(&set).ok()
}
