//! A folder per test, and `im` run in a process of its own.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// A folder of its own for a test, removed at the end.
pub struct Folder(tempfile::TempDir);

impl Folder {
    /// `name` is only to be seen in messages: the folder is this call's alone.
    pub fn new(name: &str) -> Self {
        Self(tempfile::Builder::new().prefix(&format!("im-program-{name}-")).tempdir().unwrap())
    }

    /// Where a file of that name is, or would be.
    pub fn path(&self, name: &str) -> String {
        self.0.path().join(name).display().to_string()
    }

    /// Writes a file; returns where it is.
    pub fn file(&self, name: &str, text: &str) -> String {
        fs::write(self.0.path().join(name), text).unwrap();
        self.path(name)
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.path().join(name)).unwrap()
    }

    pub fn has(&self, name: &str) -> bool {
        self.0.path().join(name).exists()
    }
}

/// A file of the examples.
pub fn example(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name).display().to_string()
}

/// A file of the demo's data.
pub fn demo(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/demo").join(name).display().to_string()
}

pub fn im(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_im")).args(args).output().unwrap()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Runs what must succeed; returns what it printed.
pub fn done(args: &[&str]) -> String {
    let o = im(args);
    assert_eq!(o.status.code(), Some(0), "{args:?}: {}", text(&o.stderr));
    assert!(!text(&o.stderr).contains('\x1b'), "a pipe gets no colours and no progress bar");
    text(&o.stdout)
}

/// As [`done`], of what prints JSON.
pub fn json(args: &[&str]) -> serde_json::Value {
    let printed = done(args);
    serde_json::from_str(&printed).unwrap_or_else(|e| panic!("{args:?}: {e}: {printed}"))
}

/// Runs what must be refused as bad input; returns the message.
pub fn refused(args: &[&str]) -> String {
    let o = im(args);
    let message = text(&o.stderr);
    assert_eq!(o.status.code(), Some(1), "{args:?}: {message}");
    assert_eq!(text(&o.stdout), "", "{args:?}");
    assert!(message.starts_with("error: ") && !message.contains('\x1b') && !message.contains("panicked"), "{message}");
    message
}
