//! Reading a file of text as a whole.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::file_error::{FileError, Problem};
use crate::utf16::AsUtf8;

/// The largest file that is read into memory: a hundred times the largest that the program writes.
const LARGEST: u64 = 64 << 20;

/// The text of a file.
///
/// # Errors
/// The file cannot be read, is larger than 64 MiB, or is no text in UTF-8 or UTF-16.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    read_at_most(path, LARGEST)
}

fn read_at_most(path: &Path, largest: u64) -> Result<String, FileError> {
    let label = path.display().to_string();
    let refused = |e: io::Error| FileError::io(&label, "read", &e);
    let said = |reason: String| FileError::new(&label, None, None, Problem::Syntax { reason });
    let file = File::open(path).map_err(refused)?;
    if file.metadata().map_err(refused)?.is_dir() {
        return Err(said("a folder; name the file in it".to_owned()));
    }
    let mut bytes = Vec::new();
    AsUtf8::new(file).take(largest + 1).read_to_end(&mut bytes).map_err(refused)?;
    if bytes.len() as u64 > largest {
        return Err(said(format!("larger than {} MB: it cannot be a file of the kind that is read here", largest >> 20)));
    }
    String::from_utf8(bytes).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count();
        let reason = "not a text in UTF-8; is a recording or a table given in the place of this file?".to_owned();
        FileError::new(&label, Some(line), None, Problem::Syntax { reason })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_large_or_no_text_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.toml");
        std::fs::write(&path, "a = 1\nb = 2\n").unwrap();
        assert_eq!(read_text(&path).unwrap(), "a = 1\nb = 2\n");
        assert!(read_at_most(&path, 12).is_ok());
        assert!(read_at_most(&path, 11).unwrap_err().to_string().contains("a.toml: larger than"));
        std::fs::write(&path, b"a = 1\nb = \xff\n").unwrap();
        assert!(read_text(&path).unwrap_err().to_string().contains("a.toml:2: not a text in UTF-8; is a recording"));
        assert!(read_text(dir.path()).unwrap_err().to_string().ends_with("a folder; name the file in it"));
        #[cfg(unix)]
        assert!(read_text(Path::new("/dev/zero")).unwrap_err().to_string().contains("/dev/zero: larger than 64 MB"));
    }
}
