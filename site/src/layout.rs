//! The frame around every page: what is where, and how it looks.

use std::fmt::Write;

use crate::links::relative;
use crate::markdown::Heading;
use im_chart::escape;

/// The one style sheet.
pub const STYLE: &str = include_str!("style.css");

/// A page in the list beside each one.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Path from the root of the site.
    pub address: String,
    /// Its words in the list.
    pub title: String,
}

/// A page as HTML: list of pages, sections of this one, body.
pub fn page(own: &str, title: &str, body: &str, groups: &[(&str, Vec<Entry>)], headings: &[Heading]) -> String {
    let mut list = String::new();
    for (name, entries) in groups {
        let _ = writeln!(list, "<h2>{}</h2>\n<ul>", escape(name));
        for entry in entries {
            let here = if entry.address == own { " aria-current=\"page\"" } else { "" };
            let (address, title) = (relative(own, &entry.address), escape(&entry.title));
            let _ =
                writeln!(list, "<li><a href=\"{address}\"{here}>{title}</a>{}</li>", sections(own == entry.address, headings));
        }
        list.push_str("</ul>\n");
    }
    let (style, home, title) = (relative(own, "style.css"), relative(own, "index.html"), escape(title));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title} · imkit</title>\n\
         <link rel=\"stylesheet\" href=\"{style}\">\n</head>\n<body>\n\
         <header><a href=\"{home}\">imkit</a><details><summary>Contents</summary><nav aria-label=\"Contents\">\n{list}</nav></details></header>\n\
         <nav class=\"side\" aria-label=\"Contents\">\n<a class=\"home\" href=\"{home}\">imkit</a>\n{list}</nav>\n\
         <main>\n{body}</main>\n</body>\n</html>\n"
    )
}

/// The sections of the page one is on.
fn sections(here: bool, headings: &[Heading]) -> String {
    let mut out = String::new();
    if here && headings.iter().any(|h| h.level == 2) {
        out.push_str("<ul>");
        for h in headings.iter().filter(|h| h.level == 2) {
            let _ = write!(out, "<li><a href=\"#{}\">{}</a></li>", escape(&h.id), escape(&h.text));
        }
        out.push_str("</ul>");
    }
    out
}
