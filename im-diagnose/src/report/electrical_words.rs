//! What the electrical side alone says, in sentences.

use super::words::{effect_name, in_sigma};
use crate::diagnosis::Verdict;
use crate::electrical_side::ElectricalSide;
use crate::format::{number, quantity};
use crate::localise::join;
use crate::torque_column::TorqueColumn;

/// The sentences of a page and of a terminal.
pub(super) fn words(e: &ElectricalSide) -> Vec<String> {
    let [before, after] = e.error.map(in_sigma);
    let how = "With the load torque taken as unknown, so that the measured speed drives the machine,";
    let sets = e.effects.iter().zip(&e.alternatives).map(|(effect, rivals)| {
        let all: Vec<String> = std::iter::once(effect).chain(rivals).map(|e| effect_name(*e)).collect();
        if all.len() > 1 { format!("either {}", all.join(" or ")) } else { all[0].clone() }
    });
    let first = match e.verdict {
        Verdict::Unexplained => {
            return vec![format!(
                "{how} the currents are not explained either ({after} rms): what fails is not at the shaft alone."
            )];
        }
        Verdict::MissingEffects | Verdict::Confounded => {
            format!(
                "{how} the currents are explained: {} {} their error from {before} to {after} rms.",
                join(&sets.collect::<Vec<_>>()),
                if e.effects.len() == 1 { "brings" } else { "bring" }
            )
        }
        Verdict::Adequate | Verdict::Inconclusive => {
            format!("{how} nothing is seen to be missing in the currents ({after} rms).")
        }
    };
    let column = e.torque_column.as_ref().map_or_else(
        || "What fails is at the shaft: its load, inertia, friction, or the sensor of the speed.".to_owned(),
        column_words,
    );
    vec![first, column]
}

fn column_words(c: &TorqueColumn) -> String {
    let offset = c.offset_nm.map(|x| format!("{} too {} at every load", quantity(x.abs(), "Nm", 2), much(x > 0.0)));
    let scale = c.scale.map(|x| format!("{} % too {}", number(100.0 * (x - 1.0).abs(), 2), much(x > 1.0)));
    let lag = c.lag_s.map(|t| format!("{} late", quantity(t, "s", 2)));
    let faults: Vec<String> = offset.into_iter().chain(scale).chain(lag).collect();
    let [before, after] = c.off_nm.map(|x| quantity(x, "Nm", 2));
    if faults.is_empty() {
        return format!(
            "What fails is at the shaft: the torque column is off by {before} rms from what currents and speed ask for, and no zero, scale or lag of \
             its sensor explains that."
        );
    }
    format!(
        "What fails is at the shaft: against what currents and speed ask for, the torque column reads {}. Without that, {after} rms of {before} are left. \
         Check the sensor, correct the column (`offset`, `gain`, `delay_s` of [load] in the recording.toml), and run again.",
        join(&faults)
    )
}

fn much(more: bool) -> &'static str {
    if more { "much" } else { "little" }
}
