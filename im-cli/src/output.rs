//! Where a command writes: checked before the work is done, not after.

use std::path::{Path, PathBuf};

use im_diagnose::intake;
use im_model::{FileError, check_writable};
use same_file::is_same_file;

use crate::failure::Failure;

/// The files that a command writes: none of them one that it reads, none twice, all of them writable.
#[derive(Default)]
pub struct Outputs {
    read: Vec<PathBuf>,
    written: Vec<PathBuf>,
}

impl Outputs {
    /// Beside the files that are read.
    pub fn beside<'a>(read: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        Self { read: read.into_iter().cloned().collect(), written: Vec::new() }
    }

    /// Beside recordings, with the mapping and the data that they stand for.
    pub fn and_recordings<'a>(mut self, recordings: impl IntoIterator<Item = &'a PathBuf>, mapping: Option<&Path>) -> Self {
        for path in recordings {
            self.read.push(path.clone());
            // What cannot be read is refused where it is read.
            self.read.extend(intake::files(path, mapping).unwrap_or_default());
        }
        self
    }

    /// The files that are read, once each.
    pub fn read(&self) -> impl Iterator<Item = &Path> {
        let first = |(k, path): (usize, &PathBuf)| !self.read[..k].contains(path);
        self.read.iter().enumerate().filter(move |one| first(*one)).map(|(_, path)| path.as_path())
    }

    /// One more file; the checks are made now.
    ///
    /// # Errors
    /// It is one that is read or written already, or cannot be written.
    pub fn file(&mut self, path: &Path) -> Result<(), Failure> {
        if path == Path::new("-") {
            return Ok(());
        }
        self.distinct(path)?;
        Ok(check_writable(path)?)
    }

    /// A folder, made if it is not there, and the files of these names in it.
    ///
    /// # Errors
    /// As [`file`](Self::file).
    pub fn folder(&mut self, dir: &Path, names: &[&str]) -> Result<(), Failure> {
        let files: Vec<PathBuf> = names.iter().map(|name| dir.join(name)).collect();
        files.iter().try_for_each(|file| self.distinct(file))?;
        if dir.is_file() {
            let what = "a file has this name, and a folder for several files is wanted; give another name";
            return Err(Failure::Input(format!("{}: {what}", dir.display())));
        }
        std::fs::create_dir_all(dir).map_err(|e| FileError::io(&dir.display().to_string(), "make", &e))?;
        Ok(files.iter().try_for_each(|file| check_writable(file))?)
    }

    fn distinct(&mut self, path: &Path) -> Result<(), Failure> {
        let same = |other: &&PathBuf| is_same_file(path, other).unwrap_or_else(|_| resolved(path) == resolved(other));
        if let Some(read) = self.read.iter().find(same) {
            let known = if path == read { "is".to_owned() } else { format!("this is {}, which is", read.display()) };
            return Err(Failure::Input(format!("{}: {known} read by this command; write to another file", path.display())));
        }
        if let Some(other) = self.written.iter().find(same) {
            let file = other.display();
            return Err(Failure::Input(format!(
                "{}: {file} is to be written there too; give it a name of its own",
                path.display()
            )));
        }
        self.written.push(path.to_owned());
        Ok(())
    }
}

/// A path to a file that need not be there, free of links and of `..`.
fn resolved(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (folder.canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_owned(),
    }
}
