//! One page: Markdown to HTML, with its headings, its links and what is wrong in it.

use pulldown_cmark::{CodeBlockKind, CowStr, Event, LinkType, Options, Parser, Tag, TagEnd, html};

use crate::Problem;
use crate::math::mathml;
use crate::slug::Slugs;

/// A heading of a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Heading {
    /// 1 to 6.
    pub level: u8,
    /// Its anchor.
    pub id: String,
    /// Its words.
    pub text: String,
}

/// A page, parsed: its links are still those of the Markdown.
pub struct Parsed<'a> {
    events: Vec<(Event<'a>, usize)>,
    /// In order.
    pub headings: Vec<Heading>,
    /// What is wrong in the page itself.
    pub problems: Vec<Problem>,
    file: &'a str,
}

/// The line of a place in a text, from 1.
pub fn line_of(text: &str, at: usize) -> usize {
    1 + text.as_bytes()[..at.min(text.len())].iter().filter(|b| **b == b'\n').count()
}

/// Parses a page.
pub fn parse<'a>(file: &'a str, text: &'a str) -> Parsed<'a> {
    let options = Options::ENABLE_TABLES | Options::ENABLE_FOOTNOTES | Options::ENABLE_STRIKETHROUGH | Options::ENABLE_MATH;
    let mut problems = Vec::new();
    let mut undefined = Vec::new();
    let mut missing = |link: pulldown_cmark::BrokenLink<'_>| {
        if link.link_type == LinkType::Reference {
            undefined.push((link.span.start, link.reference.to_string()));
        }
        None
    };
    let mut events: Vec<(Event<'a>, usize)> = Vec::new();
    let mut headings = Vec::new();
    let mut slugs = Slugs::default();
    let mut open: Option<(usize, String)> = None;
    let mut in_code = false;
    for (event, range) in Parser::new_with_broken_link_callback(text, options, Some(&mut missing)).into_offset_iter() {
        let line = line_of(text, range.start);
        if let (Some((_, words)), Event::Text(t) | Event::Code(t)) = (&mut open, &event) {
            words.push_str(t);
        }
        match &event {
            Event::Start(Tag::CodeBlock(_)) => in_code = true,
            Event::End(TagEnd::CodeBlock) => in_code = false,
            // A line of an equation that begins like a list ends the equation.
            Event::Text(t) if !in_code && t.contains('$') => {
                problems.push(Problem { file: file.into(), line, what: "a $ that no equation begins or ends with".into() });
            }
            _ => {}
        }
        let event = match event {
            Event::Start(Tag::Heading { .. }) => {
                open = Some((events.len(), String::new()));
                event
            }
            Event::End(TagEnd::Heading(level)) => {
                if let Some((start, words)) = open.take() {
                    let id = slugs.next(&words);
                    if let Event::Start(Tag::Heading { id: slot, .. }) = &mut events[start].0 {
                        *slot = Some(id.clone().into());
                    }
                    headings.push(Heading { level: level as u8, id, text: words });
                }
                event
            }
            Event::InlineMath(latex) => equation(&latex, false, (file, line), &mut problems),
            Event::DisplayMath(latex) => equation(&latex, true, (file, line), &mut problems),
            Event::Start(Tag::Table(_)) => {
                events.push((Event::Html("<div class=\"wide\">".into()), line));
                event
            }
            Event::End(TagEnd::Table) => {
                events.push((event, line));
                Event::Html("</div>\n".into())
            }
            // A code block without a language is a command or a drawing: no need to guess one.
            Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(name))) if name.is_empty() => {
                Event::Start(Tag::CodeBlock(CodeBlockKind::Indented))
            }
            other => other,
        };
        events.push((event, line));
    }
    let undefined = undefined.into_iter();
    problems.extend(undefined.map(|(at, name)| Problem {
        file: file.into(),
        line: line_of(text, at),
        what: format!("[{name}] is not defined"),
    }));
    Parsed { events, headings, problems, file }
}

fn equation<'a>(latex: &str, block: bool, (file, line): (&str, usize), problems: &mut Vec<Problem>) -> Event<'a> {
    match mathml(latex, block) {
        // A wide equation scrolls by itself instead of widening the page.
        Ok(math) if block => Event::InlineHtml(format!("<span class=\"equation\">{math}</span>").into()),
        Ok(math) => Event::InlineHtml(math.into()),
        Err(what) => {
            problems.push(Problem { file: file.into(), line, what });
            Event::Text(CowStr::from(latex.to_owned()))
        }
    }
}

impl<'a> Parsed<'a> {
    /// The page's title: its first heading.
    pub fn title(&self) -> &str {
        self.headings.first().map_or(self.file, |h| &h.text)
    }

    /// The words under each heading, in the order of the headings.
    pub fn texts(&self) -> Vec<String> {
        let mut out: Vec<String> = Vec::new();
        let mut in_heading = false;
        for (event, _) in &self.events {
            match event {
                Event::Start(Tag::Heading { .. }) => {
                    in_heading = true;
                    out.push(String::new());
                }
                Event::End(TagEnd::Heading(_)) => in_heading = false,
                Event::Text(t) | Event::Code(t) if !in_heading => {
                    if let Some(text) = out.last_mut() {
                        text.push_str(t);
                    }
                }
                Event::End(_) | Event::SoftBreak | Event::HardBreak => {
                    if let Some(text) = out.last_mut() {
                        text.push(' ');
                    }
                }
                _ => {}
            }
        }
        out.iter().map(|text| text.split_whitespace().collect::<Vec<_>>().join(" ")).collect()
    }

    /// The page as HTML. `resolve` gives the address for a link or picture, `named` that of a file named in code, if it is one; or what
    /// is wrong with it.
    pub fn html(
        self,
        mut resolve: impl FnMut(&str) -> Result<String, String>,
        mut named: impl FnMut(&str) -> Result<Option<String>, String>,
    ) -> (String, Vec<Problem>) {
        let mut problems = self.problems;
        let mut linked = false;
        let mut events: Vec<Event<'a>> = Vec::with_capacity(self.events.len());
        for (mut event, line) in self.events {
            let mut report = |what| problems.push(Problem { file: self.file.into(), line, what });
            match &mut event {
                Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => match resolve(dest_url) {
                    Ok(address) => *dest_url = address.into(),
                    Err(what) => report(what),
                },
                Event::Code(code) if !linked => match named(code) {
                    Ok(Some(address)) => {
                        let words = maud::html! { a href=(address) { code { (&**code) } } }.into_string();
                        event = Event::InlineHtml(words.into());
                    }
                    Ok(None) => {}
                    Err(what) => report(what),
                },
                _ => {}
            }
            match event {
                Event::Start(Tag::Link { .. } | Tag::Heading { .. }) => linked = true,
                Event::End(TagEnd::Link | TagEnd::Heading(_)) => linked = false,
                _ => {}
            }
            events.push(event);
        }
        let mut out = String::new();
        html::push_html(&mut out, events.into_iter());
        (out, problems)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_get_anchors_and_links_new_addresses() {
        let page = parse("a.md", "# One\n\ntext $x^2$ [b](b.md)\n\n## Two `c`\n");
        assert_eq!(page.headings[1], Heading { level: 2, id: "two-c".into(), text: "Two c".into() });
        assert_eq!(page.texts(), ["text b", ""]);
        let (html, problems) = page.html(|link| Ok(link.replace(".md", ".html")), |_| Ok(None));
        assert!(problems.is_empty());
        assert!(html.contains("<h2 id=\"two-c\">") && html.contains("href=\"b.html\"") && html.contains("<math"), "{html}");
    }

    #[test]
    fn what_is_broken_is_reported_with_its_line() {
        let page = parse("a.md", "# One\n\n[gone](gone.md)\n\n$\\nosuch$ and [x][y]\n\n$$\na\n+ b\n$$\n\n```\n$HOME\n```\n");
        let (_, mut problems) = page.html(|link| Err(format!("link to {link}: no such file")), |_| Ok(None));
        problems.sort();
        let said: Vec<_> = problems.iter().map(|p| (p.line, p.what.as_str())).collect();
        assert_eq!(said[0], (3, "link to gone.md: no such file"));
        assert_eq!((said[1].0, said[2].0), (5, 5));
        assert!(said[1].1.contains("[y]") && said[2].1.contains("not understood"), "{said:?}");
        assert!(said[3..].iter().all(|t| [7, 10, 12].contains(&t.0) && t.1.starts_with("a $")) && said.len() > 3, "{said:?}");
    }
}
