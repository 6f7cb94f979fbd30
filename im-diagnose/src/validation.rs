//! A motor before and after, on a recording that neither has seen.

use im_identify::offline::start_on;
use im_model::MotorFile;
use serde_json::{Value, json};

use crate::case::Case;
use crate::intake::{Finding, Intake};
use crate::residuals::{Errors, errors, nudged};
use crate::sources::{Refused, followed, meaningful};

/// The errors of two motors on one recording.
#[derive(Clone, Debug)]
pub struct Validation {
    /// Simulated on its own: before, after.
    pub not_nudged: [Errors; 2],
    /// With the speed nudged towards the measured one.
    pub speed_nudged: [Errors; 2],
    /// What was noticed about the recording.
    pub noticed: Vec<Finding>,
}

impl Validation {
    /// Compares both motors, each with its name in messages.
    ///
    /// # Errors
    /// They are different machines, the recording means nothing, or one of them leaves the finite range on it.
    pub fn new(before: (&MotorFile, &str), after: (&MotorFile, &str), taken: Intake, anyway: bool) -> Result<Self, Refused> {
        let pole_pairs = [before, after].map(|(m, _)| m.machine.pole_pairs());
        if pole_pairs[0] != pole_pairs[1] {
            return Err(Refused::Input(format!(
                "{} has {} pole pairs, {} has {}: these are different machines",
                before.1, pole_pairs[0], after.1, pole_pairs[1]
            )));
        }
        let noticed = taken.findings.clone();
        meaningful(&noticed, anyway)?;
        for (motor, label) in [before, after] {
            followed(motor, label, &taken)?;
        }
        let recording = taken.experiment.name.clone();
        let mut case = Case::from_intake(after.0.clone(), vec![taken], None);
        case.judge_by(&after.0.machine);
        let runs = nudged(&case.train);
        let starts = |m: &MotorFile| runs.iter().map(|e| start_on(&m.machine, e, &m.rating)).collect::<Vec<_>>();
        let starts = [starts(before.0), starts(after.0)];
        let pair = |e: &[_]| [errors(&before.0.machine, e, &starts[0]), errors(&after.0.machine, e, &starts[1])];
        let this = Self { not_nudged: pair(&case.train), speed_nudged: pair(&runs), noticed };
        for ((_, label), k) in [(before, 0), (after, 1)] {
            if [&this.not_nudged[k], &this.speed_nudged[k]].iter().any(|e| !e.chi2_per_sample.is_finite()) {
                return Err(Refused::Input(format!(
                    "{label}: simulated with {recording} it leaves the finite range; check the voltages and times of the recording, and the motor's \
                     numbers"
                )));
            }
        }
        Ok(this)
    }

    /// What `im validate --json` prints.
    pub fn to_json(&self) -> Value {
        let one = |e: &Errors| json!({"chi2_per_sample": e.chi2_per_sample, "rms_in_sigma": e.rms_in_sigma(), "rmse": e.rmse});
        let pair = |[before, after]: &[Errors; 2]| json!({"before": one(before), "after": one(after)});
        json!({"schema": 1, "data_quality": self.noticed, "not_nudged": pair(&self.not_nudged), "speed_nudged": pair(&self.speed_nudged)})
    }
}
