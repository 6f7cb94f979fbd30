//! Files and folders of the repository as pages: what a link to code shows.

use std::path::Path;

use maud::html;

/// Beyond this a text is copied as it is.
const LARGEST: u64 = 200_000;

/// What a file is shown as.
pub enum Shown {
    /// The body of a page.
    Page(String),
    /// Not at all: it is copied.
    Copied,
}

/// Whether a file is shown as a page of text.
pub fn is_text(root: &Path, path: &str) -> bool {
    let picture = [".svg", ".png", ".jpg"].iter().any(|end| path.ends_with(end));
    let full = root.join(path);
    !picture && full.metadata().is_ok_and(|m| m.len() <= LARGEST) && std::fs::read_to_string(full).is_ok()
}

/// A file with its lines numbered; each line is an anchor `L1`, `L2`, ….
pub fn file(root: &Path, path: &str) -> std::io::Result<Shown> {
    if !is_text(root, path) {
        return Ok(Shown::Copied);
    }
    let text = std::fs::read_to_string(root.join(path))?;
    let body = html! {
        h1.path { (path) }
        pre.source { code { @for (k, line) in text.lines().enumerate() { span id={ "L" (k + 1) } { (line) } "\n" } } }
    };
    Ok(Shown::Page(body.into_string()))
}

/// The names in a folder with their addresses.
pub fn listing<'a>(path: &str, names: impl Iterator<Item = (&'a str, String)>) -> String {
    let body = html! {
        h1.path { (path) }
        ul { @for (name, address) in names { li { a href=(address) { (name) } } } }
    };
    body.into_string()
}

/// The names in a folder, folders with a slash at the end; what begins with a dot and build output are left out.
pub fn folder(root: &Path, path: &str) -> std::io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(root.join(path))? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if !name.starts_with('.') && name != "target" {
            names.push(if entry.file_type()?.is_dir() { format!("{name}/") } else { name });
        }
    }
    names.sort();
    Ok(names)
}
