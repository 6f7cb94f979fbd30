//! Motor and recordings as the commands of the main job take them.

use std::path::{Path, PathBuf};

use im_diagnose::case::Case;
use im_diagnose::intake::{self, Finding, Intake};
use im_identify::offline::FitError;
use im_model::MotorFile;

use crate::failure::Failure;

/// A motor with its recordings.
#[derive(clap::Args)]
pub struct Data {
    /// The motor as it is known: a motor.toml
    #[arg(long, value_name = "FILE")]
    pub motor: PathBuf,
    /// A recording to learn from, or its recording.toml; give it several times for several recordings
    #[arg(long, value_name = "FILE", required = true)]
    pub train: Vec<PathBuf>,
    /// A recording that no fit sees, to check on
    #[arg(long, value_name = "FILE")]
    pub holdout: Option<PathBuf>,
    /// What the columns of the recordings mean, instead of the recording.toml beside them
    #[arg(long, value_name = "FILE")]
    pub mapping: Option<PathBuf>,
}

impl Data {
    /// Reads everything; what was noticed about the recordings comes along.
    pub fn case(&self) -> Result<(Case, Vec<Finding>), Failure> {
        let motor = MotorFile::read(&self.motor)?;
        let mapping = self.mapping.as_deref();
        let train = recordings(&self.train, mapping, &motor)?;
        let holdout = self.holdout.as_deref().map(|p| recording(p, mapping, &motor)).transpose()?;
        let findings = findings(train.iter().chain(&holdout));
        Ok((Case::from_intake(motor, train, holdout), findings))
    }
}

/// Reads recordings that are long enough to say something.
pub fn recordings(paths: &[PathBuf], mapping: Option<&Path>, motor: &MotorFile) -> Result<Vec<Intake>, Failure> {
    let mut all = Vec::new();
    for path in paths {
        for taken in intake::read(path, mapping, motor)? {
            let n = taken.experiment.len();
            if n < 200 {
                return Err(Failure::Input(format!(
                    "{}: {n} rows are too few to fit a machine to; record a start or a load step with at least 200",
                    path.display()
                )));
            }
            all.push(taken);
        }
    }
    Ok(all)
}

/// Reads one recording.
pub fn recording(path: &Path, mapping: Option<&Path>, motor: &MotorFile) -> Result<Intake, Failure> {
    let mut all = recordings(&[path.to_path_buf()], mapping, motor)?;
    match (all.pop(), all.is_empty()) {
        (Some(one), true) => Ok(one),
        _ => Err(Failure::Input(format!("{}: names several recordings; only one can stand here", path.display()))),
    }
}

/// What was noticed about recordings.
pub fn findings<'a>(all: impl Iterator<Item = &'a Intake>) -> Vec<Finding> {
    all.flat_map(|i| i.findings.iter().cloned()).collect()
}

/// What was noticed, for the report: one sentence each.
pub fn quality(findings: &[Finding]) -> Option<Vec<String>> {
    Some(findings.iter().map(Finding::line).collect())
}

/// A fit that could not be made, for people.
pub fn refused(motor: &Path, e: &FitError) -> Failure {
    Failure::Input(format!("{}: {e}", motor.display()))
}
