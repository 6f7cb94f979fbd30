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
        nearest: Option<String>,
        /// All that may stand there.
        known: Vec<String>,
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
    /// No rows of samples, or nothing at all.
    NoRows {
        /// What is there instead.
        found: &'static str,
    },
    /// A column that must be there.
    MissingColumn {
        /// The columns that are there.
        present: Vec<String>,
        /// The present column most like it, if any is.
        nearest: Option<String>,
    },
    /// A column that stands twice.
    DuplicateColumn {
        /// Their places, from 1.
        places: [usize; 2],
    },
    /// A row with too few or too many fields.
    RowLength {
        /// Fields found.
        found: usize,
        /// Columns in the header.
        expected: usize,
        /// Whether nothing follows it.
        last: bool,
    },
    /// A field that is not a finite number.
    NotANumber {
        /// What stands there.
        found: String,
        /// ` at t_s = 0.5`: the time of the row as it stands in its column; empty where nobody said which that is.
        at: String,
    },
    /// Time does not advance from this row's predecessor.
    TimeNotForward {
        /// Time of the predecessor, s.
        before_s: f64,
        /// Time of this row, s.
        now_s: f64,
    },
    /// Time advances unevenly.
    TimeUneven {
        /// The step to this row, s.
        step_s: f64,
        /// The usual step, s.
        usual_s: f64,
    },
}

impl FileError {
    /// An error.
    pub fn new(file: &str, line: Option<usize>, key: Option<&str>, problem: Problem) -> Self {
        Self { file: file.to_owned(), line, key: key.map(str::to_owned), problem: Box::new(problem) }
    }

    /// The same about a file of this name, with more to say at the end.
    #[must_use]
    pub fn renamed(&self, file: &str, more: &str) -> Self {
        let reason = format!("{}{more}", What(self));
        Self { file: file.to_owned(), line: self.line, key: self.key.clone(), problem: Box::new(Problem::Syntax { reason }) }
    }

    /// What is wrong and in which line, for a message that names the file already.
    pub fn without_file(&self) -> String {
        let line = self.line.map_or_else(String::new, |l| format!("line {l}: "));
        format!("{line}{}", What(self))
    }

    /// The system refused to do what `doing` says, as an infinitive: `read`.
    pub fn io(file: &str, doing: &'static str, e: &io::Error) -> Self {
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
        What(self).fmt(f)
    }
}

/// What is wrong, without where.
struct What<'a>(&'a FileError);

impl fmt::Display for What<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let key = self.0.key.as_deref().unwrap_or("");
        let place = |table: &str| if table.is_empty() { "at the top of the file".to_owned() } else { format!("in [{table}]") };
        match &*self.0.problem {
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
            Problem::NoRows { found } => write!(f, "{found}, expected a line of column names and rows of numbers below"),
            Problem::MissingColumn { present, nearest } => {
                write!(f, "column {key} is missing")?;
                if let Some(nearest) = nearest {
                    write!(f, "; is {nearest} meant for it? Rename it")?;
                }
                write!(f, "; the file has {}", present.join(", "))
            }
            Problem::DuplicateColumn { places: [a, b] } => {
                write!(f, "column {key} stands twice, as columns {a} and {b}; drop or rename one")
            }
            Problem::RowLength { found, expected, last: true } if found < expected => {
                write!(f, "the file ends within this row: {found} of {expected} fields; delete the line")
            }
            Problem::RowLength { found, expected, .. } => {
                write!(f, "the row has {found} fields, the header {expected}; repair the row or cut the recording there")
            }
            Problem::NotANumber { found, at } => {
                let (found, expected) = match found.as_str() {
                    "" => ("empty", "a number"),
                    found => (found, "a finite number with a decimal point"),
                };
                let short = if found == "empty" {
                    ", or leave short gaps out: gaps = \"leave_out\" in [time] of its recording.toml"
                } else {
                    ""
                };
                write!(f, "{key} is {found}{at}, expected {expected}; repair the row or cut the recording there{short}")
            }
            Problem::TimeNotForward { before_s, now_s } => write!(
                f,
                "{key} = {now_s} after {before_s}: time must advance from row to row; sort the rows, or write {key} with more digits"
            ),
            Problem::TimeUneven { step_s, usual_s } => {
                let less_than_a_row = (step_s / usual_s - 1.0).abs() < 0.9;
                let advice = if less_than_a_row {
                    "the clock wavers or the sampling time changes; where the rows were sampled evenly all the same, say sample_time_s in \
                     [time] of its recording.toml in place of the column, else resample it evenly"
                } else {
                    "rows are missing or the sampling time changes; cut the recording there, resample it evenly, or leave short gaps out: \
                     gaps = \"leave_out\" in [time] of its recording.toml"
                };
                write!(f, "{key} advances by {} s here, by {} s elsewhere: {advice}", rounded(*step_s), rounded(*usual_s))
            }
        }
    }
}

impl std::error::Error for FileError {}

/// Six digits are enough for a message.
fn rounded(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}
