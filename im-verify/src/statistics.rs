//! How sure a failure rate is.

use statrs::function::beta::beta_reg;

/// The Clopper-Pearson interval on a rate: with at least `confidence` the interval holds the rate, however small.
///
/// `violated` of `cases`; [0, 1] without cases.
pub fn clopper_pearson(violated: u64, cases: u64, confidence: f64) -> [f64; 2] {
    if cases == 0 {
        return [0.0, 1.0];
    }
    let tail = 0.5 * (1.0 - confidence);
    let (k, n) = (violated as f64, cases as f64);
    // P(at least k | p) = I_p(k, n − k + 1), growing in p; P(at most k | p) = 1 − I_p(k + 1, n − k).
    let low = if violated == 0 { 0.0 } else { root(|p| beta_reg(k, n - k + 1.0, p) - tail) };
    let high = if violated == cases { 1.0 } else { root(|p| beta_reg(k + 1.0, n - k, p) - (1.0 - tail)) };
    [low, high]
}

/// Where a growing function passes zero in [0, 1].
fn root(f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0f64, 1.0f64);
    // To a relative 1e-9 down to rates of 1e-12.
    for _ in 0..70 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_the_tables() {
        // No failure in n: 1 − (α/2)^{1/n}. Five of a hundred: 0.0164 to 0.1128.
        let [low, high] = clopper_pearson(0, 100, 0.95);
        assert!(low == 0.0 && (high - (1.0 - 0.025f64.powf(0.01))).abs() < 1e-9);
        let [low, high] = clopper_pearson(5, 100, 0.95);
        assert!((low - 0.0164).abs() < 1e-4 && (high - 0.1128).abs() < 1e-4, "{low} {high}");
        assert_eq!(clopper_pearson(0, 0, 0.95), [0.0, 1.0]);
        let [low, high] = clopper_pearson(100, 100, 0.95);
        assert!((low - 0.025f64.powf(0.01)).abs() < 1e-9 && high == 1.0);
        let [low, high] = clopper_pearson(1000, 1_000_000, 0.95);
        assert!(low > 0.9e-3 && high < 1.1e-3);
    }
}
