//! A speed reference that a drive can follow: twice differentiable, within speed and acceleration.

use im_model::{ModelError, Scalar};

use crate::guard;
use crate::vector::within;

/// ẍ = ω_n²(r − x) − 2ω_n ẋ with |ẋ| ≤ a: a critically damped filter whose acceleration is limited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceShaper<T> {
    /// ω_n, rad/s.
    pub bandwidth_rad_s: T,
    /// a, rad/s².
    pub acceleration_max_rad_s2: T,
}

/// The shaped reference with its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaped<T> {
    /// Speed, rad/s.
    pub speed: T,
    /// Its rate, rad/s².
    pub rate: T,
    /// The rate's rate, rad/s³.
    pub second: T,
}

impl<T: Scalar> Shaped<T> {
    /// At rest at a speed.
    pub fn at(speed: T) -> Self {
        Self { speed, rate: T::zero(), second: T::zero() }
    }
}

impl<T: Scalar> ReferenceShaper<T> {
    /// Checks the values: both positive.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        guard::SIZE.check("bandwidth_rad_s", self.bandwidth_rad_s.value())?;
        guard::SIZE.check("acceleration_max_rad_s2", self.acceleration_max_rad_s2.value())
    }

    /// One sample towards `wanted`.
    #[inline]
    pub fn step(&self, x: &mut Shaped<T>, wanted: T, sample_time_s: T) {
        let (w, t) = (self.bandwidth_rad_s, sample_time_s);
        // Implicit in the rate: stable for every sampling time.
        let d = T::one() + w * t;
        let rate = (x.rate + w * (w * t) * (wanted - x.speed)) / (d * d);
        let rate = within(rate, self.acceleration_max_rad_s2);
        x.second = (rate - x.rate) / t;
        x.rate = rate;
        x.speed += rate * t;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_arrives_without_overshoot_and_within_its_acceleration() {
        let shaper = ReferenceShaper { bandwidth_rad_s: 100.0, acceleration_max_rad_s2: 500.0 };
        let mut x = Shaped::at(0.0);
        for k in 0..6000 {
            shaper.step(&mut x, 150.0, 1e-4);
            assert!(x.rate.abs() <= 500.0 && x.speed < 150.0 + 1e-6, "{k}: {x:?}");
        }
        assert!((x.speed - 150.0).abs() < 0.01, "{x:?}");
    }
}
