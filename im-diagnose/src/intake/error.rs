//! Why a recording could not be taken in.

use std::path::PathBuf;

use im_model::FileError;
use thiserror::Error;

use super::draft::Draft;

/// Why a recording could not be taken in.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum IntakeError {
    /// A file is not as it should be.
    #[error(transparent)]
    File(#[from] FileError),
    /// The columns of a file are foreign, no mapping says what they mean, and not everything could be guessed.
    #[error("{}: {} what its columns mean, and not all could be guessed. Fill in: {}", .file.display(), .draft.nobody_says(), .draft.missing.join("; "))]
    Unmapped {
        /// The recording.
        file: PathBuf,
        /// As far as it was guessed.
        draft: Box<Draft>,
    },
}
