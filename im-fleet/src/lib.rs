//! Fleets: motors × recordings in, one table of verdicts out.
//!
//! * [`job`]: what there is to do, from a folder or a table; [`key`]: what it is known by, a hash of its content.
//! * [`screen`]: the cheap pass that decides who gets the whole diagnosis; [`row`]: what comes of a job, also of a broken one.
//! * [`work`]: jobs to rows, each once, in shards if need be; [`store`]: where the rows are kept meanwhile.
//! * [`table`]: all rows as CSV and Parquet; [`population`], [`odd`], [`change`]: what motors of a type have in common, which are odd among
//!   them, and what changed in one over time; [`summary`], [`report`]: all that for programs and as a page.
//!
//! Every job stands for itself, so that the table does not depend on who did which job, in what order, or how often it was begun.
//!
//! # Features
//!
//! | feature | default | gives |
//! | --- | --- | --- |
//! | `parquet` | no | recordings in Parquet files, and the table as one |

pub mod change;
pub mod job;
pub mod key;
pub mod odd;
pub mod population;
pub mod report;
pub mod row;
pub mod screen;
pub mod settings;
pub mod statistics;
pub mod store;
pub mod summary;
pub mod table;
pub mod work;

use std::io::Write as _;
use std::path::Path;

use im_diagnose::report::Meta;
use im_model::{FileError, write_atomically};

use row::Row;
use summary::Summary;

/// The example of the README is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

/// What is written beside the rows; with the feature `parquet` the first of them as `verdicts.parquet` too.
pub const FILES: [&str; 4] = ["verdicts.csv", "parameters.csv", "fleet.json", "fleet.html"];

/// Writes [`FILES`] into a folder, and gives the statistics in them; `how` says on the page how they came about.
///
/// # Errors
/// A file cannot be written.
pub fn write_all(out: &Path, title: &str, rows: &[Row], how: &Meta) -> Result<Summary, FileError> {
    let summary = Summary::of(rows);
    table::write(&out.join("verdicts.csv"), rows)?;
    #[cfg(feature = "parquet")]
    table::write(&out.join("verdicts.parquet"), rows)?;
    summary.write_parameters(&out.join("parameters.csv"), rows)?;
    let json = format!("{:#}\n", summary.to_json(rows));
    write_atomically(&out.join("fleet.json"), |w| w.write_all(json.as_bytes()))?;
    let page = report::html(title, rows, &summary, how);
    write_atomically(&out.join("fleet.html"), |w| w.write_all(page.as_bytes()))?;
    Ok(summary)
}
