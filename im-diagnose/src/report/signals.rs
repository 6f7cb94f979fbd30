//! Measured, modelled and residual, sample by sample: what a report draws, for whoever wants to draw it himself.

use std::path::Path;

use im_identify::offline::{Experiment, Load, load_torque};
use im_model::{FileError, Machine, Plant, State};

use crate::table_file::{self, Column};

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
        if let Load::Unseen(_) = e.load
            && let Load::Unseen(found) = e.clone().with_speed_found_by(machine, start).load
        {
            parts.extend([("omega_m_rad_s_found".into(), found.omega_m), ("omega_m_rad_s_std".into(), found.std)]);
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
        let names: Vec<String> = std::iter::once("recording".to_owned()).chain(self.columns.iter().cloned()).collect();
        let part = |(name, columns): &(String, Vec<Vec<f64>>)| {
            let rows = columns.first().map_or(0, Vec::len);
            let name = Column::Text(vec![name.clone(); rows]);
            std::iter::once(name).chain(columns.iter().cloned().map(Column::Number)).collect()
        };
        table_file::write(path, &names, &self.recordings.iter().map(part).collect::<Vec<Vec<Column>>>())
    }
}
