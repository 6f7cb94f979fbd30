//! Results on disk: one JSON line per result, appended as it is finished, so that an interrupted campaign goes on where it was.

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Write};
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

/// The longest line that is read: a hundred times the longest that is written.
const LONGEST: u64 = 1 << 20;

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
        let mut results = Vec::new();
        let mut whole = 0;
        let mut text = match File::open(path) {
            Ok(file) => Some(BufReader::new(file)),
            Err(e) if e.kind() == io::ErrorKind::NotFound => None,
            Err(e) => return Err(io(e)),
        };
        let mut line = Vec::new();
        while let Some(text) = &mut text {
            let wrong = |reason: String| JournalError::Line { path: path.to_owned(), line: results.len() + 1, reason };
            line.clear();
            let length = text.take(LONGEST).read_until(b'\n', &mut line).map_err(io)? as u64;
            if length == LONGEST {
                return Err(wrong(format!("longer than {LONGEST} bytes")));
            }
            // Only whole lines: each is written with its end.
            if !line.ends_with(b"\n") {
                if results.is_empty() && !line.is_empty() && !line.starts_with(b"{") {
                    return Err(wrong("it does not begin with {".into()));
                }
                break;
            }
            let result = serde_json::from_slice(&line).map_err(|e| wrong(e.to_string()))?;
            results.push(result);
            whole += length;
        }
        let file = OpenOptions::new().create(true).append(true).open(path).map_err(io)?;
        file.set_len(whole).map_err(io)?;
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
