//! A channel (or group, or the file) of TDMS: where its values stand, its properties, and what they make of the values.

use std::collections::HashMap;

use super::{FORMAT, invalid};
use crate::FormatError;
use crate::cursor::Cursor;
use crate::numbers::Number;

const TEXT: u32 = 0x20;
const TRUTH: u32 = 0x21;
const TIME: u32 = 0x44;

fn number(kind: u32) -> Option<Number> {
    Some(match kind {
        1 => Number::I8,
        2 => Number::I16,
        3 => Number::I32,
        4 => Number::I64,
        5 | TRUTH => Number::U8,
        6 => Number::U16,
        7 => Number::U32,
        8 => Number::U64,
        9 | 0x19 => Number::F32,
        10 | 0x1a => Number::F64,
        _ => return None,
    })
}

fn size_of(kind: u32) -> Option<usize> {
    match kind {
        0 => Some(0),
        TIME => Some(16),
        0x08_000c => Some(8),
        0x10_000d => Some(16),
        _ => number(kind).map(Number::size),
    }
}

/// What a channel has in a chunk.
#[derive(Clone, Copy)]
pub(super) struct Index {
    kind: u32,
    pub bytes: usize,
}

impl Index {
    /// The index of an object; `None` where it has no data in this segment.
    pub fn read(c: &mut Cursor<'_>, before: Option<Self>) -> Result<Option<Self>, FormatError> {
        const NONE: u32 = u32::MAX;
        const AS_BEFORE: u32 = 0;
        const DAQMX: [u32; 2] = [0x1269, 0x1369];
        match c.u32("the index of a channel")? {
            NONE => return Ok(None),
            AS_BEFORE => return before.map(Some).ok_or_else(|| invalid("a channel goes on that has not begun".to_owned())),
            n if DAQMX.contains(&n) || DAQMX.contains(&n.swap_bytes()) || n == 0x126a => {
                let found = "with raw data of DAQmx, which is not scaled".to_owned();
                let remedy = "save it scaled, for example with npTDMS: TdmsWriter and channel[:]";
                return Err(FormatError::Unsupported { format: FORMAT, found, remedy });
            }
            _ => {}
        }
        let kind = c.u32("the type of a channel")?;
        c.take(4, "the dimension of a channel")?;
        let count = c.size("the number of values")?;
        let bytes = match (kind, size_of(kind)) {
            (TEXT, _) => Some(c.size("the length of texts")?),
            (_, Some(size)) => count.checked_mul(size),
            _ => return Err(invalid(format!("a channel of the unknown type {kind}"))),
        };
        let bytes = bytes.ok_or_else(|| invalid(format!("a channel of {count} values in a chunk")))?;
        Ok(Some(Self { kind, bytes }))
    }

    /// Of one value; texts, which are not read, have none.
    pub fn size(self) -> usize {
        size_of(self.kind).unwrap_or(0)
    }
}

/// The value of a property, as far as it means something here.
pub(super) enum Property {
    Number(f64),
    Text(String),
    /// Seconds since 1904 and what goes beyond, s.
    Time(i64, f64),
}

/// A text with its length before it.
pub(super) fn text(c: &mut Cursor<'_>) -> Result<String, FormatError> {
    let n = c.u32("the length of a text")? as usize;
    Ok(String::from_utf8_lossy(c.take(n, "a text")?).into_owned())
}

/// Seconds since 1904, and the share of the next.
fn time(bytes: &[u8], big_endian: bool) -> (i64, f64) {
    let mut c = Cursor { big_endian, ..Cursor::new(bytes, FORMAT) };
    let mut next = || c.u64("a time").unwrap_or(0);
    let (first, second) = (next(), next());
    let (seconds, share) = if big_endian { (first, second) } else { (second, first) };
    (seconds as i64, share as f64 / 2_f64.powi(64))
}

impl Property {
    pub fn read(c: &mut Cursor<'_>) -> Result<Self, FormatError> {
        let kind = c.u32("the type of a property")?;
        if kind == TEXT {
            return text(c).map(Self::Text);
        }
        let size = size_of(kind).ok_or_else(|| invalid(format!("a property of the unknown type {kind}")))?;
        let bytes = c.take(size, "a property")?;
        if kind == TIME {
            let (seconds, share) = time(bytes, c.big_endian);
            return Ok(Self::Time(seconds, share));
        }
        Ok(Self::Number(number(kind).and_then(|n| n.all(bytes, c.big_endian).next()).unwrap_or(f64::NAN)))
    }
}

/// The names in a path: `/'group'/'channel'`, a quote in a name doubled.
pub(super) fn path(text: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find('\'') {
        let mut name = String::new();
        rest = &rest[start + 1..];
        loop {
            let (before, after) = rest.split_once('\'').unwrap_or((rest, ""));
            name += before;
            rest = after;
            match rest.strip_prefix('\'') {
                Some(after) => {
                    name.push('\'');
                    rest = after;
                }
                None => break,
            }
        }
        names.push(name);
    }
    names
}

pub(super) struct Object {
    pub path: Vec<String>,
    pub index: Option<Index>,
    pub properties: HashMap<String, Property>,
    values: Vec<f64>,
    times: Vec<(i64, f64)>,
}

impl Object {
    pub fn new(path: Vec<String>) -> Self {
        Self { path, index: None, properties: HashMap::new(), values: Vec::new(), times: Vec::new() }
    }

    /// Appends the values in pieces of the data.
    pub fn extend<'a>(&mut self, pieces: impl Iterator<Item = &'a [u8]>, big_endian: bool) {
        let Some(index) = self.index else { return };
        for piece in pieces {
            match number(index.kind) {
                Some(number) => self.values.extend(number.all(piece, big_endian)),
                None if index.kind == TIME => self.times.extend(piece.chunks_exact(16).map(|b| time(b, big_endian))),
                None => {}
            }
        }
    }

    fn number(&self, name: &str) -> Option<f64> {
        match self.properties.get(name) {
            Some(Property::Number(x)) => Some(*x),
            _ => None,
        }
    }

    fn text(&self, name: &str) -> Option<&str> {
        match self.properties.get(name) {
            Some(Property::Text(t)) => Some(t),
            _ => None,
        }
    }

    pub fn unit(&self) -> &str {
        self.text("unit_string").or_else(|| self.text("NI_UnitDescription")).unwrap_or("")
    }

    /// Of the time between its values, s.
    pub fn increment(&self) -> Option<f64> {
        self.number("wf_increment").filter(|x| *x > 0.0 && x.is_finite())
    }

    pub fn offset(&self) -> f64 {
        self.number("wf_start_offset").filter(|x| x.is_finite()).unwrap_or(0.0)
    }

    pub fn first_second(&self) -> Option<i64> {
        match self.properties.get("wf_start_time") {
            Some(Property::Time(seconds, _)) => Some(*seconds),
            _ => self.times.first().map(|t| t.0),
        }
    }

    /// Of its first value, s from `origin`.
    pub fn start(&self, origin: i64) -> Option<f64> {
        match self.properties.get("wf_start_time") {
            Some(Property::Time(seconds, share)) => Some(seconds.wrapping_sub(origin) as f64 + share),
            _ => None,
        }
    }

    /// Its values, scaled where the file says so; or why there are none.
    pub fn quantity(&mut self, origin: i64) -> Result<Vec<f64>, &'static str> {
        if !self.times.is_empty() {
            return Ok(self.times.iter().map(|(s, share)| s.wrapping_sub(origin) as f64 + share).collect());
        }
        if self.index.is_some_and(|i| i.bytes > 0 && number(i.kind).is_none()) {
            return Err("no real numbers");
        }
        let mut values = std::mem::take(&mut self.values);
        let scaled = self.text("NI_Scaling_Status") == Some("scaled");
        let scales = self.number("NI_Number_Of_Scales").filter(|_| !scaled).unwrap_or(0.0) as usize;
        // The last is applied to the outcome of the one that it names, here always the one before.
        for k in 0..scales.min(self.properties.len()) {
            let of = |what: &str| format!("NI_Scale[{k}]_{what}");
            let source = self.properties.iter().find(|(name, _)| name.starts_with(&of("")) && name.ends_with("_Input_Source"));
            match source {
                Some((_, Property::Number(s))) if k == 0 && *s as u32 == u32::MAX => {}
                Some((_, Property::Number(s))) if k > 0 && *s as usize == k - 1 => {}
                None if k == 0 => {}
                _ => return Err("scaled from more than one source"),
            }
            let coefficients = match self.text(&of("Scale_Type")) {
                Some("Linear") => vec![self.number(&of("Linear_Y_Intercept")), self.number(&of("Linear_Slope"))],
                Some("Polynomial") => {
                    let n = self.number(&of("Polynomial_Coefficients_Size")).unwrap_or(4.0) as usize;
                    (0..n.min(16)).map(|c| self.number(&format!("NI_Scale[{k}]_Polynomial_Coefficients[{c}]"))).collect()
                }
                _ => return Err("scaled by other means than a polynomial"),
            };
            let polynomial: Option<Vec<f64>> = coefficients.into_iter().collect();
            let polynomial = polynomial.ok_or("scaled without coefficients")?;
            values.iter_mut().for_each(|x| *x = polynomial.iter().rev().fold(0.0, |sum, c| sum * *x + c));
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_with_slashes_and_quotes() {
        assert_eq!(path("/'Motor 1'/'u/a'"), ["Motor 1", "u/a"]);
        assert_eq!(path("/'it''s'/''"), ["it's", ""]);
        assert!(path("/").is_empty());
    }
}
