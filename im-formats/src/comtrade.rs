//! COMTRADE: a configuration as text (`.cfg`) and the samples beside it (`.dat`), or both in one file (`.cff`).
//!
//! Source: IEEE C37.111-1991, -1999, -2013 (IEC 60255-24). A value is a · x + b in the unit of its channel. A channel on the secondary
//! side of an instrument transformer is brought to the primary, where the machine is. Status channels are left out.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::align::{Column, Group, table};
use crate::numbers::Number;
use crate::{FIRST_BYTES, Format, FormatError, Table};

mod config;

use config::{Config, Samples};

const FORMAT: Format = Format::Comtrade;
/// The first line of a file that holds both.
const COMBINED: &str = "--- file type: CFG";

/// Whether a file is one: a `.cfg` with a line of counts, a `.dat` with a `.cfg` beside it, or a combined file.
pub(crate) fn is_one(first: &[u8], path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
    match extension.as_str() {
        "cfg" => config::looks_like(first),
        "dat" => sibling(path, "cfg").is_some_and(|cfg| first_of(&cfg).is_ok_and(|first| config::looks_like(&first))),
        "cff" => true,
        _ => first.starts_with(COMBINED.as_bytes()),
    }
}

/// The file of the same name with another ending, in either case.
fn sibling(path: &Path, ending: &str) -> Option<PathBuf> {
    [ending.to_owned(), ending.to_uppercase()].into_iter().map(|e| path.with_extension(e)).find(|p| p.is_file())
}

fn first_of(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut first = Vec::new();
    File::open(path)?.take(FIRST_BYTES as u64).read_to_end(&mut first)?;
    Ok(first)
}

/// Reads a recording by the name of any of its files.
pub(crate) fn read(path: &Path) -> Result<Table, FormatError> {
    let is = |ending: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    if !is("cfg") && !is("dat") {
        return combined(&std::fs::read(path)?);
    }
    let beside =
        |ending: &str| sibling(path, ending).ok_or_else(|| invalid(format!("there is no .{ending} of the same name beside it")));
    let config = std::fs::read(if is("cfg") { path.to_owned() } else { beside("cfg")? })?;
    let samples = std::fs::read(if is("dat") { path.to_owned() } else { beside("dat")? })?;
    decoded(&Config::parse(&String::from_utf8_lossy(&config))?, &samples)
}

/// Sections, each under a line `--- file type: … ---`.
fn combined(bytes: &[u8]) -> Result<Table, FormatError> {
    let mut config = None;
    let mut rest = bytes;
    while let Some(end) = rest.iter().position(|b| *b == b'\n') {
        let line = String::from_utf8_lossy(&rest[..end]).trim().to_uppercase();
        rest = &rest[end + 1..];
        let Some(kind) = line.strip_prefix("--- FILE TYPE:") else { continue };
        match kind.trim() {
            kind if kind.starts_with("CFG") => config = Some(Config::parse(&String::from_utf8_lossy(rest))?),
            kind if kind.starts_with("DAT") => {
                let config = config.ok_or_else(|| invalid("its data stands before its configuration".to_owned()))?;
                let text = rest.windows(4).position(|w| w == b"--- ").unwrap_or(rest.len());
                let data = if matches!(config.samples, Samples::Ascii) { &rest[..text] } else { rest };
                return decoded(&config, data);
            }
            _ => {}
        }
    }
    Err(invalid("a combined file without a section of data".to_owned()))
}

fn invalid(reason: String) -> FormatError {
    FormatError::Invalid { format: FORMAT, reason }
}

fn decoded(config: &Config, data: &[u8]) -> Result<Table, FormatError> {
    let rows = match config.samples {
        Samples::Ascii => text_rows(config, data)?,
        Samples::Binary(number, missing) => binary_rows(config, data, number, missing)?,
    };
    let times: Vec<f64> = match config.times(rows.len()) {
        Some(by_rate) if by_rate.len() == rows.len() => by_rate,
        Some(by_rate) => {
            let reason = format!("its .cfg tells the times of {} rows, but there are {}", by_rate.len(), rows.len());
            return Err(invalid(reason));
        }
        None => rows.iter().map(|(stamp, _)| stamp * config.stamp_s).collect(),
    };
    let mut groups: Vec<(f64, Group)> = Vec::new();
    for (k, channel) in config.analog.iter().enumerate() {
        let values = rows.iter().map(|(_, x)| channel.gain * x[k] + channel.offset).collect();
        let column = Column::new(&channel.name, &channel.unit, values);
        match groups.iter_mut().find(|(skew, _)| *skew == channel.skew_s) {
            Some((_, group)) => group.columns.push(column),
            None => {
                let time = Column::new("t", "s", times.iter().map(|t| t + channel.skew_s).collect());
                let group = Group { name: config.station.clone(), time: Some(time), columns: vec![column] };
                groups.push((channel.skew_s, group));
            }
        }
    }
    let left_out = if config.status == 0 { vec![] } else { vec![format!("{} status channels", config.status)] };
    table(FORMAT, groups.into_iter().map(|(_, g)| g).collect(), left_out)
}

/// The time stamp of a row, and its values as they stand.
type Row = (f64, Vec<f64>);

fn text_rows(config: &Config, data: &[u8]) -> Result<Vec<Row>, FormatError> {
    let text = String::from_utf8_lossy(data);
    let mut rows = Vec::new();
    for (k, line) in text.split(['\n', '\u{1a}']).map(str::trim).enumerate().filter(|(_, l)| !l.is_empty()) {
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        let number = |field: &&str| match *field {
            "" => Some(f64::NAN),
            "99999" if config.marks_missing => Some(f64::NAN),
            text => text.parse::<f64>().ok().filter(|x| x.is_finite()),
        };
        let values = fields.get(2..2 + config.analog.len());
        let Some(values) = values else {
            let reason =
                format!("line {} of its data has {} fields, of which {} are expected", k + 1, fields.len(), config.fields());
            return Err(invalid(reason));
        };
        let values: Option<Vec<f64>> = values.iter().map(number).collect();
        match (number(&fields[1]), values) {
            (Some(stamp), Some(values)) => rows.push((stamp, values)),
            _ => return Err(invalid(format!("line {} of its data holds something else than numbers", k + 1))),
        }
    }
    Ok(rows)
}

/// Rows of a number and a time stamp of four bytes each, the channels, and the states in words of sixteen.
fn binary_rows(config: &Config, data: &[u8], number: Number, missing: f64) -> Result<Vec<Row>, FormatError> {
    let row = 8 + config.analog.len() * number.size() + config.status.div_ceil(16) * 2;
    if !data.len().is_multiple_of(row) {
        return Err(invalid(format!("its data of {} bytes is not rows of {row}, as its .cfg says", data.len())));
    }
    let values = |bytes: &[u8]| {
        let stamp = Number::U32.all(&bytes[4..8], false).next().unwrap_or(f64::NAN);
        let end = 8 + config.analog.len() * number.size();
        (stamp, number.all(&bytes[8..end], false).map(|x| if x == missing { f64::NAN } else { x }).collect())
    };
    Ok(data.chunks_exact(row).map(values).collect())
}
