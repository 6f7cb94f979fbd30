//! Rows of numbers in a text: the part of reading recordings that does not know what the columns mean.
//!
//! Rows are read one by one, so that memory stays at about the size of what the caller keeps.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use crate::file_error::{FileError, Problem};
use crate::toml_reader::nearest;

/// No line of numbers is longer: a file without line ends is refused before it fills the memory.
const LONGEST_LINE: u64 = 1 << 20;
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
    source: R,
    label: &'a str,
    /// Length of the source, if known.
    bytes: u64,
    line: Vec<u8>,
    line_number: usize,
    bytes_read: u64,
    format: TextFormat,
    separator: u8,
    names: Vec<String>,
    /// Columns whose fields must be finite numbers.
    needed: Vec<bool>,
    /// The line that was read for the names is the first row.
    pending: bool,
    rows: usize,
    /// Where the lines before a row changed in number: first row of it, line less row.
    offsets: Vec<(usize, usize)>,
    before_rows: u64,
}

impl<'a> Rows<'a, BufReader<File>> {
    /// Opens a file and reads its line of column names.
    ///
    /// # Errors
    /// The file cannot be read, is empty, or is no text.
    pub fn open(path: &Path, label: &'a str, format: TextFormat) -> Result<Self, FileError> {
        let io = |e: io::Error| FileError::io(label, "read", &e);
        let file = File::open(path).map_err(io)?;
        let bytes = file.metadata().map_err(io)?.len();
        Self::new(BufReader::with_capacity(1 << 17, file), label, bytes, format)
    }
}

impl<'a, R: BufRead> Rows<'a, R> {
    /// Reads the line of column names; `label` names the source in messages, `bytes` is its length or 0.
    ///
    /// # Errors
    /// The source cannot be read, is empty, or is no text.
    pub fn new(source: R, label: &'a str, bytes: u64, format: TextFormat) -> Result<Self, FileError> {
        let mut this = Self {
            source,
            label,
            bytes,
            line: Vec::new(),
            line_number: 0,
            bytes_read: 0,
            format,
            separator: b',',
            names: Vec::new(),
            needed: Vec::new(),
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
        let guessed = || [b';', b'\t', b',', b' '].into_iter().find(|s| head.as_bytes().contains(s)).unwrap_or(b',');
        this.separator = format.separator.unwrap_or_else(guessed);
        let first = |f: &[u8]| String::from_utf8_lossy(f).trim().trim_matches('"').trim().to_owned();
        this.names = fields(head.as_bytes(), this.separator).map(first).collect();
        let numbers = this.names.iter().all(|n| number(n.as_bytes(), format.decimal_comma).is_some());
        if !format.header.unwrap_or(!numbers) {
            this.pending = true;
            this.names = (1..=this.names.len()).map(|k| k.to_string()).collect();
        } else {
            for _ in 0..format.skip_after_header {
                this.raw_line()?;
            }
        }
        this.needed = vec![false; this.names.len()];
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
        self.line.clear();
        let n = (&mut self.source)
            .take(LONGEST_LINE)
            .read_until(b'\n', &mut self.line)
            .map_err(|e| FileError::io(self.label, "read", &e))?;
        if n == 0 {
            return Ok(false);
        }
        self.bytes_read += n as u64;
        self.line_number += 1;
        if n as u64 == LONGEST_LINE && self.line.last() != Some(&b'\n') {
            return Err(self.not_text());
        }
        Ok(true)
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
        let reason = "not a text of lines in UTF-8; export the recording as CSV".to_owned();
        self.error(None, Problem::Syntax { reason })
    }

    /// The numbers of the line.
    fn row(&mut self, row: &mut [f64]) -> Result<(), FileError> {
        let mut found = 0;
        for field in fields(self.line.trim_ascii_end(), self.separator) {
            if let Some(x) = row.get_mut(found) {
                *x = number(field, self.format.decimal_comma).unwrap_or(f64::NAN);
                if !x.is_finite() && self.needed[found] {
                    let text = std::str::from_utf8(field).unwrap_or("unreadable").trim_ascii();
                    return Err(self.bad_field(found, text));
                }
            }
            found += 1;
        }
        if found == row.len() { Ok(()) } else { self.row_length(found) }
    }

    #[cold]
    fn bad_field(&self, column: usize, text: &str) -> FileError {
        let fields = fields(self.line.trim_ascii_end(), self.separator).count();
        let cut = self.line.last() != Some(&b'\n') && fields < self.names.len();
        if cut {
            let problem = Problem::RowLength { found: fields, expected: self.names.len(), last: true };
            return self.error(None, problem);
        }
        let found = match text.parse::<f64>() {
            _ if text.is_empty() => String::new(),
            Ok(x) => x.to_string(),
            Err(_) => format!("\"{}\"", text.chars().take(40).collect::<String>()),
        };
        self.error(self.names.get(column).map(String::as_str), Problem::NotANumber { found })
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

fn fields(line: &[u8], separator: u8) -> impl Iterator<Item = &[u8]> {
    let white = separator == b' ';
    line.split(move |&b| b == separator || (white && b == b'\t')).filter(move |f| !white || !f.is_empty())
}

/// A finite number or not, or `None` for what is no number at all.
fn number(field: &[u8], decimal_comma: bool) -> Option<f64> {
    let field = field.trim_ascii();
    let mut buffer = [0u8; 64];
    let field = if decimal_comma && field.contains(&b',') {
        let copy = buffer.get_mut(..field.len())?;
        copy.copy_from_slice(field);
        copy.iter_mut().filter(|b| **b == b',').for_each(|b| *b = b'.');
        copy
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
    use super::fields;

    #[test]
    fn white_space_separates_only_where_nothing_else_does() {
        let split = |line: &'static str, separator: u8| fields(line.as_bytes(), separator).collect::<Vec<_>>();
        assert_eq!(split("1\t, 2,,3", b','), [&b"1\t"[..], b" 2", b"", b"3"]);
        assert_eq!(split("1 \t 2  3", b' '), [b"1", b"2", b"3"]);
    }
}
