//! How many states the effects of the registry have.

use core::ops::Range;

use super::about::StateKind;
use super::{COUNT, FILTERS, STATES};

/// How many filter states the speed sensor can have.
pub(crate) const FILTER_STATES: usize = FILTER_STARTS[COUNT];

/// For each place of the registry where its filter states begin.
const FILTER_STARTS: [usize; COUNT + 1] = {
    let (mut out, mut k) = ([0; COUNT + 1], 0);
    while k < COUNT {
        out[k + 1] = out[k] + FILTERS[k];
        k += 1;
    }
    out
};

/// The filter states of the effect at a place of the registry.
#[inline(always)]
pub(super) const fn filters(index: usize) -> Range<usize> {
    FILTER_STARTS[index]..FILTER_STARTS[index + 1]
}

/// How many numbers the states of all built-in effects are but for those that drift.
const SETTLING_STATES: usize = {
    let (mut sum, mut effect) = (0, 0);
    while effect < COUNT {
        let mut k = 0;
        while k < STATES[effect].len() {
            let info = &STATES[effect][k];
            if !matches!(info.kind, StateKind::Drifts) {
                sum += info.width();
            }
            k += 1;
        }
        effect += 1;
    }
    sum
};

/// The unknowns of a steady state: ψ_s and ψ_r (complex), ω_m, and the states of the effects but for those that drift, which are held.
pub(crate) const UNKNOWNS: usize = 5 + SETTLING_STATES;
