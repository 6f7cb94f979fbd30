//! Gains from a file that `im design` wrote, or those one starts from.

use im_model::MotorFile;
use std::path::{Path, PathBuf};

use im_observers::{Gains, Named, ObserverError};

use crate::failure::Failure;

/// Either the file is not as it should be, or the observer refuses what it says.
pub enum Refused {
    File(Failure),
    Observer(ObserverError),
}

impl Refused {
    pub fn or(self, told: impl Fn(ObserverError) -> Failure) -> Failure {
        match self {
            Self::File(e) => e,
            Self::Observer(e) => told(e),
        }
    }
}

impl From<ObserverError> for Refused {
    fn from(e: ObserverError) -> Self {
        Self::Observer(e)
    }
}

impl From<Failure> for Refused {
    fn from(e: Failure) -> Self {
        Self::File(e)
    }
}

/// A file's tables, or none.
pub struct GainsFile {
    file: Option<(PathBuf, toml::Table)>,
    /// That its gains were proven for another machine, if they were.
    pub other_machine: Option<String>,
}

impl GainsFile {
    pub fn of(path: Option<&Path>, motor: &MotorFile) -> Result<Self, Failure> {
        let Some(path) = path else { return Ok(Self { file: None, other_machine: None }) };
        let named = |what: String| Failure::Input(format!("{}: {what}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|e| named(format!("cannot be read: {e}")))?;
        let syntax = |e: toml::de::Error| {
            let line = e.span().map_or(String::new(), |s| format!(":{}", 1 + text[..s.start].matches('\n').count()));
            Failure::Input(format!("{}{line}: {}", path.display(), e.message()))
        };
        let table = text.parse::<toml::Table>().map_err(syntax)?;
        let (table, other_machine) = match table.contains_key("design") {
            true => proven(&text, motor).map_err(named)?,
            false => (table, None),
        };
        let other_machine = other_machine.map(|what| format!("{}: gains {what}", path.display()));
        Ok(Self { file: Some((path.to_owned(), table)), other_machine })
    }

    /// What the file has for an observer that samples at this time, s.
    pub fn of_observer<O: Named<f64>>(&self, sample_time_s: f64, load_coefficient: Option<f64>) -> Result<Found<'_>, Failure> {
        let Some((path, tables)) = &self.file else { return Ok(Found { table: None, load_coefficient }) };
        let wrong = |what: String| Failure::Input(format!("{}: {what}", path.display()));
        if O::TABLES.is_empty() {
            return Err(wrong(format!("the {} has no gains; leave out --gains", O::TITLE)));
        }
        let found = O::TABLES.iter().find_map(|name| Some((*name, tables.get(*name)?.as_table()?)));
        let (name, values) = found.ok_or_else(|| {
            let present: Vec<&str> = tables.keys().map(String::as_str).collect();
            wrong(format!("[{}] is missing; the file has {}", O::TABLES.join("] or ["), present.join(", ")))
        })?;
        let table = Table { path, name, values };
        if name.starts_with("sampled") {
            table.is_for(sample_time_s)?;
        }
        Ok(Found { table: Some(table), load_coefficient })
    }
}

/// A table of a file, if there is one, and what the command line says beside it.
pub struct Found<'a> {
    table: Option<Table<'a>>,
    load_coefficient: Option<f64>,
}

impl Found<'_> {
    fn wrong<T>(&self, key: &str, expected: &str) -> Result<T, Refused> {
        let place = self.table.as_ref().map_or_else(String::new, |t| format!("{}: {key} of [{}]", t.path.display(), t.name));
        Err(Failure::Input(format!("{place} must be {expected}")).into())
    }

    fn get(&self, key: &str) -> Option<&toml::Value> {
        self.table.as_ref()?.values.get(key)
    }
}

impl Gains for Found<'_> {
    type Error = Refused;

    fn table(&self) -> Option<&str> {
        self.table.as_ref().map(|t| t.name)
    }

    fn number(&self, key: &str) -> Result<Option<f64>, Refused> {
        if let ("load_coefficient_nm_s_per_rad", Some(given)) = (key, self.load_coefficient) {
            return Ok(Some(given));
        }
        match self.get(key) {
            None => Ok(None),
            Some(v) => float(v).map_or_else(|| self.wrong(key, "a number"), |x| Ok(Some(x))),
        }
    }

    fn needed(&self, key: &str) -> Result<f64, Refused> {
        self.number(key)?.map_or_else(|| self.wrong(key, "given: a number"), Ok)
    }

    fn range(&self, key: &str) -> Result<[f64; 2], Refused> {
        self.get(key).and_then(pair).map_or_else(|| self.wrong(key, "two numbers, [lower, upper]"), Ok)
    }

    fn rows<const R: usize>(&self, key: &str) -> Result<[[f64; 2]; R], Refused> {
        let rows = |v: &toml::Value| v.as_array()?.iter().map(pair).collect::<Option<Vec<_>>>()?.try_into().ok();
        self.get(key).and_then(rows).map_or_else(|| self.wrong(key, &format!("{R} rows of two numbers")), Ok)
    }
}

/// Gains with, where their proof is about another machine, a sentence that says so.
type Proven = (toml::Table, Option<String>);

/// The gains of a file that `im design` wrote, whose proof is checked first.
#[cfg(feature = "design")]
fn proven(text: &str, motor: &MotorFile) -> Result<Proven, String> {
    let (certificate, _) = im_design::Certificate::check_text(text).map_err(|e| format!("refused: {e}"))?;
    let differences = certificate.differences(&motor.machine).map_err(|e| format!("refused: {e}"))?;
    let set = im_design::gains::GainSet::from(&certificate.design).to_toml();
    let table = set.parse::<toml::Table>().map_err(|e| e.message().to_owned())?;
    let other = || crate::commands::design::other_machine(&certificate, motor, &differences);
    Ok((table, (!differences.is_empty()).then(other)))
}

#[cfg(not(feature = "design"))]
fn proven(_: &str, _: &MotorFile) -> Result<Proven, String> {
    Err("holds gains with their proof, which this build cannot check: it was made without the feature `design`".into())
}

/// A table with its place, for messages.
struct Table<'a> {
    path: &'a Path,
    name: &'static str,
    values: &'a toml::Table,
}

impl Table<'_> {
    /// Gains proven for forward Euler are proven for one period.
    fn is_for(&self, sample_time_s: f64) -> Result<(), Failure> {
        match self.values.get("period_s").and_then(float).filter(|h| (h / sample_time_s - 1.0).abs() > 1e-3) {
            Some(h) => Err(Failure::Input(format!(
                "{}: proven for a sampling period of {h} s, the recording's is {sample_time_s} s; design for that with --period {sample_time_s}",
                self.path.display()
            ))),
            None => Ok(()),
        }
    }
}

fn float(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|x| x as f64))
}

fn pair(value: &toml::Value) -> Option<[f64; 2]> {
    value.as_array()?.iter().map(float).collect::<Option<Vec<_>>>()?.try_into().ok()
}
