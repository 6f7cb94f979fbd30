//! Recordings as laboratories have them.

mod also;
mod draft;
mod findings;
mod formats;
mod judged;
mod mapping;
mod measured;
#[cfg(feature = "parquet")]
mod parquet;
mod simulated;
mod tables;
mod type_test;
mod warm;
