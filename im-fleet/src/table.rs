//! All rows as one table, and as files.

use std::collections::BTreeMap;
use std::path::Path;

use im_diagnose::table_file::{self, Column};
use im_model::FileError;

use crate::row::Row;

/// Parameters of every motor, each a column of the table with its standard deviation; those of effects stand together in `sizes`.
pub const PARAMETERS: [&str; 6] = [
    "stator_resistance_ohm",
    "inverse_gamma.rotor_resistance_ohm",
    "inverse_gamma.leakage_inductance_h",
    "inverse_gamma.magnetizing_inductance_h",
    "inertia_kg_m2",
    "viscous_friction_nm_s_per_rad",
];

/// Writes the rows as CSV, or as Parquet where the name ends so.
///
/// # Errors
/// The file cannot be written, or is to be Parquet without the feature.
pub fn write(path: &Path, rows: &[Row]) -> Result<(), FileError> {
    let (names, columns): (Vec<String>, Vec<Column>) = columns(rows).into_iter().unzip();
    table_file::write(path, &names, &[columns])
}

/// The columns of the table.
pub fn columns(rows: &[Row]) -> Vec<(String, Column)> {
    let text = |name: &str, of: &dyn Fn(&Row) -> String| (name.to_owned(), Column::Text(rows.iter().map(of).collect()));
    let number = |name: &str, of: &dyn Fn(&Row) -> Option<f64>| {
        (name.to_owned(), Column::Number(rows.iter().map(|r| of(r).unwrap_or(f64::NAN)).collect()))
    };
    let mut out = vec![
        text("key", &|r| r.key.clone()),
        text("unit", &|r| r.unit.clone()),
        text("type", &|r| r.kind.clone()),
        text("date", &|r| r.date.clone()),
        text("recordings", &|r| r.recordings.join(";")),
        text("status", &|r| r.status.name().to_owned()),
        text("verdict", &|r| r.verdict.clone()),
        text("effects", &|r| r.effects.join(";")),
        text("rivals", &|r| r.rivals.iter().map(|a| a.join("|")).collect::<Vec<_>>().join(";")),
        text("suspicion", &|r| r.suspicion.clone()),
        number("base_rms_in_sigma", &|r| r.base_rms_in_sigma),
        number("rms_in_sigma", &|r| r.rms_in_sigma),
        number("holdout_rms_in_sigma", &|r| r.holdout_rms_in_sigma),
    ];
    for key in PARAMETERS {
        let of = |r: &Row| r.parameters.iter().find(|p| p.key == key).cloned();
        out.push(number(key, &|r| of(r).map(|p| p.value)));
        out.push(number(&format!("{key}.std"), &|r| of(r).and_then(|p| p.std)));
    }
    out.push(text("sizes", &sizes));
    out.push(text("report", &|r| r.report.clone()));
    out.push(text("error", &|r| r.error.clone()));
    out
}

/// Sizes of the effects, `effect.key=value`, by key.
fn sizes(row: &Row) -> String {
    let of_effects = row.parameters.iter().filter(|p| row.effects.iter().any(|e| p.key.starts_with(&format!("{e}."))));
    let sorted: BTreeMap<&str, f64> = of_effects.map(|p| (p.key.as_str(), p.value)).collect();
    sorted.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join(";")
}
