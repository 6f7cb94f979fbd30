//! A Parquet file as a text of rows, so that one reader checks and explains every recording.
//!
//! Row k of the table is line k + 1; the names of the columns are line 1. Numbers keep their exact value, an absent one is an empty
//! field, a time stamp is the number that stands in the file (ms or µs).

use std::fmt::Write;
use std::fs::File;
use std::io::{self, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};

use im_model::{FileError, Problem};
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::reader::RowIter;
use parquet::record::{Field, Row};

/// Rows that are turned into text together.
const BLOCK: usize = 256;

/// The text, made as it is read.
pub struct ParquetText {
    rows: RowIter<'static>,
    text: String,
    given: usize,
}

impl ParquetText {
    /// Opens a file.
    ///
    /// # Errors
    /// It is no Parquet file, or is cut short.
    pub fn open(file: File, label: &str) -> Result<Self, FileError> {
        let reader = whatever_it_does(|| SerializedFileReader::new(file)).map_err(|e| {
            FileError::new(label, None, None, Problem::Syntax { reason: format!("not a whole Parquet file: {e}") })
        })?;
        let names: Vec<String> =
            reader.metadata().file_metadata().schema().get_fields().iter().map(|f| f.name().replace(['\t', '\n'], " ")).collect();
        let text = names.join("\t") + "\n";
        Ok(Self { rows: RowIter::from_file_into(Box::new(reader)), text, given: 0 })
    }

    fn fill(&mut self) -> Result<(), ParquetError> {
        self.text.clear();
        self.given = 0;
        for row in self.rows.by_ref().take(BLOCK) {
            write_row(&mut self.text, &row?);
        }
        Ok(())
    }
}

impl Read for ParquetText {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.given == self.text.len() {
            whatever_it_does(|| self.fill()).map_err(io::Error::other)?;
        }
        let n = (&self.text.as_bytes()[self.given..]).read(out)?;
        self.given += n;
        Ok(n)
    }
}

/// The library reads millions of damaged files well, and panics over a few: those, too, end in a message.
fn whatever_it_does<T>(read: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(|_| Err(ParquetError::General("its structure is damaged".to_owned())))
}

fn write_row(text: &mut String, row: &Row) {
    for (k, (_, field)) in row.get_column_iter().enumerate() {
        if k > 0 {
            text.push('\t');
        }
        // Writing to a string cannot fail.
        let _ = match field {
            Field::Null => Ok(()),
            Field::Bool(x) => write!(text, "{}", u8::from(*x)),
            // The digits of the f32 alone would name another number.
            Field::Float(x) => write!(text, "{}", f64::from(*x)),
            Field::Float16(x) => write!(text, "{}", x.to_f64()),
            Field::Double(x) => write!(text, "{x}"),
            Field::TimestampMillis(x) | Field::TimestampMicros(x) | Field::TimeMicros(x) => write!(text, "{x}"),
            Field::TimeMillis(x) | Field::Date(x) => write!(text, "{x}"),
            Field::Str(x) => write!(text, "{}", x.replace(['\t', '\n'], " ")),
            other => write!(text, "{}", other.to_string().replace(['\t', '\n'], " ")),
        };
    }
    text.push('\n');
}
