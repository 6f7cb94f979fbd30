//! The site as a whole: which pages there are, what they link to, and the files that come of it.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::Path;

use crate::layout::{self, Entry};
use crate::markdown::{self, Heading, Parsed};
use crate::source::{self, Shown};
use crate::{Problem, commands, guide, links};

/// The order of the pages beside each one; those that are not named here come last.
const GROUPS: [(&str, &[&str]); 8] = [
    ("Begin", &["README.md", "docs/walkthrough.md", "docs/program.md", "docs/glossary.md"]),
    ("The machine", &["docs/conventions.md", "docs/effects.md"]),
    ("Measurements", &["docs/recordings.md", "docs/diagnosis.md", "docs/learn.md", "docs/fleets.md"]),
    ("Python", &["docs/python.md", "docs/matlab.md"]),
    ("Drives", &["docs/observers.md", "docs/controllers.md", "docs/identifiers.md", "docs/design.md", "docs/firmware.md"]),
    (
        "Examples",
        &[
            "docs/background/gallery.md",
            "docs/background/notebook-first-diagnosis.md",
            "docs/background/notebook-own-data.md",
            "docs/background/notebook-fleet.md",
        ],
    ),
    (
        "Proofs and figures",
        &[
            "docs/background/model.md",
            "docs/background/diagnosis.md",
            "docs/background/observers.md",
            "docs/background/controllers.md",
            "docs/background/identifiers.md",
            "docs/background/design.md",
            "docs/background/claims.md",
            "docs/background/errata.md",
            "docs/background/figures.md",
            "docs/background/performance.md",
            "docs/background/json.md",
        ],
    ),
    ("For contributors", &["docs/background/architecture.md", "docs/background/extending.md"]),
];

/// Where pages stand: the guide, and what it rests on.
const FOLDERS: [&str; 2] = ["docs", "docs/background"];

/// What a file of the site holds.
pub enum Content {
    /// A page.
    Text(String),
    /// A file of the repository as it is, by its path.
    Copy(String),
}

/// A file of the site.
pub struct File {
    /// Path from the root of the site.
    pub path: String,
    /// What it holds.
    pub content: Content,
}

struct Page {
    file: String,
    text: String,
}

/// All files of the site, and what is wrong in the pages.
pub fn render(root: &Path) -> io::Result<(Vec<File>, Vec<Problem>)> {
    let pages = pages(root)?;
    let parsed: Vec<Parsed<'_>> = pages.iter().map(|p| markdown::parse(&p.file, &p.text)).collect();
    let entries: Vec<Entry> =
        pages.iter().zip(&parsed).map(|(p, m)| Entry { address: address(&p.file), title: title(&p.file, m.title()) }).collect();
    let groups = grouped(&pages, &entries);
    let headings: BTreeMap<String, Vec<Heading>> =
        pages.iter().zip(&parsed).map(|(p, m)| (p.file.clone(), m.headings.clone())).collect();
    let sections: Vec<_> = entries.iter().zip(&parsed).flat_map(|(e, m)| sections(e, m)).collect();
    let search = format!("const SECTIONS = {};\n{}", serde_json::json!(sections), layout::SEARCH);
    let mut files: Vec<File> = [("style.css", layout::STYLE.into()), ("search.js", search)]
        .map(|(path, text)| File { path: path.into(), content: Content::Text(text) })
        .into();
    let mut wanted = BTreeSet::new();
    let mut problems = guide::too_long(pages.iter().map(|p| (p.file.as_str(), p.text.as_str())));
    for (page, parsed) in pages.iter().zip(parsed) {
        let own = address(&page.file);
        let name = title(&page.file, parsed.title());
        let mut named_files = BTreeSet::new();
        let (body, wrong) = parsed.html(
            |link| resolve(root, &page.file, &own, link, &headings, &mut wanted),
            |code| named(root, &own, code, &mut named_files),
        );
        wanted.extend(named_files);
        problems.extend(wrong);
        problems.extend(commands::missing(root, &page.file, &page.text));
        let html = layout::page(&own, &name, &body, &groups, &headings[&page.file]);
        files.push(File { path: own, content: Content::Text(html) });
    }
    files.extend(linked(root, wanted, &groups)?);
    problems.sort();
    problems.dedup();
    Ok((files, problems))
}

/// Writes them.
pub fn write(root: &Path, out: &Path, files: &[File]) -> io::Result<()> {
    for file in files {
        let path = out.join(&file.path);
        std::fs::create_dir_all(path.parent().unwrap_or(out))?;
        match &file.content {
            Content::Text(text) => std::fs::write(path, text)?,
            Content::Copy(from) => std::fs::copy(root.join(from), path).map(|_| ())?,
        }
    }
    Ok(())
}

fn pages(root: &Path) -> io::Result<Vec<Page>> {
    let mut files = vec!["README.md".to_owned()];
    for folder in FOLDERS.into_iter().filter(|f| root.join(f).is_dir()) {
        let names = source::folder(root, folder)?;
        files.extend(names.iter().filter(|n| n.ends_with(".md")).map(|n| format!("{folder}/{n}")));
    }
    files.into_iter().map(|file| Ok(Page { text: std::fs::read_to_string(root.join(&file))?, file })).collect()
}

/// What the search knows of a page: of each section its address, the page, the heading, and the text.
fn sections(page: &Entry, parsed: &Parsed) -> Vec<[String; 4]> {
    let at = |h: &Heading| if h.level == 1 { page.address.clone() } else { format!("{}#{}", page.address, h.id) };
    let texts = parsed.texts();
    parsed.headings.iter().zip(texts).map(|(h, text)| [at(h), page.title.clone(), h.text.clone(), text]).collect()
}

fn address(file: &str) -> String {
    if file == "README.md" { "index.html".into() } else { file.replace(".md", ".html") }
}

fn title(file: &str, first_heading: &str) -> String {
    if file == "README.md" { "Overview".into() } else { first_heading.into() }
}

fn grouped(pages: &[Page], entries: &[Entry]) -> Vec<(&'static str, Vec<Entry>)> {
    let find = |name: &str| pages.iter().position(|p| p.file == name).map(|k| entries[k].clone());
    let mut groups: Vec<_> =
        GROUPS.map(|(group, names)| (group, names.iter().filter_map(|n| find(n)).collect::<Vec<_>>())).into();
    let named = |file: &str| GROUPS.iter().any(|(_, names)| names.contains(&file));
    let rest: Vec<_> = pages.iter().zip(entries).filter(|(p, _)| !named(&p.file)).map(|(_, e)| e.clone()).collect();
    if !rest.is_empty() {
        groups.push(("More", rest));
    }
    groups
}

/// The address of a link in the site; what it needs there is added to `wanted`.
fn resolve(
    root: &Path,
    file: &str,
    own: &str,
    link: &str,
    headings: &BTreeMap<String, Vec<Heading>>,
    wanted: &mut BTreeSet<String>,
) -> Result<String, String> {
    let Some(target) = links::target(file, link)? else { return Ok(link.into()) };
    let anchor = target.anchor.as_ref().map_or(String::new(), |a| format!("#{a}"));
    if let Some(headings) = headings.get(&target.path) {
        return match target.anchor.filter(|a| !headings.iter().any(|h| h.id == *a)) {
            Some(a) => Err(format!("link to {link}: {} has no heading with the anchor #{a}", target.path)),
            None if target.path == file => Ok(if anchor.is_empty() { "#".into() } else { anchor }),
            None => Ok(links::relative(own, &address(&target.path)) + &anchor),
        };
    }
    if target.path.is_empty() || !root.join(&target.path).exists() {
        return Err(format!("link to {link}: there is no {}", if target.path.is_empty() { "such page" } else { &target.path }));
    }
    if let Some(a) = &target.anchor {
        let lines = std::fs::read_to_string(root.join(&target.path)).map_or(0, |t| t.lines().count());
        if !a.strip_prefix('L').and_then(|n| n.parse().ok()).is_some_and(|n: usize| (1..=lines).contains(&n)) {
            return Err(format!("link to {link}: {} has no line {a}", target.path));
        }
    }
    wanted.insert(target.path.clone());
    Ok(links::relative(own, &links::place(root, &target.path)) + &anchor)
}

/// The address of a file named in code, where it names one.
fn named(root: &Path, own: &str, code: &str, wanted: &mut BTreeSet<String>) -> Result<Option<String>, String> {
    let plain = code.chars().all(|c| c.is_ascii_alphanumeric() || "-_./".contains(c));
    // A path begins with a folder of the repository, else it is a rate or somebody else's file.
    let Some((folder, _)) = code.split_once('/').filter(|(folder, _)| plain && !folder.starts_with('.') && *folder != "target")
    else {
        return Ok(None);
    };
    if folder.is_empty() || !root.join(folder).is_dir() {
        return Ok(None);
    }
    let path = code.trim_end_matches('/');
    if !root.join(path).exists() {
        return Err(format!("`{code}`: there is no such file"));
    }
    if path.ends_with(".md") {
        return Ok(None);
    }
    wanted.insert(path.into());
    Ok(Some(links::relative(own, &links::place(root, path))))
}

/// Pages and copies of what is linked, and of what is in linked folders.
fn linked(root: &Path, wanted: BTreeSet<String>, groups: &[(&str, Vec<Entry>)]) -> io::Result<Vec<File>> {
    let mut queue: Vec<String> = wanted.into_iter().collect();
    let mut done = BTreeSet::new();
    let mut files = Vec::new();
    while let Some(path) = queue.pop() {
        if !done.insert(path.clone()) {
            continue;
        }
        let place = links::place(root, &path);
        let content = if root.join(&path).is_dir() {
            let names = source::folder(root, &path)?;
            let children: Vec<String> = names.iter().map(|n| format!("{path}/{}", n.trim_end_matches('/'))).collect();
            let addresses = children.iter().map(|c| links::relative(&place, &links::place(root, c)));
            let body = source::listing(&path, names.iter().map(String::as_str).zip(addresses));
            queue.extend(children);
            Content::Text(layout::page(&place, &path, &body, groups, &[]))
        } else {
            match source::file(root, &path)? {
                Shown::Page(body) => Content::Text(layout::page(&place, &path, &body, groups, &[])),
                Shown::Copied => Content::Copy(path),
            }
        };
        files.push(File { path: place, content });
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every link, anchor, picture and equation of the pages as they stand.
    #[test]
    fn nothing_in_the_documentation_is_broken() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let (files, problems) = render(&root).unwrap();
        let said: Vec<String> = problems.iter().map(Problem::to_string).collect();
        assert!(said.is_empty(), "{}", said.join("\n"));
        // The search knows every section of every page.
        let search = files.iter().find(|f| f.path == "search.js").unwrap();
        let Content::Text(search) = &search.content else { panic!("not a text") };
        let known = search.strip_prefix("const SECTIONS = ").unwrap().split(";\n").next().unwrap();
        let known: Vec<[String; 4]> = serde_json::from_str(known).unwrap();
        let found = |words: &str| known.iter().find(|s| s[3].contains(words)).map(|s| s[0].as_str());
        assert_eq!(found("gives rotor flux, speed and torque from stator voltage and current"), Some("docs/observers.html"));
        // The site needs no network: nothing in it is fetched from elsewhere.
        assert!(!layout::STYLE.contains("@import") && !layout::STYLE.contains("url("));
        for file in &files {
            if let Content::Text(text) = &file.content {
                assert!(!text.contains("src=\"http"), "{}", file.path);
            }
        }
    }

    #[test]
    fn broken_links_are_reported_with_file_and_line() {
        let root = std::env::temp_dir().join(format!("im-site-{}", std::process::id()));
        std::fs::create_dir_all(root.join("docs")).unwrap();
        std::fs::write(root.join("README.md"), "# A\n\n[no page](docs/none.md)\n[no anchor](docs/b.md#gone)\n").unwrap();
        std::fs::write(root.join("docs/b.md"), "# B\n\n![no picture](images/none.svg)\n[good](../README.md#a)\n").unwrap();
        let (_, problems) = render(&root).unwrap();
        std::fs::remove_dir_all(&root).unwrap();
        let said: Vec<String> = problems.iter().map(Problem::to_string).collect();
        assert_eq!(
            said,
            [
                "README.md:3: link to docs/none.md: there is no docs/none.md",
                "README.md:4: link to docs/b.md#gone: docs/b.md has no heading with the anchor #gone",
                "docs/b.md:3: link to images/none.svg: there is no docs/images/none.svg",
            ]
        );
    }
}
