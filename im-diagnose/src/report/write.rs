//! The files of a diagnosis.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use im_model::{FileError, write_atomically};
use serde_json::json;

use super::{Story, html};

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

/// What [`write()`] writes.
pub const FILES: [&str; 4] = ["report.html", "motor.refined.toml", "diagnosis.json", "data_quality.json"];

/// Writes [`FILES`] into a directory, which is made where it is missing. Each file is
/// written whole or not at all.
pub fn write(dir: impl AsRef<Path>, story: &Story) -> Result<Written, FileError> {
    let dir = dir.as_ref();
    // Everything is made before anything is written.
    let page = html(story);
    let answer = format!("{:#}\n", story.to_json());
    let quality = format!("{:#}\n", json!({"schema": 1, "data_quality": story.meta.quality}));
    let made =
        Written { report: dir.join("report.html"), diagnosis: dir.join("diagnosis.json"), motor: dir.join("motor.refined.toml") };
    // A directory that cannot be made shows when the first file is written, with its name.
    let _ = fs::create_dir_all(dir);
    story.d.refined.write(&made.motor)?;
    write_atomically(&made.diagnosis, |out| out.write_all(answer.as_bytes()))?;
    write_atomically(&dir.join("data_quality.json"), |out| out.write_all(quality.as_bytes()))?;
    write_atomically(&made.report, |out| out.write_all(page.as_bytes()))?;
    Ok(made)
}
