//! What can be wrong with a file, in one sentence that says what to do.

use crate::Format;

/// Why a file gives no table.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// The file system says no.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Something the file announces lies beyond its end.
    #[error("not a whole {format}: {what} should stand at byte {at}, where the data ends; copy or save the recording again")]
    Truncated {
        /// What it began as.
        format: Format,
        /// What was sought.
        what: &'static str,
        /// Where, from the beginning of the file or of the packed part.
        at: usize,
    },
    /// The file contradicts itself or its format.
    #[error("not a valid {format}: {reason}; copy or save the recording again")]
    Invalid {
        /// What it began as.
        format: Format,
        /// What contradicts what.
        reason: String,
    },
    /// A valid file that is not read.
    #[error("a {format} {found}: {remedy}")]
    Unsupported {
        /// What it is.
        format: Format,
        /// What it has that is not read, after the name of the format.
        found: String,
        /// What to do.
        remedy: &'static str,
    },
    /// There is nothing to read in it.
    #[error("a {format} without a channel of at least two numbers{}", listed(.left_out))]
    NoChannels {
        /// What it is.
        format: Format,
        /// What it holds instead, and why that was left out.
        left_out: Vec<String>,
    },
}

fn listed(these: &[String]) -> String {
    const SHOWN: usize = 5;
    match these.len() {
        0 => String::new(),
        n if n <= SHOWN => format!("; left out: {}", these.join(", ")),
        n => format!("; left out: {} and {} more", these[..SHOWN].join(", "), n - SHOWN),
    }
}
