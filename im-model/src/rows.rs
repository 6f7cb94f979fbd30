//! Rows of numbers in a text: the part of reading recordings that does not know what the columns mean.
//!
//! Rows are read one by one, so that memory stays at about the size of what the caller keeps.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use crate::file_error::{FileError, Problem};
use crate::toml_text::nearest;
use crate::utf16::AsUtf8;

/// No row is longer, with all lines in its quotes: a file without line ends is refused before it fills the memory.
const LONGEST_ROW: u64 = 1 << 20;
/// How far a step of time may lie from the usual one: written times are rounded, missing rows are a whole step.
const UNEVEN: f64 = 0.25;

/// How a text of rows is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextFormat {
    /// Between the fields; a space stands for any white space. Guessed from the first line when absent: semicolon, tab, comma, space.
    pub separator: Option<u8>,
    /// Numbers are written 1,5 rather than 1.5.
    pub decimal_comma: bool,
    /// Whether the first line names the columns; without it columns are called 1, 2, 3 … Guessed from the first line when absent.
    pub header: Option<bool>,
    /// Lines before the first one that counts.
    pub skip_lines: usize,
    /// Lines between the names and the first row, such as one of units.
    pub skip_after_header: usize,
    /// What a line begins with that is passed over.
    pub comment: u8,
}

impl Default for TextFormat {
    fn default() -> Self {
        Self { separator: None, decimal_comma: false, header: None, skip_lines: 0, skip_after_header: 0, comment: b'#' }
    }
}

/// Reads rows of numbers under named columns.
pub struct Rows<'a, R> {
    source: BufReader<AsUtf8<R>>,
    label: &'a str,
    /// Length of the source, if known.
    bytes: u64,
    line: Vec<u8>,
    /// Where `line` begins, from 1, and how many lines are read.
    line_number: usize,
    lines_read: usize,
    bytes_read: u64,
    format: TextFormat,
    separator: u8,
    fields: Fields,
    names: Vec<String>,
    /// Columns whose fields must be finite numbers.
    needed: Vec<bool>,
    /// Columns of these whose fields may be empty.
    may_be_empty: Vec<bool>,
    /// The column of time, once it is known.
    time: Option<usize>,
    /// What each column has shown of times of day.
    clocks: Vec<Clock>,
    /// The line that was read for the names is the first row.
    pending: bool,
    rows: usize,
    /// Where the lines before a row changed in number: first row of it, line less row.
    offsets: Vec<(usize, usize)>,
    before_rows: u64,
}

impl<'a> Rows<'a, File> {
    /// Opens a file and reads its line of column names.
    ///
    /// # Errors
    /// The file cannot be read, is empty, or is no text.
    pub fn open(path: &Path, label: &'a str, format: TextFormat) -> Result<Self, FileError> {
        let io = |e: io::Error| FileError::io(label, "read", &e);
        let file = File::open(path).map_err(io)?;
        let bytes = file.metadata().map_err(io)?.len();
        Self::new(file, label, bytes, format)
    }
}

impl<'a, R: Read> Rows<'a, R> {
    /// Reads the line of column names; `label` names the source in messages, `bytes` is its length or 0.
    ///
    /// # Errors
    /// The source cannot be read, is empty, or is no text.
    pub fn new(source: R, label: &'a str, bytes: u64, format: TextFormat) -> Result<Self, FileError> {
        let mut this = Self {
            source: BufReader::with_capacity(1 << 17, AsUtf8::new(source)),
            label,
            bytes,
            line: Vec::new(),
            line_number: 0,
            lines_read: 0,
            bytes_read: 0,
            format,
            separator: b',',
            fields: Fields::new(b','),
            names: Vec::new(),
            needed: Vec::new(),
            may_be_empty: Vec::new(),
            time: None,
            clocks: Vec::new(),
            pending: false,
            rows: 0,
            offsets: Vec::new(),
            before_rows: 0,
        };
        for _ in 0..format.skip_lines {
            this.raw_line()?;
        }
        if !this.next_line()? {
            return Err(FileError::new(label, None, None, Problem::NoRows { found: "the file is empty" }));
        }
        let head = this.text()?.trim_start_matches('\u{feff}').to_owned();
        this.separator = format.separator.unwrap_or_else(|| separator_of(&head));
        this.fields = Fields::new(this.separator);
        this.split(head.into_bytes())?;
        this.names = this.fields.iter().map(name).collect();
        // A separator at the end of the line begins no column.
        this.names.truncate(this.names.iter().rposition(|n| !n.is_empty()).map_or(1, |last| last + 1));
        let is_number = |n: &String| number(n.as_bytes(), format.decimal_comma).or_else(|| time_of_day(n)).is_some();
        let numbers = this.names.iter().all(is_number);
        if !format.header.unwrap_or(!numbers) {
            this.pending = true;
            this.names = (1..=this.names.len()).map(|k| k.to_string()).collect();
        } else {
            for _ in 0..format.skip_after_header {
                this.raw_line()?;
            }
        }
        this.needed = vec![false; this.names.len()];
        this.may_be_empty = this.needed.clone();
        this.clocks = vec![Clock::default(); this.names.len()];
        this.before_rows = this.bytes_read;
        Ok(this)
    }

    /// The names of the columns.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Whether the file names its columns.
    pub fn has_names(&self) -> bool {
        !self.pending || self.rows > 0
    }

    /// What separates the fields.
    pub fn separator(&self) -> u8 {
        self.separator
    }

    /// From now on the fields of `column` must be finite numbers; those of others are NaN where they are not.
    pub fn require(&mut self, column: usize) {
        self.needed[column] = true;
    }

    /// Whether the fields of a column must be numbers, or empty.
    pub fn is_required(&self, column: usize) -> bool {
        self.needed[column]
    }

    /// Whether fields stand between this byte.
    pub fn separated_by(&self, separator: u8) -> bool {
        self.separator == separator
    }

    /// From now on the fields of `column` must be finite numbers or empty; an empty one is NaN.
    pub fn require_where_given(&mut self, column: usize) {
        self.require(column);
        self.may_be_empty[column] = true;
    }

    /// From now on `column` is the one of time: it may hold times of day, and messages name a row's time.
    pub fn time_in(&mut self, column: usize) {
        self.time = Some(column);
    }

    /// Whether a column has shown times of day so far; they are read as seconds since midnight, and go on over the next.
    pub fn is_clock(&self, column: usize) -> bool {
        self.clocks[column].shown
    }

    /// Reads the next row into `row`, one number per column; `false` at the end.
    ///
    /// # Errors
    /// A row with too few or too many fields, or a required field that is not a finite number, with its line and column.
    pub fn next(&mut self, row: &mut [f64]) -> Result<bool, FileError> {
        let at_hand = self.pending && self.rows == 0;
        if !at_hand && !self.next_line()? {
            return Ok(false);
        }
        let offset = self.line_number - self.rows;
        if self.offsets.last().is_none_or(|(_, o)| *o != offset) {
            self.offsets.push((self.rows, offset));
        }
        self.rows += 1;
        self.row(row)?;
        Ok(true)
    }

    /// How many more rows there are, guessed from the length of the file and of the rows so far.
    pub fn rows_ahead(&self) -> usize {
        let per_row = ((self.bytes_read - self.before_rows) / self.rows.max(1) as u64).max(1);
        let more = (self.bytes.saturating_sub(self.bytes_read) / per_row) as usize;
        more + more / 50
    }

    /// The line in the file of row `k`, counted from 0.
    pub fn line_of(&self, k: usize) -> usize {
        k + self.offsets.iter().rev().find(|(from, _)| *from <= k).map_or(0, |(_, o)| *o)
    }

    /// The line in the file of every row: where the rows begin at which line less row.
    pub fn line_offsets(&self) -> &[(usize, usize)] {
        &self.offsets
    }

    /// The next line, whatever it holds; `false` at the end.
    fn raw_line(&mut self) -> Result<bool, FileError> {
        self.line_number = self.lines_read + 1;
        let mut line = std::mem::take(&mut self.line);
        line.clear();
        let n = self.read_line(&mut line, LONGEST_ROW)?;
        self.line = line;
        if n as u64 == LONGEST_ROW && self.line.last() != Some(&b'\n') {
            return Err(self.not_text());
        }
        Ok(n > 0)
    }

    /// Appends a line of at most `room` bytes; how many there were.
    fn read_line(&mut self, line: &mut Vec<u8>, room: u64) -> Result<usize, FileError> {
        let n = (&mut self.source).take(room).read_until(b'\n', line).map_err(|e| FileError::io(self.label, "read", &e))?;
        self.lines_read += usize::from(n > 0);
        self.bytes_read += n as u64;
        let controls = |b: &u8| b.is_ascii_control() && !b.is_ascii_whitespace();
        // What German instruments write on Windows; of a binary file nothing is made.
        if std::str::from_utf8(line).is_err() && !line.iter().any(controls) {
            let latin_1: String = line.iter().copied().map(char::from).collect();
            *line = latin_1.into_bytes();
        }
        Ok(n)
    }

    /// The next line with content; `false` at the end.
    fn next_line(&mut self) -> Result<bool, FileError> {
        while self.raw_line()? {
            let content = self.line.trim_ascii();
            if !content.is_empty() && content[0] != self.format.comment {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The line as text.
    fn text(&self) -> Result<&str, FileError> {
        match std::str::from_utf8(self.line.trim_ascii()) {
            Ok(text) if !text.contains('\0') => Ok(text),
            _ => Err(self.not_text()),
        }
    }

    fn not_text(&self) -> FileError {
        let reason = "no text in UTF-8, UTF-16 or Latin-1 (a workbook?); export the recording as CSV in UTF-8".to_owned();
        self.error(None, Problem::Syntax { reason })
    }

    /// Splits the row that begins with `line`; gives back its last line.
    fn split(&mut self, mut line: Vec<u8>) -> Result<Vec<u8>, FileError> {
        self.fields.begin();
        let mut room = LONGEST_ROW;
        while !self.fields.feed(&line) {
            room = room.saturating_sub(line.len() as u64);
            line.clear();
            if self.read_line(&mut line, room)? == 0 {
                let reason = "a quote opens in this row and is not closed".to_owned();
                return Err(self.error(None, Problem::Syntax { reason }));
            }
        }
        Ok(line)
    }

    /// The numbers of the line.
    fn row(&mut self, row: &mut [f64]) -> Result<(), FileError> {
        let line = std::mem::take(&mut self.line);
        self.line = self.split(line)?;
        let mut found = 0;
        for field in self.fields.iter() {
            if let Some(x) = row.get_mut(found) {
                let clock = !self.needed[found] || self.time == Some(found);
                let of_day = || if clock { self.clocks[found].read(field) } else { None };
                *x = number(field, self.format.decimal_comma).or_else(of_day).unwrap_or(f64::NAN);
                let empty = self.may_be_empty[found] && field.trim_ascii().is_empty();
                if !x.is_finite() && self.needed[found] && !empty {
                    return Err(self.bad_field(found));
                }
            } else if found == row.len() && field.trim_ascii().is_empty() {
                // A separator at the end of the line.
                continue;
            }
            found += 1;
        }
        if found == row.len() { Ok(()) } else { self.row_length(found) }
    }

    #[cold]
    fn bad_field(&self, column: usize) -> FileError {
        let fields = self.fields.iter().count();
        let cut = self.line.last() != Some(&b'\n') && fields < self.names.len();
        if cut {
            let problem = Problem::RowLength { found: fields, expected: self.names.len(), last: true };
            return self.error(None, problem);
        }
        let text = |column: usize| -> String {
            let field = self.fields.iter().nth(column).unwrap_or_default();
            String::from_utf8_lossy(field.trim_ascii()).chars().take(40).collect()
        };
        let field = text(column);
        let found = match field.parse::<f64>() {
            _ if field.is_empty() => String::new(),
            Ok(x) => x.to_string(),
            Err(_) => format!("\"{field}\""),
        };
        let time = self.time.filter(|t| *t != column);
        let at = time.map_or_else(String::new, |t| format!(" at {} = {}", self.names[t], text(t)));
        self.error(self.names.get(column).map(String::as_str), Problem::NotANumber { found, at })
    }

    #[cold]
    fn row_length(&mut self, found: usize) -> Result<(), FileError> {
        let at = self.line_number;
        let last = !self.next_line()?;
        let problem = Problem::RowLength { found, expected: self.names.len(), last };
        Err(FileError::new(self.label, Some(at), None, problem))
    }

    /// An error at the line that was read last.
    pub fn error(&self, column: Option<&str>, problem: Problem) -> FileError {
        FileError::new(self.label, (self.line_number > 0).then_some(self.line_number), column, problem)
    }

    /// The place of a column.
    ///
    /// # Errors
    /// The name stands twice.
    pub fn find(&self, name: &str) -> Result<Option<usize>, FileError> {
        let mut places = self.names.iter().enumerate().filter(|(_, n)| *n == name).map(|(k, _)| k);
        match (places.next(), places.next()) {
            (Some(a), Some(b)) => Err(self.error(Some(name), Problem::DuplicateColumn { places: [a + 1, b + 1] })),
            (first, _) => Ok(first),
        }
    }

    /// The error that a column is missing; `candidate` says which of those there may be meant for it.
    pub fn missing(&self, name: &str, candidate: impl Fn(&str) -> bool) -> FileError {
        let nearest = self.like(name, candidate).map(str::to_owned);
        self.error(Some(name), Problem::MissingColumn { present: self.names.clone(), nearest })
    }

    /// The column among the candidates that looks like `name`.
    pub fn like(&self, name: &str, candidate: impl Fn(&str) -> bool) -> Option<&str> {
        nearest(name, self.names.iter().map(String::as_str).filter(|n| candidate(n)))
    }
}

/// Fields of a line, unquoted; a space separates at any white space, and then nothing is quoted.
pub fn fields_of(line: &str, separator: u8) -> Vec<String> {
    let mut fields = Fields::new(separator);
    fields.begin();
    fields.feed(line.as_bytes());
    fields.iter().map(|f| String::from_utf8_lossy(f).trim().to_owned()).collect()
}

/// The separator of a line of names: the first of semicolon, tab, comma and space that stands outside quotes.
fn separator_of(head: &str) -> u8 {
    let outside: Vec<u8> = head.split('"').step_by(2).flat_map(str::bytes).collect();
    [b';', b'\t', b',', b' '].into_iter().find(|s| outside.contains(s)).unwrap_or(b',')
}

/// The fields of a row. A line at a time is handed to the parser of the crate `csv`, whose own reader would take in a whole file
/// after a quote that is not closed.
struct Fields {
    csv: Box<csv_core::Reader>,
    white: bool,
    bytes: Vec<u8>,
    used: usize,
    ends: Vec<usize>,
    count: usize,
}

impl Fields {
    fn new(separator: u8) -> Self {
        let csv = csv_core::ReaderBuilder::new().delimiter(separator).terminator(csv_core::Terminator::Any(b'\n')).build();
        Self { csv: Box::new(csv), white: separator == b' ', bytes: Vec::new(), used: 0, ends: Vec::new(), count: 0 }
    }

    /// A new row.
    fn begin(&mut self) {
        (self.used, self.count) = (0, 0);
    }

    /// One more line of the row; `false` where a quote is still open at its end.
    fn feed(&mut self, line: &[u8]) -> bool {
        let kept = line.iter().rposition(|b| !matches!(b, b' ' | b'\r' | b'\n')).map_or(0, |last| last + 1);
        let line = &line[..kept];
        // Room for all that a line can hold.
        self.bytes.resize(self.bytes.len().max(self.used + line.len() + 1), 0);
        self.ends.resize(self.ends.len().max(self.count + line.len() + 2), 0);
        if self.white {
            for field in line.split(u8::is_ascii_whitespace).filter(|f| !f.is_empty()) {
                self.bytes[self.used..self.used + field.len()].copy_from_slice(field);
                self.used += field.len();
                self.ends[self.count] = self.used;
                self.count += 1;
            }
            return true;
        }
        // Nothing would be the end of the file to the parser.
        for part in [line, b"\n"].into_iter().filter(|part| !part.is_empty()) {
            let (bytes, ends) = (&mut self.bytes[self.used..], &mut self.ends[self.count..]);
            let (result, _, written, ended) = self.csv.read_record(part, bytes, ends);
            self.used += written;
            self.count += ended;
            if !matches!(result, csv_core::ReadRecordResult::InputEmpty) {
                return true;
            }
        }
        false
    }

    fn iter(&self) -> impl Iterator<Item = &[u8]> {
        let mut start = 0;
        self.ends[..self.count].iter().map(move |&end| &self.bytes[std::mem::replace(&mut start, end)..end])
    }
}

/// A column's name without quotes and line ends.
fn name(field: &[u8]) -> String {
    String::from_utf8_lossy(field).replace(['\r', '\n'], " ").trim().trim_matches('"').trim().to_owned()
}

/// The number that a field holds, finite or not, with a decimal point, or with a decimal comma and points between thousands.
pub fn number_in(field: &str, decimal_comma: bool) -> Option<f64> {
    number(field.as_bytes(), decimal_comma)
}

/// Seconds in a day.
const DAY_S: f64 = 86400.0;

/// A time as clocks show it, `12:34:56.789`, as seconds since midnight. A date before it, `2026-03-01T` or `1.3.2026 `, and a zone behind it
/// are passed over.
pub fn time_of_day(field: &str) -> Option<f64> {
    let field = field.trim().trim_matches('"');
    let clock = match field.rsplit_once(['T', ' ']) {
        Some((date, clock)) if date.bytes().all(|b| b.is_ascii_digit() || b"-./ ".contains(&b)) => clock,
        Some(_) => return None,
        None => field,
    };
    let clock = clock.strip_suffix('Z').or(clock.split(['+', '-']).next())?;
    let mut parts = clock.splitn(3, ':');
    let mut whole = |below: f64| {
        let part = parts.next().filter(|p| (1..=2).contains(&p.len()) && p.bytes().all(|b| b.is_ascii_digit()))?;
        part.parse().ok().filter(|x: &f64| *x < below)
    };
    let (hours, minutes) = (whole(24.0)?, whole(60.0)?);
    let seconds = parts.next().filter(|p| p.starts_with(|c: char| c.is_ascii_digit()))?;
    let seconds = seconds.replace(',', ".").parse().ok().filter(|x: &f64| *x < 61.0)?;
    Some(hours * 3600.0 + minutes * 60.0 + seconds)
}

/// The times of day of a column, row after row.
#[derive(Clone, Copy, Default)]
struct Clock {
    shown: bool,
    last_s: f64,
    /// The days that have passed.
    days_s: f64,
}

impl Clock {
    fn read(&mut self, field: &[u8]) -> Option<f64> {
        // Looked for first: columns of words are many.
        let of_day = field.contains(&b':').then(|| std::str::from_utf8(field).ok().and_then(time_of_day))??;
        // Back by more than half a day is midnight; by less, time that runs backwards.
        if self.shown && of_day < self.last_s - DAY_S / 2.0 {
            self.days_s += DAY_S;
        }
        (self.shown, self.last_s) = (true, of_day);
        Some(of_day + self.days_s)
    }
}

/// Whether points part the digits before a decimal comma into thousands: `1.234.567,8`.
fn in_thousands(whole: &[u8]) -> bool {
    let mut groups = whole.strip_prefix(b"-").unwrap_or(whole).split(|b| *b == b'.');
    let digits = |g: &[u8]| g.iter().all(u8::is_ascii_digit);
    groups.next().is_some_and(|g| (1..=3).contains(&g.len()) && digits(g)) && groups.all(|g| g.len() == 3 && digits(g))
}

/// A finite number or not, or `None` for what is no number at all.
fn number(field: &[u8], decimal_comma: bool) -> Option<f64> {
    let field = field.trim_ascii();
    // Quoted after a blank, which the parser takes for part of the field.
    let field = field.strip_prefix(b"\"").and_then(|f| f.strip_suffix(b"\"")).unwrap_or(field);
    let mut buffer = [0u8; 64];
    let field = if decimal_comma && field.contains(&b',') {
        let copy = buffer.get_mut(..field.len())?;
        copy.copy_from_slice(field);
        let comma = copy.iter().position(|b| *b == b',')?;
        let mut length = copy.len();
        if copy[..comma].contains(&b'.') {
            if !in_thousands(&copy[..comma]) {
                return None;
            }
            length = 0;
            for k in 0..copy.len() {
                if copy[k] != b'.' || k > comma {
                    copy[length] = copy[k];
                    length += 1;
                }
            }
        }
        copy.iter_mut().filter(|b| **b == b',').for_each(|b| *b = b'.');
        copy.get(..length)?
    } else {
        field
    };
    std::str::from_utf8(field).ok()?.parse().ok()
}

/// The sampling time of evenly spaced times, at least two.
///
/// # Errors
/// The row, counted from 0, where they are not evenly spaced, and what is wrong there.
pub fn sampling_time(time: &[f64]) -> Result<f64, (usize, Problem)> {
    // The median of the first thousand steps: a single gap does not move it.
    let mut steps: Vec<f64> = time.windows(2).take(1000).map(|w| w[1] - w[0]).collect();
    let middle = steps.len() / 2;
    let usual_s = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    for (k, w) in time.windows(2).enumerate() {
        let step_s = w[1] - w[0];
        if (step_s - usual_s).abs() > UNEVEN * usual_s {
            return Err((k + 1, Problem::TimeUneven { step_s, usual_s }));
        }
    }
    let (first, last) = (time[0], time[time.len() - 1]);
    let n = (time.len() - 1) as f64;
    let mean = (last - first) / n;
    // Steps can be even one by one and still change over the run.
    let drift = |k: &usize| (time[*k] - first - mean * *k as f64).abs() > mean;
    if let Some(k) = (0..time.len()).find(drift) {
        return Err((k, Problem::TimeUneven { step_s: (time[k] - first) / k as f64, usual_s: mean }));
    }
    // The shortest number, or whole frequency, that gives the last time as well as the mean does: 1e-4, not 1.0000000000000002e-4.
    let ulp = 4.0 * f64::EPSILON * first.abs().max(last.abs());
    let decimals = (0..=12).filter_map(|digits| format!("{mean:.digits$e}").parse::<f64>().ok());
    let whole_frequency = 1.0 / (1.0 / mean).round();
    let fits = |t: &f64| (first + n * t - last).abs() <= ulp;
    Ok(decimals.chain([whole_frequency]).find(fits).unwrap_or(mean))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_hold_separators_and_white_space_separates_only_where_nothing_else_does() {
        assert_eq!(fields_of("1\t, 2,,3", b','), ["1", "2", "", "3"]);
        assert_eq!(fields_of("1 \t 2  3", b' '), ["1", "2", "3"]);
        assert_eq!(fields_of("\"time, s\",\"u \"\"a\"\"\",3\r\n", b','), ["time, s", "u \"a\"", "3"]);
        assert_eq!(fields_of("1\t\t", b'\t'), ["1", "", ""]);
        assert_eq!(
            [separator_of("\"a;b\",c"), separator_of("a b"), separator_of("a;b,c"), separator_of("a")],
            [b',', b' ', b';', b',']
        );
    }

    fn table(text: &str, format: TextFormat) -> Result<(Vec<String>, Vec<Vec<f64>>), FileError> {
        let mut rows = Rows::new(text.as_bytes(), "t.csv", 0, format)?;
        let names = rows.names().to_vec();
        (0..names.len()).for_each(|k| rows.require(k));
        let mut all = Vec::new();
        let mut row = vec![0.0; names.len()];
        while rows.next(&mut row)? {
            all.push(row.clone());
        }
        Ok((names, all))
    }

    #[test]
    fn cells_may_be_quoted_and_a_quoted_name_may_hold_separators_and_line_ends() {
        let (names, rows) = table("\"time, s\",\"u\n(V)\"\n\"0\",\"1.5\"\n 1 , \"2\" \n", TextFormat::default()).unwrap();
        assert_eq!(names, ["time, s", "u (V)"]);
        assert_eq!(rows, [[0.0, 1.5], [1.0, 2.0]]);
        let german = TextFormat { decimal_comma: true, ..TextFormat::default() };
        let (names, rows) = table("\"t; s\";u;\n\"0,5\";1,25;\n1;2;\n", german).unwrap();
        assert_eq!((names.join("|"), rows), ("t; s|u".to_owned(), vec![vec![0.5, 1.25], vec![1.0, 2.0]]));
        // The line of an error counts the lines within quotes.
        let e = table("\"a\nb\",c\n1,2\n1,x\n", TextFormat::default()).unwrap_err().to_string();
        assert!(e.starts_with("t.csv:4: c is \"x\""), "{e}");
    }

    #[test]
    fn a_quote_that_is_not_closed_is_said_where_it_opens_and_takes_bounded_memory() {
        let e = table("a,b\n1,\"2\n3,4\n", TextFormat::default()).unwrap_err().to_string();
        assert_eq!(e, "t.csv:2: a quote opens in this row and is not closed");
        let long = format!("a,b\n1,\"2\n{}", "3,4\n".repeat(1 << 19));
        let mut rows = Rows::new(long.as_bytes(), "t.csv", 0, TextFormat::default()).unwrap();
        assert!(rows.next(&mut [0.0; 2]).unwrap_err().to_string().contains("t.csv:2: a quote opens"));
        assert!(rows.bytes_read <= LONGEST_ROW + 16);
    }

    #[test]
    fn times_of_day_are_seconds_and_go_on_over_midnight() {
        for field in [
            "12:34:56.789",
            "\"12:34:56,789\"",
            "2026-03-01T12:34:56.789+01:00",
            "1.3.2026 12:34:56,789",
            "2026-03-01 12:34:56.789Z",
        ] {
            assert!((time_of_day(field).unwrap() - 45296.789).abs() < 1e-9, "{field}");
        }
        for field in
            ["12:34", "25:00:00", "12:60:00", "12:34:56:7", "at 12:34:56", "12:34:nan", "12:34:-5", "12:34:56.7 PM", "1:2", ""]
        {
            assert_eq!(time_of_day(field), None, "{field}");
        }
        let text = "t,u\n23:59:59.9,1\n00:00:00.0,2\n0:00:00.1,3\n";
        let mut rows = Rows::new(text.as_bytes(), "t.csv", 0, TextFormat::default()).unwrap();
        (0..2).for_each(|k| rows.require(k));
        rows.time_in(0);
        let mut row = [0.0; 2];
        let mut times = Vec::new();
        while rows.next(&mut row).unwrap() {
            times.push(row[0]);
        }
        assert!(times.iter().zip([86399.9, 86400.0, 86400.1]).all(|(t, s)| (t - s).abs() < 1e-9), "{times:?}");
        assert!(rows.is_clock(0) && !rows.is_clock(1));
        // A time in another column is no number.
        let e = table("t,u\n1,12:00:00\n", TextFormat::default()).unwrap_err().to_string();
        assert!(e.contains("u is \"12:00:00\", expected a finite number"), "{e}");
    }

    #[test]
    fn what_is_no_number_is_named_by_its_line_in_an_editor_its_column_and_its_time() {
        let of = |text: &str, format| {
            let mut rows = Rows::new(text.as_bytes(), "t.csv", 0, format).unwrap();
            (0..2).for_each(|k| rows.require(k));
            rows.time_in(0);
            let mut row = [0.0; 2];
            loop {
                if let Err(e) = rows.next(&mut row) {
                    return e.to_string();
                }
            }
        };
        // A remark over two lines, an empty line, the names, the units, two rows: in an editor the NaN stands in line 7.
        let text = "Run 3,\"made\r\nby hand\"\r\n\r\nt_s,i_A\r\n(s),(A)\r\n0.1,1\r\n0.2,NaN\r\n";
        let format = TextFormat { skip_lines: 3, skip_after_header: 1, ..TextFormat::default() };
        assert!(
            of(text, format).starts_with("t.csv:7: i_A is NaN at t_s = 0.2, expected a finite number"),
            "{}",
            of(text, format)
        );
        assert!(
            of("t_s,i_A\n# remark\n\n0.1,\n", TextFormat::default())
                .starts_with("t.csv:4: i_A is empty at t_s = 0.1, expected a number;")
        );
        assert!(of("t_s,i_A\nx,1\n", TextFormat::default()).starts_with("t.csv:2: t_s is \"x\", expected"));
    }

    proptest::proptest! {
        /// What a spreadsheet writes in quotes is what is read.
        #[test]
        fn quoted_fields_round_trip(cells in proptest::collection::vec("[ -~]{0,8}", 1..6)) {
            let line = cells.iter().map(|c| format!("\"{}\"", c.replace('"', "\"\""))).collect::<Vec<_>>().join(";");
            let trimmed: Vec<&str> = cells.iter().map(|c| c.trim()).collect();
            proptest::prop_assert_eq!(fields_of(&line, b';'), trimmed);
        }
    }
}
