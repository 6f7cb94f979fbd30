//! Reading TOML key by key, so that every error can point at its line.

use std::ops::Range;

use toml::de::{DeTable, DeValue};

use crate::error::Bound;
use crate::file_error::{FileError, Problem};
use crate::simulation::Profile;

/// The text of a file, parsed.
pub struct Document<'a> {
    label: &'a str,
    text: &'a str,
    root: toml::Spanned<DeTable<'a>>,
}

impl<'a> Document<'a> {
    /// Parses; `label` names the file in messages.
    pub fn parse(text: &'a str, label: &'a str) -> Result<Self, FileError> {
        match DeTable::parse(text) {
            Ok(root) => Ok(Self { label, text, root }),
            Err(e) => {
                let line = e.span().map(|s| line_of(text, s.start));
                let reason = format!("not TOML: {}", e.message().trim().replace('\n', ", "));
                Err(FileError::new(label, line, None, Problem::Syntax { reason }))
            }
        }
    }

    /// The top of the file, where only `known` keys may stand.
    pub fn top(&self, known: &[&'static str]) -> Result<Table<'_>, FileError> {
        Table::open(self, String::new(), None, self.root.get_ref(), known)
    }
}

/// The line, from 1, of a byte position.
fn line_of(text: &str, at: usize) -> usize {
    1 + text.as_bytes().iter().take(at).filter(|&&b| b == b'\n').count()
}

/// What kind of value stands at a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Text in quotes.
    Text,
    /// A whole number.
    Whole,
    /// A number with a point.
    Float,
    /// `true` or `false`.
    Boolean,
    /// A date.
    Date,
    /// A list.
    List,
    /// A table.
    Table,
}

/// A table whose keys are all known.
pub struct Table<'a> {
    document: &'a Document<'a>,
    /// Full name, as in the header.
    pub name: String,
    line: Option<usize>,
    table: &'a DeTable<'a>,
}

impl<'a> Table<'a> {
    fn open(
        document: &'a Document<'a>,
        name: String,
        line: Option<usize>,
        table: &'a DeTable<'a>,
        known: &[&'static str],
    ) -> Result<Self, FileError> {
        let this = Self { document, name, line, table };
        // The first in the file, for the table's own order is another.
        let unknown = table.keys().filter(|k| !known.contains(&k.get_ref().as_ref())).min_by_key(|k| k.span().start);
        match unknown {
            None => Ok(this),
            Some(key) => {
                let nearest = nearest(key.get_ref(), known.iter().copied());
                let problem = Problem::UnknownKey { table: this.name.clone(), nearest, known: known.to_vec() };
                Err(this.error(Some(key.span()), Some(key.get_ref()), problem))
            }
        }
    }

    fn error(&self, at: Option<Range<usize>>, key: Option<&str>, problem: Problem) -> FileError {
        let line = at.map(|s| line_of(self.document.text, s.start)).or(self.line);
        FileError::new(self.document.label, line, key, problem)
    }

    fn find(&self, key: &str) -> Option<(Range<usize>, &'a DeValue<'a>)> {
        self.table.iter().find(|(k, _)| k.get_ref().as_ref() == key).map(|(k, v)| (k.span(), v.get_ref()))
    }

    /// An error about `key`.
    pub fn fail(&self, key: &'static str, problem: Problem) -> FileError {
        self.error(self.find(key).map(|(span, _)| span), Some(key), problem)
    }

    /// An error that something else was expected at `key`.
    pub fn unexpected(&self, key: &'static str, found: impl Into<String>, expected: impl Into<String>) -> FileError {
        self.fail(key, Problem::Unexpected { found: found.into(), expected: expected.into() })
    }

    /// An error that `key` is missing.
    pub fn missing(&self, key: &'static str, expected: impl Into<String>) -> FileError {
        self.error(None, Some(key), Problem::MissingKey { table: self.name.clone(), expected: expected.into() })
    }

    /// A table within, with only `known` keys.
    pub fn table(&self, key: &'static str, known: &[&'static str]) -> Result<Option<Table<'a>>, FileError> {
        let Some((span, value)) = self.find(key) else { return Ok(None) };
        let name = if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) };
        match value {
            DeValue::Table(t) => {
                Table::open(self.document, name, Some(line_of(self.document.text, span.start)), t, known).map(Some)
            }
            other => Err(self.unexpected(key, describe(other), format!("a table: [{name}]"))),
        }
    }

    /// A number within `bound`.
    pub fn number(&self, key: &'static str, bound: Bound) -> Result<Option<f64>, FileError> {
        let Some((_, value)) = self.find(key) else { return Ok(None) };
        let x = number(value).ok_or_else(|| self.unexpected(key, describe(value), format!("a number, {bound}")))?;
        bound.check(key, x).map_err(|e| self.fail(key, Problem::Value(e)))?;
        Ok(Some(x))
    }

    /// What kind of value stands at `key`.
    pub fn kind(&self, key: &str) -> Option<Kind> {
        Some(match self.find(key)?.1 {
            DeValue::String(_) => Kind::Text,
            DeValue::Integer(_) => Kind::Whole,
            DeValue::Float(_) => Kind::Float,
            DeValue::Boolean(_) => Kind::Boolean,
            DeValue::Datetime(_) => Kind::Date,
            DeValue::Array(_) => Kind::List,
            DeValue::Table(_) => Kind::Table,
        })
    }

    /// The line of `key`, or of the table where the key is absent.
    pub fn line(&self, key: &str) -> Option<usize> {
        self.find(key).map(|(span, _)| line_of(self.document.text, span.start)).or(self.line)
    }

    /// What stands at `key`, in words for messages.
    pub fn found(&self, key: &str) -> String {
        self.find(key).map_or_else(|| "missing".to_owned(), |(_, v)| describe(v))
    }

    /// `true` or `false`.
    pub fn boolean(&self, key: &'static str) -> Result<Option<bool>, FileError> {
        match self.find(key) {
            None => Ok(None),
            Some((_, DeValue::Boolean(b))) => Ok(Some(*b)),
            Some((_, other)) => Err(self.unexpected(key, describe(other), "true or false")),
        }
    }

    /// One text, or a list of texts.
    pub fn texts(&self, key: &'static str) -> Result<Option<Vec<String>>, FileError> {
        const EXPECTED: &str = "text in quotes, or a list of texts";
        match self.find(key) {
            None => Ok(None),
            Some((_, DeValue::String(s))) => Ok(Some(vec![s.to_string()])),
            Some((_, DeValue::Array(list))) => list
                .iter()
                .map(|x| match x.get_ref() {
                    DeValue::String(s) => Ok(s.to_string()),
                    other => Err(self.unexpected(key, format!("a list with {} in it", describe(other)), EXPECTED)),
                })
                .collect::<Result<Vec<_>, _>>()
                .map(Some),
            Some((_, other)) => Err(self.unexpected(key, describe(other), EXPECTED)),
        }
    }

    /// Whether the key stands here.
    pub fn has(&self, key: &str) -> bool {
        self.find(key).is_some()
    }

    /// A quantity over time: a number, or a list of points `[t, x]` in the order of time.
    pub fn profile(&self, key: &'static str) -> Result<Option<Profile>, FileError> {
        const EXPECTED: &str = "a number, or points [[t_s, value], …] in the order of time; two at one time make a step";
        let Some((_, value)) = self.find(key) else { return Ok(None) };
        let wrong = |found: String| self.unexpected(key, found, EXPECTED);
        let pair = |point: &DeValue<'_>| match point {
            DeValue::Array(p) if p.len() == 2 => Some([number(p[0].get_ref())?, number(p[1].get_ref())?]),
            _ => None,
        };
        let points = match value {
            DeValue::Array(list) => list
                .iter()
                .map(|p| {
                    pair(p.get_ref())
                        .ok_or_else(|| wrong("a list with something other than a point [t_s, value] in it".to_owned()))
                })
                .collect::<Result<Vec<_>, _>>()?,
            other => vec![[0.0, number(other).ok_or_else(|| wrong(describe(other)))?]],
        };
        Profile::points(points).map(Some).map_err(|e| self.unexpected(key, format!("not a profile ({e})"), EXPECTED))
    }

    /// One of several words.
    pub fn choice<V: Copy>(&self, key: &'static str, words: &[(&'static str, V)]) -> Result<Option<V>, FileError> {
        let Some((_, value)) = self.find(key) else { return Ok(None) };
        let DeValue::String(word) = value else { return Err(self.unexpected(key, describe(value), one_of(words))) };
        match words.iter().find(|(w, _)| w == word) {
            Some((_, v)) => Ok(Some(*v)),
            None => Err(self.unexpected(key, describe(value), one_of(words))),
        }
    }

    /// A whole number within the closed range.
    pub fn whole(&self, key: &'static str, range: (u64, u64)) -> Result<Option<u64>, FileError> {
        let Some((_, value)) = self.find(key) else { return Ok(None) };
        let x = match value {
            DeValue::Integer(i) => u64::from_str_radix(i.as_str(), i.radix()).ok().filter(|x| (range.0..=range.1).contains(x)),
            _ => None,
        };
        x.map(Some)
            .ok_or_else(|| self.unexpected(key, describe(value), format!("a whole number from {} to {}", range.0, range.1)))
    }

    /// A text.
    pub fn text(&self, key: &'static str) -> Result<Option<&'a str>, FileError> {
        match self.find(key) {
            None => Ok(None),
            Some((_, DeValue::String(s))) => Ok(Some(s)),
            Some((_, other)) => Err(self.unexpected(key, describe(other), "text in quotes")),
        }
    }
}

fn one_of<V>(words: &[(&'static str, V)]) -> String {
    let quoted: Vec<String> = words.iter().map(|(w, _)| format!("\"{w}\"")).collect();
    format!("one of {}", quoted.join(", "))
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(f) => f.as_str().parse().ok(),
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|x| x as f64),
        _ => None,
    }
}

fn describe(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(s) => format!("the text \"{s}\""),
        DeValue::Integer(i) => i.to_string(),
        DeValue::Float(f) => f.to_string(),
        DeValue::Boolean(b) => b.to_string(),
        DeValue::Datetime(d) => d.to_string(),
        DeValue::Array(_) => "a list".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    }
}

/// The candidate that `word` is most likely a slip of, if any is like it.
pub fn nearest<'k>(word: &str, candidates: impl Iterator<Item = &'k str>) -> Option<&'k str> {
    candidates
        .map(|c| (edits(word, c), c))
        .filter(|(d, c)| *d <= word.chars().count().max(c.chars().count()) / 3)
        .min_by_key(|(d, _)| *d)
        .map(|(_, c)| c)
}

/// Levenshtein's distance.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut corner = i;
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = corner + usize::from(x != *y);
            corner = row[j + 1];
            row[j + 1] = replaced.min(corner + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

/// A number that reads back as the same bits.
pub fn exact(x: f64) -> String {
    // The shortest text that round-trips; always with a point or an exponent, so that TOML reads a float.
    format!("{x:?}")
}

/// A text in quotes.
pub fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Letters put in, left out and replaced count one each, wherever they are.
    #[test]
    fn a_slip_of_the_pen_is_counted_by_its_letters() {
        for (a, b, distance) in [
            ("", "flux", 4),
            ("flux", "", 4),
            ("flux", "flux", 0),
            ("flux", "fluxx", 1),
            ("xflux", "flux", 1),
            ("flux", "fux", 1),
            ("flux", "flax", 1),
            ("flux", "lfux", 2),
            ("kitten", "sitting", 3),
            ("abc", "xyz", 3),
        ] {
            assert_eq!(edits(a, b), distance, "{a} {b}");
        }
    }

    /// A third of the longer word may be wrong.
    #[test]
    fn what_is_like_nothing_is_like_nothing() {
        let keys = ["inertia_kg_m2", "pole_pairs", "flux"];
        let near = |word: &str| nearest(word, keys.iter().copied());
        assert_eq!(
            [near("pole_pair"), near("polepares"), near("flax"), near("fl"), near("")],
            [Some("pole_pairs"), Some("pole_pairs"), Some("flux"), None, None]
        );
    }
}
