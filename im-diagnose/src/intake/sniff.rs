//! How an unknown text of rows is written: separator, decimal comma, where the names and the numbers begin.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use im_model::{AsUtf8, FileError, TextFormat, fields_of, number_in, time_of_day};

use super::mapping::TextSaid;
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

/// Looks at the beginning of a file, where `said` does not say how it is written.
///
/// # Errors
/// The file cannot be read.
pub fn sniff(path: &Path, label: &str, said: TextSaid) -> Result<Sniffed, FileError> {
    let io = |e: std::io::Error| FileError::io(label, "read", &e);
    let mut file = File::open(path).map_err(io)?;
    match raw::kind_of(&mut file, path).map_err(io)? {
        Kind::Parquet => return Ok(Sniffed::default()),
        Kind::OtherPrograms => return Ok(Sniffed { left_out: raw::other_programs(path, label)?.1, ..Sniffed::default() }),
        Kind::Workbook => return raw::open(path, label, TextFormat::default()).map(|_| Sniffed::default()),
        Kind::Text => {}
    }
    let source = BufReader::new(AsUtf8::new(file).take(1 << 20));
    let mut lines = Vec::new();
    for line in source.split(b'\n').take(LINES) {
        lines.push(
            String::from_utf8_lossy(&line.map_err(io)?).trim_start_matches('\u{feff}').trim_matches([' ', '\r']).to_owned(),
        );
    }
    Ok(of_lines(&lines, said))
}

fn of_lines(lines: &[String], said: TextSaid) -> Sniffed {
    let skipped = said.skip_lines.unwrap_or(0).min(lines.len());
    let lines = &lines[skipped..];
    let mut best: Option<(usize, usize, u8, bool)> = None;
    // A short table ends with its file.
    let end = lines.iter().rposition(|l| !l.is_empty()).map_or(0, |k| k + 1);
    let is_whole = skipped + lines.len() < LINES;
    let usual = [(b';', false), (b';', true), (b'\t', false), (b'\t', true), (b',', false), (b' ', false), (b' ', true)];
    let usual = usual.map(|(s, comma)| (said.separator.unwrap_or(s), said.decimal_comma.unwrap_or(comma)));
    for (separator, comma) in usual {
        let shape = |line: &String| {
            let f = fields_of(line, separator);
            (f.len(), f.iter().filter(|x| is_number(x, comma)).count())
        };
        let shapes: Vec<(usize, usize)> = lines.iter().map(shape).collect();
        let table = |k: &usize| {
            let (count, _) = shapes[*k];
            let rows = &shapes[*k..(*k + TABLE).min(end)];
            (rows.len() == TABLE || is_whole)
                && rows.iter().all(|(c, numbers)| *c == count && *numbers >= COLUMNS && 2 * *numbers > count)
        };
        if let Some(first) = (0..end).find(table) {
            let numbers = shapes[first].1;
            if best.is_none_or(|(n, ..)| numbers > n) {
                best = Some((numbers, first, separator, comma));
            }
        }
    }
    let Some((_, first, separator, comma)) = best else {
        return Sniffed { format: said.over(TextFormat::default()), ..Sniffed::default() };
    };
    let count = fields_of(&lines[first], separator).len();
    let comment = char::from(said.comment.unwrap_or(TextFormat::default().comment));
    let heads = |line: &String| {
        let f = fields_of(line, separator);
        // A spreadsheet fills a line of remarks up with empty fields.
        let filled = f.iter().filter(|x| !x.trim().is_empty()).count();
        f.len() == count && 2 * filled > count && !line.starts_with(comment) && f.iter().all(|x| !is_number(x, comma))
    };
    let distinct = |line: &String| {
        let mut names: Vec<String> = fields_of(line, separator).iter().map(|f| f.trim().to_owned()).collect();
        names.sort_unstable();
        names.windows(2).all(|w| w[0] != w[1])
    };
    let head = match (said.header, said.skip_lines) {
        (Some(false), _) => None,
        (_, Some(_)) => (first > 0).then_some(0),
        // A line of units or settings above the names says the same of several columns; names tell them apart.
        _ => lines[..first].iter().position(|l| heads(l) && distinct(l)).or_else(|| lines[..first].iter().position(heads)),
    };
    let units = head
        .and_then(|h| lines[h + 1..first].iter().find(|l| heads(l)))
        .map(|l| fields_of(l, separator).iter().map(|f| f.trim_matches(['(', ')', '[', ']', ' ', '"']).to_owned()).collect());
    let format = TextFormat {
        separator: Some(separator),
        decimal_comma: comma,
        header: Some(head.is_some()),
        skip_lines: skipped + head.unwrap_or(first),
        skip_after_header: head.map_or(0, |h| first - h - 1),
        ..TextFormat::default()
    };
    Sniffed { format: said.over(format), units: units.unwrap_or_default(), left_out: Vec::new() }
}

fn is_number(text: &str, comma: bool) -> bool {
    // A point alone is no decimal comma's.
    let number = number_in(text, comma).is_some() && (!comma || !text.contains('.') || text.contains(','));
    number || time_of_day(text).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Sniffed {
        said(text, TextSaid::default())
    }

    fn said(text: &str, said: TextSaid) -> Sniffed {
        of_lines(&text.lines().map(str::to_owned).collect::<Vec<_>>(), said)
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
        let one_row = of("Spannung (V);Strom (A);Leistung (W)\n230,5;2,1;180,4\n").format;
        assert_eq!((one_row.separator, one_row.decimal_comma, one_row.skip_lines), (Some(b';'), true, 0));
        // As spreadsheets write it: remarks filled up with separators, points between thousands.
        let sheet =
            of("Messung 3;;\nDatum: 1.2.;;\nZeit (ms);U1;n\n999,9;1,5;1.000,5\n1.000,0;1,6;1.001,5\n1.000,1;1,6;1.002,0\n")
                .format;
        assert_eq!((sheet.separator, sheet.decimal_comma, sheet.skip_lines, sheet.header), (Some(b';'), true, 2, Some(true)));
        // A scope's settings, a value for each channel, stand above the names.
        let settings =
            of("Model,X\nProbe,1,1,1\nVertical Units,V,V,V\n\nTIME,CH1,CH2,CH3\n0.0,1.5,2,1\n0.1,1.6,3,1\n0.2,1.6,3,1\n").format;
        assert_eq!((settings.separator, settings.skip_lines, settings.skip_after_header), (Some(b','), 4, 0));
        let bare = of("0.0 1.5 2\n0.1  1.6 3\n0.2 1.6 3\n").format;
        assert_eq!((bare.separator, bare.header, bare.skip_lines), (Some(b' '), Some(false), 0));
    }

    #[test]
    fn what_is_said_of_a_text_is_kept_and_the_rest_is_seen() {
        let text = "Messung;;\nU;I;n\n1;2;3\nt;u;i\ns;V;A\n0,0;1,5;2\n0,1;1,6;3\n0,2;1,6;3,5\n";
        let f = said(text, TextSaid { skip_lines: Some(3), ..TextSaid::default() }).format;
        assert_eq!(
            (f.separator, f.decimal_comma, f.header, f.skip_lines, f.skip_after_header),
            (Some(b';'), true, Some(true), 3, 1)
        );
        let f = said(text, TextSaid { separator: Some(b'|'), decimal_comma: Some(true), ..TextSaid::default() }).format;
        assert_eq!((f.separator, f.decimal_comma, f.skip_lines), (Some(b'|'), true, 0));
        let f = said("a b c\n1 2 3\n1 2 3\n1 2 3\n", TextSaid { header: Some(false), ..TextSaid::default() }).format;
        assert_eq!((f.header, f.skip_lines), (Some(false), 1));
        // A date and a time of day are columns of numbers, or one.
        let f = of("t;u;i\n2026-03-01 12:00:00,000;1,5;2\n2026-03-01 12:00:00,001;1,5;2\n2026-03-01 12:00:00,002;1,5;2\n").format;
        assert_eq!((f.separator, f.decimal_comma, f.header), (Some(b';'), true, Some(true)));
    }
}
