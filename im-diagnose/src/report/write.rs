//! The files of a diagnosis.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use im_model::{FileError, MotorFile, write_atomically};
use serde_json::json;

use super::{Story, html};

/// What [`Files::write`] writes.
pub const FILES: [&str; 4] = ["report.html", "motor.refined.toml", "diagnosis.json", "data_quality.json"];

/// The files of a diagnosis, made before any of them is written.
#[derive(Clone, Debug)]
pub struct Files {
    /// The page.
    pub report: String,
    /// The answer for programs.
    pub diagnosis: String,
    /// What was noticed about the recordings, for programs.
    pub data_quality: String,
    /// The motor with the effects added and everything refitted.
    pub motor: MotorFile,
}

/// Where the files went.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// The page.
    pub report: PathBuf,
    /// The answer for programs.
    pub diagnosis: PathBuf,
    /// The motor with the effects added and everything refitted.
    pub motor: PathBuf,
}

impl Files {
    /// Of a story.
    pub fn of(story: &Story) -> Self {
        let (report, diagnosis) = rayon::join(|| html(story), || format!("{:#}\n", story.to_json()));
        Self {
            report,
            diagnosis,
            data_quality: format!("{:#}\n", json!({"schema": 1, "data_quality": story.meta.quality})),
            motor: story.d.refined.clone(),
        }
    }

    /// Writes [`FILES`] into a directory, which is made where it is missing. Each file is written whole or not at all.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, dir: impl AsRef<Path>) -> Result<Written, FileError> {
        let [report, motor, diagnosis, data_quality] = FILES.map(|name| dir.as_ref().join(name));
        // A directory that cannot be made shows when the first file is written, with its name.
        let _ = fs::create_dir_all(dir);
        self.motor.write(&motor)?;
        for (path, text) in [(&diagnosis, &self.diagnosis), (&data_quality, &self.data_quality), (&report, &self.report)] {
            write_atomically(path, |out| out.write_all(text.as_bytes()))?;
        }
        Ok(Written { report, diagnosis, motor })
    }
}
