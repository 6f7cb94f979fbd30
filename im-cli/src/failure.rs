//! How a command fails: one message, with the line it is about.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::process::ExitCode;

use im_diagnose::sources::Refused;
use im_model::{FileError, fields_of};

use crate::terminal::{lines_wrapped, say};

/// Why a command ended early.
#[derive(Debug)]
pub enum Failure {
    /// A file that is not as it should be.
    File(FileError),
    /// Anything else that is wrong with the input; the text says what and where.
    Input(String),
    /// Claims that did not come out as they are stated; names them. Status 3.
    #[cfg(feature = "verify")]
    NotAsStated(String),
    /// A case that violates a claim that is stated to hold. Status 3.
    #[cfg(feature = "verify")]
    Violated(String),
    /// Nobody reads our output any more: nothing to say.
    NobodyListens,
}

impl From<FileError> for Failure {
    fn from(e: FileError) -> Self {
        Self::File(e)
    }
}

impl From<Refused> for Failure {
    fn from(e: Refused) -> Self {
        match e {
            Refused::File(e) => Self::File(e),
            Refused::Input(text) => Self::Input(text),
        }
    }
}

impl From<io::Error> for Failure {
    fn from(e: io::Error) -> Self {
        match e.kind() {
            io::ErrorKind::BrokenPipe => Self::NobodyListens,
            _ => Self::Input(format!("cannot write the output: {e}")),
        }
    }
}

impl Failure {
    /// Says on stderr what is wrong; the status to end with.
    pub fn report(&self) -> ExitCode {
        match self {
            Self::NobodyListens => return ExitCode::SUCCESS,
            #[cfg(feature = "verify")]
            Self::NotAsStated(which) => {
                say(&format!("not as stated: {which}\n"));
                return ExitCode::from(3);
            }
            #[cfg(feature = "verify")]
            Self::Violated(what) => {
                say(&format!("violated: {what}\n"));
                return ExitCode::from(3);
            }
            // What is no list stays as it is, for those who look for it.
            Self::Input(text) if text.contains("\n  - ") => say(&lines_wrapped(&format!("error: {text}"))),
            Self::Input(text) => say(&format!("error: {text}\n")),
            Self::File(e) => {
                say(&format!("error: {e}\n{}", excerpt(e).unwrap_or_default()));
            }
        }
        ExitCode::from(1)
    }
}

/// The line that an error is about, with the key or field marked.
fn excerpt(e: &FileError) -> Option<String> {
    const WIDTH: usize = 72;
    const LONGEST: u64 = 1 << 20;
    let number = e.line?;
    let mut file = BufReader::new(File::open(&e.file).ok()?);
    let mut next = || {
        let mut line = Vec::new();
        (&mut file).take(LONGEST).read_until(b'\n', &mut line).ok().filter(|n| *n > 0 && (*n as u64) < LONGEST)?;
        // A control character takes no room on the screen.
        let text = String::from_utf8_lossy(&line).trim_end().to_owned();
        Some(text.replace(|c: char| c.is_control() && c != '\t', "\u{fffd}"))
    };
    let first = next()?;
    let mut line = first.clone();
    for _ in 1..number {
        line = next()?;
    }
    let key = e.key.as_deref().unwrap_or("");
    let (start, length) = mark(&first, &line, key)?;
    // Long lines are cut around the mark.
    let from = (start + length).saturating_sub(WIDTH - 8).min(start);
    let shown: String = line.chars().skip(from).take(WIDTH).collect();
    let margin = " ".repeat(number.to_string().len());
    let caret = " ".repeat(start - from) + &"^".repeat(length.clamp(1, WIDTH - (start - from)));
    Some(format!(" {margin} |\n {number} | {shown}\n {margin} | {caret}\n"))
}

/// Where in `line` the key stands, or the field under the column of that name: start and length in characters.
fn mark(first: &str, line: &str, key: &str) -> Option<(usize, usize)> {
    if let Some(at) = line.find(key).filter(|_| !key.is_empty()) {
        return Some((line[..at].chars().count(), key.chars().count()));
    }
    let separator = [';', '\t', ','].into_iter().find(|s| first.contains(*s))?;
    let Some(column) = fields_of(first, separator as u8).iter().position(|name| name == key) else {
        // Without a key the whole line is meant, which needs no mark beside it.
        return None;
    };
    let mut fields = line.split(separator);
    let before: usize = fields.by_ref().take(column).map(|f| f.chars().count() + 1).sum();
    Some((before, fields.next()?.chars().count().max(1)))
}

#[cfg(test)]
mod tests {
    use super::mark;

    #[test]
    fn keys_and_fields_are_marked() {
        assert_eq!(mark("[machine]", "  pole_pairs = 0", "pole_pairs"), Some((2, 10)));
        assert_eq!(mark("t_s,i_a,x", "0.1,oops,3", "i_a"), Some((4, 4)));
        assert_eq!(mark("t_s,i_a,x", "0.1", "i_a"), None);
        assert_eq!(mark("t_s,i_a,x", "0.1,2", ""), None);
    }
}
