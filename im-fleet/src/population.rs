//! What units of a type have in common: a hierarchical model.
//!
//! Of unit i a logarithm x_i was measured with variance s_i²; x_i ~ N(θ_i, s_i²) and θ_i ~ N(μ, τ²). τ² by Paule and Mandel (1982): the
//! weighted sum of squares about the weighted mean is what it is expected to be, Σ (x_i − μ)²/(s_i² + τ²) = n − 1. What the unit's own
//! recordings leave open is borrowed from its type:
//!
//! θ̂_i = (x_i/s_i² + μ/τ²)/(1/s_i² + 1/τ²),   var θ̂_i = 1/(1/s_i² + 1/τ²)

/// Fewest units that say how far units of a type differ.
pub const FEWEST: usize = 5;

/// A measured logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Its value.
    pub x: f64,
    /// Its variance.
    pub variance: f64,
}

/// A type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Population {
    /// μ.
    pub mean: f64,
    /// Variance of the estimate of μ.
    pub mean_variance: f64,
    /// τ: by how much units differ.
    pub spread: f64,
    /// How many units it was found from.
    pub count: usize,
}

impl Population {
    /// Of the units measured; `None` with fewer than [`FEWEST`].
    pub fn of(units: &[Measured]) -> Option<Self> {
        if units.len() < FEWEST {
            return None;
        }
        let weights = |t: f64| units.iter().map(|u| 1.0 / (u.variance + t)).collect::<Vec<f64>>();
        let mean = |w: &[f64]| units.iter().zip(w).map(|(u, w)| w * u.x).sum::<f64>() / w.iter().sum::<f64>();
        let excess = |t: f64| {
            let w = weights(t);
            let m = mean(&w);
            units.iter().zip(&w).map(|(u, w)| w * (u.x - m).powi(2)).sum::<f64>() - (units.len() - 1) as f64
        };
        // The sum falls as τ² grows.
        let center = units.iter().map(|u| u.x).sum::<f64>() / units.len() as f64;
        let (mut low, mut high) = (0.0, units.iter().map(|u| (u.x - center).powi(2)).sum::<f64>());
        if excess(0.0) <= 0.0 {
            high = 0.0;
        }
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if excess(middle) > 0.0 { low = middle } else { high = middle }
        }
        let w = weights(high);
        Some(Self { mean: mean(&w), mean_variance: 1.0 / w.iter().sum::<f64>(), spread: high.sqrt(), count: units.len() })
    }

    /// What is known of a unit: by its own recordings, where they say something, and by its type.
    pub fn borrowed(&self, own: Option<Measured>) -> Measured {
        let of_type = Measured { x: self.mean, variance: self.spread.powi(2) + self.mean_variance };
        let Some(own) = own else { return of_type };
        let variance = 1.0 / (1.0 / own.variance.max(1e-300) + 1.0 / of_type.variance.max(1e-300));
        Measured { x: variance * (own.x / own.variance.max(1e-300) + of_type.x / of_type.variance.max(1e-300)), variance }
    }

    /// By how many standard deviations a unit lies off its type.
    pub fn distance(&self, unit: Measured) -> f64 {
        (unit.x - self.mean) / (unit.variance + self.spread.powi(2) + self.mean_variance).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_trials::hidden::chance::Chance;

    #[test]
    fn mean_and_spread_come_back_and_a_poorly_measured_unit_borrows() {
        let mut chance = Chance::new(1, "units");
        let truth: Vec<f64> = (0..400).map(|_| 0.7 + 0.1 * chance.normal()).collect();
        let measured: Vec<Measured> = truth
            .iter()
            .enumerate()
            .map(|(k, x)| {
                let s = [0.02, 0.1, 0.5][k % 3];
                Measured { x: x + s * chance.normal(), variance: s * s }
            })
            .collect();
        let p = Population::of(&measured).unwrap();
        // Standard errors: of the mean 0.1/√270, of the spread about 0.1/√(2·270).
        assert!((p.mean - 0.7).abs() < 0.025 && (p.spread - 0.1).abs() < 0.02, "{p:?}");
        let rms = |of: &dyn Fn(usize) -> f64| {
            let worst: Vec<f64> = (2..400).step_by(3).map(|k| (of(k) - truth[k]).powi(2)).collect();
            (worst.iter().sum::<f64>() / worst.len() as f64).sqrt()
        };
        let (alone, together) = (rms(&|k| measured[k].x), rms(&|k| p.borrowed(Some(measured[k])).x));
        assert!(alone > 0.4 && together < 0.12, "{alone} {together}");
        let same = vec![Measured { x: 1.0, variance: 0.01 }; 6];
        assert_eq!(Population::of(&same).unwrap().spread, 0.0);
        assert!(Population::of(&same[..4]).is_none());
    }
}
