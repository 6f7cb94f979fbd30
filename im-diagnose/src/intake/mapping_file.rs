//! Reading `recording.toml`.

use im_model::toml_reader::{Document, Kind, Table};
use im_model::{Bound, FileError, Problem, TextFormat};

use super::mapping::{
    Begin, Calibration, Column, CurrentForm, Instant, Line, Load, Mapping, Offset, Signal, Speed, Time, Voltage, VoltageForm,
};
use super::unit::{Quantity, UNITS, named};

const ANY: Bound = Bound::Within(-1e12, 1e12);
const SIGNAL: &[&str] = &["column", "unit", "gain", "offset", "calibrate", "alternate"];
const COLUMN: &str = "a column: its name in quotes, its number from 1, or { column = …, unit = …, gain = …, offset = … }";

/// What a section says for all its columns.
struct Common {
    unit: Option<f64>,
    gain: f64,
    offset: Offset,
}

impl Mapping {
    /// Reads a mapping; `label` names the file in messages.
    ///
    /// # Errors
    /// What is not understood, is missing or contradicts itself, with its line and key.
    pub fn parse(text: &str, label: &str) -> Result<Self, FileError> {
        let document = Document::parse(text, label)?;
        let top = document.top(&["file", "files", "start", "text", "time", "voltage", "current", "speed", "load"])?;
        let files = match (top.texts("files")?, top.text("file")?) {
            (Some(_), Some(_)) => return Err(top.unexpected("file", "given beside files", "one of them")),
            (Some(many), None) => many,
            (None, one) => one.map(str::to_owned).into_iter().collect(),
        };
        let begin = [("auto", Begin::Auto), ("at_rest", Begin::AtRest), ("in_motion", Begin::InMotion)];
        Ok(Self {
            label: label.to_owned(),
            files,
            format: text_format(&top)?,
            time: time(&top)?,
            voltage: voltage(&top)?,
            current: current(&top)?,
            speed: speed(&top)?,
            load: load(&top)?,
            begin: top.choice("start", &begin)?.unwrap_or_default(),
        })
    }
}

fn text_format(top: &Table<'_>) -> Result<TextFormat, FileError> {
    let mut format = TextFormat::default();
    let Some(t) = top.table("text", &["separator", "decimal", "header", "comment", "skip_lines", "skip_after_header"])? else {
        return Ok(format);
    };
    let separators = [(",", b','), (";", b';'), ("tab", b'\t'), ("\t", b'\t'), ("space", b' '), (" ", b' '), ("|", b'|')];
    format.separator = t.choice("separator", &separators)?;
    format.decimal_comma = t.choice("decimal", &[(".", false), (",", true)])?.unwrap_or(false);
    format.header = t.boolean("header")?;
    format.comment =
        t.choice("comment", &[("#", b'#'), ("%", b'%'), ("!", b'!'), ("/", b'/'), ("\"", b'"'), (";", b';')])?.unwrap_or(b'#');
    format.skip_lines = t.whole("skip_lines", (0, 100_000))?.unwrap_or(0) as usize;
    format.skip_after_header = t.whole("skip_after_header", (0, 1000))?.unwrap_or(0) as usize;
    Ok(format)
}

fn time(top: &Table<'_>) -> Result<Time, FileError> {
    let expected = "[time] with column = \"…\", or sample_time_s where the file has no column of time";
    let t = top
        .table("time", &["column", "unit", "sample_time_s", "from_s", "to_s", "gaps"])?
        .ok_or_else(|| top.missing("time", expected))?;
    let signal = match t.kind("column") {
        None => None,
        Some(_) => Some(Signal { unit: unit(&t, Some(Quantity::Time))?, ..column(&t, "column")? }),
    };
    let sample_time_s = t.number("sample_time_s", Bound::Positive)?;
    match (&signal, sample_time_s) {
        (None, None) => return Err(t.missing("column", expected)),
        (Some(_), Some(_)) => return Err(t.unexpected("sample_time_s", "given beside column", "one of them")),
        _ => {}
    }
    let from_s = t.number("from_s", ANY)?.unwrap_or(f64::NEG_INFINITY);
    let to_s = t.number("to_s", ANY)?.unwrap_or(f64::INFINITY);
    if from_s >= to_s {
        return Err(t.unexpected("to_s", to_s.to_string(), format!("more than from_s = {from_s}")));
    }
    let fill_gaps = t.choice("gaps", &[("refuse", false), ("leave_out", true)])?.unwrap_or(false);
    Ok(Time { signal, sample_time_s, from_s, to_s, fill_gaps })
}

fn voltage(top: &Table<'_>) -> Result<Voltage, FileError> {
    let forms = "columns a, b, c (phases; a, b against the star point), two or three of ab, bc, ca (line to line), alpha and beta, \
                 or duty_a, duty_b, duty_c and dc_link";
    let known = &[
        "a", "b", "c", "ab", "bc", "ca", "alpha", "beta", "duty_a", "duty_b", "duty_c", "dc_link", "unit", "gain", "offset",
        "instant",
    ];
    let t = top.table("voltage", known)?.ok_or_else(|| top.missing("voltage", format!("[voltage] with {forms}")))?;
    let q = Some(Quantity::Voltage);
    let common = common(&t, q)?;
    let get = |key| signal(&t, key, q, &common);
    let phases = [get("a")?, get("b")?, get("c")?];
    let lines = [get("ab")?, get("bc")?, get("ca")?];
    let vector = [get("alpha")?, get("beta")?];
    let duty_common = Common { unit: Some(1.0), gain: 1.0, offset: Offset::Value(0.0) };
    let leg = |key| signal(&t, key, None, &duty_common);
    let duty = [leg("duty_a")?, leg("duty_b")?, leg("duty_c")?];
    let dc_link = get("dc_link")?;
    let any = |s: &[Option<Signal>]| s.iter().any(Option::is_some);
    let given = [any(&phases), any(&lines), any(&vector), any(&duty) || dc_link.is_some()];
    if given.iter().filter(|g| **g).count() > 1 {
        return Err(t.unexpected("voltage", "given in several forms", format!("one of: {forms}")));
    }
    let miss = |key| t.missing(key, format!("[voltage] takes {forms}"));
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
        (.., [a, b, _]) if given[3] => {
            return Err(miss(if a.is_none() {
                "duty_a"
            } else if b.is_none() {
                "duty_b"
            } else {
                "duty_c"
            }));
        }
        _ => return Err(miss("a")),
    };
    let words = [("held_from_row", Instant::HeldFromRow), ("sample", Instant::Sample), ("held_until_row", Instant::HeldUntilRow)];
    let instant = t.choice("instant", &words)?.unwrap_or(Instant::HeldFromRow);
    Ok(Voltage { form, instant })
}

fn current(top: &Table<'_>) -> Result<CurrentForm, FileError> {
    let forms = "columns a, b, c (two of them are enough), or alpha and beta";
    let t = top
        .table("current", &["a", "b", "c", "alpha", "beta", "unit", "gain", "offset"])?
        .ok_or_else(|| top.missing("current", format!("[current] with {forms}")))?;
    let q = Some(Quantity::Current);
    let common = common(&t, q)?;
    let get = |key| signal(&t, key, q, &common);
    let phases = [get("a")?, get("b")?, get("c")?];
    let vector = [get("alpha")?, get("beta")?];
    let miss = |key| t.missing(key, format!("[current] takes {forms}"));
    match (phases, vector) {
        ([Some(_), ..] | [_, Some(_), _] | [.., Some(_)], [Some(_), _] | [_, Some(_)]) => {
            Err(t.unexpected("alpha", "given beside phases", format!("one form: {forms}")))
        }
        ([Some(a), Some(b), Some(c)], _) => Ok(CurrentForm::Phases([a, b, c])),
        ([Some(a), Some(b), None], _) => Ok(CurrentForm::TwoPhases([0, 1], [a, b])),
        ([Some(a), None, Some(c)], _) => Ok(CurrentForm::TwoPhases([0, 2], [a, c])),
        ([None, Some(b), Some(c)], _) => Ok(CurrentForm::TwoPhases([1, 2], [b, c])),
        (_, [Some(alpha), Some(beta)]) => Ok(CurrentForm::AlphaBeta([alpha, beta])),
        ([None, None, None], [alpha, _]) if t.has("alpha") || t.has("beta") => {
            Err(miss(if alpha.is_none() { "alpha" } else { "beta" }))
        }
        ([a, ..], _) => Err(miss(if a.is_none() { "a" } else { "b" })),
    }
}

fn speed(top: &Table<'_>) -> Result<Speed, FileError> {
    let known = &["column", "unit", "gain", "offset", "calibrate", "alternate", "electrical", "locked"];
    let Some(t) = top.table("speed", known)? else { return Ok(Speed::Absent) };
    let locked = t.boolean("locked")?.unwrap_or(false);
    if locked {
        if t.has("column") {
            return Err(t.unexpected("column", "given beside locked = true", "one of them: a locked rotor stands"));
        }
        return Ok(Speed::Locked);
    }
    if !t.has("column") {
        return Err(t.missing("column", "the column of the speed, or locked = true; leave [speed] out where it is not measured"));
    }
    let signal = from_table(&t, Some(Quantity::Speed), &Common { unit: None, gain: 1.0, offset: Offset::Value(0.0) })?;
    Ok(Speed::Measured { signal, electrical: t.boolean("electrical")?.unwrap_or(false) })
}

fn load(top: &Table<'_>) -> Result<Load, FileError> {
    let known = &["column", "unit", "gain", "offset", "calibrate", "alternate", "times", "torque_nm"];
    let Some(t) = top.table("load", known)? else { return Ok(Load::Absent) };
    if let Some(x) = t.number("torque_nm", ANY)? {
        if t.has("column") {
            return Err(t.unexpected("torque_nm", "given beside column", "one of them"));
        }
        return Ok(Load::Constant(x));
    }
    if !t.has("column") {
        return Err(t.missing(
            "column",
            "the column of the load torque, or torque_nm = a constant; leave [load] out where it is not known",
        ));
    }
    let plain = Common { unit: None, gain: 1.0, offset: Offset::Value(0.0) };
    let times = signal(&t, "times", None, &plain)?;
    // A torque that is a product is in Nm by its gain; units of the factors are part of it.
    let quantity = if times.is_some() { None } else { Some(Quantity::Torque) };
    Ok(Load::Measured { signal: from_table(&t, quantity, &plain)?, times })
}

fn common(t: &Table<'_>, quantity: Option<Quantity>) -> Result<Common, FileError> {
    Ok(Common { unit: unit(t, quantity)?, gain: gain(t)?.unwrap_or(1.0), offset: offset(t)?.unwrap_or(Offset::Value(0.0)) })
}

/// A column with all that may be said of it; what it does not say itself is `common`'s.
fn signal(t: &Table<'_>, key: &'static str, quantity: Option<Quantity>, common: &Common) -> Result<Option<Signal>, FileError> {
    match t.kind(key) {
        None => Ok(None),
        Some(Kind::Table) => t.table(key, SIGNAL)?.map(|inner| from_table(&inner, quantity, common)).transpose(),
        Some(_) => Ok(Some(Signal { unit: common.unit, gain: common.gain, offset: common.offset, ..column(t, key)? })),
    }
}

/// A column in a quantity of any kind, with nothing in common with others.
pub(super) fn plain_signal(t: &Table<'_>, key: &'static str) -> Result<Option<Signal>, FileError> {
    signal(t, key, None, &Common { unit: None, gain: 1.0, offset: Offset::Value(0.0) })
}

fn from_table(t: &Table<'_>, quantity: Option<Quantity>, common: &Common) -> Result<Signal, FileError> {
    let alternate = signal(t, "alternate", quantity, common)?.map(Box::new);
    let calibrate = t
        .table("calibrate", &["from_s", "to_s", "value"])?
        .map(|c| {
            let need = |key| c.number(key, ANY)?.ok_or_else(|| c.missing(key, "calibrate = { from_s = …, to_s = …, value = … }"));
            Ok(Calibration { from_s: need("from_s")?, to_s: need("to_s")?, value: need("value")? })
        })
        .transpose()?;
    if calibrate.is_some() && t.has("gain") {
        return Err(t.unexpected("gain", "given beside calibrate", "one of them: calibrate finds the gain"));
    }
    Ok(Signal {
        unit: unit(t, quantity)?.or(common.unit),
        gain: gain(t)?.unwrap_or(common.gain),
        offset: offset(t)?.unwrap_or(common.offset),
        calibrate,
        alternate,
        ..column(t, "column")?
    })
}

fn column(t: &Table<'_>, key: &'static str) -> Result<Signal, FileError> {
    let column = match t.kind(key) {
        Some(Kind::Text) => Column::Name(t.text(key)?.unwrap_or_default().to_owned()),
        Some(Kind::Whole) => Column::Number(t.whole(key, (1, 10_000))?.unwrap_or(1) as usize),
        None => return Err(t.missing(key, COLUMN)),
        Some(_) => return Err(t.unexpected(key, t.found(key), COLUMN)),
    };
    Ok(Signal { column, line: t.line(key), ..Signal::plain("") })
}

fn gain(t: &Table<'_>) -> Result<Option<f64>, FileError> {
    match t.number("gain", ANY)? {
        Some(0.0) => Err(t.unexpected("gain", "0", "another number: a gain of zero leaves nothing")),
        other => Ok(other),
    }
}

fn offset(t: &Table<'_>) -> Result<Option<Offset>, FileError> {
    const EXPECTED: &str = "a number in the column's own unit, \"mean\", or { mean_before_s = … }";
    match t.kind("offset") {
        None => Ok(None),
        Some(Kind::Whole | Kind::Float) => Ok(t.number("offset", ANY)?.map(Offset::Value)),
        Some(Kind::Text) if t.text("offset")? == Some("mean") => Ok(Some(Offset::Mean)),
        Some(Kind::Table) => match t.table("offset", &["mean_before_s"])? {
            Some(inner) => {
                let until = inner.number("mean_before_s", ANY)?.ok_or_else(|| inner.missing("mean_before_s", EXPECTED))?;
                Ok(Some(Offset::MeanBefore(until)))
            }
            None => Ok(None),
        },
        Some(_) => Err(t.unexpected("offset", t.found("offset"), EXPECTED)),
    }
}

fn unit(t: &Table<'_>, quantity: Option<Quantity>) -> Result<Option<f64>, FileError> {
    let Some(text) = t.text("unit")? else { return Ok(None) };
    let fits = |q| quantity.is_none_or(|wanted| wanted == q);
    match named(text).filter(|u| fits(u.quantity)) {
        Some(u) => Ok(Some(u.si)),
        None => {
            let words: Vec<_> = UNITS.iter().filter(|u| fits(u.quantity)).map(|u| u.text).collect();
            let problem = Problem::Unexpected { found: format!("\"{text}\""), expected: format!("one of {}", words.join(", ")) };
            Err(t.fail("unit", problem))
        }
    }
}
