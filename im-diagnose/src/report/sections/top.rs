//! The first lines: the cause, how sure, and what would refute it.

use maud::{Markup, html};

use super::super::page::{head, list};
use super::super::story::{Story, summary, verdict_words};
use crate::format::sentence;

/// Name of the motor, light or dark, then the answers.
pub(crate) fn top(s: &Story) -> Markup {
    let (sign, word) = verdict_words(s.d.verdict);
    let a = summary(s);
    let refute =
        if s.d.verdict == crate::diagnosis::Verdict::Inconclusive { "What would decide" } else { "What would refute it" };
    let place: Vec<String> = s.base().place.findings().into_iter().take(2).map(|f| sentence(&f)).collect();
    html! {
        (head(&s.title(), Some(&format!("{sign} {word}"))))
        h1 { (a.cause) }
        @for t in a.electrical.iter().chain(&a.beside) { p.say { (t) } }
        @for remark in s.d.remarks() { p.warn { "⚠ " (sentence(&remark)) } }
        dl.sure {
            (part("How sure", &a.sure))
            @if !place.is_empty() { dt { "Where it shows" } dd { (place.join(" ")) } }
            (part(refute, &a.refute))
            @if let Some(t) = &s.meta.next_test { dt { "Next test" } dd { (t.text) " " a href="#next" { "Profile" } } }
        }
    }
}

fn part(name: &str, items: &[String]) -> Markup {
    html! {
        @match items {
            [] => {}
            [one] => { dt { (name) } dd { (one) } }
            many => { dt { (name) } dd { (list(many)) } }
        }
    }
}
