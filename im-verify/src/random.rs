//! Random numbers by counter: number `k` of case `index` of a claim is a function of (seed, claim, index, k) and of nothing else, so that a
//! case is the same whoever draws it, in whatever order, on whatever machine.

/// The numbers of one case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Draws {
    key: u64,
}

impl Draws {
    /// Those of case `index` of claim number `claim`.
    pub fn new(seed: u64, claim: u32, index: u64) -> Self {
        Self { key: mixed(mixed(mixed(seed) ^ u64::from(claim)) ^ index) }
    }

    /// Number `k`, even in [0, 1).
    pub fn unit(self, k: u64) -> f64 {
        (mixed(self.key ^ mixed(k)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The finalizer of SplitMix64 (Steele, Lea, Flood 2014): a bijection whose output bits each depend on all input bits.
fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_even_and_those_of_neighbours_unrelated() {
        let n = 20_000;
        let (mut mean, mut product) = (0.0, 0.0);
        for index in 0..n {
            let (a, b) = (Draws::new(1, 7, index).unit(0), Draws::new(1, 7, index + 1).unit(0));
            mean += a / n as f64;
            product += (a - 0.5) * (b - 0.5) / n as f64;
        }
        // Five standard deviations: 1/√(12 n) and 1/(12 √n).
        assert!((mean - 0.5).abs() < 5.0 * 0.0021 && product.abs() < 5.0 * 0.0006, "{mean} {product}");
        let d = Draws::new(1, 7, 3);
        assert!(d != Draws::new(2, 7, 3) && d != Draws::new(1, 8, 3) && d.unit(0) != d.unit(1));
    }
}
