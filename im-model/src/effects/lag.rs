//! A first-order lag τ ẏ = x − y over a sample, solved exactly.

use core::ops::{Add, Mul, Sub};

/// How far y is behind x, y − x, after a sample in which x went in a straight line by `rise`; `behind` before it. `lag` is τ over the length of
/// the sample, `decay` e^{−t/τ}.
#[inline(always)]
pub(super) fn behind_ramp<T: Copy, V>(behind: V, rise: V, lag: T, decay: T) -> V
where
    V: Copy + Add<Output = V> + Sub<Output = V> + Mul<T, Output = V>,
{
    // A particular solution for x = x₀ + s t is x − τ s; the rest decays.
    let settled = rise * lag;
    (behind + settled) * decay - settled
}
