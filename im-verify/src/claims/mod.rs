//! The claims, paper by paper.

use crate::claim::Claim;

mod derdiyok;
mod jadot_equations;
mod jadot_runs;
mod kenne_equations;
mod kenne_runs;
mod kubota;
mod model;
mod mtpa;
mod thau;
mod utkin;

/// All claims, by number.
pub fn all() -> Vec<Claim> {
    let mut all = [
        model::CLAIMS,
        kubota::CLAIMS,
        derdiyok::CLAIMS,
        utkin::CLAIMS,
        thau::CLAIMS,
        mtpa::CLAIMS,
        kenne_equations::CLAIMS,
        kenne_runs::CLAIMS,
        jadot_equations::CLAIMS,
        jadot_runs::CLAIMS,
    ]
    .concat();
    all.sort_by_key(|c| c.number);
    all
}
