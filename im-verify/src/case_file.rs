//! A case as a file, to look at and to run alone.

use im_model::machines::ALL;
use im_model::toml_text::TomlText;
use im_model::{FileKind, Machine, Rating, TParameters};
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
    /// Where it is not a named one either.
    #[serde(skip_serializing_if = "Option::is_none")]
    motor: Option<Motor>,
    #[serde(skip_serializing_if = "Option::is_none")]
    machine: Option<toml::Table>,
    #[serde(default)]
    values: toml::Table,
}

/// A machine that was given, as the case needs it.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Motor {
    pole_pairs: u32,
    stator_resistance_ohm: f64,
    rotor_resistance_ohm: f64,
    stator_leakage_inductance_h: f64,
    rotor_leakage_inductance_h: f64,
    magnetizing_inductance_h: f64,
    inertia_kg_m2: f64,
    viscous_friction_nm_s_per_rad: f64,
    rated_torque_nm: f64,
    rated_frequency_hz: f64,
    rated_phase_voltage_peak_v: f64,
    rated_rotor_flux_vs: f64,
}

impl Motor {
    fn of(s: &Subject) -> Self {
        let (p, r) = (s.machine.parameters(), &s.rating);
        Self {
            pole_pairs: s.machine.pole_pairs(),
            stator_resistance_ohm: p.stator_resistance_ohm,
            rotor_resistance_ohm: p.rotor_resistance_ohm,
            stator_leakage_inductance_h: p.stator_leakage_inductance_h,
            rotor_leakage_inductance_h: p.rotor_leakage_inductance_h,
            magnetizing_inductance_h: p.magnetizing_inductance_h,
            inertia_kg_m2: p.inertia_kg_m2,
            viscous_friction_nm_s_per_rad: p.viscous_friction_nm_s_per_rad,
            rated_torque_nm: r.torque_nm,
            rated_frequency_hz: r.electrical_frequency_hz,
            rated_phase_voltage_peak_v: r.phase_voltage_peak_v,
            rated_rotor_flux_vs: r.rotor_flux_vs,
        }
    }

    fn subject(&self, name: String) -> Result<Subject, CaseError> {
        let parameters = TParameters {
            stator_resistance_ohm: self.stator_resistance_ohm,
            rotor_resistance_ohm: self.rotor_resistance_ohm,
            stator_leakage_inductance_h: self.stator_leakage_inductance_h,
            rotor_leakage_inductance_h: self.rotor_leakage_inductance_h,
            magnetizing_inductance_h: self.magnetizing_inductance_h,
            inertia_kg_m2: self.inertia_kg_m2,
            viscous_friction_nm_s_per_rad: self.viscous_friction_nm_s_per_rad,
        };
        let rating = Rating {
            torque_nm: self.rated_torque_nm,
            electrical_frequency_hz: self.rated_frequency_hz,
            phase_voltage_peak_v: self.rated_phase_voltage_peak_v,
            rotor_flux_vs: self.rated_rotor_flux_vs,
        };
        let wrong = |e: im_model::ModelError| CaseError::Value { table: "motor", key: name.clone(), what: e.to_string() };
        rating.validate().map_err(wrong)?;
        let machine = Machine::base(parameters, self.pole_pairs).map_err(wrong)?;
        Ok(Subject { name, machine, rating })
    }
}

/// A case as TOML. `seed` and `index` say where it was shrunk from.
pub fn to_text(claim: &Claim, point: &Point, machines: &Machines, seed: u64, index: u64) -> String {
    let table = |variables: &[Variable], values: &[f64]| {
        variables.iter().zip(values).map(|(v, x)| (v.name.to_owned(), toml::Value::Float(*x))).collect::<toml::Table>()
    };
    let given = match machines {
        Machines::Random => None,
        Machines::One(s) => Some(s.as_ref()),
    };
    let own = given.filter(|s| Subject::by_name(&s.name).as_ref() != Some(s));
    let file = CaseFile {
        claim: claim.name.into(),
        seed,
        index,
        subject: given.map(|s| s.name.clone()),
        motor: own.map(Motor::of),
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

/// Reads a case: the claim, the point, the machines. A machine that is `given` takes the place of the file's, but for a random one.
///
/// # Errors
/// What is wrong, with key and remedy.
pub fn from_text(text: &str, claims: &[Claim], given: Option<Subject>) -> Result<(Claim, Point, Machines), CaseError> {
    let file: CaseFile =
        TomlText::new(text, "case", &[]).of_kind(FileKind::Claim).read().map_err(|e| CaseError::Syntax(e.to_string()))?;
    let claim = claims.iter().find(|c| c.name == file.claim).ok_or(CaseError::Claim(file.claim))?;
    let values = read("values", claim.variables, &file.values)?;
    if let Some(table) = &file.machine {
        let machine = read("machine", &MACHINE, table)?;
        let machine = machine.try_into().unwrap_or_else(|_| unreachable!("as many values as variables"));
        return Ok((*claim, Point { machine: Some(machine), values }, Machines::Random));
    }
    let subject = match (given, file.motor, file.subject) {
        (Some(given), ..) => given,
        (None, Some(motor), name) => motor.subject(name.unwrap_or_else(|| "motor".into()))?,
        (None, None, Some(name)) => Subject::by_name(&name).ok_or(CaseError::Subject(name))?,
        (None, None, None) => {
            let what = "is missing; a case needs [machine], [motor], or subject = the name of a machine".into();
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
