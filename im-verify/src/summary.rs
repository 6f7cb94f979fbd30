//! Blocks of results put together: one row per claim, and whether it came out as `docs/background/claims.md` states it.

use crate::campaign::{Block, Campaign};
use crate::claim::{Claim, Found};
use crate::statistics::clopper_pearson;
use crate::subject::Machines;

/// Confidence of the intervals.
pub const CONFIDENCE: f64 = 0.95;

/// How a campaign compares with what `docs/background/claims.md` states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// None violated where it holds, a counterexample found where it fails.
    AsStated,
    /// Too few cases to tell: no counterexample, but so few cases would often meet none; or no case that meets the assumptions.
    TooFew,
    /// No counterexample on this machine, of a claim that fails on others.
    NotOnThisMachine,
    /// A counterexample where it holds, or none in so many cases that there should be one.
    Otherwise,
}

impl Outcome {
    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::AsStated => "as stated",
            Self::TooFew => "too few cases to tell",
            Self::NotOnThisMachine => "not on this machine",
            Self::Otherwise => "NOT AS STATED",
        }
    }

    /// With so small a chance that cases of the known rate of failure meet no counterexample, there is none to be met.
    const DOUBT: f64 = 1e-3;

    fn of(found: Found, machines: &Machines, cases: u64, violated: u64) -> Self {
        match found {
            _ if cases == 0 => Self::TooFew,
            Found::Fails { .. } if violated > 0 => Self::AsStated,
            Found::Fails { .. } if *machines != Machines::Random => Self::NotOnThisMachine,
            Found::Fails { rate } if (1.0 - rate).powf(cases as f64) > Self::DOUBT => Self::TooFew,
            Found::Holds | Found::HoldsIf if violated == 0 => Self::AsStated,
            _ => Self::Otherwise,
        }
    }
}

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
    /// How it came out.
    pub outcome: Outcome,
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
        let outcome = Outcome::of(claim.found, &campaign.machines, cases, violated);
        let interval = clopper_pearson(violated, cases, CONFIDENCE);
        Self { claim: claim.number, cases, outside, violated, interval, worst, violating, outcome }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subject::Subject;

    #[test]
    fn few_cases_of_a_rare_failure_tell_nothing_and_many_do() {
        let of = |found, cases, violated| Outcome::of(found, &Machines::Random, cases, violated);
        let rare = Found::Fails { rate: 0.01 };
        assert_eq!(of(rare, 20, 0), Outcome::TooFew);
        assert_eq!(of(rare, 20, 1), Outcome::AsStated);
        // 0.99^687 is a thousandth.
        assert_eq!((of(rare, 680, 0), of(rare, 700, 0)), (Outcome::TooFew, Outcome::Otherwise));
        assert_eq!((of(Found::Holds, 20, 0), of(Found::Holds, 20, 1)), (Outcome::AsStated, Outcome::Otherwise));
        assert_eq!(of(Found::HoldsIf, 0, 0), Outcome::TooFew);
        let one = Machines::One(Box::new(Subject::by_name("jadot_table_i").unwrap()));
        assert_eq!(Outcome::of(rare, &one, 100_000, 0), Outcome::NotOnThisMachine);
    }
}
