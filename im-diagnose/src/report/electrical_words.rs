//! What the electrical side alone says, in sentences.

use super::words::{effect_name, in_sigma, sets_words};
use crate::diagnosis::Verdict;
use crate::diagnosis::{AskedLoad, ElectricalSide};
use crate::format::{much, quantity, too_much};
use crate::localise::join;
use crate::torque_column::TorqueColumn;

/// What is said where everything together is not explained.
pub(super) struct Words {
    /// The cause, where it is at the shaft.
    pub cause: Option<String>,
    /// What the currents say.
    pub beside: String,
    /// What would refute the cause.
    pub refute: Option<String>,
}

/// As phrases.
pub(super) fn words(e: &ElectricalSide) -> Words {
    let [before, after] = e.error.map(in_sigma);
    let how = "with the load torque taken as unknown, so that the measured speed drives the machine,";
    let beside = match e.verdict {
        Verdict::Unexplained => {
            let there = match e.effects.len() {
                0 => String::new(),
                1 => format!("; {} is there all the same", effect_name(e.effects[0])),
                _ => format!("; {} are there all the same", sets_words(&e.effects, &e.alternatives)),
            };
            let load = e.load.map_or_else(String::new, |l| format!("; they ask for {}", load_words(l)));
            let beside = format!(
                "{how} the currents are not explained either ({after} rms): what fails is not at the shaft alone{there}{load}"
            );
            return Words { cause: None, beside, refute: None };
        }
        Verdict::MissingEffects | Verdict::Confounded => format!(
            "{how} the currents are explained: {} {} their error from {before} to {after} rms",
            sets_words(&e.effects, &e.alternatives),
            if e.effects.len() == 1 { "brings" } else { "bring" }
        ),
        Verdict::Adequate | Verdict::Inconclusive => format!("{how} nothing is seen to be missing in the currents ({after} rms)"),
    };
    let of_load = || e.load.map_or_else(String::new, |l| format!("; currents and speed ask for {}", load_words(l)));
    let (cause, refute) = e.torque_column.as_ref().map_or_else(
        || (format!("its load, inertia, friction, or the sensor of the speed{}", of_load()), None),
        |c| (column_words(c), is_faulty(c).then(|| CORRECT.to_owned())),
    );
    Words { cause: Some(format!("what fails is at the shaft: {cause}")), beside, refute }
}

fn load_words(l: AskedLoad) -> String {
    let [mean, least, most] = [l.mean_nm, l.least_nm, l.most_nm].map(|x| quantity(x, "Nm", 2));
    let none = if l.none_was_said { ", and it was said that there is none" } else { "" };
    format!("a load torque of {mean} on average, between {least} and {most}{none}")
}

const CORRECT: &str = "The same recordings with the torque column corrected (offset, gain, delay_s of [load] in a recording.toml): the error has to fall as far.";

fn is_faulty(c: &TorqueColumn) -> bool {
    c.offset_nm.is_some() || c.scale.is_some() || c.lag_s.is_some()
}

fn column_words(c: &TorqueColumn) -> String {
    let [before, after] = c.off_nm.map(|x| quantity(x, "Nm", 2));
    if !is_faulty(c) {
        return format!(
            "the torque column is off by {before} rms from what currents and speed ask for, and no zero, scale or lag of its sensor explains that"
        );
    }
    let offset = c.offset_nm.map(|x| format!("{} too {} at every load", quantity(x.abs(), "Nm", 2), much(x > 0.0)));
    let lag = c.lag_s.map(|t| format!("{} late", quantity(t, "s", 2)));
    let faults: Vec<String> = offset.into_iter().chain(c.scale.map(too_much)).chain(lag).collect();
    format!(
        "against what currents and speed ask for, the torque column reads {}; without that, {after} rms of {before} are left",
        join(&faults)
    )
}
