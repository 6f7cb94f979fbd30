//! Results on disk: one JSON line per result, appended as it is finished, so that an interrupted campaign goes on where it was.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::{Serialize, de::DeserializeOwned};

/// What is wrong with a file of results.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// It cannot be read or written.
    #[error("{path}: {error}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// A line before the last that is no result.
    #[error("{path}:{line}: not a result of im verify ({reason}). Name another folder, or remove the line", path = path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// What the reader says.
        reason: String,
    },
}

/// An open file of results, of blocks of cases ([`Block`](crate::Block)) or of any other kind.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Opens or makes the file; gives the results it holds. A last line that was torn off is cut away.
    ///
    /// # Errors
    /// Input and output, or a line that is no result.
    pub fn open<T: DeserializeOwned>(path: &Path) -> Result<(Self, Vec<T>), JournalError> {
        let io = |error| JournalError::Io { path: path.to_owned(), error };
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == io::ErrorKind::NotFound => String::new(),
            Err(e) => return Err(io(e)),
        };
        // Only whole lines: each is written with its end.
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut results = Vec::new();
        for (k, line) in text[..whole].lines().enumerate() {
            let result = serde_json::from_str(line);
            results.push(result.map_err(|e| JournalError::Line { path: path.to_owned(), line: k + 1, reason: e.to_string() })?);
        }
        if whole == 0 && !text.is_empty() && !text.starts_with('{') {
            return Err(JournalError::Line { path: path.to_owned(), line: 1, reason: "it does not begin with {".into() });
        }
        let file = OpenOptions::new().create(true).append(true).open(path).map_err(io)?;
        file.set_len(whole as u64).map_err(io)?;
        Ok((Self { path: path.to_owned(), file }, results))
    }

    /// Appends a result: one write, so that what is there is whole but for the last line.
    ///
    /// # Errors
    /// Input and output.
    pub fn append(&mut self, result: &impl Serialize) -> Result<(), JournalError> {
        let io = |error| JournalError::Io { path: self.path.clone(), error };
        let line = serde_json::to_string(result).map_err(|e| io(e.into()))? + "\n";
        self.file.write_all(line.as_bytes()).and_then(|()| self.file.flush()).map_err(io)
    }
}
