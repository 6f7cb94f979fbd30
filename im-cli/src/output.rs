//! Where a command writes: checked before the work is done, not after.

use std::path::Path;

use im_model::{FileError, check_writable};

use crate::failure::Failure;

/// Makes a folder, if it is not there, in which files can be written.
pub fn folder(dir: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(dir).map_err(|e| FileError::io(&dir.display().to_string(), "make", &e))?;
    Ok(check_writable(&dir.join("report.html"))?)
}

/// Sees to it that a file can be written.
pub fn file(path: &Path) -> Result<(), Failure> {
    Ok(check_writable(path)?)
}
