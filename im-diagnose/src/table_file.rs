//! Tables of texts and numbers as files: CSV, or Parquet where the name ends so. A number that is not finite is an empty field, or null.

use std::io::{self, Write};
use std::path::Path;

use im_model::{FileError, write_atomically};

/// A column of a table, or of a part of it.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// Words.
    Text(Vec<String>),
    /// Numbers; NaN where there is none.
    Number(Vec<f64>),
}

impl Column {
    fn len(&self) -> usize {
        match self {
            Self::Text(x) => x.len(),
            Self::Number(x) => x.len(),
        }
    }
}

/// Writes a table given in parts, one below the other, each with a column for every name.
///
/// # Errors
/// The file cannot be written, or is to be Parquet without the feature.
pub fn write(path: &Path, names: &[String], parts: &[Vec<Column>]) -> Result<(), FileError> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet")) {
        return write_parquet(path, names, parts);
    }
    write_atomically(path, |out| write_csv(out, names, parts))
}

fn write_csv(out: &mut dyn Write, names: &[String], parts: &[Vec<Column>]) -> io::Result<()> {
    writeln!(out, "{}", names.iter().map(|n| quoted(n)).collect::<Vec<_>>().join(","))?;
    for part in parts {
        for k in 0..part.first().map_or(0, Column::len) {
            for (c, column) in part.iter().enumerate() {
                if c > 0 {
                    write!(out, ",")?;
                }
                match column {
                    Column::Text(x) => write!(out, "{}", quoted(&x[k]))?,
                    Column::Number(x) if x[k].is_finite() => write!(out, "{}", x[k])?,
                    Column::Number(_) => {}
                }
            }
            writeln!(out)?;
        }
    }
    Ok(())
}

/// A field of a CSV file.
fn quoted(text: &str) -> String {
    let plain = !text.contains([',', '"', '\n', '\r']);
    if plain { text.to_owned() } else { format!("\"{}\"", text.replace('"', "\"\"")) }
}

#[cfg(not(feature = "parquet"))]
fn write_parquet(path: &Path, _: &[String], _: &[Vec<Column>]) -> Result<(), FileError> {
    let problem = im_model::Problem::Unexpected {
        found: "a name that ends in .parquet".into(),
        expected: "one that ends in .csv: this program was built without the feature `parquet`".into(),
    };
    Err(FileError::new(&path.display().to_string(), None, None, problem))
}

#[cfg(feature = "parquet")]
fn write_parquet(path: &Path, names: &[String], parts: &[Vec<Column>]) -> Result<(), FileError> {
    write_atomically(path, |out| parquet(out, names, parts).map_err(io::Error::other))
}

#[cfg(feature = "parquet")]
fn parquet(out: &mut (impl Write + Send), names: &[String], parts: &[Vec<Column>]) -> Result<(), parquet::errors::ParquetError> {
    use std::sync::Arc;

    use parquet::basic::{ConvertedType, Repetition, Type as Physical};
    use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::types::Type;

    let is_text = |k: usize| parts.first().is_some_and(|p| matches!(p[k], Column::Text(_)));
    let field = |(k, name): (usize, &String)| {
        let made = if is_text(k) {
            let text = Type::primitive_type_builder(name, Physical::BYTE_ARRAY);
            text.with_repetition(Repetition::REQUIRED).with_converted_type(ConvertedType::UTF8).build()
        } else {
            Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::OPTIONAL).build()
        };
        made.map(Arc::new)
    };
    let fields = names.iter().enumerate().map(field).collect::<Result<Vec<_>, _>>()?;
    let schema = Type::group_type_builder("table").with_fields(fields).build()?;
    let mut file = SerializedFileWriter::new(&mut *out, Arc::new(schema), Arc::default())?;
    for part in parts {
        let mut group = file.next_row_group()?;
        for values in part {
            let Some(mut column) = group.next_column()? else { break };
            match values {
                Column::Text(x) => {
                    let texts: Vec<ByteArray> = x.iter().map(|t| ByteArray::from(t.as_str())).collect();
                    column.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
                }
                Column::Number(x) => {
                    let there: Vec<f64> = x.iter().copied().filter(|x| x.is_finite()).collect();
                    let levels: Vec<i16> = x.iter().map(|x| i16::from(x.is_finite())).collect();
                    column.typed::<DoubleType>().write_batch(&there, Some(&levels), None)?;
                }
            }
            column.close()?;
        }
        group.close()?;
    }
    file.close().map(|_| ())
}
