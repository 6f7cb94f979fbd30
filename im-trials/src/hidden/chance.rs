//! Reproducible chance: one stream of numbers per seed and purpose, so that adding an effect to a case leaves its machine,
//! its manoeuvre and its noise as they were.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Chance {
    source: Xoshiro256PlusPlus,
}

impl Chance {
    /// The stream of a seed for one purpose.
    pub fn new(seed: u64, purpose: &str) -> Self {
        // FNV-1a over the purpose, mixed with the seed.
        let mut hash = 0xcbf2_9ce4_8422_2325_u64 ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        for byte in purpose.bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
        Self { source: Xoshiro256PlusPlus::seed_from_u64(hash) }
    }

    /// Uniform in `low..high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.source.random::<f64>()
    }

    /// One of `n` equally likely numbers `0..n`.
    pub fn one_of(&mut self, n: usize) -> usize {
        ((self.source.random::<f64>() * n as f64) as usize).min(n - 1)
    }

    /// −1 or +1.
    pub fn sign(&mut self) -> f64 {
        if self.source.random::<f64>() < 0.5 { -1.0 } else { 1.0 }
    }

    /// Standard normal (polar method of Marsaglia).
    pub fn normal(&mut self) -> f64 {
        loop {
            let (u, v) = (self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            let s = u * u + v * v;
            if s > 0.0 && s < 1.0 {
                return u * (-2.0 * s.ln() / s).sqrt();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_zero_mean_and_unit_variance() {
        let mut chance = Chance::new(7, "normal");
        let n = 100_000;
        let (mut sum, mut square) = (0.0, 0.0);
        for _ in 0..n {
            let x = chance.normal();
            sum += x;
            square += x * x;
        }
        // Standard errors are 0.0032 and 0.0045: four of each.
        assert!((sum / f64::from(n)).abs() < 0.013);
        assert!((square / f64::from(n) - 1.0).abs() < 0.018);
    }

    #[test]
    fn purposes_have_streams_of_their_own() {
        let first = |purpose| Chance::new(1, purpose).between(0.0, 1.0);
        assert_ne!(first("noise"), first("machine"));
        assert_eq!(first("noise"), first("noise"));
    }
}
