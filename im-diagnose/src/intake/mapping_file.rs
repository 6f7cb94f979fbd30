//! Reading `recording.toml`.

use std::fmt;
use std::ops::Range;

use im_identify::offline::Size;
use im_model::toml_text::{Positive, TomlText, Whole, Within};
use im_model::{FileError, FileKind, Problem, TextFormat};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Unexpected, Visitor};
use toml::Spanned;

use super::mapping::{
    Also, Begin, Calibration, Clock, Column, CurrentForm, Instant, Line, Load, Mapping, Offset, Preface, Said, Signal, Speed,
    TextSaid, Time, Voltage, VoltageForm, by_key,
};
use super::unit::{Quantity, UNITS, named};

type Number = Within<-1_000_000_000_000, 1_000_000_000_000>;
/// A column where it stands in the mapping.
pub(super) type ColumnToml = Spanned<SignalToml>;

const COLUMN: &str = "a column: its name in quotes, its number from 1, or { column = …, unit = …, gain = …, offset = … }";
const OFFSET: &str = "a number in the column's own unit, \"mean\", or { mean_before_s = … }";
const TIME: &str = "[time] with column = \"…\", or sample_time_s where the file has no column of time";
const FRAME: &str = "[frame] with angle = the column of the d axis' electrical angle, rad (unit = \"deg\" or \"turn\")";
const CALIBRATE: &str = "calibrate = { from_s = …, to_s = …, value = … }";
const VOLTAGES: &str = "columns a, b, c (phases; a, b against the star point), two or three of ab, bc, ca (line to line), alpha and \
                        beta, d and q with [frame], or duty_a, duty_b, duty_c and dc_link";
const LOADS: &str = "column = the load torque's, constant = Nm or \"fit\", fan = Nm s²/rad² or \"fit\", unknown = true, or none = true \
                     where nothing drives or brakes the shaft";
const SIZE: &str = "a number, or \"fit\"";
const CURRENTS: &str = "columns a, b, c (two of them are enough), alpha and beta, or d and q with [frame]";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MappingToml {
    file: Option<String>,
    files: Option<Files>,
    start: Option<Begin>,
    winding_c: Option<Within<-100, 300>>,
    text: Option<TextToml>,
    time: Option<Spanned<TimeToml>>,
    voltage: Option<Spanned<VoltageToml>>,
    current: Option<Spanned<CurrentToml>>,
    frame: Option<Spanned<FrameToml>>,
    speed: Option<Spanned<SpeedToml>>,
    load: Option<Spanned<LoadToml>>,
    #[serde(default)]
    also: Vec<Spanned<AlsoToml>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AlsoToml {
    file: String,
    time: ColumnToml,
    shift_s: Option<Number>,
    align: Option<AlignToml>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AlignToml {
    column: ColumnToml,
    with: ColumnToml,
}

/// One name, or a list of them.
struct Files(Vec<String>);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TextToml {
    separator: Option<Separator>,
    decimal: Option<Decimal>,
    header: Option<bool>,
    comment: Option<Comment>,
    skip_lines: Option<Whole<0, 100_000>>,
    skip_after_header: Option<Whole<0, 1000>>,
}

#[derive(Clone, Copy, Deserialize)]
enum Separator {
    #[serde(rename = ",")]
    Comma = b',' as isize,
    #[serde(rename = ";")]
    Semicolon = b';' as isize,
    #[serde(rename = "tab", alias = "\t")]
    Tab = b'\t' as isize,
    #[serde(rename = "space", alias = " ")]
    Space = b' ' as isize,
    #[serde(rename = "|")]
    Bar = b'|' as isize,
}

#[derive(Deserialize, PartialEq)]
enum Decimal {
    #[serde(rename = ".")]
    Point,
    #[serde(rename = ",")]
    Comma,
}

#[derive(Clone, Copy, Deserialize)]
enum Comment {
    #[serde(rename = "#")]
    Hash = b'#' as isize,
    #[serde(rename = "%")]
    Percent = b'%' as isize,
    #[serde(rename = "!")]
    Exclamation = b'!' as isize,
    #[serde(rename = "/")]
    Slash = b'/' as isize,
    #[serde(rename = "\"")]
    Quote = b'"' as isize,
    #[serde(rename = ";")]
    Semicolon = b';' as isize,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TimeToml {
    column: Option<Spanned<Column>>,
    unit: Option<Spanned<String>>,
    sample_time_s: Option<Positive>,
    from_s: Option<Number>,
    to_s: Option<Number>,
    gaps: Option<Gaps>,
}

#[derive(Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum Gaps {
    Refuse,
    LeaveOut,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct VoltageToml {
    a: Option<ColumnToml>,
    b: Option<ColumnToml>,
    c: Option<ColumnToml>,
    ab: Option<ColumnToml>,
    bc: Option<ColumnToml>,
    ca: Option<ColumnToml>,
    alpha: Option<ColumnToml>,
    beta: Option<ColumnToml>,
    d: Option<ColumnToml>,
    q: Option<ColumnToml>,
    duty_a: Option<ColumnToml>,
    duty_b: Option<ColumnToml>,
    duty_c: Option<ColumnToml>,
    dc_link: Option<ColumnToml>,
    times: Option<ColumnToml>,
    unit: Option<Spanned<String>>,
    gain: Option<Spanned<Number>>,
    offset: Option<Offset>,
    instant: Option<Instant>,
    measured: Option<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CurrentToml {
    a: Option<ColumnToml>,
    b: Option<ColumnToml>,
    c: Option<ColumnToml>,
    alpha: Option<ColumnToml>,
    beta: Option<ColumnToml>,
    d: Option<ColumnToml>,
    q: Option<ColumnToml>,
    unit: Option<Spanned<String>>,
    gain: Option<Spanned<Number>>,
    offset: Option<Offset>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameToml {
    angle: ColumnToml,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SpeedToml {
    column: Option<Spanned<Column>>,
    unit: Option<Spanned<String>>,
    gain: Option<Spanned<Number>>,
    offset: Option<Offset>,
    calibrate: Option<CalibrateToml>,
    alternate: Option<Box<ColumnToml>>,
    #[serde(default)]
    reciprocal: bool,
    delay_s: Option<Number>,
    #[serde(default)]
    spikes: bool,
    counts_per_turn: Option<Positive>,
    wraps_at: Option<Positive>,
    #[serde(default)]
    electrical: bool,
    #[serde(default)]
    locked: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LoadToml {
    column: Option<Spanned<Column>>,
    unit: Option<Spanned<String>>,
    gain: Option<Spanned<Number>>,
    offset: Option<Offset>,
    calibrate: Option<CalibrateToml>,
    alternate: Option<Box<ColumnToml>>,
    #[serde(default)]
    reciprocal: bool,
    delay_s: Option<Number>,
    #[serde(default)]
    spikes: bool,
    times: Option<ColumnToml>,
    torque_nm: Option<Number>,
    constant: Option<SizeToml>,
    fan: Option<SizeToml>,
    #[serde(default)]
    unknown: bool,
    #[serde(default)]
    none: bool,
}

/// A number, or `"fit"`.
struct SizeToml(Size);

/// A column with all that may be said of it; or its name or number alone.
#[derive(Default)]
pub(super) struct SignalToml(FullToml);

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct FullToml {
    column: Option<Spanned<Column>>,
    unit: Option<Spanned<String>>,
    gain: Option<Spanned<Number>>,
    offset: Option<Offset>,
    calibrate: Option<CalibrateToml>,
    alternate: Option<Box<ColumnToml>>,
    #[serde(default)]
    reciprocal: bool,
    delay_s: Option<Number>,
    #[serde(default)]
    spikes: bool,
    /// The column where it stands alone.
    #[serde(skip)]
    alone: Option<Column>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CalibrateToml {
    from_s: Number,
    to_s: Number,
    value: Number,
}

/// What a section says for all its columns.
struct Common {
    unit: Option<f64>,
    gain: f64,
    offset: Offset,
}

const PLAIN: Common = Common { unit: None, gain: 1.0, offset: Offset::Value(0.0) };

impl<'de> Deserialize<'de> for Files {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Names;
        impl<'de> Visitor<'de> for Names {
            type Value = Files;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("text in quotes, or a list of texts")
            }
            fn visit_str<E: Error>(self, name: &str) -> Result<Files, E> {
                Ok(Files(vec![name.to_owned()]))
            }
            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, list: A) -> Result<Files, A::Error> {
                Vec::deserialize(serde::de::value::SeqAccessDeserializer::new(list)).map(Files)
            }
        }
        from.deserialize_any(Names)
    }
}

/// The name of a column, or its number from 1.
fn numbered<E: Error>(number: i64, expected: &dyn serde::de::Expected) -> Result<Column, E> {
    match usize::try_from(number) {
        Ok(n @ 1..=10_000) => Ok(Column::Number(n)),
        _ => Err(E::invalid_value(Unexpected::Signed(number), expected)),
    }
}

impl<'de> Deserialize<'de> for Column {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Plain;
        impl Visitor<'_> for Plain {
            type Value = Column;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a column: its name in quotes, or its number from 1")
            }
            fn visit_str<E: Error>(self, name: &str) -> Result<Column, E> {
                Ok(Column::Name(name.to_owned()))
            }
            fn visit_i64<E: Error>(self, number: i64) -> Result<Column, E> {
                numbered(number, &self)
            }
        }
        from.deserialize_any(Plain)
    }
}

impl<'de> Deserialize<'de> for SignalToml {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Any;
        fn alone(column: Column) -> SignalToml {
            SignalToml(FullToml { alone: Some(column), ..FullToml::default() })
        }
        impl<'de> Visitor<'de> for Any {
            type Value = SignalToml;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(COLUMN)
            }
            fn visit_str<E: Error>(self, name: &str) -> Result<SignalToml, E> {
                Ok(alone(Column::Name(name.to_owned())))
            }
            fn visit_i64<E: Error>(self, number: i64) -> Result<SignalToml, E> {
                numbered(number, &self).map(alone)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<SignalToml, A::Error> {
                FullToml::deserialize(MapAccessDeserializer::new(map)).map(SignalToml)
            }
        }
        from.deserialize_any(Any)
    }
}

impl<'de> Deserialize<'de> for SizeToml {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Any;
        impl Visitor<'_> for Any {
            type Value = SizeToml;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(SIZE)
            }
            fn visit_f64<E: Error>(self, x: f64) -> Result<SizeToml, E> {
                if x.abs() <= 1e12 { Ok(SizeToml(Size::Given(x))) } else { Err(E::invalid_value(Unexpected::Float(x), &self)) }
            }
            fn visit_i64<E: Error>(self, x: i64) -> Result<SizeToml, E> {
                self.visit_f64(x as f64)
            }
            fn visit_str<E: Error>(self, word: &str) -> Result<SizeToml, E> {
                if word == "fit" { Ok(SizeToml(Size::Fitted)) } else { Err(E::invalid_value(Unexpected::Str(word), &self)) }
            }
        }
        from.deserialize_any(Any)
    }
}

impl<'de> Deserialize<'de> for Offset {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Before {
            mean_before_s: Number,
        }
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Offset;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(OFFSET)
            }
            fn visit_f64<E: Error>(self, x: f64) -> Result<Offset, E> {
                if x.abs() <= 1e12 { Ok(Offset::Value(x)) } else { Err(E::invalid_value(Unexpected::Float(x), &self)) }
            }
            fn visit_i64<E: Error>(self, x: i64) -> Result<Offset, E> {
                self.visit_f64(x as f64)
            }
            fn visit_str<E: Error>(self, word: &str) -> Result<Offset, E> {
                if word == "mean" { Ok(Offset::Mean) } else { Err(E::invalid_value(Unexpected::Str(word), &self)) }
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Offset, A::Error> {
                Before::deserialize(MapAccessDeserializer::new(map)).map(|b| Offset::MeanBefore(b.mean_before_s.0))
            }
        }
        from.deserialize_any(Any)
    }
}

/// What a draft leaves open.
const FILL_IN: &str = "FILL_IN";

/// The first line, from 1, in which something of a draft is still open, and its key.
fn to_fill_in(text: &str) -> Option<(usize, &str)> {
    let open = |line: &'_ str| -> bool {
        let said = line.split('#').next().unwrap_or_default();
        said.split_once('=').is_some_and(|(_, value)| value.trim() == FILL_IN)
    };
    let (k, line) = text.lines().enumerate().find(|(_, line)| open(line))?;
    Some((k + 1, line.split('=').next().unwrap_or_default().trim()))
}

impl Mapping {
    /// Reads a mapping of columns; `label` names the file in messages.
    ///
    /// # Errors
    /// What is not understood, is missing or contradicts itself, with its line and key.
    pub fn parse(text: &str, label: &str) -> Result<Self, FileError> {
        match Said::parse(text, label)? {
            Said::Columns(mapping) => Ok(*mapping),
            Said::Preface(_) => Err(TomlText::new(text, label, &[]).missing(0..0, "time", TIME)),
        }
    }

    /// Reads a mapping of columns that a program wrote, each key of the top in a line of its own: messages name it, for nobody sees the lines.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_keys(text: &str, label: &str) -> Result<Self, FileError> {
        let keys: Vec<String> = text.lines().map(|l| l.split(" = ").next().unwrap_or_default().to_owned()).collect();
        let read = Self::parse(text, label).map_err(|e| by_key(&keys, e))?;
        Ok(Self { keys, ..read })
    }
}

impl Said {
    /// Reads a `recording.toml`; `label` names the file in messages.
    ///
    /// # Errors
    /// As [`Mapping::parse`].
    pub fn parse(text: &str, label: &str) -> Result<Self, FileError> {
        let hints = [
            ("also.time", "the column of time of that file"),
            ("from_s", CALIBRATE),
            ("to_s", CALIBRATE),
            ("value", CALIBRATE),
            ("mean_before_s", OFFSET),
        ];
        if let Some((line, key)) = to_fill_in(text) {
            let expected = "what the comment beside it asks for: the draft could not guess it".to_owned();
            let problem = Problem::Unexpected { found: FILL_IN.to_owned(), expected };
            return Err(FileError::new(label, Some(line), Some(key), problem));
        }
        let toml = TomlText::new(text, label, &hints).of_kind(FileKind::Mapping);
        let m: MappingToml = toml.read()?;
        let files = match (m.files, m.file) {
            (Some(_), Some(_)) => return Err(toml.refused(0..0, "file", "given beside files", "one of them")),
            (Some(many), None) => many.0,
            (None, one) => one.into_iter().collect(),
        };
        let format = m.text.map_or_else(TextSaid::default, TextSaid::from);
        let (begin, winding_c) = (m.start.unwrap_or_default(), m.winding_c.map(|c| c.0));
        let columns = [m.frame.is_some(), m.speed.is_some(), m.load.is_some(), !m.also.is_empty()].contains(&true);
        let (table_of_time, voltages, currents) = match (m.time, m.voltage, m.current) {
            (Some(t), Some(u), Some(i)) => (t, u, i),
            (None, None, None) if !columns => {
                return Ok(Self::Preface(Preface { label: label.to_owned(), files, text: format, begin, winding_c }));
            }
            (None, ..) => return Err(toml.missing(0..0, "time", TIME)),
            (_, None, _) => return Err(toml.missing(0..0, "voltage", format!("[voltage] with {VOLTAGES}"))),
            _ => return Err(toml.missing(0..0, "current", format!("[current] with {CURRENTS}"))),
        };
        let angle = match (m.frame, voltages.get_ref().turns() || currents.get_ref().turns()) {
            (Some(f), true) => Some(signal(&toml, f.into_inner().angle, Some(Quantity::Angle), &PLAIN)?),
            (None, true) => return Err(toml.missing(0..0, "frame", FRAME)),
            (Some(f), false) => return Err(toml.refused(f.span(), "frame", "given without columns d and q", "none, or d and q")),
            (None, false) => None,
        };
        Ok(Self::Columns(Box::new(Mapping {
            label: label.to_owned(),
            keys: Vec::new(),
            also: m.also.into_iter().map(|t| also(&toml, t, files.len())).collect::<Result<_, _>>()?,
            files,
            angle,
            format: format.over(TextFormat::default()),
            time: time(&toml, table_of_time)?,
            voltage: voltage(&toml, voltages)?,
            current: current(&toml, currents)?,
            speed: m.speed.map_or(Ok(Speed::Absent), |t| speed(&toml, t))?,
            load: m.load.map_or(Ok(Load::Unstated), |t| load(&toml, t))?,
            begin,
            winding_c,
        })))
    }
}

impl VoltageToml {
    /// Whether it stands in d and q.
    fn turns(&self) -> bool {
        self.d.is_some() || self.q.is_some()
    }
}

impl CurrentToml {
    /// Whether it stands in d and q.
    fn turns(&self) -> bool {
        self.d.is_some() || self.q.is_some()
    }
}

impl From<TextToml> for TextSaid {
    fn from(t: TextToml) -> Self {
        Self {
            separator: t.separator.map(|s| s as u8),
            decimal_comma: t.decimal.map(|d| d == Decimal::Comma),
            header: t.header,
            comment: t.comment.map(|c| c as u8),
            skip_lines: t.skip_lines.map(|n| n.0 as usize),
            skip_after_header: t.skip_after_header.map(|n| n.0 as usize),
        }
    }
}

fn also(toml: &TomlText<'_>, table: Spanned<AlsoToml>, files: usize) -> Result<Also, FileError> {
    let (at, t) = (table.span(), table.into_inner());
    if files > 1 {
        return Err(toml.refused(
            at,
            "file",
            "given beside several files",
            "a mapping of its own for each run that has other files",
        ));
    }
    let clock = match (t.shift_s, t.align) {
        (Some(_), Some(_)) => return Err(toml.refused(at, "shift_s", "given beside align", "one of them")),
        (Some(shift), None) => Clock::Shift(shift.0),
        (None, None) => Clock::Unsaid,
        (None, Some(a)) => {
            Clock::Alike { column: Box::new(plain_signal(toml, a.column)?), with: Box::new(plain_signal(toml, a.with)?) }
        }
    };
    let time = signal(toml, t.time, Some(Quantity::Time), &PLAIN)?;
    Ok(Also { file: t.file, time, clock, line: toml.line(at.start) })
}

fn time(toml: &TomlText<'_>, table: Spanned<TimeToml>) -> Result<Time, FileError> {
    let (at, t) = (table.span(), table.into_inner());
    let unit = unit(toml, t.unit.as_ref(), Some(Quantity::Time))?;
    let signal =
        t.column.map(|c| Signal { unit, line: Some(toml.line(c.span().start)), column: c.into_inner(), ..Signal::plain("") });
    match (&signal, t.sample_time_s) {
        (None, None) => return Err(toml.missing(at, "column", TIME)),
        (Some(_), Some(_)) => return Err(toml.refused(at, "sample_time_s", "given beside column", "one of them")),
        _ => {}
    }
    let from_s = t.from_s.map_or(f64::NEG_INFINITY, |x| x.0);
    let to_s = t.to_s.map_or(f64::INFINITY, |x| x.0);
    if from_s >= to_s {
        return Err(toml.refused(at, "to_s", &to_s.to_string(), format!("more than from_s = {from_s}")));
    }
    Ok(Time { signal, sample_time_s: t.sample_time_s.map(|x| x.0), from_s, to_s, fill_gaps: t.gaps == Some(Gaps::LeaveOut) })
}

fn voltage(toml: &TomlText<'_>, table: Spanned<VoltageToml>) -> Result<Voltage, FileError> {
    let (at, t) = (table.span(), table.into_inner());
    let q = Some(Quantity::Voltage);
    let common = common(toml, t.unit.as_ref(), t.gain.as_ref(), t.offset, q)?;
    let get = |s: Option<ColumnToml>| s.map(|s| signal(toml, s, q, &common)).transpose();
    let phases = [get(t.a)?, get(t.b)?, get(t.c)?];
    let lines = [get(t.ab)?, get(t.bc)?, get(t.ca)?];
    let vector = [get(t.alpha)?, get(t.beta)?];
    let turning = [get(t.d)?, get(t.q)?];
    let duty_common = Common { unit: Some(1.0), ..PLAIN };
    let leg = |s: Option<ColumnToml>| s.map(|s| signal(toml, s, None, &duty_common)).transpose();
    let duty = [leg(t.duty_a)?, leg(t.duty_b)?, leg(t.duty_c)?];
    let dc_link = get(t.dc_link)?;
    let any = |s: &[Option<Signal>]| s.iter().any(Option::is_some);
    let given = [any(&phases), any(&lines), any(&vector), any(&duty) || dc_link.is_some(), any(&turning)];
    if given.iter().filter(|g| **g).count() > 1 {
        return Err(toml.refused(at, "voltage", "given in several forms", format!("one of: {VOLTAGES}")));
    }
    let miss = |key| toml.missing(at.clone(), key, format!("[voltage] takes {VOLTAGES}"));
    if given[4] {
        let [Some(d), Some(q)] = turning else { return Err(miss("q")) };
        let times = t.times.map(|s| plain_signal(toml, s)).transpose()?;
        let instant = t.instant.unwrap_or(Instant::HeldFromRow);
        return Ok(Voltage { form: VoltageForm::Dq([d, q]), times, instant, measured: t.measured });
    }
    let form = match (phases, lines, vector, duty) {
        ([Some(a), Some(b), Some(c)], ..) => VoltageForm::Phases([a, b, c]),
        ([Some(a), Some(b), None], ..) => VoltageForm::TwoPhases([a, b]),
        ([a, ..], ..) if given[0] => return Err(miss(if a.is_none() { "a" } else { "b" })),
        (_, [Some(ab), Some(bc), Some(ca)], ..) => VoltageForm::ThreeLines([ab, bc, ca]),
        (_, [Some(ab), Some(bc), None], ..) => VoltageForm::Lines([Line::Ab, Line::Bc], [ab, bc]),
        (_, [Some(ab), None, Some(ca)], ..) => VoltageForm::Lines([Line::Ab, Line::Ca], [ab, ca]),
        (_, [None, Some(bc), Some(ca)], ..) => VoltageForm::Lines([Line::Bc, Line::Ca], [bc, ca]),
        (_, [ab, ..], ..) if given[1] => return Err(miss(if ab.is_none() { "ab" } else { "bc" })),
        (_, _, [Some(alpha), Some(beta)], _) => VoltageForm::AlphaBeta([alpha, beta]),
        (_, _, [alpha, _], _) if given[2] => return Err(miss(if alpha.is_none() { "alpha" } else { "beta" })),
        (_, _, _, [Some(a), Some(b), Some(c)]) => VoltageForm::Duty([a, b, c], dc_link.ok_or_else(|| miss("dc_link"))?),
        (.., [None, ..]) if given[3] => return Err(miss("duty_a")),
        (.., [_, b, _]) if given[3] => return Err(miss(if b.is_none() { "duty_b" } else { "duty_c" })),
        _ => return Err(miss("a")),
    };
    if let (VoltageForm::Duty(..), Some(_)) = (&form, &t.times) {
        return Err(toml.refused(at, "times", "given beside dc_link", "one of them"));
    }
    let times = t.times.map(|s| plain_signal(toml, s)).transpose()?;
    Ok(Voltage { form, times, instant: t.instant.unwrap_or(Instant::HeldFromRow), measured: t.measured })
}

fn current(toml: &TomlText<'_>, table: Spanned<CurrentToml>) -> Result<CurrentForm, FileError> {
    let (at, t) = (table.span(), table.into_inner());
    let q = Some(Quantity::Current);
    let common = common(toml, t.unit.as_ref(), t.gain.as_ref(), t.offset, q)?;
    let get = |s: Option<ColumnToml>| s.map(|s| signal(toml, s, q, &common)).transpose();
    let phases = [get(t.a)?, get(t.b)?, get(t.c)?];
    let vector = [get(t.alpha)?, get(t.beta)?];
    let turning = [get(t.d)?, get(t.q)?];
    let miss = |key| Err(toml.missing(at.clone(), key, format!("[current] takes {CURRENTS}")));
    let several = phases.iter().chain(&vector).any(Option::is_some);
    match (turning, several) {
        ([None, None], _) => {}
        ([Some(d), Some(q)], false) => return Ok(CurrentForm::Dq([d, q])),
        (_, true) => return Err(toml.refused(at, "d", "given beside another form", format!("one form: {CURRENTS}"))),
        ([d, _], false) => return miss(if d.is_none() { "d" } else { "q" }),
    }
    match (phases, vector) {
        ([Some(_), ..] | [_, Some(_), _] | [.., Some(_)], [Some(_), _] | [_, Some(_)]) => {
            Err(toml.refused(at, "alpha", "given beside phases", format!("one form: {CURRENTS}")))
        }
        ([Some(a), Some(b), Some(c)], _) => Ok(CurrentForm::Phases([a, b, c])),
        ([Some(a), Some(b), None], _) => Ok(CurrentForm::TwoPhases([0, 1], [a, b])),
        ([Some(a), None, Some(c)], _) => Ok(CurrentForm::TwoPhases([0, 2], [a, c])),
        ([None, Some(b), Some(c)], _) => Ok(CurrentForm::TwoPhases([1, 2], [b, c])),
        (_, [Some(alpha), Some(beta)]) => Ok(CurrentForm::AlphaBeta([alpha, beta])),
        (_, [Some(_), None]) => miss("beta"),
        (_, [None, Some(_)]) => miss("alpha"),
        ([a, ..], _) => miss(if a.is_none() { "a" } else { "b" }),
    }
}

fn speed(toml: &TomlText<'_>, table: Spanned<SpeedToml>) -> Result<Speed, FileError> {
    let (at, t) = (table.span(), table.into_inner());
    match (t.locked, &t.column) {
        (true, Some(_)) => {
            return Err(toml.refused(at, "column", "given beside locked = true", "one of them: a locked rotor stands"));
        }
        (true, None) => return Ok(Speed::Locked),
        (false, None) => {
            let expected = "the column of the speed, or locked = true; leave [speed] out where it is not measured";
            return Err(toml.missing(at, "column", expected));
        }
        (false, Some(_)) => {}
    }
    let SpeedToml { column, unit, gain, offset, calibrate, alternate, electrical, reciprocal, delay_s, spikes, .. } = t;
    let full = FullToml { column, unit, gain, offset, calibrate, alternate, reciprocal, delay_s, spikes, alone: None };
    if let Some(per_turn) = t.counts_per_turn {
        let signal = full_signal(toml, at, full, None, &PLAIN)?;
        return Ok(Speed::Counts { signal, per_turn: per_turn.0, wraps_at: t.wraps_at.map(|x| x.0) });
    }
    Ok(Speed::Measured { signal: full_signal(toml, at, full, Some(Quantity::Speed), &PLAIN)?, electrical })
}

fn load(toml: &TomlText<'_>, table: Spanned<LoadToml>) -> Result<Load, FileError> {
    let (at, t) = (table.span(), table.into_inner());
    let law = t.constant.is_some() || t.fan.is_some();
    let given = [
        ("column", t.column.is_some()),
        ("torque_nm", t.torque_nm.is_some()),
        (if t.constant.is_some() { "constant" } else { "fan" }, law),
        ("unknown", t.unknown),
        ("none", t.none),
    ];
    let mut said = given.into_iter().filter(|(_, given)| *given).map(|(key, _)| key);
    match (said.next(), said.next()) {
        (None, _) => return Err(toml.missing(at, "column", LOADS)),
        (Some(first), Some(second)) => {
            return Err(toml.refused(at, second, &format!("given beside {first}"), format!("one of: {LOADS}")));
        }
        _ => {}
    }
    if t.unknown {
        return Ok(Load::Unknown);
    }
    if t.none {
        return Ok(Load::Absent);
    }
    if let Some(x) = t.torque_nm {
        return Ok(Load::Constant(x.0));
    }
    if law {
        let size = |s: Option<SizeToml>| s.map_or(Size::Given(0.0), |s| s.0);
        return Ok(match (size(t.constant), size(t.fan)) {
            (Size::Given(x), Size::Given(0.0)) => Load::Constant(x),
            (constant, fan) => Load::Law { constant, fan },
        });
    }
    let LoadToml { column, unit, gain, offset, calibrate, alternate, times, reciprocal, delay_s, spikes, .. } = t;
    let times = times.map(|s| plain_signal(toml, s)).transpose()?;
    // A torque that is a product is in Nm by its gain; units of the factors are part of it.
    let quantity = if times.is_some() { None } else { Some(Quantity::Torque) };
    let full = FullToml { column, unit, gain, offset, calibrate, alternate, reciprocal, delay_s, spikes, alone: None };
    Ok(Load::Measured { signal: full_signal(toml, at, full, quantity, &PLAIN)?, times })
}

fn common(
    toml: &TomlText<'_>,
    text: Option<&Spanned<String>>,
    factor: Option<&Spanned<Number>>,
    offset: Option<Offset>,
    quantity: Option<Quantity>,
) -> Result<Common, FileError> {
    let gain = gain(toml, factor)?.unwrap_or(1.0);
    Ok(Common { unit: unit(toml, text, quantity)?, gain, offset: offset.unwrap_or(Offset::Value(0.0)) })
}

/// A column with all that may be said of it; what it does not say itself is `common`'s.
fn signal(toml: &TomlText<'_>, s: ColumnToml, quantity: Option<Quantity>, common: &Common) -> Result<Signal, FileError> {
    let at = s.span();
    full_signal(toml, at, s.into_inner().0, quantity, common)
}

/// A column in a quantity of any kind, with nothing in common with others.
pub(super) fn plain_signal(toml: &TomlText<'_>, s: ColumnToml) -> Result<Signal, FileError> {
    signal(toml, s, None, &PLAIN)
}

fn full_signal(
    toml: &TomlText<'_>,
    at: Range<usize>,
    t: FullToml,
    quantity: Option<Quantity>,
    common: &Common,
) -> Result<Signal, FileError> {
    let (column, line) = match (t.alone, t.column) {
        (Some(column), _) => (column, toml.line(at.start)),
        (None, Some(c)) => (c.get_ref().clone(), toml.line(c.span().start)),
        (None, None) => return Err(toml.missing(at, "column", COLUMN)),
    };
    if t.calibrate.is_some() && t.gain.is_some() {
        return Err(toml.refused(at, "gain", "given beside calibrate", "one of them: calibrate finds the gain"));
    }
    let alternate = t.alternate.map(|s| signal(toml, *s, quantity, common).map(Box::new)).transpose()?;
    Ok(Signal {
        column,
        unit: unit(toml, t.unit.as_ref(), quantity)?.or(common.unit),
        gain: gain(toml, t.gain.as_ref())?.unwrap_or(common.gain),
        offset: t.offset.unwrap_or(common.offset),
        calibrate: t.calibrate.map(|c| Calibration { from_s: c.from_s.0, to_s: c.to_s.0, value: c.value.0 }),
        alternate,
        reciprocal: t.reciprocal,
        delay_s: t.delay_s.map_or(0.0, |x| x.0),
        spikes: t.spikes,
        line: Some(line),
    })
}

fn gain(toml: &TomlText<'_>, gain: Option<&Spanned<Number>>) -> Result<Option<f64>, FileError> {
    match gain.map(|g| (g.get_ref().0, g.span())) {
        Some((0.0, at)) => Err(toml.unexpected(at, None, "another number: a gain of zero leaves nothing")),
        other => Ok(other.map(|(x, _)| x)),
    }
}

fn unit(toml: &TomlText<'_>, text: Option<&Spanned<String>>, quantity: Option<Quantity>) -> Result<Option<f64>, FileError> {
    let Some(text) = text else { return Ok(None) };
    let fits = |q| quantity.is_none_or(|wanted| wanted == q);
    match named(text.get_ref()).filter(|u| fits(u.quantity)) {
        Some(u) => Ok(Some(u.si)),
        None => {
            let words: Vec<_> = UNITS.iter().filter(|u| fits(u.quantity)).map(|u| u.text).collect();
            let found = format!("\"{}\"", text.get_ref());
            Err(toml.unexpected(text.span(), Some(&found), format!("one of {}", words.join(", "))))
        }
    }
}
