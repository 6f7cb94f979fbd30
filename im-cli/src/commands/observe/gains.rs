//! Gains from a file that `im design` wrote, or those one starts from.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use im_model::toml_text::TomlText;
use im_model::{FileKind, ModelError, MotorFile, read_text};
use im_observers::{Gains, Named, ObserverError};
use toml::Spanned;

use crate::failure::Failure;
use crate::terminal::rounded;

/// Either the file is not as it should be, or the observer refuses what it says.
pub enum Refused {
    File(Failure),
    Observer(ObserverError),
}

impl Refused {
    pub fn or(self, refused: impl Fn(ObserverError) -> Failure) -> Failure {
        match self {
            Self::File(e) => e,
            Self::Observer(e) => refused(e),
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
    file: Option<Tables>,
    /// That its gains were proven for another machine, if they were.
    pub other_machine: Option<String>,
}

struct Tables {
    path: PathBuf,
    text: String,
    tables: BTreeMap<String, Spanned<toml::Value>>,
    /// Whether the text is that of the file, and not of gains taken out of a certificate: its lines are those of the file.
    as_written: bool,
}

impl GainsFile {
    pub fn of(path: Option<&Path>, motor: &MotorFile) -> Result<Self, Failure> {
        let Some(path) = path else { return Ok(Self { file: None, other_machine: None }) };
        let label = path.display().to_string();
        let read = |text: &str| TomlText::new(text, &label, &[]).read::<BTreeMap<String, Spanned<toml::Value>>>();
        let mut text = read_text(path)?;
        if let Some(reason) = FileKind::Certificate.mistaken(&text) {
            return Err(Failure::Input(format!("{label}: {reason}")));
        }
        let mut tables = read(&text)?;
        let mut other_machine = None;
        let as_written = !tables.contains_key("design");
        if !as_written {
            let refused = |what| Failure::Input(format!("{label}: {what}"));
            (text, other_machine) = proven(&text, motor).map_err(refused)?;
            tables = read(&text)?;
        }
        let other_machine = other_machine.map(|what| format!("{label}: gains {what}"));
        Ok(Self { file: Some(Tables { path: path.to_owned(), text, tables, as_written }), other_machine })
    }

    /// What the file has for an observer that samples at this time, s.
    pub fn of_observer<O: Named<f64>>(&self, sample_time_s: f64, load_coefficient: Option<f64>) -> Result<Found<'_>, Failure> {
        let Some(file) = &self.file else { return Ok(Found { table: None, load_coefficient, added: RefCell::default() }) };
        let wrong = |what: String| Failure::Input(format!("{}: {what}", file.path.display()));
        if O::TABLES.is_empty() {
            return Err(wrong(format!("the {} has no gains; leave out --gains", O::TITLE)));
        }
        let found = O::TABLES.iter().find_map(|name| {
            let table = file.tables.get(*name)?;
            Some(Table { file, name, at: table.span(), values: table.get_ref().as_table()? })
        });
        let table = found.ok_or_else(|| {
            let present: Vec<&str> = file.tables.keys().map(String::as_str).collect();
            wrong(format!("[{}] is missing; the file has {}", O::TABLES.join("] or ["), present.join(", ")))
        })?;
        if table.name.starts_with("sampled") {
            table.is_for(sample_time_s)?;
        }
        Ok(Found { table: Some(table), load_coefficient, added: RefCell::default() })
    }
}

/// A table of a file, if there is one, and what the command line says beside it.
pub struct Found<'a> {
    table: Option<Table<'a>>,
    load_coefficient: Option<f64>,
    added: RefCell<Vec<(&'static str, f64)>>,
}

impl Found<'_> {
    /// What the observer took beside the file, which has no such keys; what is zero is off.
    pub fn added<O: Named<f64>>(self) -> Added {
        let table = self.table.as_ref();
        let gains = if table.is_some() { self.added.into_inner() } else { Vec::new() };
        Added { gains, of_the_proof: table.filter(|t| !t.file.as_written).map(|_| O::BESIDE_THE_PROOF) }
    }

    /// What the observer says of a gain, with the line where the gain stands; of what stands nowhere, as the observer says it.
    pub fn refused(&self, e: ObserverError) -> Refused {
        let key = match e {
            ObserverError::Value(ModelError::OutOfBounds { quantity, .. }) => Some(quantity),
            ObserverError::NotRotationInvariant { name, .. } => Some(name),
            // The gains together: at their table.
            ObserverError::StepTooLong { .. } => None,
            ObserverError::Value(_) => return e.into(),
        };
        match &self.table {
            Some(t) if t.file.as_written && key.is_none_or(|key| t.values.contains_key(key)) => {
                let line = key
                    .map_or_else(|| t.toml(|toml| toml.line(t.at.start)), |key| t.toml(|toml| toml.line_of(t.at.clone(), key)));
                Failure::Input(format!("{}:{line}: {e}", t.file.path.display())).into()
            }
            _ => e.into(),
        }
    }

    /// What `read` makes of a key's value, if it is there.
    fn get<T>(&self, key: &str, expected: &str, read: impl Fn(&toml::Value) -> Option<T>) -> Result<Option<T>, Refused> {
        let Some((table, value)) = self.table.as_ref().and_then(|t| Some((t, t.values.get(key)?))) else { return Ok(None) };
        let wrong = |toml: TomlText<'_>| toml.refused(table.at.clone(), key, &value.to_string(), expected);
        read(value).map(Some).ok_or_else(|| table.fail(wrong))
    }

    fn need<T>(&self, key: &str, expected: &str, read: impl Fn(&toml::Value) -> Option<T>) -> Result<T, Refused> {
        let missing = || match &self.table {
            Some(t) => t.fail(|toml| toml.missing(t.at.clone(), key, expected)),
            None => Failure::Input(format!("{key} is missing: {expected}")).into(),
        };
        self.get(key, expected, read)?.ok_or_else(missing)
    }
}

impl Gains for Found<'_> {
    type Error = Refused;

    fn table(&self) -> Option<&str> {
        self.table.as_ref().map(|t| t.name)
    }

    fn number(&self, key: &str) -> Result<Option<f64>, Refused> {
        match (key, self.load_coefficient) {
            ("load_coefficient_nm_s_per_rad", Some(given)) => Ok(Some(given)),
            _ => self.get(key, "a finite number", float),
        }
    }

    fn note_usual(&self, key: &'static str, usual: f64) {
        self.added.borrow_mut().push((key, usual));
    }

    fn needed(&self, key: &str) -> Result<f64, Refused> {
        self.need(key, "a finite number", float)
    }

    fn range(&self, key: &str) -> Result<[f64; 2], Refused> {
        self.need(key, "two numbers, [lower, upper]", pair)
    }

    fn rows<const R: usize>(&self, key: &str) -> Result<[[f64; 2]; R], Refused> {
        let rows = |v: &toml::Value| v.as_array()?.iter().map(pair).collect::<Option<Vec<_>>>()?.try_into().ok();
        self.need(key, &format!("{R} rows of two numbers"), rows)
    }
}

/// Gains that an observer starts from, taken where the file has none.
pub struct Added {
    pub gains: Vec<(&'static str, f64)>,
    /// Where the file is a certificate: what its proof says of them.
    of_the_proof: Option<&'static str>,
}

impl std::fmt::Display for Added {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let gains: Vec<_> = self.gains.iter().map(|(key, x)| format!("{key} = {}", rounded(*x))).collect();
        write!(f, "{}", gains.join(", "))?;
        self.of_the_proof.map_or(Ok(()), |what| write!(f, "; {what}"))
    }
}

/// Gains with, where their proof is about another machine, a sentence that says so.
type Proven = (String, Option<String>);

/// The gains of a file that `im design` wrote, whose proof is checked first.
#[cfg(feature = "design")]
fn proven(text: &str, motor: &MotorFile) -> Result<Proven, String> {
    let (certificate, _) = im_design::Certificate::check_text(text).map_err(|e| format!("refused: {e}"))?;
    let differences = certificate.differences(&motor.machine).map_err(|e| format!("refused: {e}"))?;
    let set = im_design::gains::GainSet::from(&certificate.design).to_toml();
    let other = || crate::commands::design::other_machine(&certificate, motor, &differences);
    Ok((set, (!differences.is_empty()).then(other)))
}

#[cfg(not(feature = "design"))]
fn proven(_: &str, _: &MotorFile) -> Result<Proven, String> {
    Err("holds gains with their proof, which this build cannot check: it was made without the feature `design`".into())
}

/// A table with its place, for messages.
struct Table<'a> {
    file: &'a Tables,
    name: &'static str,
    at: Range<usize>,
    values: &'a toml::Table,
}

impl Table<'_> {
    fn toml<R>(&self, of: impl Fn(TomlText<'_>) -> R) -> R {
        let label = self.file.path.display().to_string();
        of(TomlText::new(&self.file.text, &label, &[]))
    }

    fn fail(&self, error: impl Fn(TomlText<'_>) -> im_model::FileError) -> Refused {
        Refused::File(Failure::File(self.toml(error)))
    }

    /// Gains proven for forward Euler are proven for one period.
    fn is_for(&self, sample_time_s: f64) -> Result<(), Failure> {
        match self.values.get("period_s").and_then(float).filter(|h| (h / sample_time_s - 1.0).abs() > 1e-3) {
            Some(h) => Err(Failure::Input(format!(
                "{}: proven for a sampling period of {h} s, the recording's is {sample_time_s} s; design for that with --period {sample_time_s}",
                self.file.path.display()
            ))),
            None => Ok(()),
        }
    }
}

fn float(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|x| x as f64)).filter(|x| x.is_finite())
}

/// Two numbers.
fn pair(value: &toml::Value) -> Option<[f64; 2]> {
    value.as_array()?.iter().map(float).collect::<Option<Vec<_>>>()?.try_into().ok()
}
