//! Many cases of many claims over all cores, in blocks that are shared out and resumed.

use std::sync::Mutex;

use im_model::Shard;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::claim::Claim;
use crate::subject::Machines;

/// What is to be tried.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// The claims.
    pub claims: Vec<Claim>,
    /// On which machines.
    pub machines: Machines,
    /// Cases of each claim; by their cost if none.
    pub cases: Option<u64>,
    /// The seed.
    pub seed: u64,
    /// The part to do here.
    pub shard: Shard,
}

/// What came out of a block of cases: a line of the results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// Number of the claim.
    pub claim: u32,
    /// Its name.
    pub name: String,
    /// The seed.
    pub seed: u64,
    /// Whose machines: [`Machines::label`].
    pub machines: String,
    /// Index of the first case.
    pub first: u64,
    /// Number of cases.
    pub cases: u64,
    /// Of these, those that violate the claim.
    pub violated: u64,
    /// Of these, those that do not meet its assumptions.
    pub outside: u64,
    /// The smallest margin, and the case it belongs to; none if all are outside.
    pub worst: Option<(f64, u64)>,
    /// The first violating cases, up to [`KEPT`].
    pub violating: Vec<u64>,
}

/// Violating cases that a block names.
pub const KEPT: usize = 20;

/// A piece of work.
#[derive(Clone, Copy, Debug)]
struct Work {
    claim: usize,
    first: u64,
    cases: u64,
}

impl Campaign {
    /// Cases of a claim in the whole campaign.
    pub fn cases_of(&self, claim: &Claim) -> u64 {
        self.cases.unwrap_or(claim.cost.cases())
    }

    fn work(&self) -> Vec<Work> {
        let mut all = Vec::new();
        for (k, claim) in self.claims.iter().enumerate() {
            let (cases, block) = (self.cases_of(claim), claim.cost.block());
            let blocks = (0..cases.div_ceil(block)).filter(|b| self.shard.has(*b));
            all.extend(blocks.map(|b| Work { claim: k, first: b * block, cases: block.min(cases - b * block) }));
        }
        all
    }

    /// Whether a result is one of this campaign's blocks, of this shard or another.
    pub fn owns(&self, block: &Block) -> bool {
        let claim = self.claims.iter().find(|c| c.number == block.claim && c.name == block.name);
        let fits = |c: &Claim| {
            let (size, all) = (c.cost.block(), self.cases_of(c));
            block.first.is_multiple_of(size) && block.first < all && block.cases == size.min(all - block.first)
        };
        block.seed == self.seed && block.machines == self.machines.label() && claim.is_some_and(fits)
    }

    /// What of this shard is not among the `done` blocks.
    fn left(&self, done: &[Block]) -> Vec<Work> {
        let mut left = self.work();
        left.retain(|w| {
            let claim = &self.claims[w.claim];
            !done.iter().any(|b| self.owns(b) && b.claim == claim.number && b.first == w.first)
        });
        left
    }

    /// How much work is left beside the `done` blocks, in units of a [`Cost::Equation`](crate::Cost::Equation) case: for progress bars.
    pub fn effort_left(&self, done: &[Block]) -> u64 {
        self.left(done).iter().map(|w| w.cases * self.claims[w.claim].cost.effort()).sum()
    }

    /// How much of it a block was.
    pub fn effort_of(&self, block: &Block) -> u64 {
        self.claims.iter().find(|c| c.number == block.claim).map_or(0, |c| block.cases * c.cost.effort())
    }

    /// Tries what is not among the `done` blocks. Each finished block is given to `tell`, one at a time; an error of it ends the campaign.
    ///
    /// # Errors
    /// The first error of `tell`.
    pub fn run<E: Send>(&self, done: &[Block], tell: impl FnMut(&Block) -> Result<(), E> + Send) -> Result<(), E> {
        let label = self.machines.label();
        let tell = Mutex::new(tell);
        self.left(done).par_iter().with_max_len(1).try_for_each(|w| {
            let block = self.block(w, &label);
            let mut tell = tell.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            tell(&block)
        })
    }

    fn block(&self, w: &Work, label: &str) -> Block {
        let claim = &self.claims[w.claim];
        let mut out = Block {
            claim: claim.number,
            name: claim.name.into(),
            seed: self.seed,
            machines: label.into(),
            first: w.first,
            cases: w.cases,
            violated: 0,
            outside: 0,
            worst: None,
            violating: Vec::new(),
        };
        for index in w.first..w.first + w.cases {
            let verdict = claim.verdict(&claim.draw(self.seed, index, &self.machines), &self.machines);
            let Some(margin) = verdict.margin() else {
                out.outside += 1;
                continue;
            };
            if verdict.is_violated() {
                out.violated += 1;
                if out.violating.len() < KEPT {
                    out.violating.push(index);
                }
            }
            if out.worst.is_none_or(|(worst, _)| margin < worst) {
                out.worst = Some((margin, index));
            }
        }
        out
    }
}
