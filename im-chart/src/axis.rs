//! Axes: what they span, where a value lies on them, round numbers to write beside them.

use crate::scale::ticks;

/// One axis of a chart.
#[derive(Clone, Debug)]
pub struct Axis {
    lo: f64,
    hi: f64,
    pub(crate) label: String,
    log: bool,
}

impl Axis {
    /// Linear, as it is given.
    pub(crate) fn exact([lo, hi]: [f64; 2]) -> Self {
        Self { lo, hi, label: String::new(), log: false }
    }

    /// Linear, widened where it has no extent.
    pub fn new(lo: f64, hi: f64, label: impl Into<String>) -> Self {
        let (lo, hi) = if lo.is_finite() && hi.is_finite() { (lo.min(hi), lo.max(hi)) } else { (0.0, 1.0) };
        let (lo, hi) = if hi - lo > 1e-12 * hi.abs().max(lo.abs()) && hi > lo {
            (lo, hi)
        } else {
            (lo - 0.5 * lo.abs().max(1e-3), hi + 0.5 * hi.abs().max(1e-3))
        };
        Self { lo, hi, label: label.into(), log: false }
    }

    /// Around values, with a little room; zero included where it is near.
    pub fn around(values: impl IntoIterator<Item = f64>, label: impl Into<String>) -> Self {
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values.into_iter().filter(|v| v.is_finite()) {
            lo = lo.min(v);
            hi = hi.max(v);
        }
        if lo == 0.0 && hi == 0.0 {
            return Self::new(-1.0, 1.0, label);
        }
        if lo > 0.0 && lo < 0.6 * hi {
            lo = 0.0;
        }
        if hi < 0.0 && hi > 0.6 * lo {
            hi = 0.0;
        }
        let room = 0.06 * (hi - lo);
        let keep = |x: f64, moved: f64| if x == 0.0 { x } else { moved };
        Self::new(keep(lo, lo - room), keep(hi, hi + room), label)
    }

    /// Logarithmic; bounds are taken to be positive.
    pub fn log(lo: f64, hi: f64, label: impl Into<String>) -> Self {
        let (lo, hi) = (lo.max(1e-12), hi.max(1e-11));
        let (lo, hi) = if hi > 1.2 * lo { (lo, hi) } else { (lo / 1.5, hi * 1.5) };
        Self { lo, hi, label: label.into(), log: true }
    }

    /// Where a value lies: 0 at the lower end, 1 at the upper.
    pub(crate) fn at(&self, v: f64) -> f64 {
        if self.log {
            (v.max(self.lo * 1e-3) / self.lo).ln() / (self.hi / self.lo).ln()
        } else {
            (v - self.lo) / (self.hi - self.lo)
        }
    }

    /// Ticks with their words.
    pub(crate) fn ticks(&self, wanted: f64) -> Vec<(f64, String)> {
        if self.log {
            let decades = (self.hi / self.lo).log10();
            let steps: &[f64] = if decades < 1.6 { &[1.0, 2.0, 5.0] } else { &[1.0] };
            let every = (decades / 6.0).ceil().max(1.0) as i32;
            let mut out = Vec::new();
            let first = self.lo.log10().floor() as i32;
            for d in (first..=self.hi.log10().ceil() as i32).filter(|d| d.rem_euclid(every) == 0) {
                for s in steps {
                    let v = s * 10f64.powi(d);
                    if v >= self.lo * 0.999 && v <= self.hi * 1.001 {
                        out.push((v, decade_words(v)));
                    }
                }
            }
            // Within a step of the decades: numbers as between them.
            if out.len() > 1 {
                return out;
            }
        }
        ticks([self.lo, self.hi], wanted)
    }
}

/// 0.01, 5, 2000, 1e−6.
fn decade_words(x: f64) -> String {
    let power = x.abs().log10().floor();
    if (-4.0..5.0).contains(&power) {
        format!("{:.*}", (-power).max(0.0) as usize, x)
    } else {
        format!("{x:.0e}").replace('-', "−")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_of_decades_are_few_and_every_axis_has_some() {
        let words = |a: Axis| a.ticks(5.0).into_iter().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(words(Axis::log(0.9, 600.0, "")), ["1", "10", "100"]);
        assert_eq!(words(Axis::log(0.009, 0.06, "")), ["0.01", "0.02", "0.05"]);
        assert!(words(Axis::log(0.031, 0.09, "")).len() > 1);
        assert_eq!(decade_words(2e-7), "2e−7");
        // No extent, no numbers: still an axis.
        assert!(!words(Axis::new(2.0, 2.0, "")).is_empty());
        assert!(!words(Axis::around([f64::NAN], "")).is_empty());
    }
}
