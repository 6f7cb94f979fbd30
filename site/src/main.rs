//! Renders `README.md`, `docs/*.md` and `docs/background/*.md` as one static site: `cargo run -p im-site [-- OUT]`, into `target/site` unless OUT is given.
//!
//! Equations become MathML here, pictures are copied, files of the repository that a page links to become pages of plain text. Every link,
//! anchor, picture and example named in a command is checked; what is broken is reported with file and line, nothing is written, and the
//! status is 1. So is a guide that is too long.
//!
//! Not mdbook with KaTeX: its plugins for equations run in the reader's browser or need a program of their own, links into the repository stay
//! unchecked, and search, print and a dark page are here as well.

mod book;
mod commands;
mod guide;
mod layout;
mod links;
mod markdown;
mod math;
mod slug;
mod source;

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Something wrong in a page.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Problem {
    /// File, from the root of the repository.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// What is wrong.
    pub what: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.file, self.line, self.what)
    }
}

fn main() -> ExitCode {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
    let out = std::env::args_os().nth(1).map_or_else(|| target.join("site"), PathBuf::from);
    let rendered = book::render(&root);
    let (files, problems) = match rendered {
        Ok(done) => done,
        Err(e) => {
            eprintln!("error: {e}");
            return ExitCode::from(1);
        }
    };
    if !problems.is_empty() {
        problems.iter().for_each(|p| eprintln!("{p}"));
        eprintln!("error: {} broken in the documentation; no site was written", problems.len());
        return ExitCode::from(1);
    }
    if let Err(e) = book::write(&root, &out, &files) {
        eprintln!("error: cannot write {}: {e}", out.display());
        return ExitCode::from(1);
    }
    let pages = files.iter().filter(|f| matches!(f.content, book::Content::Text(_))).count();
    println!("{} pages, {} pictures and other files: {}", pages, files.len() - pages, out.join("index.html").display());
    ExitCode::SUCCESS
}
