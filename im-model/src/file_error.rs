//! What can be wrong with a file: which file, which line, which key or column, what was expected, what to do.

use std::fmt;
use std::io;

use crate::error::ModelError;

/// A file that could not be read or written. The text is one message for people: `motor.toml:9: magnetizing_inductance_h = -0.2 must
/// be positive and finite`.
#[derive(Clone, Debug, PartialEq)]
pub struct FileError {
    /// The file, as it was named by the caller.
    pub file: String,
    /// The line, from 1, where the file has one to point at.
    pub line: Option<usize>,
    /// The key or the column.
    pub key: Option<String>,
    /// What is wrong.
    pub problem: Box<Problem>,
}

/// What is wrong with a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Problem {
    /// The system refused.
    Io {
        /// What was tried, as an infinitive: `read`, `write`.
        doing: &'static str,
        /// The kind of refusal.
        kind: io::ErrorKind,
        /// The system's words.
        reason: String,
    },
    /// The text is not of the format at all.
    Syntax {
        /// The parser's words.
        reason: String,
    },
    /// A key that nobody reads.
    UnknownKey {
        /// The table it stands in; empty at the top.
        table: String,
        /// The known key most like it, if any is.
        nearest: Option<&'static str>,
        /// All that may stand there.
        known: Vec<&'static str>,
    },
    /// A key or table that must be there.
    MissingKey {
        /// The table it belongs in; empty at the top.
        table: String,
        /// What to write.
        expected: String,
    },
    /// A number outside its range.
    Value(ModelError),
    /// Anything else that was found where something different is needed.
    Unexpected {
        /// What stands there.
        found: String,
        /// What should.
        expected: String,
    },
    /// A table of samples that is not a recording. The text says what was found and what to do.
    Samples {
        /// What was found, what was expected and what to do.
        reason: String,
    },
}

impl FileError {
    pub(crate) fn new(file: &str, line: Option<usize>, key: Option<&str>, problem: Problem) -> Self {
        Self { file: file.to_owned(), line, key: key.map(str::to_owned), problem: Box::new(problem) }
    }

    pub(crate) fn io(file: &str, doing: &'static str, e: &io::Error) -> Self {
        Self::new(file, None, None, Problem::Io { doing, kind: e.kind(), reason: e.to_string() })
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        f.write_str(": ")?;
        let key = self.key.as_deref().unwrap_or("");
        let place = |table: &str| if table.is_empty() { "at the top of the file".to_owned() } else { format!("in [{table}]") };
        match &*self.problem {
            Problem::Io { doing, kind: io::ErrorKind::NotFound, .. } => {
                write!(f, "cannot {doing} it: no such file or folder")
            }
            Problem::Io { doing, reason, .. } => write!(f, "cannot {doing} it: {reason}"),
            Problem::Syntax { reason } => f.write_str(reason),
            Problem::UnknownKey { table, nearest: Some(nearest), .. } => {
                write!(f, "unknown key {key} {}; did you mean {nearest}?", place(table))
            }
            Problem::UnknownKey { table, known, .. } => {
                write!(f, "unknown key {key} {}; known there: {}", place(table), known.join(", "))
            }
            Problem::MissingKey { table, expected } => write!(f, "{key} is missing {}: {expected}", place(table)),
            Problem::Value(e) => write!(f, "{e}"),
            Problem::Unexpected { found, expected } => write!(f, "{key} is {found}, expected {expected}"),
            Problem::Samples { reason } => f.write_str(reason),
        }
    }
}

impl std::error::Error for FileError {}
