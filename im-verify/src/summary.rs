//! Blocks of results put together: one row per claim, and whether it came out as `docs/claims.md` states it.

use crate::campaign::{Block, Campaign};
use crate::claim::{Claim, Found};
use crate::statistics::clopper_pearson;

/// Confidence of the intervals.
pub const CONFIDENCE: f64 = 0.95;

/// A claim over all its cases.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Number of the claim.
    pub claim: u32,
    /// Cases tried, those outside its assumptions not counted.
    pub cases: u64,
    /// Cases outside its assumptions.
    pub outside: u64,
    /// Cases that violate it.
    pub violated: u64,
    /// Clopper-Pearson interval of the failure rate at [`CONFIDENCE`].
    pub interval: [f64; 2],
    /// Smallest margin, and its case.
    pub worst: Option<(f64, u64)>,
    /// The first violating cases, in order.
    pub violating: Vec<u64>,
    /// Whether it came out as stated: none violated where it holds, a counterexample found where it fails; no cases say nothing.
    pub as_stated: bool,
}

impl Row {
    /// One claim over the blocks that are its own.
    pub fn of(claim: &Claim, campaign: &Campaign, blocks: &[Block]) -> Self {
        let own = || blocks.iter().filter(|b| b.claim == claim.number && campaign.owns(b));
        let sum = |f: fn(&Block) -> u64| own().map(f).sum::<u64>();
        let (outside, violated) = (sum(|b| b.outside), sum(|b| b.violated));
        let cases = sum(|b| b.cases) - outside;
        let mut violating: Vec<u64> = own().flat_map(|b| b.violating.iter().copied()).collect();
        violating.sort_unstable();
        // Equal margins: the first case, whatever the order of the blocks.
        let worst = own().filter_map(|b| b.worst).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let as_stated = cases > 0 && (violated > 0) == (claim.found == Found::Fails);
        let interval = clopper_pearson(violated, cases, CONFIDENCE);
        Self { claim: claim.number, cases, outside, violated, interval, worst, violating, as_stated }
    }
}
