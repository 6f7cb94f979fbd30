//! A free-form effect by itself: which quantity over which variable, and its parameters.

use super::parameters::{Acts, COEFFICIENTS, Over};
use crate::effects::ParameterInfo;

/// A free-form effect: where it acts, what it depends on, and where its curve lies.
#[derive(Clone, Copy, Debug)]
pub struct FreeForm {
    pub(super) acts: Acts,
    pub(super) over: Over,
    pub(super) parameters: &'static [ParameterInfo],
}

impl FreeForm {
    /// One whose parameters are given, for a `static`: coefficients, [`SPREAD`](Self::SPREAD), then the ends of the range or the order.
    pub const fn with_parameters(acts: Acts, over: Over, parameters: &'static [ParameterInfo]) -> Self {
        Self { acts, over, parameters }
    }

    /// The quantity that it adds to.
    pub fn acts(&self) -> Acts {
        self.acts
    }
    /// What it depends on.
    pub fn over(&self) -> Over {
        self.over
    }

    /// Index of the parameter that holds the size that the coefficients have before any data: their precision is
    /// [`precision`](Self::precision) over its square.
    pub const SPREAD: usize = COEFFICIENTS;
}
