//! Columns that stand in memory (arrays, a data frame) as a text of rows, so that one reader checks and explains every recording.
//!
//! Row k is line k + 1; the names of the columns are line 1. Numbers keep their exact value, NaN is an empty field.

use std::fmt::Write;
use std::io::{self, Read};
use std::sync::Arc;

use im_model::{FileError, Problem, Rows, TextFormat};

use super::mapping::Mapping;

/// How such a text is written: names of columns may hold anything but a tab.
pub const TABBED: TextFormat = TextFormat {
    separator: Some(b'\t'),
    decimal_comma: false,
    header: Some(true),
    skip_lines: 0,
    skip_after_header: 0,
    comment: 0,
};
/// Rows that are turned into text together.
const BLOCK: usize = 256;

/// Columns of one length, with what they mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// What the recording is called in messages and reports.
    pub label: String,
    /// Names.
    pub names: Arc<[String]>,
    /// One per name.
    pub values: Arc<[Vec<f64>]>,
    /// What they mean; without, they are canonical or guessed.
    pub mapping: Option<Mapping>,
}

impl Columns {
    /// Columns of one length.
    ///
    /// # Errors
    /// There are none, or one is longer than another.
    pub fn try_new(label: &str, columns: Vec<(String, Vec<f64>)>, mapping: Option<Mapping>) -> Result<Self, FileError> {
        let refused = |key: Option<&str>, problem| Err(FileError::new(label, None, key, problem));
        let (names, values): (Vec<String>, Vec<Vec<f64>>) = columns.into_iter().unzip();
        let Some(rows) = values.first().map(Vec::len) else {
            return refused(None, Problem::NoRows { found: "there are no columns" });
        };
        if let Some((name, x)) = names.iter().zip(&values).find(|(_, x)| x.len() != rows) {
            let found = format!("{} rows", x.len());
            return refused(Some(name), Problem::Unexpected { found, expected: format!("{rows}, as {} has", names[0]) });
        }
        Ok(Self { label: label.to_owned(), names: names.into(), values: values.into(), mapping })
    }

    /// The columns as rows of text.
    ///
    /// # Errors
    /// As [`Rows::new`].
    pub fn rows<'a>(&self, label: &'a str) -> Result<Rows<'a, Box<dyn Read>>, FileError> {
        let names: Vec<String> = self.names.iter().map(|n| n.replace(['\t', '\n', '\r'], " ")).collect();
        let text = ColumnsText { values: self.values.clone(), row: 0, text: names.join("\t") + "\n", given: 0 };
        Rows::new(Box::new(text) as Box<dyn Read>, label, 0, TABBED)
    }
}

/// The text, made as it is read.
struct ColumnsText {
    values: Arc<[Vec<f64>]>,
    row: usize,
    text: String,
    given: usize,
}

impl ColumnsText {
    fn fill(&mut self) {
        self.text.clear();
        self.given = 0;
        let rows = self.values.first().map_or(0, Vec::len);
        let block = self.row..(self.row + BLOCK).min(rows);
        self.row = block.end;
        for k in block {
            for (c, column) in self.values.iter().enumerate() {
                if c > 0 {
                    self.text.push('\t');
                }
                if !column[k].is_nan() {
                    // Writing to a string cannot fail.
                    let _ = write!(self.text, "{}", column[k]);
                }
            }
            self.text.push('\n');
        }
    }
}

impl Read for ColumnsText {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.given == self.text.len() {
            self.fill();
        }
        let n = (&self.text.as_bytes()[self.given..]).read(out)?;
        self.given += n;
        Ok(n)
    }
}
