//! What a link in a page points to.

use std::path::Path;

use crate::source;

/// A link's target within the repository.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// Path from the root of the repository, without `.` and `..`; empty for the root itself.
    pub path: String,
    /// What follows `#`, decoded.
    pub anchor: Option<String>,
}

/// Where `link` points, seen from the file `from`; `None` for an address outside the repository.
pub fn target(from: &str, link: &str) -> Result<Option<Target>, String> {
    if link.contains("://") || link.starts_with("mailto:") {
        return Ok(None);
    }
    let (path, anchor) = link.split_once('#').map_or((link, None), |(path, anchor)| (path, Some(decoded(anchor))));
    if path.is_empty() {
        return Ok(Some(Target { path: from.into(), anchor }));
    }
    let path = decoded(path);
    if path.starts_with('/') {
        return Err(format!("link to {link}: must be relative"));
    }
    let mut parts: Vec<&str> = from.split('/').collect();
    parts.pop();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop().ok_or_else(|| format!("link to {link}: points outside the repository"))?;
            }
            name => parts.push(name),
        }
    }
    Ok(Some(Target { path: parts.join("/"), anchor }))
}

/// The address of `to` as written in the page `from`; both from the root of the site.
pub fn relative(from: &str, to: &str) -> String {
    let mut from: Vec<&str> = from.split('/').collect();
    from.pop();
    let to: Vec<&str> = to.split('/').collect();
    let same = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let mut parts = vec![".."; from.len() - same];
    parts.extend(&to[same..]);
    parts.join("/")
}

/// Where a file or folder of the repository that is no page stands in the site.
pub fn place(root: &Path, path: &str) -> String {
    if root.join(path).is_dir() {
        format!("source/{path}/index.html")
    } else if source::is_text(root, path) {
        format!("source/{path}.html")
    } else {
        path.into()
    }
}

/// `%20` and the like.
fn decoded(text: &str) -> String {
    let mut out = Vec::new();
    let mut rest = text.as_bytes();
    while let [first, more @ ..] = rest {
        let code = more.get(..2).and_then(|d| u8::from_str_radix(std::str::from_utf8(d).ok()?, 16).ok());
        match code.filter(|_| *first == b'%') {
            Some(byte) => {
                out.push(byte);
                rest = &more[2..];
            }
            None => {
                out.push(*first);
                rest = more;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_are_followed_from_their_page() {
        let to = |link| target("docs/model.md", link).unwrap().map(|t| (t.path, t.anchor));
        assert_eq!(to("conventions.md#frames"), Some(("docs/conventions.md".into(), Some("frames".into()))));
        assert_eq!(to("../README.md"), Some(("README.md".into(), None)));
        assert_eq!(to("#kenn%C3%A9"), Some(("docs/model.md".into(), Some("kenné".into()))));
        assert_eq!(to("https://example.org/#x"), None);
        assert!(target("docs/model.md", "../../secret").is_err());
        assert_eq!(relative("docs/model.html", "docs/images/a.svg"), "images/a.svg");
        assert_eq!(relative("docs/model.html", "index.html"), "../index.html");
        assert_eq!(relative("index.html", "docs/model.html"), "docs/model.html");
    }
}
