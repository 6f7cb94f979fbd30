//! How a command fails: one message, with the line it is about.

use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::process::ExitCode;

use im_model::FileError;

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
    /// Nobody reads our output any more: nothing to say.
    NobodyListens,
}

impl From<FileError> for Failure {
    fn from(e: FileError) -> Self {
        Self::File(e)
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
                eprintln!("not as stated: {which}");
                return ExitCode::from(3);
            }
            Self::Input(text) => eprintln!("error: {text}"),
            Self::File(e) => {
                eprintln!("error: {e}");
                if let Some(excerpt) = excerpt(e) {
                    eprint!("{excerpt}");
                }
            }
        }
        ExitCode::from(1)
    }
}

/// The line that an error is about, with the key or field marked.
fn excerpt(e: &FileError) -> Option<String> {
    const WIDTH: usize = 72;
    let number = e.line?;
    let mut lines = BufReader::new(File::open(&e.file).ok()?).lines().map_while(Result::ok);
    let first = lines.next()?;
    let line = if number == 1 { first.clone() } else { lines.nth(number - 2)? };
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
    let separator = [',', ';', '\t'].into_iter().find(|s| first.contains(*s))?;
    let Some(column) = first.split(separator).position(|name| name.trim() == key) else {
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
