//! Motor and recordings as the commands of the main job take them.

use std::path::{Path, PathBuf};

use im_diagnose::case::Case;
use im_identify::offline::FitError;
use im_model::{MotorFile, Recording};

use crate::failure::Failure;

/// A motor with its recordings.
#[derive(clap::Args)]
pub struct Data {
    /// The motor as it is known: a motor.toml
    #[arg(long, value_name = "FILE")]
    pub motor: PathBuf,
    /// A recording to learn from; give it several times for several recordings
    #[arg(long, value_name = "CSV", required = true)]
    pub train: Vec<PathBuf>,
    /// A recording that no fit sees, to check on
    #[arg(long, value_name = "CSV")]
    pub holdout: Option<PathBuf>,
}

impl Data {
    /// Reads everything.
    pub fn case(&self) -> Result<Case, Failure> {
        let motor = MotorFile::read(&self.motor)?;
        let train = recordings(&self.train)?;
        let holdout = self.holdout.as_deref().map(recording).transpose()?;
        Ok(Case::new(motor, &train, holdout.as_ref()))
    }
}

/// Reads a recording that is long enough to say something.
pub fn recording(path: &Path) -> Result<Recording, Failure> {
    let r = Recording::read_csv(path)?;
    if r.len() < 200 {
        let n = r.len();
        return Err(Failure::Input(format!(
            "{}: {n} rows are too few to fit a machine to; record a start or a load step with at least 200",
            path.display()
        )));
    }
    Ok(r)
}

/// Reads recordings.
pub fn recordings(paths: &[PathBuf]) -> Result<Vec<Recording>, Failure> {
    paths.iter().map(|p| recording(p)).collect()
}

/// A fit that could not be made, for people.
pub fn refused(motor: &Path, e: &FitError) -> Failure {
    Failure::Input(format!("{}: {e}", motor.display()))
}
