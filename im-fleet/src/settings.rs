//! How jobs are done.

use im_diagnose::search::Significance;

/// How jobs are done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Chance of a false alarm over the whole library, of a diagnosis.
    pub significance: Significance,
    /// Diagnose all, also those that the screening sees nothing in.
    pub all: bool,
    /// Go on where what was noticed about the data makes the answer meaningless.
    pub anyway: bool,
    /// Write a report for each motor that is diagnosed.
    pub reports: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { significance: Significance::default(), all: false, anyway: false, reports: true }
    }
}

impl Settings {
    /// All of it as text: what a row depends on.
    pub fn text(&self) -> String {
        format!("{self:?}")
    }
}
