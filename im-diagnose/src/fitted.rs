//! The parameters of a motor from recordings, its effects as they are, and how well they are known.

use im_identify::offline::FitError;
use im_model::{MotorFile, ParameterId};
use serde_json::{Map, Value, json};

use crate::case::Case;
use crate::held_ratio::{HELD, held_std};
use crate::left_error;
use crate::residuals::{Errors, errors};
use crate::search::{Model, Options, Refinement};
use crate::uncertainty::{Estimate, Estimates, MachineQuantity};

/// A fitted motor.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The motor as given.
    pub before: MotorFile,
    /// The fitted one.
    pub after: MotorFile,
    /// Its error on the recordings it was fitted to.
    pub train: Errors,
    /// Mean squared residual of the held-out recording in σ².
    pub holdout: Option<f64>,
    /// What the recordings determine, with its covariance.
    pub estimates: Estimates,
    /// Size of the supply's voltage over the rated one, where it is steady.
    pub supply: Option<f64>,
}

impl Fitted {
    /// Fits the motor of a case to its recordings.
    ///
    /// # Errors
    /// The fit cannot be made.
    pub fn new(case: Case, options: Options) -> Result<Self, FitError> {
        let (refinement, model) = Refinement::new(case, options)?;
        Ok(Self::with_prediction(&refinement, &model))
    }

    /// Of a model that is fitted already, with the band of what it leaves.
    pub fn with_prediction(refinement: &Refinement, model: &Model) -> Self {
        let mut fitted = Self::of_model(refinement, model);
        fitted.after.prediction = left_error::of_model(refinement, model, &fitted.estimates);
        fitted
    }

    /// The same without the band.
    pub fn of_model(refinement: &Refinement, model: &Model) -> Self {
        let (before, fit) = (refinement.case().motor.clone(), &model.fit);
        let after = MotorFile { machine: fit.machine, prediction: None, ..before.clone() };
        let train = errors(&fit.machine, refinement.nudged(), &fit.starts);
        let estimates = Estimates::of_fit(&before, fit, refinement.nudged());
        Self { before, after, train, holdout: model.holdout, estimates, supply: refinement.case().supply() }
    }

    /// What `im fit --json` prints, but for the quality of the data.
    pub fn to_json(&self) -> Value {
        let held = HELD.into_iter().zip(held_std(&self.estimates, &self.after));
        let held =
            held.map(|(p, std)| (MachineQuantity::Parameter(ParameterId::Base(p)), None, Some(std).filter(|s| s.is_finite())));
        let all = self.estimates.list.iter().map(|e| (e.quantity, Some(e), Some(e.std))).chain(held);
        let one = |(q, e, std): (MachineQuantity, Option<&Estimate>, Option<f64>)| {
            let value = json!({
                "before": q.of(&self.before.machine), "after": q.of(&self.after.machine), "std": std, "unit": q.unit(),
                "determined": e.map(|e| !e.is_open()), "leakage_ratio_held": e.is_none(),
            });
            (q.key(), value)
        };
        let parameters: Map<_, _> = all.map(one).collect();
        json!({
            "schema": 1, "chi2_per_sample": self.train.chi2_per_sample, "rmse": self.train.rmse, "fit_percent": self.train.fit_percent,
            "parameters": parameters, "covariance": self.estimates.to_json(), "holdout_chi2_per_sample": self.holdout,
        })
    }
}
