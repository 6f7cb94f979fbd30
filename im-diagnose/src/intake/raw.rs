//! The columns of a file as they stand in it.

use std::fs::File;
use std::io::{Read, Seek};
use std::path::Path;

use im_formats::FormatError;
use im_model::{FileError, Problem, Rows, TextFormat};

use super::columns::Columns;
use super::mapping::{Column, Mapping, Signal, by_key};

/// Columns of numbers of one length.
#[derive(Clone, Debug, Default)]
pub struct RawTable {
    /// The file, for messages.
    pub label: String,
    /// Names of all its columns.
    pub names: Vec<String>,
    /// One per name; empty where a column was not asked for.
    pub columns: Vec<Vec<f64>>,
    /// Whether a column showed times of day, which are seconds.
    pub clocks: Vec<bool>,
    /// Rows that were left out because they repeat the row before them in everything, time included.
    pub repeated: usize,
    /// Line in the file less row, from a row on.
    offsets: Vec<(usize, usize)>,
}

impl RawTable {
    /// Reads `asked` columns of a text, at most `limit` rows; what must hold numbers throughout has been required of `rows`.
    ///
    /// # Errors
    /// As [`Rows::next`]; fewer than two rows.
    pub fn from_rows<R: Read>(mut rows: Rows<'_, R>, label: &str, asked: &[usize], limit: usize) -> Result<Self, FileError> {
        let names = rows.names().to_vec();
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
        let mut row = vec![0.0; names.len()];
        let mut before: Vec<f64> = Vec::new();
        let (mut n, mut repeated) = (0, 0);
        while n < limit && rows.next(&mut row)? {
            // The same row written twice: a logger's stutter. Equal rows at a later time are measurements.
            if before == row {
                repeated += 1;
                continue;
            }
            if n == 1000 {
                let more = rows.rows_ahead().min(limit);
                asked.iter().for_each(|&k| columns[k].reserve_exact(more));
            }
            before.clone_from(&row);
            // A row with a field that is empty where it may be: one that is missing.
            if asked.iter().any(|&k| rows.is_required(k) && row[k].is_nan()) {
                continue;
            }
            asked.iter().for_each(|&k| columns[k].push(row[k]));
            n += 1;
        }
        if n < 2 {
            let found = if n == 0 { "no rows under the header" } else { "only one row: the sampling time needs two" };
            return Err(rows.error(None, Problem::NoRows { found }));
        }
        let clocks = (0..names.len()).map(|k| rows.is_clock(k)).collect();
        Ok(Self { label: label.to_owned(), names, columns, clocks, repeated, offsets: rows.line_offsets().to_vec() })
    }

    /// Columns that come from no text.
    pub fn from_columns(label: &str, names: Vec<String>, columns: Vec<Vec<f64>>) -> Self {
        let clocks = vec![false; names.len()];
        Self { label: label.to_owned(), names, columns, clocks, repeated: 0, offsets: Vec::new() }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.columns.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The line in the file of row `k`, where it has lines.
    pub fn line_of(&self, k: usize) -> Option<usize> {
        self.offsets.iter().rev().find(|(from, _)| *from <= k).map(|(_, o)| k + o)
    }
}

/// Opens a text, or a Parquet file or a recording of another program (`im-formats`) as one.
///
/// # Errors
/// It cannot be read, is a folder, is empty, or is none of these.
pub fn open<'a>(path: &Path, label: &'a str, format: TextFormat) -> Result<Rows<'a, Box<dyn Read>>, FileError> {
    if path.is_dir() {
        let problem = Problem::Syntax { reason: "a folder, not a recording; name the file in it".to_owned() };
        return Err(FileError::new(label, None, None, problem));
    }
    let io = |e: std::io::Error| FileError::io(label, "read", &e);
    let mut file = File::open(path).map_err(io)?;
    let bytes = file.metadata().map_err(io)?.len();
    let (source, bytes, format): (Box<dyn Read>, u64, TextFormat) = match kind_of(&mut file, path).map_err(io)? {
        Kind::OtherPrograms => return other_programs(path, label)?.0.rows(label),
        Kind::Parquet => {
            let (text, format) = parquet_as_text(file, label)?;
            (text, 0, format)
        }
        Kind::Workbook => {
            let reason = "a workbook or another archive, not a recording; save its sheet as CSV".to_owned();
            return Err(FileError::new(label, None, None, Problem::Syntax { reason }));
        }
        Kind::Text => (Box::new(file), bytes, format),
    };
    Rows::new(source, label, bytes, format)
}

/// How a file is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Lines of text.
    Text,
    /// Apache Parquet.
    Parquet,
    /// What `im-formats` reads.
    OtherPrograms,
    /// A spreadsheet's own file, or another zip archive.
    Workbook,
}

/// How a file is written, by its first bytes; it stands at its beginning afterwards.
///
/// # Errors
/// It cannot be read.
pub fn kind_of(file: &mut File, path: &Path) -> std::io::Result<Kind> {
    let mut first = Vec::new();
    file.by_ref().take(im_formats::FIRST_BYTES.max(4) as u64).read_to_end(&mut first)?;
    file.rewind()?;
    Ok(match (first.starts_with(b"PAR1"), im_formats::format_of(&first, path)) {
        (true, _) => Kind::Parquet,
        (false, Some(_)) => Kind::OtherPrograms,
        (false, None) if first.starts_with(b"PK\x03\x04") => Kind::Workbook,
        (false, None) => Kind::Text,
    })
}

/// The columns of another program's file, and the names of what it holds besides.
///
/// # Errors
/// It cannot be read, or holds no recording.
pub fn other_programs(path: &Path, label: &str) -> Result<(Columns, Vec<String>), FileError> {
    let table = im_formats::read(path).map_err(|e| match e {
        FormatError::Io(e) => FileError::io(label, "read", &e),
        other => FileError::new(label, None, None, Problem::Syntax { reason: other.to_string() }),
    })?;
    let columns = Columns::try_new(label, table.names.into_iter().zip(table.columns).collect(), None)?;
    Ok((columns, table.left_out))
}

#[cfg(feature = "parquet")]
fn parquet_as_text(file: File, label: &str) -> Result<(Box<dyn Read>, TextFormat), FileError> {
    use super::columns::TABBED;
    use super::parquet_text::ParquetText;
    Ok((Box::new(ParquetText::open(file, label)?), TABBED))
}

#[cfg(not(feature = "parquet"))]
fn parquet_as_text(_: File, label: &str) -> Result<(Box<dyn Read>, TextFormat), FileError> {
    let reason = "a Parquet file, which this build does not read: build with `--features parquet`, or write the recording as CSV";
    Err(FileError::new(label, None, None, Problem::Syntax { reason: reason.to_owned() }))
}

/// The place of the column that a mapping asks for.
///
/// # Errors
/// The file has no such column, or has it twice; the error points at the mapping.
pub fn place(names: &[String], signal: &Signal, mapping: &Mapping) -> Result<usize, FileError> {
    find(names, signal, &mapping.label).map_err(|e| by_key(&mapping.keys, e))
}

/// As [`place`]; `mapping` names the mapping in messages.
///
/// # Errors
/// As [`place`].
pub fn find(names: &[String], signal: &Signal, mapping: &str) -> Result<usize, FileError> {
    let fail = |key: &str, problem| FileError::new(mapping, signal.line, Some(key), problem);
    match &signal.column {
        Column::Number(n) if *n <= names.len() => Ok(n - 1),
        Column::Number(n) => {
            let expected = format!("a column from 1 to {}: the data file has no more", names.len());
            Err(fail("column", Problem::Unexpected { found: n.to_string(), expected }))
        }
        Column::Name(name) => {
            let mut places = names.iter().enumerate().filter(|(_, n)| *n == name).map(|(k, _)| k);
            match (places.next(), places.next()) {
                (Some(k), None) => Ok(k),
                (Some(a), Some(b)) => Err(fail(name, Problem::DuplicateColumn { places: [a + 1, b + 1] })),
                (None, _) => {
                    let nearest = im_model::toml_text::nearest(name, names.iter().map(String::as_str)).map(str::to_owned);
                    Err(fail(name, Problem::MissingColumn { present: names.to_vec(), nearest }))
                }
            }
        }
    }
}
