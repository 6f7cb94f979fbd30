//! What comes of a job: one row of the table.

use serde::{Deserialize, Serialize};

/// How far a job went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JobStatus {
    /// Nothing stood out: no diagnosis was needed.
    Screened,
    /// Diagnosed.
    Diagnosed,
    /// It could not be done: the row says why.
    #[default]
    Failed,
}

impl JobStatus {
    /// The word in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Screened => "screened",
            Self::Diagnosed => "diagnosed",
            Self::Failed => "failed",
        }
    }
}

/// A parameter as the last model of a job has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its key, as in `diagnosis.json`.
    pub key: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation; `None` where it is not determined.
    pub std: Option<f64>,
}

/// One row.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The hash that the job is known by.
    pub key: String,
    /// The motor's own name.
    pub unit: String,
    /// Its type.
    pub kind: String,
    /// When it was recorded.
    pub date: String,
    /// Names of its recordings, held-out one last.
    pub recordings: Vec<String>,
    /// How far the job went.
    pub status: JobStatus,
    /// The verdict of the diagnosis; `adequate` where the screening saw nothing; empty where the job failed.
    pub verdict: String,
    /// Effects that the machine is said to have.
    pub effects: Vec<String>,
    /// For each, those that explain the recordings as well.
    pub rivals: Vec<Vec<String>>,
    /// What made the screening ask for a diagnosis; empty where nothing did.
    pub suspicion: String,
    /// Error of the fitted base model, in σ rms.
    pub base_rms_in_sigma: Option<f64>,
    /// Error of the last model on the recordings it was fitted to.
    pub rms_in_sigma: Option<f64>,
    /// The same on the held-out recording.
    pub holdout_rms_in_sigma: Option<f64>,
    /// Parameters of the last model.
    pub parameters: Vec<Parameter>,
    /// The report of the motor, relative to the table.
    pub report: String,
    /// What went wrong.
    pub error: String,
}

impl Row {
    /// The value and standard deviation of a parameter.
    pub fn parameter(&self, key: &str) -> Option<(f64, f64)> {
        let p = self.parameters.iter().find(|p| p.key == key)?;
        Some((p.value, p.std?))
    }

    /// Whether something is wrong with the motor as the diagnosis has it.
    pub fn is_flagged(&self) -> bool {
        matches!(self.verdict.as_str(), "missing_effects" | "confounded" | "unexplained")
    }
}
