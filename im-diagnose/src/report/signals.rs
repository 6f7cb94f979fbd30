//! Measured, modelled and residual, sample by sample: what a report draws, for whoever wants to draw it himself.

use std::io::{self, Write};
use std::path::Path;

use im_identify::offline::{Experiment, Load, load_torque};
use im_model::{FileError, Machine, Plant, State, write_atomically};

/// The signals of some recordings, one after the other. A column that a recording does not have is empty there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SignalTable {
    /// Columns after `recording`: `t_s`, then for each signal what was measured, what the model says, and the difference.
    pub columns: Vec<String>,
    /// Name and columns of each recording; NaN where there is no number.
    pub recordings: Vec<(String, Vec<Vec<f64>>)>,
}

impl SignalTable {
    /// Adds a recording and what a model says of it, per channel.
    pub(super) fn add(&mut self, machine: &Machine<f64>, start: &State<f64>, e: &Experiment, predictions: &[Vec<f64>]) {
        let n = e.len();
        // The rows of a table have no time.
        let step = if e.is_table() { 1.0 } else { e.sample_time_s };
        let mut parts = vec![("t_s".to_owned(), (0..n).map(|k| step * k as f64).collect::<Vec<f64>>())];
        let mut three = |name: &str, measured: Vec<f64>, modelled: Vec<f64>| {
            let residual = measured.iter().zip(&modelled).map(|(a, b)| a - b).collect();
            let suffixes = ["measured", "modelled", "residual"].map(|s| format!("{name}_{s}"));
            parts.extend(suffixes.into_iter().zip([measured, modelled, residual]));
        };
        for (c, modelled) in e.channels.iter().zip(predictions) {
            let measured = (0..n).map(|k| if c.is_valid(k) { c.values[k] } else { f64::NAN }).collect();
            three(&c.name, measured, modelled.clone());
        }
        if let Load::Unknown(shown) = &e.load {
            // The speed drives the model: it is smoothed, and what the sensor did to it is taken off.
            let plant = Plant::new(machine);
            let driven = (0..n).map(|k| plant.speed_behind(shown.smooth[k])).collect();
            three(&shown.channel.name, shown.channel.values.clone(), driven);
            if let Some(load) = load_torque(machine, e, start) {
                parts.extend([("tau_load_Nm_found".into(), load.torque_nm), ("tau_load_Nm_std".into(), load.std_nm)]);
            }
        }
        for (name, _) in &parts {
            if !self.columns.contains(name) {
                self.columns.push(name.clone());
                self.recordings.iter_mut().for_each(|(_, columns)| {
                    let rows = columns.first().map_or(0, Vec::len);
                    columns.push(vec![f64::NAN; rows]);
                });
            }
        }
        let mut columns = vec![vec![f64::NAN; n]; self.columns.len()];
        for (name, values) in parts {
            if let Some(k) = self.columns.iter().position(|c| *c == name) {
                columns[k] = values;
            }
        }
        self.recordings.push((e.name.clone(), columns));
    }

    /// Writes a CSV file, or with the feature `parquet` a Parquet file where the name ends so.
    ///
    /// # Errors
    /// The file cannot be written, or is to be Parquet without the feature.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet")) {
            return self.write_parquet(path);
        }
        write_atomically(path, |out| self.write_csv(out))
    }

    fn write_csv(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "recording,{}", self.columns.join(","))?;
        for (name, columns) in &self.recordings {
            let name = quoted(name);
            for k in 0..columns.first().map_or(0, Vec::len) {
                write!(out, "{name}")?;
                for column in columns {
                    match column[k] {
                        x if x.is_finite() => write!(out, ",{x}")?,
                        _ => write!(out, ",")?,
                    }
                }
                writeln!(out)?;
            }
        }
        Ok(())
    }

    #[cfg(not(feature = "parquet"))]
    fn write_parquet(&self, path: &Path) -> Result<(), FileError> {
        let problem = im_model::Problem::Unexpected {
            found: "a name that ends in .parquet".into(),
            expected: "one that ends in .csv: this program was built without the feature `parquet`".into(),
        };
        Err(FileError::new(&path.display().to_string(), None, None, problem))
    }

    #[cfg(feature = "parquet")]
    fn write_parquet(&self, path: &Path) -> Result<(), FileError> {
        write_atomically(path, |out| self.parquet(out).map_err(io::Error::other))
    }

    #[cfg(feature = "parquet")]
    fn parquet(&self, out: &mut (impl Write + Send)) -> Result<(), parquet::errors::ParquetError> {
        use std::sync::Arc;

        use parquet::basic::{Repetition, Type as Physical};
        use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
        use parquet::file::writer::SerializedFileWriter;
        use parquet::schema::types::Type;

        let text = Type::primitive_type_builder("recording", Physical::BYTE_ARRAY)
            .with_repetition(Repetition::REQUIRED)
            .with_converted_type(parquet::basic::ConvertedType::UTF8)
            .build()?;
        let number = |name: &String| {
            Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::OPTIONAL).build().map(Arc::new)
        };
        let mut fields = vec![Arc::new(text)];
        fields.extend(self.columns.iter().map(number).collect::<Result<Vec<_>, _>>()?);
        let schema = Type::group_type_builder("signals").with_fields(fields).build()?;
        let mut file = SerializedFileWriter::new(&mut *out, Arc::new(schema), Arc::default())?;
        for (name, columns) in &self.recordings {
            let mut group = file.next_row_group()?;
            let rows = columns.first().map_or(0, Vec::len);
            if let Some(mut column) = group.next_column()? {
                let names = vec![ByteArray::from(name.as_str()); rows];
                column.typed::<ByteArrayType>().write_batch(&names, None, None)?;
                column.close()?;
            }
            for values in columns {
                if let Some(mut column) = group.next_column()? {
                    let there: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
                    let levels: Vec<i16> = values.iter().map(|x| i16::from(x.is_finite())).collect();
                    column.typed::<DoubleType>().write_batch(&there, Some(&levels), None)?;
                    column.close()?;
                }
            }
            group.close()?;
        }
        file.close().map(|_| ())
    }
}

/// A field of a CSV file.
fn quoted(text: &str) -> String {
    let plain = !text.contains([',', '"', '\n', '\r']);
    if plain { text.to_owned() } else { format!("\"{}\"", text.replace('"', "\"\"")) }
}
