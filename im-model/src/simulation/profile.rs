//! A quantity over time: straight lines between points, steps where two points share their time.

use crate::error::{Bound, ModelError};

/// A quantity over time, constant before its first point and after its last.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    points: Vec<[f64; 2]>,
}

impl Profile {
    /// The same value at all times.
    pub fn constant(value: f64) -> Self {
        Self { points: vec![[0.0, value]] }
    }

    /// Points `[t in s, value]` in the order of time; two at the same time are a step.
    ///
    /// # Errors
    /// There are no points, one is not finite, or time runs backwards: names the offending time or value.
    pub fn points(points: impl Into<Vec<[f64; 2]>>) -> Result<Self, ModelError> {
        let points = points.into();
        Bound::Within(1.0, 1e9).check("number of points", points.len() as f64)?;
        let mut before = f64::MIN;
        for &[t, x] in &points {
            Bound::Within(before, 1e12).check("time_s of a point", t)?;
            Bound::Within(-1e12, 1e12).check("value of a point", x)?;
            before = t;
        }
        Ok(Self { points })
    }

    /// The value at a time, s; at a step, that after it.
    pub fn at(&self, t: f64) -> f64 {
        // Sums of sample times miss a step by their rounding: a nanosecond early is on time.
        let t = t + 1e-9;
        let after = self.points.partition_point(|p| p[0] <= t);
        match (after.checked_sub(1).and_then(|k| self.points.get(k)), self.points.get(after)) {
            (Some([t0, x0]), Some([t1, x1])) => x0 + (x1 - x0) * (t - 1e-9 - t0).max(0.0) / (t1 - t0),
            (Some([_, x]), None) | (None, Some([_, x])) => *x,
            (None, None) => 0.0,
        }
    }

    /// The largest magnitude.
    pub fn largest(&self) -> f64 {
        self.points.iter().fold(0.0, |m, p| m.max(p[1].abs()))
    }
}

impl From<f64> for Profile {
    fn from(value: f64) -> Self {
        Self::constant(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_steps() {
        let p = Profile::points([[1.0, 0.0], [2.0, 10.0], [2.0, 20.0], [3.0, 20.0]]).unwrap();
        for (t, x) in [(0.0, 0.0), (1.0, 0.0), (1.5, 5.0), (2.0, 20.0), (9.0, 20.0)] {
            assert!((p.at(t) - x).abs() < 1e-12, "{t}: {}", p.at(t));
        }
        let n: f64 = (0..20_000).map(|_| 1e-4).sum();
        assert_eq!(p.at(n), 20.0, "{n}");
        assert!(Profile::points([[1.0, 0.0], [0.5, 0.0]]).unwrap_err().to_string().contains("0.5"));
        assert!(Profile::points([]).is_err());
        assert!(Profile::points([[0.0, f64::NAN]]).is_err());
    }
}
