//! Tails of the normal distribution, and many tests at once.

use statrs::distribution::{ContinuousCDF, Normal};

/// The chance of a standard normal number at least as far from zero.
pub fn two_sided(z: f64) -> f64 {
    2.0 * Normal::standard().sf(z.abs())
}

/// Which of many p-values are discoveries, with at most a part `q` of them false in the mean (Benjamini & Hochberg 1995).
pub fn benjamini_hochberg(p: &[f64], q: f64) -> Vec<bool> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let passes = |rank: usize| p[order[rank]] <= q * (rank + 1) as f64 / p.len() as f64;
    let last = (0..p.len()).rev().find(|&rank| passes(rank));
    let mut out = vec![false; p.len()];
    for &k in order.iter().take(last.map_or(0, |l| l + 1)) {
        out[k] = true;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of Benjamini and Hochberg (1995), section 3.2: of fifteen p-values four are discoveries at q = 0.05.
    #[test]
    fn the_example_of_the_paper() {
        let p =
            [0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719, 0.6528, 0.7590, 1.0];
        let found = benjamini_hochberg(&p, 0.05);
        assert_eq!(found.iter().filter(|f| **f).count(), 4);
        assert!(found[..4].iter().all(|f| *f));
        assert!(benjamini_hochberg(&[], 0.05).is_empty());
        assert!((two_sided(1.959_964) - 0.05).abs() < 1e-7);
    }
}
