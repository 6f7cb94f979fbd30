//! Fleets, in the pieces that any engine can carry: jobs and rows cross as JSON.

use std::path::PathBuf;

use im_diagnose::report::Meta;
use im_diagnose::search::Significance;
use im_fleet::job::{self, Job};
use im_fleet::row::Row;
use im_fleet::settings::Settings;
use im_fleet::store::Store;
use im_fleet::work;
use im_fleet::{key, write_all};
use im_model::Shard;
use pyo3::prelude::*;
use serde_json::json;

use crate::diagnose::PROGRAM;
use crate::errors::refused;
use crate::work::work as working;

/// The jobs of a folder or a table, each with its key, and whether it belongs to the shard.
#[pyfunction]
pub fn fleet_jobs(
    py: Python<'_>,
    fleet: PathBuf,
    settings: (f64, bool, bool, bool),
    shard: &str,
) -> PyResult<Vec<(String, String, bool)>> {
    let settings = made(settings)?;
    let shard: Shard = shard.parse().map_err(|e| refused(format!("shard {e}")))?;
    let jobs = working(py, "reading the fleet", 0, || {
        let jobs = job::jobs(&fleet)?;
        Ok::<_, im_diagnose::sources::Refused>(jobs.into_iter().map(|job| (key::key(&job, &settings), job)).collect::<Vec<_>>())
    })?;
    let one = |(key, job): (String, Job)| {
        let mine = shard.has(key::number(&key));
        (key, json!(job).to_string(), mine)
    };
    Ok(jobs.map_err(refused)?.into_iter().map(one).collect())
}

/// Does one job: its row.
#[pyfunction]
pub fn fleet_row(
    py: Python<'_>,
    job: &str,
    key: &str,
    out: PathBuf,
    settings: (f64, bool, bool, bool),
    threads: usize,
) -> PyResult<String> {
    let job: Job = serde_json::from_str(job).map_err(refused)?;
    let settings = made(settings)?;
    let row = working(py, &format!("judging {}", job.label()), threads, || work::one(&job, key, &out, &settings))?;
    Ok(json!(row).to_string())
}

/// The row of a job that could not even be tried.
#[pyfunction]
pub fn fleet_failed_row(job: &str, key: &str, error: &str) -> PyResult<String> {
    let job: Job = serde_json::from_str(job).map_err(refused)?;
    Ok(json!(work::failed(&job, key, error)).to_string())
}

/// The rows of these keys that are done, or `None`.
#[pyfunction]
pub fn fleet_kept(out: PathBuf, keys: Vec<String>) -> PyResult<Vec<Option<String>>> {
    let store = Store::open(&out).map_err(refused)?;
    Ok(keys.iter().map(|key| store.get(key).map(|row| json!(row).to_string())).collect())
}

/// Keeps a row.
#[pyfunction]
pub fn fleet_keep(out: PathBuf, row: &str) -> PyResult<()> {
    let row: Row = serde_json::from_str(row).map_err(refused)?;
    Store::open(&out).and_then(|store| store.put(&row)).map_err(refused)
}

/// Writes the tables and the page of all rows; the statistics in them.
#[pyfunction]
pub fn fleet_write(py: Python<'_>, out: PathBuf, title: &str, rows: Vec<String>) -> PyResult<String> {
    let rows: Vec<Row> = rows.iter().map(|r| serde_json::from_str(r)).collect::<Result<_, _>>().map_err(refused)?;
    let how = Meta { program: PROGRAM.into(), ..Meta::default() };
    let summary = working(py, "writing", 1, || write_all(&out, title, &rows, &how))?.map_err(refused)?;
    Ok(summary.to_json(&rows).to_string())
}

/// Significance, all, anyway, reports.
fn made((significance, all, anyway, reports): (f64, bool, bool, bool)) -> PyResult<Settings> {
    Ok(Settings { significance: Significance::try_from(significance).map_err(refused)?, all, anyway, reports })
}
