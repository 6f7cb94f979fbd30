//! The first lines: the cause, how sure, and what would refute it.

use super::super::page::list;
use super::super::story::{Story, summary, verdict_words};
use super::super::words::escape;
use crate::format::sentence;

/// Name of the motor, light or dark, then the answers.
pub(crate) fn top(s: &Story) -> String {
    let (sign, word) = verdict_words(s.d.verdict);
    let a = summary(s);
    let lines = |items: &[String]| match items {
        [] => String::new(),
        [one] => escape(one),
        many => list(&many.iter().map(|i| escape(i)).collect::<Vec<_>>()),
    };
    let part = |name: &str, text: String| if text.is_empty() { String::new() } else { format!("<dt>{name}</dt><dd>{text}</dd>") };
    let place = s.base().place.findings().into_iter().take(2).map(|f| escape(&sentence(&f))).collect::<Vec<_>>().join(" ");
    let warn = |t: &String| format!("<p class=\"warn\">⚠ {}</p>", escape(&sentence(t)));
    let remarks: String = s.d.remarks().iter().map(warn).collect();
    let refute =
        if s.d.verdict == crate::diagnosis::Verdict::Inconclusive { "What would decide" } else { "What would refute it" };
    let next =
        s.meta.next_test.as_ref().map_or(String::new(), |t| format!(r##"{} <a href="#next">Profile</a>"##, escape(&t.text)));
    format!(
        r#"{}<h1>{}</h1>{remarks}<dl class="sure">{}{}{}{}</dl>"#,
        head(&s.title(), &format!(r#"<span class="badge">{sign} {word}</span>"#)),
        escape(&a.cause),
        part("How sure", lines(&a.sure)),
        part("Where it shows", place),
        part(refute, lines(&a.refute)),
        part("Next test", next),
    )
}

/// The line above everything.
pub(crate) fn head(title: &str, badge: &str) -> String {
    format!(
        r#"<header class="top"><b>{}</b>{badge}<span style="flex:1"></span><button id="theme" class="no-print">light / dark</button></header>"#,
        escape(title)
    )
}
