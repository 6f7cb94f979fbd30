//! The claims, paper by paper.

use crate::claim::Claim;

mod derdiyok;
mod full_order;
mod jadot_equations;
mod jadot_runs;
mod jadot_theorem_2;
mod kenne_equations;
mod kenne_runs;
mod kubota;
mod lowest_frequency;
mod model;
mod mtpa;
mod thau;
mod utkin;

/// Kwon et al. of all their observers, which claims about low speed extend.
const PERFORM_WELL: &str = "These observers perform well in the steady state or when the speed does not change aggressively.";

/// All claims, by number.
pub fn all() -> Vec<Claim> {
    let mut all = [
        model::CLAIMS,
        kubota::CLAIMS,
        full_order::CLAIMS,
        lowest_frequency::CLAIMS,
        derdiyok::CLAIMS,
        utkin::CLAIMS,
        thau::CLAIMS,
        mtpa::CLAIMS,
        kenne_equations::CLAIMS,
        kenne_runs::CLAIMS,
        jadot_equations::CLAIMS,
        jadot_runs::CLAIMS,
        jadot_theorem_2::CLAIMS,
    ]
    .concat();
    all.sort_by_key(|c| c.number);
    all
}

/// A determinant, by Gauss's elimination.
fn determinant<const N: usize>(mut m: [[f64; N]; N]) -> f64 {
    let mut product = 1.0;
    for k in 0..N {
        let largest = (k..N).max_by(|a, b| m[*a][k].abs().total_cmp(&m[*b][k].abs())).unwrap_or(k);
        if largest != k {
            m.swap(k, largest);
            product = -product;
        }
        product *= m[k][k];
        let pivot = m[k];
        for row in &mut m[k + 1..] {
            let share = row[k] / pivot[k];
            row.iter_mut().zip(pivot).skip(k).for_each(|(x, p)| *x -= share * p);
        }
    }
    product
}
