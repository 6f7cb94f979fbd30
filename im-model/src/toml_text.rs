//! Reading TOML by serde, with errors that name the line, the key, what stands there and what should.
//!
//! The type says what may stand where: a struct with `deny_unknown_fields` the keys of a table, an enum the words, [`Positive`],
//! [`NotNegative`], [`Within`] and [`Whole`] the numbers. What only the whole can say (one of two keys, a number against another) is
//! checked afterwards; `toml::Spanned` keeps the place for it.

use std::ops::Range;

use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error, Visitor};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::{Bound, ModelError};
use crate::file_error::{FileError, Problem};
use crate::file_kind::FileKind;

/// A text in TOML.
#[derive(Clone, Copy)]
pub struct TomlText<'a> {
    text: &'a str,
    label: &'a str,
    hints: &'a [(&'a str, &'a str)],
    kind: Option<FileKind>,
}

/// An entry of a table: where it stands and what it is.
struct Entry<'t> {
    /// The names of the tables around it.
    path: Vec<&'t str>,
    siblings: &'t DeTable<'t>,
    key: &'t str,
    value: &'t Spanned<DeValue<'t>>,
}

impl<'a> TomlText<'a> {
    /// `label` names the file in messages; `hints` say for keys, or for a table's keys as in `start.kind`, what to write
    /// where they are missing.
    pub fn new(text: &'a str, label: &'a str, hints: &'a [(&'a str, &'a str)]) -> Self {
        Self { text, label, hints, kind: None }
    }

    /// Of this kind: a file of another kind in its place is said to be that.
    #[must_use]
    pub fn of_kind(self, kind: FileKind) -> Self {
        Self { kind: Some(kind), ..self }
    }

    /// Reads the whole.
    ///
    /// # Errors
    /// No TOML, an unknown key, a missing one, a value that does not fit.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T, FileError> {
        toml::from_str(self.text).map_err(|e| self.explain(&e))
    }

    /// The line, from 1, of a byte position.
    pub fn line(&self, at: usize) -> usize {
        1 + self.text.bytes().take(at).filter(|b| *b == b'\n').count()
    }

    /// An error that something else was expected at the value that spans `at`.
    pub fn unexpected(&self, at: Range<usize>, found: Option<&str>, expected: impl Into<String>) -> FileError {
        let root = DeTable::parse(self.text).ok();
        let entry = root.as_ref().and_then(|r| find(r.get_ref(), &at, &mut Vec::new()));
        let found = found.map_or_else(|| entry.as_ref().map_or_else(String::new, |e| described(e.value, &at)), str::to_owned);
        self.error(Some(at), entry.as_ref().map(|e| e.key), Problem::Unexpected { found, expected: expected.into() })
    }

    /// An error about `key` of the table that spans `table`, at the line of the key where it is there.
    pub fn about(&self, table: Range<usize>, key: &str, problem: Problem) -> FileError {
        let at = self.key_in(&table, key).unwrap_or(table);
        self.error(Some(at).filter(|at| !at.is_empty()), Some(key), problem)
    }

    /// The line, from 1, of `key` in the table that spans `table`; of the table where it has no such key.
    pub fn line_of(&self, table: Range<usize>, key: &str) -> usize {
        self.line(self.key_in(&table, key).unwrap_or(table).start)
    }

    fn key_in(&self, table: &Range<usize>, key: &str) -> Option<Range<usize>> {
        let root = DeTable::parse(self.text).ok()?;
        let keys = table_at(root.get_ref(), table)?;
        keys.iter().find(|(k, _)| k.get_ref() == key).map(|(k, _)| k.span())
    }

    /// An error that something else was expected at `key` of the table that spans `table`.
    pub fn refused(&self, table: Range<usize>, key: &str, found: &str, expected: impl Into<String>) -> FileError {
        self.about(table, key, Problem::Unexpected { found: found.to_owned(), expected: expected.into() })
    }

    /// An error that `key` is missing in the table that spans `table`; an empty span is the top.
    pub fn missing(&self, table: Range<usize>, key: &str, expected: impl Into<String>) -> FileError {
        let root = DeTable::parse(self.text).ok();
        let entry = root.as_ref().filter(|_| !table.is_empty()).and_then(|r| find(r.get_ref(), &table, &mut Vec::new()));
        let name = entry.map_or_else(String::new, |e| named(&e.path, e.key));
        let problem = Problem::MissingKey { table: name, expected: expected.into() };
        self.error(Some(table).filter(|at| !at.is_empty()), Some(key), problem)
    }

    /// An error that nobody reads `key`, which spans `at`.
    pub fn unknown(&self, at: Range<usize>, key: &str, known: &[&str]) -> FileError {
        let root = DeTable::parse(self.text).ok();
        let entry = root.as_ref().and_then(|r| find(r.get_ref(), &at, &mut Vec::new()));
        // The first in the file, for a table's own order is another.
        let first = entry.as_ref().and_then(|e| {
            let unknown = e.siblings.keys().filter(|k| !known.contains(&k.get_ref().as_ref()));
            unknown.min_by_key(|k| k.span().start)
        });
        let (at, key) = first.map_or((at, key), |k| (k.span(), k.get_ref().as_ref()));
        let table = entry.as_ref().map_or_else(String::new, |e| e.path.join("."));
        let nearest = nearest(key, known.iter().copied()).map(str::to_owned);
        let known = known.iter().map(|k| (*k).to_owned()).collect();
        self.error(Some(at), Some(key), Problem::UnknownKey { table, nearest, known })
    }

    /// An error about numbers that do not fit each other: at the key of the quantity's name, where one has it.
    pub fn value(&self, e: ModelError) -> FileError {
        let root = DeTable::parse(self.text).ok();
        let name = if let ModelError::OutOfBounds { quantity, .. } = e { quantity } else { "" };
        let at = root.as_ref().and_then(|r| key_named(r.get_ref(), name));
        self.error(at.clone(), at.map(|_| name), Problem::Value(e))
    }

    /// A number within `bound`.
    ///
    /// # Errors
    /// No number, or outside the bound.
    pub fn number(&self, value: &Spanned<toml::Value>, key: &'static str, bound: Bound) -> Result<f64, FileError> {
        let x = value.get_ref().as_float().or_else(|| value.get_ref().as_integer().map(|x| x as f64));
        let x = x.ok_or_else(|| self.unexpected(value.span(), None, format!("a number, {bound}")))?;
        bound.check(key, x).map_err(|e| self.error(Some(value.span()), Some(key), Problem::Value(e)))?;
        Ok(x)
    }

    fn error(&self, at: Option<Range<usize>>, key: Option<&str>, problem: Problem) -> FileError {
        FileError::new(self.label, at.map(|at| self.line(at.start)), key, problem)
    }

    /// What serde says, in our words. Its sentences are the only form in which it says them.
    fn explain(&self, e: &toml::de::Error) -> FileError {
        if let Some(reason) = self.kind.and_then(|kind| kind.mistaken(self.text)) {
            return self.error(None, None, Problem::Syntax { reason });
        }
        let (message, at) = (e.message().trim(), e.span().unwrap_or_default());
        let Ok(root) = DeTable::parse(self.text) else {
            let line = self.text.lines().nth(self.line(at.start) - 1).unwrap_or_default();
            let reason = match slip(line) {
                Some(slip) => format!("not TOML: {slip}"),
                None => format!("not TOML: {}", message.replace('\n', ", ")),
            };
            return self.error(e.span(), None, Problem::Syntax { reason });
        };
        let named_in = |text: &str| text.split('`').nth(1).unwrap_or_default().to_owned();
        let (head, expected) = message.rsplit_once(", expected ").unwrap_or((message, ""));
        if let Some(rest) = message.strip_prefix("missing field ") {
            let key = named_in(rest);
            let table = find(root.get_ref(), &at, &mut Vec::new()).map_or("", |e| e.key);
            let meant = |k: &str| k == key || k.split_once('.') == Some((table, &key));
            let hint = self.hints.iter().find(|(k, _)| meant(k)).map_or("give it", |(_, hint)| hint);
            return self.missing(at, &key, hint);
        }
        let words: Vec<&str> = expected.split('`').skip(1).step_by(2).collect();
        if head.starts_with("unknown field ") {
            return self.unknown(at, &named_in(head), &words);
        }
        if head.starts_with("unknown variant ") {
            return self.unexpected(at, None, format!("one of \"{}\"", words.join("\", \"")));
        }
        if let Some(found) = head.strip_prefix("is ") {
            return self.unexpected(at, Some(found), expected);
        }
        if message == "wanted string or table" {
            return self.unexpected(at, None, "text in quotes");
        }
        let entry = find(root.get_ref(), &at, &mut Vec::new());
        if head.starts_with("invalid ") {
            let table =
                || entry.as_ref().map_or_else(|| "a table".to_owned(), |e| format!("a table: [{}]", named(&e.path, e.key)));
            let expected = match expected {
                "a string" => "text in quotes".to_owned(),
                "a boolean" => "true or false".to_owned(),
                "a sequence" => "a list".to_owned(),
                "f64" => "a number".to_owned(),
                "a map" => table(),
                _ if expected.starts_with("struct ") => table(),
                _ => expected.to_owned(),
            };
            return self.unexpected(at, None, expected);
        }
        let key = entry.map(|e| e.key);
        let reason =
            if message.starts_with("= ") { format!("{} {message}", key.unwrap_or_default()) } else { message.to_owned() };
        self.error(e.span(), key, Problem::Syntax { reason })
    }
}

/// The innermost entry whose key, or whose value, spans `at`.
fn find<'t>(table: &'t DeTable<'t>, at: &Range<usize>, path: &mut Vec<&'t str>) -> Option<Entry<'t>> {
    for (k, v) in table {
        path.push(k.get_ref().as_ref());
        let deeper = tables(v.get_ref()).find_map(|t| find(t, at, path));
        path.pop();
        if deeper.is_some() {
            return deeper;
        }
        let covers = v.span().start <= at.start && at.end <= v.span().end;
        if k.span() == *at || covers {
            return Some(Entry { path: path.clone(), siblings: table, key: k.get_ref().as_ref(), value: v });
        }
    }
    None
}

/// The tables within a value.
fn tables<'t>(value: &'t DeValue<'t>) -> Box<dyn Iterator<Item = &'t DeTable<'t>> + 't> {
    match value {
        DeValue::Table(t) => Box::new(std::iter::once(t)),
        DeValue::Array(list) => Box::new(list.iter().flat_map(|x| tables(x.get_ref()))),
        _ => Box::new(std::iter::empty()),
    }
}

/// The table that spans `at`; an empty span is the top.
fn table_at<'t>(top: &'t DeTable<'t>, at: &Range<usize>) -> Option<&'t DeTable<'t>> {
    if at.is_empty() {
        return Some(top);
    }
    match find(top, at, &mut Vec::new())?.value.get_ref() {
        DeValue::Table(t) => Some(t),
        _ => None,
    }
}

fn key_named(table: &DeTable<'_>, name: &str) -> Option<Range<usize>> {
    let here = table.keys().find(|k| k.get_ref() == name).map(Spanned::span);
    here.or_else(|| table.values().flat_map(|v| tables(v.get_ref())).find_map(|t| key_named(t, name)))
}

fn named(path: &[&str], key: &str) -> String {
    path.iter().copied().chain([key]).collect::<Vec<_>>().join(".")
}

/// A value in words; of a list, the element that spans `at`.
fn described(value: &Spanned<DeValue<'_>>, at: &Range<usize>) -> String {
    match value.get_ref() {
        DeValue::String(s) => format!("the text \"{s}\""),
        DeValue::Integer(i) => i.to_string(),
        DeValue::Float(f) => f.to_string(),
        DeValue::Boolean(b) => b.to_string(),
        DeValue::Datetime(d) => d.to_string(),
        DeValue::Table(_) => "a table".to_owned(),
        DeValue::Array(list) => {
            let inside = |x: &&Spanned<DeValue<'_>>| x.span().start <= at.start && at.end <= x.span().end;
            match list.iter().find(inside) {
                Some(x) => format!("a list with {} in it", described(x, at)),
                None => "a list".to_owned(),
            }
        }
    }
}

/// A number within a bound, from a field of a type that has it.
fn bounded<'de, D: Deserializer<'de>>(from: D, bound: Bound) -> Result<f64, D::Error> {
    struct Bounded(Bound);
    impl Visitor<'_> for Bounded {
        type Value = f64;
        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            write!(f, "a number, {}", self.0)
        }
        fn visit_f64<E: Error>(self, x: f64) -> Result<f64, E> {
            self.0.check("", x).map(|()| x).map_err(|e| E::custom(e.to_string().trim_start()))
        }
        fn visit_i64<E: Error>(self, x: i64) -> Result<f64, E> {
            self.visit_f64(x as f64)
        }
        fn visit_u64<E: Error>(self, x: u64) -> Result<f64, E> {
            self.visit_f64(x as f64)
        }
    }
    from.deserialize_f64(Bounded(bound))
}

/// A positive number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Positive(pub f64);

/// A number from zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NotNegative(pub f64);

/// A number within a closed range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Within<const LOW: i64, const HIGH: i64>(pub f64);

/// A whole number within a closed range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Whole<const LOW: u64, const HIGH: u64>(pub u64);

impl<'de> Deserialize<'de> for Positive {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        bounded(from, Bound::Positive).map(Self)
    }
}

impl<'de> Deserialize<'de> for NotNegative {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        bounded(from, Bound::NotNegative).map(Self)
    }
}

impl<'de, const LOW: i64, const HIGH: i64> Deserialize<'de> for Within<LOW, HIGH> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        bounded(from, Bound::Within(LOW as f64, HIGH as f64)).map(Self)
    }
}

impl<'de, const LOW: u64, const HIGH: u64> Deserialize<'de> for Whole<LOW, HIGH> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct InRange<const LOW: u64, const HIGH: u64>;
        impl<const LOW: u64, const HIGH: u64> Visitor<'_> for InRange<LOW, HIGH> {
            type Value = u64;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "a whole number from {LOW} to {HIGH}")
            }
            fn visit_i64<E: Error>(self, x: i64) -> Result<u64, E> {
                let fits = u64::try_from(x).ok().filter(|x| (LOW..=HIGH).contains(x));
                fits.ok_or_else(|| E::invalid_value(serde::de::Unexpected::Signed(x), &self))
            }
        }
        from.deserialize_u64(InRange::<LOW, HIGH>).map(Self)
    }
}

/// The candidate that `word` is most likely a slip of, if any is like it: a third of the longer one may be wrong.
pub fn nearest<'k>(word: &str, candidates: impl Iterator<Item = &'k str>) -> Option<&'k str> {
    candidates
        .map(|c| (strsim::levenshtein(word, c), c))
        .filter(|(d, c)| *d <= word.chars().count().max(c.chars().count()) / 3)
        .min_by_key(|(d, _)| *d)
        .map(|(_, c)| c)
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

/// What is probably meant by a line that is no TOML.
fn slip(line: &str) -> Option<String> {
    let Some((key, value)) = line.split_once('=') else {
        let columns = line.split([',', ';', '\t']).count();
        return (columns > 2).then(|| {
            format!("expected key = value, and this line has {columns} columns; is a recording or a table given in the place of this file?")
        });
    };
    let value = value.split('#').next().unwrap_or_default().trim();
    let (whole, part) = value.split_once(',').unwrap_or((value, ""));
    let digits = |s: &str| !s.is_empty() && s.bytes().all(|b| b.is_ascii_digit());
    if digits(whole.trim_start_matches(['-', '+'])) && digits(part) {
        return Some(format!("{value} has a comma; numbers have a decimal point: {whole}.{part}"));
    }
    let word = value.starts_with(char::is_alphabetic) && !["true", "false", "inf", "nan"].contains(&value);
    word.then(|| format!("{} is {value}; a text stands in quotes, \"{value}\", and a number is written in digits", key.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct File {
        head: Spanned<Head>,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Head {
        name: Option<String>,
        on: Option<bool>,
        kind: Option<Kind>,
        size: Option<Positive>,
        angle: Option<Within<-1, 1>>,
        pairs: Option<Whole<1, 100>>,
        list: Option<Vec<NotNegative>>,
        inner: Option<Box<Head>>,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Kind {
        FirstOne,
        Second,
    }

    fn message(text: &str) -> String {
        TomlText::new(text, "f.toml", &[("head", "write [head]")]).read::<File>().unwrap_err().to_string()
    }

    #[test]
    fn every_misfit_is_said_with_line_key_and_what_was_expected() {
        for (text, expected) in [
            ("", "f.toml: head is missing at the top of the file: write [head]"),
            ("head = 3", "f.toml:1: head is 3, expected a table: [head]"),
            ("[head]\nname = 2", "f.toml:2: name is 2, expected text in quotes"),
            ("[head]\non = 2", "f.toml:2: on is 2, expected true or false"),
            ("[head]\nkind = \"third\"", "f.toml:2: kind is the text \"third\", expected one of \"first_one\", \"second\""),
            ("[head]\nkind = 1", "f.toml:2: kind is 1, expected text in quotes"),
            ("[head]\nsize = -1", "f.toml:2: size = -1 must be positive and finite"),
            ("[head]\nsize = nan", "f.toml:2: size = NaN must be positive and finite"),
            ("[head]\nsize = \"1\"", "f.toml:2: size is the text \"1\", expected a number, positive and finite"),
            ("[head]\nangle = 1.5", "f.toml:2: angle = 1.5 must be from -1 to 1"),
            ("[head]\npairs = 2.5", "f.toml:2: pairs is 2.5, expected a whole number from 1 to 100"),
            ("[head]\npairs = -2", "f.toml:2: pairs is -2, expected a whole number from 1 to 100"),
            (
                "[head]\n\nlist = [1,\n2, true]",
                "f.toml:4: list is a list with true in it, expected a number, zero or positive, and finite",
            ),
            ("[head]\nsise = 1\nunknown = 2", "f.toml:2: unknown key sise in [head]; did you mean size?"),
            ("[head.inner]\nsise = 1", "f.toml:2: unknown key sise in [head.inner]; did you mean size?"),
            ("[head]\ninner = { pair = 1 }", "f.toml:2: unknown key pair in [head.inner]; did you mean pairs?"),
            ("[hed]", "f.toml:1: unknown key hed at the top of the file; did you mean head?"),
            ("[head]\na, b", "f.toml:2: not TOML: "),
            ("[head]\npairs = two", "f.toml:2: not TOML: pairs is two; a text stands in quotes, \"two\", and a number is"),
            ("[head]\nsize = 2,5", "f.toml:2: not TOML: 2,5 has a comma; numbers have a decimal point: 2.5"),
            ("t,u,i\n0,1,2", "f.toml:1: not TOML: expected key = value, and this line has 3 columns; is a recording or a table"),
        ] {
            let said = message(text);
            assert!(said.starts_with(expected), "{text}: {said}");
        }
    }

    #[test]
    fn what_is_like_nothing_is_like_nothing() {
        let keys = ["inertia_kg_m2", "pole_pairs", "flux"];
        let near = |word: &str| nearest(word, keys.iter().copied());
        assert_eq!(
            [near("pole_pair"), near("polepares"), near("flax"), near("fl"), near("")],
            [Some("pole_pairs"), Some("pole_pairs"), Some("flux"), None, None]
        );
    }

    proptest::proptest! {
        /// Whatever the text: an error has a line of the file, or none.
        #[test]
        fn any_text_is_read_or_refused_at_one_of_its_lines(text in "[\\[\\]a-z=\"'{}0-9.,\n ]{0,60}") {
            if let Err(e) = TomlText::new(&text, "f", &[]).read::<File>() {
                proptest::prop_assert!(e.line.is_none_or(|l| l >= 1 && l <= 1 + text.matches('\n').count()), "{}", e);
            }
        }
    }
}
