//! A case as a file, to look at and to run alone.

use im_model::machines::ALL;
use serde::{Deserialize, Serialize};

use crate::claim::{Claim, Point};
use crate::subject::{MACHINE, Machines, Subject};
use crate::variable::Variable;

/// What is wrong with a case file.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum CaseError {
    /// Not TOML, or keys that are not those of a case.
    #[error("{0}")]
    Syntax(String),
    /// A claim that there is not.
    #[error("claim = \"{0}\" is none of the claims; im verify --list shows them")]
    Claim(String),
    /// A value is missing, unknown or out of range.
    #[error("[{table}] {key}: {what}")]
    Value {
        /// The table it stands in.
        table: &'static str,
        /// Its key.
        key: String,
        /// What is wrong, and what is expected.
        what: String,
    },
    /// A named machine that there is not.
    #[error("subject = \"{0}\" is none of the named machines ({names}); give the motor.toml with --motor", names = names())]
    Subject(String),
}

fn names() -> String {
    ALL.map(|m| m.name).join(", ")
}

/// The file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CaseFile {
    claim: String,
    seed: u64,
    index: u64,
    /// Where the machine is not a random one.
    #[serde(skip_serializing_if = "Option::is_none")]
    subject: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    machine: Option<toml::Table>,
    #[serde(default)]
    values: toml::Table,
}

/// A case as TOML. `seed` and `index` say where it was shrunk from.
pub fn to_text(claim: &Claim, point: &Point, machines: &Machines, seed: u64, index: u64) -> String {
    let table = |variables: &[Variable], values: &[f64]| {
        variables.iter().zip(values).map(|(v, x)| (v.name.to_owned(), toml::Value::Float(*x))).collect::<toml::Table>()
    };
    let subject = match machines {
        Machines::Random => None,
        Machines::One(s) => Some(s.name.clone()),
    };
    let file = CaseFile {
        claim: claim.name.into(),
        seed,
        index,
        subject,
        machine: point.machine.as_ref().map(|m| table(&MACHINE, m)),
        values: table(claim.variables, &point.values),
    };
    let why = match claim.verdict(point, machines) {
        crate::Verdict::Violated { why, .. } => format!("# {why}\n"),
        _ => String::new(),
    };
    let head =
        format!("# Claim {}, {}: {}\n{why}# Try it again: im verify --replay FILE\n", claim.number, claim.place, claim.statement);
    head + &toml::to_string(&file).unwrap_or_else(|_| unreachable!("a table of numbers"))
}

/// Reads a case: the claim, the point, the machines. A machine that is neither random nor named is `given`.
///
/// # Errors
/// What is wrong, with key and remedy.
pub fn from_text(text: &str, claims: &[Claim], given: Option<Subject>) -> Result<(Claim, Point, Machines), CaseError> {
    let file: CaseFile = toml::from_str(text).map_err(|e| CaseError::Syntax(e.to_string().trim_end().to_owned()))?;
    let claim = claims.iter().find(|c| c.name == file.claim).ok_or(CaseError::Claim(file.claim))?;
    let values = read("values", claim.variables, &file.values)?;
    if let Some(table) = &file.machine {
        let machine = read("machine", &MACHINE, table)?;
        let machine = machine.try_into().unwrap_or_else(|_| unreachable!("as many values as variables"));
        return Ok((*claim, Point { machine: Some(machine), values }, Machines::Random));
    }
    let subject = match (file.subject, given) {
        (_, Some(given)) => given,
        (Some(name), None) => Subject::by_name(&name).ok_or(CaseError::Subject(name))?,
        (None, None) => {
            let what = "is missing; a case needs [machine], or subject = the name of a machine".into();
            return Err(CaseError::Value { table: "machine", key: "power_w".into(), what });
        }
    };
    Ok((*claim, Point { machine: None, values }, Machines::One(Box::new(subject))))
}

fn read(table: &'static str, variables: &[Variable], values: &toml::Table) -> Result<Vec<f64>, CaseError> {
    let wrong = |key: &str, what: String| CaseError::Value { table, key: key.to_owned(), what };
    if let Some(key) = values.keys().find(|k| variables.iter().all(|v| v.name != k.as_str())) {
        let names: Vec<&str> = variables.iter().map(|v| v.name).collect();
        return Err(wrong(key, format!("unknown; expected are {}", names.join(", "))));
    }
    let value = |v: &Variable| {
        let range = || format!("from {} to {}", v.low, v.high);
        let x = match values.get(v.name) {
            Some(toml::Value::Float(x)) => *x,
            Some(toml::Value::Integer(x)) => *x as f64,
            Some(other) => return Err(wrong(v.name, format!("{other} must be a number {}", range()))),
            None => return Err(wrong(v.name, format!("is missing; give a number {}", range()))),
        };
        if v.admits(x) { Ok(x) } else { Err(wrong(v.name, format!("{x} must lie {}", range()))) }
    };
    variables.iter().map(value).collect()
}
