//! The sign law (37) of Kenné et al. in sampled time, and ranges that estimates are kept in.

use im_model::{Bound, ModelError, Scalar};

/// Change of an estimate over a sample by dR̂/dt = −k sign(e): `reach` is kh, `error` is estimate less truth.
///
/// The sign is taken implicitly, at the end of the sample: where the error is smaller than kh it is removed at once and nothing
/// chatters. With |dR/dt| ≤ μ, |e| falls by (k − μ)h in every sample until it is below kh, and below μh after that: Theorem 7, sampled.
/// Within a boundary layer (wider than kh, or it has no effect) the law is linear.
#[inline]
pub fn sign_law<T: Scalar>(error: T, reach: T, layer: T) -> T {
    let slope = if layer > reach { reach / layer } else { T::one() };
    -(error * slope).max(-reach).min(reach)
}

/// Where an estimate is kept: physical considerations, not tuning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range<T> {
    low: T,
    high: T,
}

impl<T: Scalar> Range<T> {
    /// From `low` to `high`.
    ///
    /// # Errors
    /// Names `quantity` when `low` is negative, a bound is not finite, or they are in the wrong order.
    pub fn try_new(quantity: &'static str, low: T, high: T) -> Result<Self, ModelError> {
        Bound::NotNegative.check(quantity, low.value())?;
        Bound::Within(low.value(), f64::MAX).check(quantity, high.value())?;
        Ok(Self { low, high })
    }

    /// From x/factor to x·factor, for a positive x and a factor above 1; the user of the range checks it.
    pub(crate) fn around(x: T, factor: T) -> Self {
        Self { low: x / factor, high: x * factor }
    }

    /// Lower end.
    pub fn low(&self) -> T {
        self.low
    }

    /// Upper end.
    pub fn high(&self) -> T {
        self.high
    }

    /// Whether an estimate is at an end of it: what was measured asks for more, and the range holds it.
    #[inline]
    pub fn binds(&self, x: T) -> bool {
        !(x > self.low && x < self.high)
    }

    /// The nearest value within; the lower end for what is not a number.
    #[inline]
    pub fn project(&self, x: T) -> T {
        if x > self.low { x.min(self.high) } else { self.low }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Theorem 7 in sampled time, for any resistance that changes no faster than μ and any k > μ.
        #[test]
        fn error_falls_at_k_less_mu_until_it_vanishes(
            start in -5.0..5.0f64, k in 0.1..50.0f64, share in 0.0..0.95f64, h in 1e-6..2e-4f64,
            slopes in prop::collection::vec(-1.0..1.0f64, 1..40), samples in 1usize..4000,
        ) {
            let mu = share * k;
            let (mut truth, mut estimate, e0) = (1.0, 1.0 + start, start.abs());
            for n in 0..samples {
                truth += mu * h * slopes[n * slopes.len() / samples];
                // The error is that at the end of the sample, of which the law knows all but its own step.
                estimate += sign_law(estimate - truth, k * h, 0.0);
                let promised = (e0 - (k - mu) * h * (n + 1) as f64).max(0.0);
                // The truth moves within the sample, hence μh.
                prop_assert!((estimate - truth).abs() <= promised + mu * h + 1e-12);
            }
        }
    }

    #[test]
    fn boundary_layer_is_linear_inside_and_keeps_the_speed_outside() {
        assert_eq!(sign_law(0.05, 0.01, 0.1), -0.005);
        assert_eq!(sign_law(-3.0, 0.01, 0.1), 0.01);
        assert_eq!(sign_law(0.004, 0.01, 0.0), -0.004);
    }

    #[test]
    fn ranges_project_and_refuse() {
        let r = Range::try_new("x_ohm", 0.5, 2.0).unwrap();
        assert_eq!([0.1, 1.0, 3.0, f64::NAN, f64::INFINITY].map(|x| r.project(x)), [0.5, 1.0, 2.0, 0.5, 2.0]);
        for (low, high) in [(-1.0, 2.0), (2.0, 1.0), (0.0, f64::NAN)] {
            assert!(Range::try_new("x_ohm", low, high).unwrap_err().to_string().starts_with("x_ohm"));
        }
    }
}
