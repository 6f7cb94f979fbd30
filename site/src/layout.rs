//! The frame around every page: what is where, and how it looks.

use maud::{DOCTYPE, PreEscaped, html};

use crate::links::relative;
use crate::markdown::Heading;

/// The one style sheet.
pub const STYLE: &str = include_str!("style.css");

/// The search over all pages, behind `SECTIONS`.
pub const SEARCH: &str = include_str!("search.js");

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
    let sections: Vec<&Heading> = headings.iter().filter(|h| h.level == 2).collect();
    let list = html! {
        @for (name, entries) in groups {
            h2 { (name) }
            ul { @for entry in entries {
                @let here = entry.address == own;
                li {
                    a href=(relative(own, &entry.address)) aria-current=[here.then_some("page")] { (entry.title) }
                    @if here && !sections.is_empty() {
                        ul { @for h in &sections { li { a href={ "#" (h.id) } { (h.text) } } } }
                    }
                }
            } }
        }
    };
    let home = relative(own, "index.html");
    // Without scripts there is no search.
    let find = html! { input type="search" placeholder="Search" aria-label="Search" hidden; ul.found {} };
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) " · imkit" }
                link rel="stylesheet" href=(relative(own, "style.css"));
                script defer src=(relative(own, "search.js")) data-root=(home.trim_end_matches("index.html")) {}
            }
            body {
                header {
                    a href=(home) { "imkit" }
                    details { summary { "Contents" } nav aria-label="Contents" { (find) (list) } }
                }
                nav.side aria-label="Contents" { a.home href=(home) { "imkit" } (find) (list) }
                main { (PreEscaped(body)) }
            }
        }
    };
    page.into_string() + "\n"
}
