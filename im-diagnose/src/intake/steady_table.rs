//! Tables of steady states, as no-load, locked-rotor and load tests are written down: one row per point.
//!
//! `V_LL_V,I_A,P_3ph_W,Q_3ph_var,n_rpm,T_Nm,winding_C,rotor_C`: line-to-line voltage and line current, rms; active and reactive power of the three phases;
//! speed; torque at the shaft; temperatures of the stator winding and of the rotor. `Q_3ph_var` and what follows may be missing, or empty where a
//! row was not measured so far. A mapping (`no_load.table.toml` beside `no_load.csv`, or `table.toml` for every table of a folder) says what the columns do
//! not, and names foreign ones:
//!
//! ```toml
//! [table]
//! kind = "no_load"                       # "locked", "load"; else seen from the rows
//! class = 0.2                            # of the instruments, per cent of the largest reading; 0.5 without
//! voltage = "U (V)"                      # line to line, rms; phase_voltage instead where it is the phase's
//! current = { column = "I", unit = "mA" }
//! power = "P (kW)"
//! speed = "n_rpm"
//! winding_c = 78                         # where no column says it
//! ```

use std::path::{Path, PathBuf};

use im_model::toml_text::{Positive, TomlText, Within};
use im_model::{FileError, FileKind, Problem, TextFormat, read_text};
use serde::{Deserialize, Serialize};

use super::mapping::{Offset, Signal, TextSaid};
use super::mapping_file::{ColumnToml, TextToml, plain_signal};
use super::raw;
use super::sniff::sniff;
use super::unit::{self, Quantity};

/// What a table was taken for.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TableKind {
    /// Running free, at several voltages.
    NoLoad,
    /// Rotor held.
    Locked,
    /// At several torques.
    Load,
    /// No speed was measured and nobody says: free or held, as the impedance shows.
    #[serde(skip_deserializing)]
    Unsaid,
}

/// One steady state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SteadyRow {
    /// Phase voltage of the star-equivalent machine, V rms.
    pub phase_voltage_rms_v: f64,
    /// Line current, A rms.
    pub current_rms_a: f64,
    /// Active power of three phases, W.
    pub active_power_w: f64,
    /// Reactive power of three phases, var; lagging positive.
    pub reactive_power_var: Option<f64>,
    /// Speed, rad/s mechanical.
    pub omega_m_rad_s: Option<f64>,
    /// Torque at the shaft, Nm.
    pub torque_nm: Option<f64>,
    /// Temperature of the stator winding, °C.
    pub winding_c: Option<f64>,
    /// Temperature of the rotor, °C, where it is not the stator winding's.
    pub rotor_c: Option<f64>,
}

/// Below this speed a rotor is held.
const STANDS_RAD_S: f64 = 1.0;

impl SteadyRow {
    /// Whether its speed is known, and that of a rotor that is held.
    pub fn stands(&self) -> bool {
        self.omega_m_rad_s.is_some_and(|w| w.abs() < STANDS_RAD_S)
    }
}

/// A table of steady states.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SteadyTable {
    /// Name: the file's.
    pub name: String,
    /// What it was taken for.
    pub kind: TableKind,
    /// Class of its instruments: what they may be off by, per cent of their largest reading.
    pub class_percent: f64,
    /// Its points.
    pub rows: Vec<SteadyRow>,
}

/// The keys of a mapping; in their order, the names of the columns where there is none, and what is measured (a power, a temperature: `None`).
const KEYS: [&str; 9] = ["voltage", "phase_voltage", "current", "power", "reactive_power", "speed", "torque", "winding", "rotor"];
const CANONICAL: [&str; 9] = ["V_LL_V", "V_ph_V", "I_A", "P_3ph_W", "Q_3ph_var", "n_rpm", "T_Nm", "winding_C", "rotor_C"];

const QUANTITIES: [Option<Quantity>; 9] = [
    Some(Quantity::Voltage),
    Some(Quantity::Voltage),
    Some(Quantity::Current),
    None,
    None,
    Some(Quantity::Speed),
    Some(Quantity::Torque),
    None,
    None,
];

/// Class of instruments where nobody says.
const USUAL_CLASS_PERCENT: f64 = 0.5;
/// From here on columns may be missing, or empty in some rows.
const REACTIVE: usize = 4;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MappingToml {
    table: TableToml,
    text: Option<TextToml>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TableToml {
    kind: Option<TableKind>,
    class: Option<Positive>,
    voltage: Option<ColumnToml>,
    phase_voltage: Option<ColumnToml>,
    current: Option<ColumnToml>,
    power: Option<ColumnToml>,
    reactive_power: Option<ColumnToml>,
    speed: Option<ColumnToml>,
    torque: Option<ColumnToml>,
    winding: Option<ColumnToml>,
    rotor: Option<ColumnToml>,
    winding_c: Option<Within<-100, 300>>,
}

/// How the columns of a table stand in a file: by the order of [`CANONICAL`].
struct TableMapping {
    label: String,
    kind: Option<TableKind>,
    class_percent: f64,
    /// Temperature of the windings where no column says it, °C.
    winding_c: Option<f64>,
    /// How the text is written, where somebody says.
    format: Option<TextFormat>,
    signals: [Option<Signal>; CANONICAL.len()],
}

impl SteadyTable {
    /// Reads a table; `mapping` is its `[table]` file where the columns are foreign and none stands beside it.
    ///
    /// # Errors
    /// The file cannot be read, lacks a column, holds something that is not a number, or a point that no machine takes: a voltage or a
    /// current that is not positive, a power beyond √3 U I by more than a tenth.
    pub fn read(path: &Path, mapping: Option<&Path>) -> Result<Self, FileError> {
        let label = path.display().to_string();
        // The decimal comma is seen; which lines count nobody guesses.
        let seen = sniff(path, &label, TextSaid::default())?.format;
        let seen = TextFormat { separator: seen.separator, decimal_comma: seen.decimal_comma, ..TextFormat::default() };
        let mut rows = raw::open(path, &label, seen)?;
        let own = TableMapping::canonical(rows.names(), &label);
        let given = mapping.map(Path::to_path_buf).or_else(|| TableMapping::beside(path));
        let foreign = given.is_none() && own.signals.iter().all(Option::is_none);
        let mapping = match given {
            Some(m) => TableMapping::read(&m)?.over(own, rows.names()),
            None => own,
        };
        if let Some(format) = mapping.format {
            rows = raw::open(path, &label, format)?;
        }
        let names = rows.names().to_vec();
        // Where a column stands, and its unit in SI.
        let mut places = [None; CANONICAL.len()];
        for (k, place) in places.iter_mut().enumerate() {
            if let Some(signal) = &mapping.signals[k] {
                let at = match raw::find(&names, signal, &mapping.label) {
                    Ok(at) => at,
                    // One mapping for several tests, of which not each has a speed; a name that is nearly right is a slip of the pen.
                    Err(e) if k >= REACTIVE && matches!(*e.problem, Problem::MissingColumn { nearest: None, .. }) => continue,
                    Err(e) => return Err(e),
                };
                if k < REACTIVE {
                    rows.require(at)
                } else {
                    rows.require_where_given(at)
                }
                *place = Some((at, mapping.unit(k, signal, &names[at], &names)?));
            }
        }
        for (k, any) in [(0, places[0].or(places[1])), (2, places[2]), (3, places[3])] {
            if any.is_none() {
                let e = rows.missing(CANONICAL[k], |n| !CANONICAL.contains(&n));
                if let Some(reason) = read_text(path).ok().and_then(|text| FileKind::Rows.mistaken(&text)) {
                    return Err(FileError::new(&label, None, None, Problem::Syntax { reason }));
                }
                let is_time = |n: &&String| unit::in_name_among(n, &names).is_some_and(|u| u.quantity == Quantity::Time);
                if let Some(time) = names.iter().find(is_time) {
                    let reason = format!(
                        "a table of steady states is expected here, and this is a recording over the time {time:?}; give it as --train, or as --data where one is compared"
                    );
                    return Err(FileError::new(&label, None, None, Problem::Syntax { reason }));
                }
                return Err(if foreign { e.renamed(&label, &proposal(path, &names)) } else { e });
            }
        }
        let mut points = Vec::new();
        let mut row = vec![0.0; names.len()];
        while rows.next(&mut row)? {
            let get = |k: usize| -> Option<f64> {
                let (signal, (at, unit)) = (mapping.signals[k].as_ref()?, places[k]?);
                let offset = if let Offset::Value(x) = signal.offset { x } else { 0.0 };
                // An empty field was not measured.
                Some(signal.gain * unit * (row[at] - offset)).filter(|x| x.is_finite())
            };
            let voltage = get(1).or(get(0).map(|v| v / 3f64.sqrt())).unwrap_or(0.0);
            let (current, power) = (get(2).unwrap_or(0.0), get(3).unwrap_or(0.0));
            let wrong = |key: &str, x: f64, expected: &str| {
                Err(rows.error(Some(key), Problem::Unexpected { found: x.to_string(), expected: expected.to_owned() }))
            };
            if voltage <= 0.0 {
                return wrong(CANONICAL[0], voltage, "a positive voltage");
            }
            if current <= 0.0 {
                return wrong(CANONICAL[2], current, "a positive current");
            }
            if power.abs() > 1.1 * 3.0 * voltage * current {
                return wrong(CANONICAL[3], power, "no more than √3 U I; is it in another unit, or of one phase?");
            }
            points.push(SteadyRow {
                phase_voltage_rms_v: voltage,
                current_rms_a: current,
                active_power_w: power,
                reactive_power_var: get(4),
                omega_m_rad_s: get(5),
                torque_nm: get(6),
                winding_c: get(7).or(mapping.winding_c),
                rotor_c: get(8),
            });
        }
        if points.is_empty() {
            return Err(rows.error(None, Problem::NoRows { found: "no rows under the header" }));
        }
        let name = path.file_stem().map_or_else(|| label.clone(), |s| s.to_string_lossy().into_owned());
        let kind = mapping.kind.unwrap_or_else(|| kind_of(&points));
        Ok(Self { name, kind, class_percent: mapping.class_percent, rows: points })
    }
}

/// Locked where the speed is zero; load when current and torque vary at one voltage; no load else. Without any speed the rows alone do not say.
fn kind_of(rows: &[SteadyRow]) -> TableKind {
    if rows.iter().all(|r| r.omega_m_rad_s.is_none()) {
        return TableKind::Unsaid;
    }
    if rows.iter().all(|r| r.omega_m_rad_s.is_none() || r.stands()) {
        return TableKind::Locked;
    }
    let spread = |f: &dyn Fn(&SteadyRow) -> f64| {
        let (low, high) = rows.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), r| (l.min(f(r)), h.max(f(r))));
        (high - low) / high.abs().max(1e-12)
    };
    if spread(&|r| r.phase_voltage_rms_v) < 0.1 && spread(&|r| r.active_power_w) > 0.3 {
        TableKind::Load
    } else {
        TableKind::NoLoad
    }
}

/// A first mapping for the columns of a table, by their units.
fn proposal(path: &Path, names: &[String]) -> String {
    let of = |q: Quantity| names.iter().find(|n| unit::in_name_among(n, names).is_some_and(|u| u.quantity == q));
    let power = |units: &[&str]| names.iter().find(|n| power_unit(n).is_some_and(|u| units.contains(&u)));
    let lines = [
        ("voltage", of(Quantity::Voltage), "   # line to line, rms; phase_voltage where it is the phase's"),
        ("current", of(Quantity::Current), "   # of the line, rms"),
        ("power", power(&["W", "kW"]), "   # of the three phases"),
        ("reactive_power", power(&["var", "kvar", "VAr", "kVAr", "Var"]), ""),
        ("speed", of(Quantity::Speed), ""),
        ("torque", of(Quantity::Torque), ""),
    ];
    let essential = ["voltage", "current", "power"];
    let said = lines.iter().filter(|(key, name, _)| name.is_some() || essential.contains(key));
    let said: String = said.map(|(key, name, note)| format!("\n  {key} = \"{}\"{note}", name.map_or("…", |n| n))).collect();
    let file = path.with_extension("table.toml").file_name().map_or_else(String::new, |f| f.to_string_lossy().into_owned());
    format!(". {file} beside it, or table.toml for every table of the folder, says what the columns are:\n  [table]{said}")
}

impl TableMapping {
    /// The mapping that stands beside a table.
    fn beside(path: &Path) -> Option<PathBuf> {
        [path.with_extension("table.toml"), path.with_file_name("table.toml")].into_iter().find(|p| p.is_file())
    }

    /// What it says, and of the columns that it does not name the canonical ones. Of a table that has all of these it may be of other columns, those of
    /// the folder's other tables.
    fn over(mut self, own: Self, names: &[String]) -> Self {
        if own.is_complete() {
            self.signals.iter_mut().for_each(|s| *s = s.take().filter(|s| raw::find(names, s, &self.label).is_ok()));
        }
        let [line, phase, ..] = &self.signals;
        let first = if line.is_some() || phase.is_some() { 2 } else { 0 };
        for (signal, canonical) in self.signals.iter_mut().zip(own.signals).skip(first) {
            *signal = signal.take().or(canonical);
        }
        self
    }

    /// Whether voltage, current and power are there.
    fn is_complete(&self) -> bool {
        let [line, phase, current, power, ..] = &self.signals;
        (line.is_some() || phase.is_some()) && current.is_some() && power.is_some()
    }

    fn canonical(names: &[String], label: &str) -> Self {
        let signals = CANONICAL.map(|name| names.iter().any(|n| n == name).then(|| Signal::plain(name)));
        let class_percent = USUAL_CLASS_PERCENT;
        Self { label: label.to_owned(), kind: None, class_percent, winding_c: None, format: None, signals }
    }

    fn read(path: &Path) -> Result<Self, FileError> {
        let label = path.display().to_string();
        let text = read_text(path)?;
        let toml =
            TomlText::new(&text, &label, &[("table", "[table] with voltage, current and power")]).of_kind(FileKind::TableMapping);
        let MappingToml { table: t, text } = toml.read::<MappingToml>()?;
        let columns = [t.voltage, t.phase_voltage, t.current, t.power, t.reactive_power, t.speed, t.torque, t.winding, t.rotor];
        let mut signals = [const { None }; CANONICAL.len()];
        for (signal, given) in signals.iter_mut().zip(columns) {
            *signal = given.map(|c| column(&toml, c)).transpose()?;
        }
        let class_percent = t.class.map_or(USUAL_CLASS_PERCENT, |c| c.0);
        let winding_c = t.winding_c.map(|c| c.0);
        let format = text.map(|t| TextSaid::from(t).over(TextFormat::default()));
        Ok(Self { label, kind: t.kind, class_percent, winding_c, format, signals })
    }

    /// The unit in SI of a signal that stands in the column `name`: as the mapping says, else as the name says among the others; a speed is in rpm.
    fn unit(&self, k: usize, signal: &Signal, name: &str, names: &[String]) -> Result<f64, FileError> {
        if let Some(unit) = signal.unit {
            return Ok(unit);
        }
        let fail = |[found, expected]: [String; 2]| {
            FileError::new(
                &self.label,
                signal.line,
                Some(&format!("unit of {}", KEYS[k])),
                Problem::Unexpected { found, expected },
            )
        };
        Ok(match QUANTITIES[k] {
            Some(q) => {
                let usual = if q == Quantity::Speed { std::f64::consts::PI / 30.0 } else { 1.0 };
                unit::by_name(name, names, q).map_err(fail)?.unwrap_or(usual)
            }
            None if power_unit(name).is_some_and(|u| u.starts_with('k')) => 1e3,
            None => 1.0,
        })
    }
}

/// A column of a table.
fn column(toml: &TomlText<'_>, given: ColumnToml) -> Result<Signal, FileError> {
    let at = given.span();
    let signal = plain_signal(toml, given)?;
    let of_time = signal.calibrate.is_some() || !matches!(signal.offset, Offset::Value(_));
    if of_time || signal.alternate.is_some() {
        let expected = "column, unit, gain and an offset that is a number: a table has no time and one sensor of each quantity";
        return Err(toml.unexpected(at, Some("given with calibrate, alternate or an offset over time"), expected));
    }
    Ok(signal)
}

/// The unit of power at the end of a name: `P (kW)`, `Q_var`.
fn power_unit(name: &str) -> Option<&str> {
    let tail = name.rsplit(['_', ' ', '(', '[']).next()?.trim_end_matches([')', ']']);
    ["W", "kW", "var", "VAr", "Var", "kvar", "kVAr"].contains(&tail).then_some(tail)
}
