//! A quantity over time: straight lines between points, steps where two points share their time.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};

use crate::error::{Bound, ModelError};
use crate::toml_text::exact;

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

impl Profile {
    /// As it stands in a file: a number, or points.
    pub(crate) fn to_toml(&self) -> String {
        match &self.points[..] {
            [[0.0, x]] => exact(*x),
            points => {
                let points: Vec<String> = points.iter().map(|[t, x]| format!("[{}, {}]", exact(*t), exact(*x))).collect();
                format!("[{}]", points.join(", "))
            }
        }
    }
}

impl From<f64> for Profile {
    fn from(value: f64) -> Self {
        Self::constant(value)
    }
}

impl Default for Profile {
    fn default() -> Self {
        Self::constant(0.0)
    }
}

/// A number, or a list of points `[t, x]` in the order of time.
impl<'de> Deserialize<'de> for Profile {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        const EXPECTED: &str = "a number, or points [[t_s, value], …] in the order of time; two at one time make a step";
        struct Points;
        impl<'de> Visitor<'de> for Points {
            type Value = Profile;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(EXPECTED)
            }
            fn visit_f64<E: Error>(self, x: f64) -> Result<Profile, E> {
                checked(vec![[0.0, x]])
            }
            fn visit_i64<E: Error>(self, x: i64) -> Result<Profile, E> {
                self.visit_f64(x as f64)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Profile, A::Error> {
                let mut points: Vec<[f64; 2]> = Vec::new();
                let other = || wrong("a list with something other than a point [t_s, value] in it");
                while let Some(point) = list.next_element::<Vec<f64>>().map_err(|_: A::Error| other())? {
                    points.push(point.try_into().map_err(|_| other())?);
                }
                checked(points)
            }
        }
        fn checked<E: Error>(points: Vec<[f64; 2]>) -> Result<Profile, E> {
            Profile::points(points).map_err(|e| wrong(&format!("not a profile ({e})")))
        }
        // As the reader of TOML explains it: what is there, and what should be.
        fn wrong<E: Error>(found: &str) -> E {
            E::custom(format_args!("is {found}, expected {EXPECTED}"))
        }
        from.deserialize_any(Points)
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
