//! Writing a file as a whole or not at all: into a temporary neighbour first, then renamed over the old one.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

use crate::file_error::FileError;

/// Writes what `body` writes. On any failure the old file stays as it was. A target that is not a regular file (a pipe, a device)
/// is written directly.
pub fn write_atomically(path: &Path, body: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<(), FileError> {
    write(path, body).map_err(|e| FileError::io(&path.display().to_string(), "write", &e))
}

/// Whether a file can be written at `path`, before the work is done that is to be kept there. Nothing is left behind.
///
/// # Errors
/// Its folder is not there or may not be written to, it is a folder, or a link to a file that is not there.
pub fn check_writable(path: &Path) -> Result<(), FileError> {
    let check = || {
        let target = target_of(path)?;
        match fs::metadata(&target) {
            Ok(m) if m.is_dir() => Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder")),
            Ok(m) if !m.is_file() => Ok(()),
            _ => Neighbour::of(&target).map(drop),
        }
    };
    check().map_err(|e| FileError::io(&path.display().to_string(), "write", &e))
}

fn write(path: &Path, body: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
    let target = target_of(path)?;
    let old = fs::metadata(&target).ok();
    if old.as_ref().is_some_and(|m| !m.is_file()) {
        let mut out = BufWriter::new(OpenOptions::new().write(true).open(path)?);
        body(&mut out)?;
        return out.flush();
    }
    let temporary = Neighbour::of(&target)?;
    let mut out = BufWriter::with_capacity(1 << 16, temporary.file.as_file().try_clone()?);
    body(&mut out)?;
    out.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
    if let Some(old) = old {
        temporary.file.as_file().set_permissions(old.permissions())?;
    }
    temporary.becomes(&target)
}

/// Through a link, what it points at is replaced, not the link.
fn target_of(path: &Path) -> io::Result<PathBuf> {
    match fs::canonicalize(path) {
        Ok(target) => Ok(target),
        Err(_) if path.is_symlink() => {
            let to = fs::read_link(path)?;
            let reason = format!("it is a link to {}, which is not there; remove the link or make the file", to.display());
            Err(io::Error::other(reason))
        }
        Err(_) => Ok(path.to_owned()),
    }
}

/// Paths of the neighbours that are there now.
static BEING_WRITTEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn being_written() -> MutexGuard<'static, Vec<PathBuf>> {
    BEING_WRITTEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what is half written, for a program that is about to end. Until the result is dropped no file begins and none is finished.
#[must_use]
pub fn abandon_files() -> impl Drop {
    let mut open = being_written();
    for path in open.drain(..) {
        // What is gone already need not be removed.
        let _ = fs::remove_file(path);
    }
    open
}

/// A new file beside the target that no other writer uses; removed unless it takes its place.
struct Neighbour {
    file: NamedTempFile,
    listed: Listed,
}

/// A path in the list, as long as this lives.
struct Listed(PathBuf);

impl Drop for Listed {
    fn drop(&mut self) {
        being_written().retain(|path| *path != self.0);
    }
}

impl Neighbour {
    fn of(target: &Path) -> io::Result<Self> {
        let name = target.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"))?;
        let mut prefix = std::ffi::OsString::from(".");
        prefix.push(name);
        prefix.push(".");
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix).suffix(".tmp");
        // Readable by whom new files are readable, as the process's mask says.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let folder = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut open = being_written();
        // The temporary name is not the user's: the reason alone is passed on.
        let file = builder.tempfile_in(folder).map_err(|e| io::Error::new(e.kind(), folder_error(folder, &e)))?;
        open.push(file.path().to_owned());
        let listed = Listed(file.path().to_owned());
        Ok(Self { file, listed })
    }

    fn becomes(self, target: &Path) -> io::Result<()> {
        // Declared first, dropped last: it takes the lock again.
        let _listed = self.listed;
        let _open = being_written();
        self.file.persist(target)?;
        Ok(())
    }
}

fn folder_error(folder: &Path, e: &io::Error) -> String {
    if folder.is_dir() { e.kind().to_string() } else { format!("there is no folder {}", folder.display()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_litter() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_atomically(&path, |w| w.write_all(b"old")).unwrap();
        let e = write_atomically(&path, |w| {
            w.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert!(e.unwrap_err().to_string().ends_with("a.txt: cannot write it: disk full"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
        write_atomically(&path, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert!(write_atomically(&dir.path().join("none/b.txt"), |_| Ok(())).is_err());
    }

    #[test]
    fn what_can_be_written_is_known_before_and_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        check_writable(&dir.path().join("new.txt")).unwrap();
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
        assert!(check_writable(dir.path()).unwrap_err().to_string().ends_with("it is a folder"));
        assert!(check_writable(&dir.path().join("none/b.txt")).is_err());
        // A device takes what is written to it, whether or not files may stand beside it.
        #[cfg(unix)]
        {
            let before = fs::metadata("/dev").unwrap().modified().unwrap();
            check_writable(Path::new("/dev/null")).unwrap();
            assert_eq!(fs::metadata("/dev").unwrap().modified().unwrap(), before);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_written_through_and_a_dangling_one_is_left() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let dir = tempfile::tempdir().unwrap();
        let (file, link, dangling) = (dir.path().join("a.txt"), dir.path().join("link"), dir.path().join("dangling"));
        write_atomically(&file, |w| w.write_all(b"old")).unwrap();
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o400, 0o400);
        symlink("a.txt", &link).unwrap();
        write_atomically(&link, |w| w.write_all(b"new")).unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        symlink("nowhere.txt", &dangling).unwrap();
        for e in [check_writable(&dangling).unwrap_err(), write_atomically(&dangling, |_| Ok(())).unwrap_err()] {
            assert!(e.to_string().contains("dangling: cannot write it: it is a link to nowhere.txt"), "{e}");
        }
        assert!(dangling.is_symlink());
    }
}
