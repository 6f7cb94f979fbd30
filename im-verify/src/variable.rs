//! What varies from case to case: named quantities with a range, and the value that is simplest.

/// How a range is covered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Even,
    /// Evenly in the logarithm.
    Ratio,
    /// Whole numbers, both ends included.
    Whole,
}

/// A quantity of a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variable {
    /// Name with its unit, as in files.
    pub name: &'static str,
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Where shrinking leads to.
    pub simple: f64,
    /// How the range is covered.
    pub scale: Scale,
}

impl Variable {
    /// Even in [low, high]; simplest in the middle.
    pub const fn even(name: &'static str, low: f64, high: f64) -> Self {
        Self { name, low, high, simple: 0.5 * (low + high), scale: Scale::Even }
    }

    /// Even in the logarithm; simplest at `simple`.
    pub const fn ratio(name: &'static str, low: f64, high: f64, simple: f64) -> Self {
        Self { name, low, high, simple, scale: Scale::Ratio }
    }

    /// Whole numbers from `low` to `high`; simplest at `simple`.
    pub const fn whole(name: &'static str, low: f64, high: f64, simple: f64) -> Self {
        Self { name, low, high, simple, scale: Scale::Whole }
    }

    /// An angle, rad: a whole turn, simplest at zero.
    pub const fn angle(name: &'static str) -> Self {
        Self::even(name, -core::f64::consts::PI, core::f64::consts::PI)
    }

    /// Simplest at `simple`.
    pub const fn simplest_at(self, simple: f64) -> Self {
        Self { simple, ..self }
    }

    /// The value at `share` of the range, in [0, 1).
    pub fn at(&self, share: f64) -> f64 {
        match self.scale {
            Scale::Even => self.low + (self.high - self.low) * share,
            Scale::Ratio => self.low * (self.high / self.low).powf(share),
            Scale::Whole => (self.low + (self.high - self.low + 1.0) * share).floor().min(self.high),
        }
    }

    /// Whether a value lies in the range, as values from files must.
    pub fn admits(&self, x: f64) -> bool {
        (self.low..=self.high).contains(&x) && (self.scale != Scale::Whole || x.fract() == 0.0)
    }

    /// A value half-way from `simple` (or from what is known to be too simple) to `x`.
    pub(crate) fn between(&self, a: f64, b: f64) -> f64 {
        match self.scale {
            Scale::Even => 0.5 * (a + b),
            Scale::Ratio => (a * b).sqrt(),
            Scale::Whole => (0.5 * (a + b)).round(),
        }
    }
}
