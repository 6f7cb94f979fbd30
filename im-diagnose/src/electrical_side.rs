//! The electrical side alone, where everything together is not explained.
//!
//! With the load torque taken as unknown the measured speed drives the machine, and the balance of torques is not used. Effects that explain the
//! currents then are missing whatever is wrong at the shaft; what the balance asks of the load is held against the torque column.

use im_identify::offline::Experiment;
use im_model::EffectId;
use serde_json::{Value, json};

use crate::case::Case;
use crate::diagnosis::{Diagnosis, Step, Verdict, diagnose};
use crate::search::Options;
use crate::torque_column::TorqueColumn;

/// Simulations that its search may take: what takes more is as a rule not explained.
const MOST_WORK: f64 = 1000.0;

/// What the electrical side alone says.
#[derive(Clone, Debug, PartialEq)]
pub struct ElectricalSide {
    /// Its verdict.
    pub verdict: Verdict,
    /// The effects that explain it.
    pub effects: Vec<EffectId>,
    /// For each, those that explain it as well.
    pub alternatives: Vec<Vec<EffectId>>,
    /// χ²/N of the refitted base model and of the last one, the larger of training and held-out recordings.
    pub error: [f64; 2],
    /// The torque column against what currents and speed ask for, where the currents are explained.
    pub torque_column: Option<TorqueColumn>,
}

impl ElectricalSide {
    /// Asked where everything together is `unexplained`, and the speed was measured beside a load that was taken as known.
    pub fn after(d: &Diagnosis) -> Option<Self> {
        let Case { motor, train, holdout } = &d.case;
        if d.verdict != Verdict::Unexplained || train.iter().chain(holdout).any(Experiment::speed_is_imposed) {
            return None;
        }
        let driven = |e: &Experiment| e.clone().driven_by_speed();
        let case =
            Case { motor: motor.clone(), train: train.iter().map(driven).collect(), holdout: holdout.as_ref().map(driven) };
        if !case.train.iter().chain(&case.holdout).all(Experiment::speed_is_imposed) {
            return None;
        }
        let found = diagnose(case, Options { most_work: MOST_WORK, ..Options::default() }).ok()?;
        let last = found.steps.last()?;
        let explained = found.verdict != Verdict::Unexplained;
        let torque_column = explained.then(|| TorqueColumn::of(&last.machine, &found.case.train, &last.starts)).flatten();
        let alternatives = found.named().iter().map(|e| found.rivals(*e).to_vec()).collect();
        let error = [&found.steps[0], last].map(Step::error);
        Some(Self { verdict: found.verdict, effects: found.named().to_vec(), alternatives, error, torque_column })
    }

    /// As it stands in `diagnosis.json`.
    pub fn to_json(&self) -> Value {
        let names = |v: &[EffectId]| v.iter().map(|e| e.name()).collect::<Vec<_>>();
        json!({
            "verdict": self.verdict.name(),
            "named": names(&self.effects),
            "alternatives": self.effects.iter().zip(&self.alternatives).map(|(e, a)| (e.name().to_owned(), json!(names(a)))).collect::<serde_json::Map<_, _>>(),
            "rms_in_sigma": self.error.map(f64::sqrt),
            "torque_column": self.torque_column,
        })
    }
}
