//! How an unknown text of rows is written: separator, decimal comma, where the names and the numbers begin.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use im_model::{FileError, TextFormat, fields_of, number_in};

use super::raw::{self, Kind};

/// Lines that are looked at, and rows of numbers in a row that make a table.
const LINES: usize = 200;
const TABLE: usize = 3;
/// Columns a recording has at least: time, a voltage, a current.
const COLUMNS: usize = 3;

/// What was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sniffed {
    /// How to read it.
    pub format: TextFormat,
    /// A line of units under the names, where there is one.
    pub units: Vec<String>,
    /// What another program's file holds beside its columns.
    pub left_out: Vec<String>,
}

/// Looks at the beginning of a file.
///
/// # Errors
/// The file cannot be read.
pub fn sniff(path: &Path, label: &str) -> Result<Sniffed, FileError> {
    let io = |e: std::io::Error| FileError::io(label, "read", &e);
    let mut file = File::open(path).map_err(io)?;
    match raw::kind_of(&mut file, path).map_err(io)? {
        Kind::Parquet => return Ok(Sniffed::default()),
        Kind::OtherPrograms => return Ok(Sniffed { left_out: raw::other_programs(path, label)?.1, ..Sniffed::default() }),
        Kind::Text => {}
    }
    let source = BufReader::new(file.take(1 << 20));
    let mut lines = Vec::new();
    for line in source.split(b'\n').take(LINES) {
        lines.push(
            String::from_utf8_lossy(&line.map_err(io)?).trim_start_matches('\u{feff}').trim_matches([' ', '\r']).to_owned(),
        );
    }
    Ok(of_lines(&lines))
}

fn of_lines(lines: &[String]) -> Sniffed {
    let mut best: Option<(usize, usize, u8, bool)> = None;
    for (separator, comma) in
        [(b';', false), (b';', true), (b'\t', false), (b'\t', true), (b',', false), (b' ', false), (b' ', true)]
    {
        let shape = |line: &String| {
            let f = fields_of(line, separator);
            (f.len(), f.iter().filter(|x| is_number(x, comma)).count())
        };
        let shapes: Vec<(usize, usize)> = lines.iter().map(shape).collect();
        let table = |k: &usize| {
            let (count, _) = shapes[*k];
            let rows = &shapes[*k..(*k + TABLE).min(shapes.len())];
            rows.iter().all(|(c, numbers)| *c == count && *numbers >= COLUMNS && 2 * *numbers > count)
        };
        if let Some(first) = (0..lines.len().saturating_sub(TABLE - 1)).find(table) {
            let numbers = shapes[first].1;
            if best.is_none_or(|(n, ..)| numbers > n) {
                best = Some((numbers, first, separator, comma));
            }
        }
    }
    let Some((_, first, separator, comma)) = best else {
        return Sniffed::default();
    };
    let count = fields_of(&lines[first], separator).len();
    let heads = |line: &String| {
        let f = fields_of(line, separator);
        // A spreadsheet fills a line of remarks up with empty fields.
        let filled = f.iter().filter(|x| !x.trim().is_empty()).count();
        f.len() == count && 2 * filled > count && !line.starts_with('#') && f.iter().all(|x| !is_number(x, comma))
    };
    let head = lines[..first].iter().position(heads);
    let units = head
        .and_then(|h| lines[h + 1..first].iter().find(|l| heads(l)))
        .map(|l| fields_of(l, separator).iter().map(|f| f.trim_matches(['(', ')', '[', ']', ' ', '"']).to_owned()).collect());
    let format = TextFormat {
        separator: Some(separator),
        decimal_comma: comma,
        header: Some(head.is_some()),
        skip_lines: head.unwrap_or(first),
        skip_after_header: head.map_or(0, |h| first - h - 1),
        ..TextFormat::default()
    };
    Sniffed { format, units: units.unwrap_or_default(), left_out: Vec::new() }
}

fn is_number(text: &str, comma: bool) -> bool {
    // A point alone is no decimal comma's.
    number_in(text, comma).is_some() && (!comma || !text.contains('.') || text.contains(','))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Sniffed {
        of_lines(&text.lines().map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn scopes_spreadsheets_and_bare_numbers_are_distinguished() {
        let scope = of("Time,Channel A,Channel B\n(ms),(V),(mA)\n\n0.0,1.5,2\n0.1,1.6,3\n0.2,1.6,3\n");
        let f = scope.format;
        assert_eq!(
            (f.separator, f.decimal_comma, f.header, f.skip_lines, f.skip_after_header),
            (Some(b','), false, Some(true), 0, 2)
        );
        assert_eq!(scope.units, ["ms", "V", "mA"]);
        let german = of("Messung vom 3.4.\nZeit;U1;I1\n0,0;1,5;2\n0,1;1,6;3\n0,2;1,6;3,5\n").format;
        assert_eq!((german.separator, german.decimal_comma, german.skip_lines), (Some(b';'), true, 1));
        // As spreadsheets write it: remarks filled up with separators, points between thousands.
        let sheet =
            of("Messung 3;;\nDatum: 1.2.;;\nZeit (ms);U1;n\n999,9;1,5;1.000,5\n1.000,0;1,6;1.001,5\n1.000,1;1,6;1.002,0\n")
                .format;
        assert_eq!((sheet.separator, sheet.decimal_comma, sheet.skip_lines, sheet.header), (Some(b';'), true, 2, Some(true)));
        let bare = of("0.0 1.5 2\n0.1  1.6 3\n0.2 1.6 3\n").format;
        assert_eq!((bare.separator, bare.header, bare.skip_lines), (Some(b' '), Some(false), 0));
    }
}
