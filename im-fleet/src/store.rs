//! Rows that are done, one file each, by key: what a run resumes from, and what shards that share the folder leave for each other.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use im_model::{FileError, write_atomically};

use crate::row::Row;

/// A folder of rows.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

impl Store {
    /// In a folder, which is made where it is missing.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn open(folder: &Path) -> Result<Self, FileError> {
        let folder = folder.join("rows");
        fs::create_dir_all(&folder).map_err(|e| FileError::io(&folder.display().to_string(), "make", &e))?;
        Ok(Self { folder })
    }

    /// Thousands of files to a folder: by the first two digits of the key.
    fn path(&self, key: &str) -> PathBuf {
        self.folder.join(&key[..2.min(key.len())]).join(format!("{key}.json"))
    }

    /// The row of a key, if it is done; a file that is no row is done again.
    pub fn get(&self, key: &str) -> Option<Row> {
        let text = fs::read_to_string(self.path(key)).ok()?;
        serde_json::from_str(&text).ok().filter(|row: &Row| row.key == key)
    }

    /// Keeps a row: whole or not at all, whoever else writes it at the same time.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn put(&self, row: &Row) -> Result<(), FileError> {
        let path = self.path(&row.key);
        let folder = path.parent().unwrap_or(&self.folder);
        fs::create_dir_all(folder).map_err(|e| FileError::io(&folder.display().to_string(), "make", &e))?;
        let text = serde_json::to_string(row).unwrap_or_default();
        write_atomically(&path, |out| writeln!(out, "{text}"))
    }
}
