//! A column of a recording, as a quantity.

/// One column in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Its name in the file.
    pub column: String,
    /// One value per row.
    pub values: Vec<f64>,
    /// SI units per unit of the column, and what was subtracted from the column before.
    pub gain: f64,
    /// See `gain`.
    pub offset: f64,
}
