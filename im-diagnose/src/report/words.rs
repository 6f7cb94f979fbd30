//! Names of effects, parameters and channels as people read them.

use crate::diagnosis::{Diagnosis, ParameterChange};
pub use crate::format::{effect_name, short_effect_name};
use crate::format::{number, percent_change};
use crate::localise::join;
use crate::uncertainty::MachineQuantity;
use im_identify::offline::Experiment;
use im_model::{BaseParameter, EffectId, ParameterId};

/// Effects, each with its rivals: "A, either B or C".
pub(super) fn sets_words(effects: &[EffectId], alternatives: &[Vec<EffectId>]) -> String {
    let set = |(e, rivals): (&EffectId, &Vec<EffectId>)| {
        let all: Vec<String> = std::iter::once(e).chain(rivals).map(|e| effect_name(*e)).collect();
        if all.len() > 1 { format!("either {}", all.join(" or ")) } else { all[0].clone() }
    };
    join(&effects.iter().zip(alternatives).map(set).collect::<Vec<_>>())
}

/// A quantity's name, its symbol where it has one, and what it means.
pub fn quantity_name(q: MachineQuantity) -> (String, String) {
    let inverse_gamma = |name: &str, meaning: &str| (format!("{name} (inverse-Γ)"), meaning.to_owned());
    match q {
        MachineQuantity::RotorResistance => inverse_gamma("rotor resistance R_R", "R_r (L_m/L_r)²: as the terminals show it"),
        MachineQuantity::LeakageInductance => {
            inverse_gamma("leakage inductance L_σ", "L_s − L_m²/L_r: all leakage on the stator side")
        }
        MachineQuantity::MagnetizingInductance => inverse_gamma("magnetizing inductance L_M", "L_m²/L_r"),
        MachineQuantity::Parameter(id) => parameter_name(id),
    }
}

/// The name of a quantity by its key in files.
pub fn key_words(key: &str) -> String {
    MachineQuantity::from_key(key).map_or_else(|| key.replace(['_', '.'], " "), |q| quantity_name(q).0)
}

/// A parameter's name, its symbol where it has one, and what it means.
fn parameter_name(id: ParameterId) -> (String, String) {
    match id {
        ParameterId::Base(p) => (
            match p {
                BaseParameter::StatorResistance => "stator resistance R_s",
                BaseParameter::RotorResistance => "rotor resistance R_r",
                BaseParameter::StatorLeakageInductance => "stator leakage inductance L_ls",
                BaseParameter::RotorLeakageInductance => "rotor leakage inductance L_lr",
                BaseParameter::MagnetizingInductance => "magnetizing inductance L_m",
                BaseParameter::Inertia => "inertia J",
                BaseParameter::ViscousFriction => "viscous friction D",
            }
            .into(),
            String::new(),
        ),
        ParameterId::Effect(e, k) => {
            let info = &e.parameters()[k];
            let key = info.key.trim_end_matches(&unit_suffix(info.unit)).replace('_', " ");
            (format!("{}: {key}", short_effect_name(e)), info.meaning.trim().trim_end_matches('.').to_owned())
        }
    }
}

/// The tail that a unit leaves on a key.
fn unit_suffix(unit: &str) -> String {
    let tail: String = unit
        .chars()
        .filter_map(|c| match c {
            '²' => Some('2'),
            '/' | ' ' => Some('_'),
            c if c.is_alphanumeric() => Some(c.to_ascii_lowercase()),
            _ => None,
        })
        .collect();
    let tail = match tail.as_str() {
        "k_j" => "k_per_j".into(),
        "1_k" => "per_k".into(),
        "nm_s2_rad2" => "nm_s2".into(),
        _ => tail,
    };
    if tail.is_empty() { "\u{0}".into() } else { format!("_{tail}") }
}

/// What a channel shows, and its unit.
pub fn channel_name(name: &str) -> (String, &'static str) {
    let unit = if name.ends_with("_A") {
        "A"
    } else if name.ends_with("rad_s") {
        "rad/s"
    } else if name.ends_with("_W") {
        "W"
    } else if name.ends_with("_var") {
        "var"
    } else {
        ""
    };
    let words = match name {
        "i_alpha_A" => "stator current, α axis".into(),
        "i_beta_A" => "stator current, β axis".into(),
        "i_a_A" => "current of phase a".into(),
        "i_b_A" => "current of phase b".into(),
        "i_c_A" => "current of phase c".into(),
        "omega_m_rad_s" => "mechanical speed".into(),
        "i_rms_A" => "current, rms".into(),
        "p_W" => "active power".into(),
        "q_var" => "reactive power".into(),
        _ => name.trim_end_matches("_A").trim_end_matches("_rad_s").replace('_', " "),
    };
    (words, unit)
}

/// The rms error in units of the sensor noise σ, to three digits, from its mean square.
pub fn in_sigma(chi2: f64) -> String {
    let rms = chi2.sqrt();
    if rms < 10.0 {
        return format!("{rms:.2}\u{a0}σ");
    }
    let place = 10f64.powf(rms.log10().floor() - 2.0).max(1e-1);
    format!("{}\u{a0}σ", number((rms / place).round() * place, 3))
}

/// What is to be said of the noise of measured voltages, where it counts.
pub(crate) fn voltage_noise<'a>(experiments: impl Iterator<Item = &'a Experiment>) -> Option<String> {
    let (mut counted, mut taken): (Option<f64>, f64) = (None, 0.0);
    for e in experiments {
        counted = e.voltage_noise.counted().into_iter().chain(counted).reduce(f64::max);
        taken = taken.max(e.voltage_noise.volts.taken_v);
    }
    if taken > 0.0 {
        return Some(format!(
            "The voltage is the mains, found behind the noise of its sensor, {} V rms: sines that wander. What they may be off by is in no error in σ.",
            number(taken, 2)
        ));
    }
    let most = counted?;
    Some(format!(
        "The noise of the measured voltage, {} V rms, counts too: what it makes of currents and speed is in the errors in their units, and no error in σ.",
        number(most, 2)
    ))
}

/// The name of a recording without its folder.
pub(crate) fn file_name(run: &str) -> String {
    std::path::Path::new(run).file_name().map_or(run.into(), |n| n.to_string_lossy().into())
}

/// Whether a parameter is of an effect that the motor did not have.
pub(crate) fn is_new(p: &ParameterChange, d: &Diagnosis) -> bool {
    matches!(p.quantity, MachineQuantity::Parameter(ParameterId::Effect(e, _)) if !d.case.motor.machine.effects().is_on(e))
}

/// How a parameter has changed.
pub(crate) fn change_words(p: &ParameterChange, d: &Diagnosis) -> String {
    if is_new(p, d) {
        "new".to_owned()
    } else if p.is_unknown() {
        "not determined".to_owned()
    } else {
        percent_change(p.before, p.after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::EffectId;

    #[test]
    fn errors_keep_three_digits() {
        assert_eq!([1.0, 10.04, 10_486.0, 1e8].map(in_sigma), ["1.00\u{a0}σ", "3.17\u{a0}σ", "102\u{a0}σ", "10000\u{a0}σ"]);
    }

    #[test]
    fn names_carry_no_underscores_of_files() {
        assert_eq!(effect_name(EffectId::MainFluxSaturation), "main-flux saturation");
        assert_eq!(parameter_name(ParameterId::Effect(EffectId::InverterNonlinearity, 0)).0, "inverter nonlinearity: voltage");
        assert_eq!(parameter_name(ParameterId::Effect(EffectId::Windage, 0)).0, "windage: coefficient");
        assert_eq!(channel_name("i_alpha_A"), ("stator current, α axis".into(), "A"));
    }
}
