//! The claims, paper by paper.

use crate::claim::Claim;

mod derdiyok;
mod kubota;
mod model;

/// All claims, by number.
pub fn all() -> Vec<Claim> {
    let mut all = [model::CLAIMS, kubota::CLAIMS, derdiyok::CLAIMS].concat();
    all.sort_by_key(|c| c.number);
    all
}
