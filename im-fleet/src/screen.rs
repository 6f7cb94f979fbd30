//! The cheap pass: the base model is fitted, then the residual is tested. What stands out gets the whole diagnosis.
//!
//! Suspicion is cheap and a diagnosis is careful: the thresholds here are generous, those of the diagnosis keep the false alarms down.

use im_diagnose::case::Case;
use im_diagnose::diagnosis::{Diagnosis, diagnose_from};
use im_diagnose::fitted::Fitted;
use im_diagnose::residual_tests::{Dependence, dependences};
use im_diagnose::search::{Model, Options, Refinement};
use im_identify::offline::FitError;

/// Error from which on a model is not as good as its sensors, in σ².
const EXCESS: f64 = 1.05;
/// −log₁₀ of the chance that a residual depends on something as much by accident.
const SURE: f64 = 4.0;

/// What the cheap pass saw.
pub struct Screening {
    /// The fitted base model.
    pub fitted: Fitted,
    /// What the residual depends on, strongest first.
    pub dependences: Vec<Dependence>,
    refinement: Refinement,
    base: Model,
}

impl Screening {
    /// Fits the base model of a case, and tests what it leaves.
    ///
    /// # Errors
    /// The fit cannot be made.
    pub fn new(case: Case, options: Options) -> Result<Self, FitError> {
        let (refinement, base) = Refinement::new(case, options)?;
        let dependences = dependences(&base.fit.machine, &base.fit.starts, refinement.nudged());
        Ok(Self { fitted: Fitted::of_model(&refinement, &base), dependences, refinement, base })
    }

    /// The whole diagnosis, from the fitted base model on.
    ///
    /// # Errors
    /// A fit cannot be made.
    pub fn diagnosed(self) -> Result<Diagnosis, FitError> {
        diagnose_from(self.refinement, self.base)
    }

    /// Why a diagnosis is asked for; `None` where nothing stands out.
    pub fn suspicion(&self) -> Option<String> {
        if let Some(d) = self.dependences.first().filter(|d| d.log_p > SURE) {
            return Some(format!("{} depends on {} (p = 1e-{:.0})", d.part.label(), d.variable.label(), d.log_p));
        }
        let errors = [Some(self.fitted.train.chi2_per_sample), self.fitted.holdout];
        let worst = errors.into_iter().flatten().fold(0.0, f64::max);
        if worst > EXCESS || !worst.is_finite() {
            return Some(format!("error {:.3} σ rms", worst.sqrt()));
        }
        None
    }
}
