//! The reports in words, as files, and in a browser.

mod browser;
mod cases;
mod electrical;
mod words;
