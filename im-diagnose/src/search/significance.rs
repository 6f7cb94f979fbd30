//! How often a search may find what is not there.

use std::fmt;
use std::str::FromStr;

/// Chance of a false alarm over the whole library: above 0, below 0.5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Significance(f64);

impl Significance {
    /// The chance.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl Default for Significance {
    fn default() -> Self {
        Self(0.01)
    }
}

impl TryFrom<f64> for Significance {
    type Error = String;

    fn try_from(p: f64) -> Result<Self, String> {
        if p > 0.0 && p < 0.5 { Ok(Self(p)) } else { Err(format!("the significance {p} must lie between 0 and 0.5")) }
    }
}

impl FromStr for Significance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.parse::<f64>().map_err(|_| format!("{text:?} is no number"))?.try_into()
    }
}

impl fmt::Display for Significance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chance_is_more_than_none_and_less_than_even() {
        for bad in ["0", "0.5", "-1", "nan", "inf", "one"] {
            assert!(bad.parse::<Significance>().is_err(), "{bad}");
        }
        assert_eq!("0.01".parse(), Ok(Significance::default()));
    }
}
