//! How jobs are done.

use im_diagnose::search::Options;

/// How jobs are done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Chance of a false alarm over the whole library, of a diagnosis.
    pub significance: f64,
    /// Diagnose all, also those that the screening sees nothing in.
    pub all: bool,
    /// Go on where what was noticed about the data makes the answer meaningless.
    pub anyway: bool,
    /// Write a report for each motor that is diagnosed.
    pub reports: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { significance: Options::default().significance, all: false, anyway: false, reports: true }
    }
}

impl Settings {
    /// All of it as text: what a row depends on.
    pub fn text(&self) -> String {
        format!("{self:?}")
    }
}
