//! Writing a file as a whole or not at all: into a temporary neighbour first, then renamed over the old one.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::file_error::FileError;

/// Writes what `body` writes. On any failure the old file stays as it was. A target that is not a regular file (a pipe, a device)
/// is written directly.
pub fn write_atomically(path: &Path, body: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<(), FileError> {
    write(path, body).map_err(|e| FileError::io(&path.display().to_string(), "write", &e))
}

/// Whether a file can be written at `path`, before the work is done that is to be kept there. Nothing is left behind.
///
/// # Errors
/// Its folder is not there or may not be written to.
pub fn check_writable(path: &Path) -> Result<(), FileError> {
    let check = || {
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        match fs::metadata(&target) {
            Ok(m) if m.is_dir() => Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder")),
            Ok(m) if !m.is_file() => Ok(()),
            _ => open_neighbour(&target).and_then(|(temporary, _)| fs::remove_file(temporary)),
        }
    };
    check().map_err(|e| FileError::io(&path.display().to_string(), "write", &e))
}

fn write(path: &Path, body: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
    // Through a link, what it points at is replaced, not the link.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if fs::metadata(&target).is_ok_and(|m| !m.is_file()) {
        let mut out = BufWriter::new(OpenOptions::new().write(true).open(path)?);
        body(&mut out)?;
        return out.flush();
    }
    let (temporary, file) = open_neighbour(&target)?;
    let written = (|| {
        let mut out = BufWriter::with_capacity(1 << 16, file);
        body(&mut out)?;
        out.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
        if let Ok(old) = fs::metadata(&target) {
            fs::set_permissions(&temporary, old.permissions())?;
        }
        fs::rename(&temporary, &target)
    })();
    if written.is_err() {
        // The first error is the one to report.
        let _ = fs::remove_file(&temporary);
    }
    written
}

/// A new file beside `target` that no other writer uses.
fn open_neighbour(target: &Path) -> io::Result<(PathBuf, File)> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let name = target.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"))?;
    loop {
        let mut own = std::ffi::OsString::from(".");
        own.push(name);
        own.push(format!(".{}-{}.tmp", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed)));
        let path = target.with_file_name(own);
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(file) => return Ok((path, file)),
            // Left behind by a process of the same number that was killed.
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_litter() {
        let dir = std::env::temp_dir().join(format!("im-model-atomic-{}", std::process::id()));
        fs::create_dir_all(&dir).unwrap();
        let path = dir.join("a.txt");
        write_atomically(&path, |w| w.write_all(b"old")).unwrap();
        let e = write_atomically(&path, |w| {
            w.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert!(e.unwrap_err().to_string().ends_with("a.txt: cannot write it: disk full"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(&dir).unwrap().count(), 1);
        write_atomically(&path, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert!(write_atomically(&dir.join("none/b.txt"), |_| Ok(())).is_err());
        fs::remove_dir_all(&dir).unwrap();
    }

    #[test]
    fn what_can_be_written_is_known_before_and_leaves_nothing_behind() {
        let dir = std::env::temp_dir().join(format!("im-model-writable-{}", std::process::id()));
        fs::create_dir_all(&dir).unwrap();
        check_writable(&dir.join("new.txt")).unwrap();
        assert_eq!(fs::read_dir(&dir).unwrap().count(), 0);
        assert!(check_writable(&dir).unwrap_err().to_string().ends_with("it is a folder"));
        assert!(check_writable(&dir.join("none/b.txt")).is_err());
        fs::remove_dir_all(&dir).unwrap();
        // A device takes what is written to it, whether or not files may stand beside it.
        #[cfg(unix)]
        {
            let before = fs::metadata("/dev").unwrap().modified().unwrap();
            check_writable(Path::new("/dev/null")).unwrap();
            assert_eq!(fs::metadata("/dev").unwrap().modified().unwrap(), before);
        }
    }
}
