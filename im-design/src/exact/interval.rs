//! Intervals with floats as ends, every operation rounded outwards: what holds for the interval holds for the number.
//!
//! For claims about curves with exponentials and powers, which have no exact value. Sum, product, quotient and root of IEEE
//! floats are correctly rounded, so one step outwards encloses them; the exponential is summed as a series with its remainder,
//! and the logarithm is whatever the exponential confirms.

use std::ops::{Add, Mul, Neg, Sub};

/// All numbers from `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// From two ends.
    pub const fn new(low: f64, high: f64) -> Self {
        Interval { low, high }
    }

    /// One number.
    pub const fn point(x: f64) -> Self {
        Interval { low: x, high: x }
    }

    /// The part that is not negative.
    #[must_use]
    pub fn not_negative(self) -> Self {
        Interval::new(self.low.max(0.0), self.high.max(0.0))
    }

    /// |x|, an interval from zero on.
    #[must_use]
    pub fn magnitude(self) -> Self {
        Interval::new(0.0, self.low.abs().max(self.high.abs()))
    }

    /// Quotient; everything when the divisor contains zero.
    #[must_use]
    pub fn over(self, by: Self) -> Self {
        if !(by.low > 0.0 || by.high < 0.0) {
            return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        }
        outward([self.low / by.low, self.low / by.high, self.high / by.low, self.high / by.high])
    }

    /// x², never negative.
    #[must_use]
    pub fn squared(self) -> Self {
        let least = if self.low > 0.0 { self.low } else { (-self.high).max(0.0) };
        let most = self.low.abs().max(self.high.abs());
        Interval::new((least * least).next_down().max(0.0), (most * most).next_up())
    }

    /// Root of a number that is not negative.
    #[must_use]
    pub fn root(self) -> Self {
        Interval::new(self.low.max(0.0).sqrt().next_down().max(0.0), self.high.max(0.0).sqrt().next_up())
    }

    /// eˣ.
    #[must_use]
    pub fn exp(self) -> Self {
        Interval::new(exp_point(self.low).low, exp_point(self.high).high)
    }

    /// x^power for x ≥ 0 and power > 0.
    #[must_use]
    pub fn power(self, power: f64) -> Self {
        let at = |x: f64| if x > 0.0 { (ln_point(x) * Interval::point(power)).exp() } else { Interval::point(0.0) };
        Interval::new(at(self.low).low, at(self.high).high)
    }

    /// ln x for x > 0.
    #[must_use]
    pub fn ln(self) -> Self {
        Interval::new(ln_point(self.low).low, ln_point(self.high).high)
    }
}

fn outward(candidates: [f64; 4]) -> Interval {
    let [a, b, c, d] = candidates.map(|x| if x.is_nan() { 0.0 } else { x });
    Interval::new(a.min(b).min(c).min(d).next_down(), a.max(b).max(c).max(d).next_up())
}

/// eˣ = 2ⁿ eʳ, |r| ≤ 0.35: fourteen terms of the series and twice the next for all that follow.
fn exp_point(x: f64) -> Interval {
    let n = (x / std::f64::consts::LN_2).round();
    // The ends of what floats are made for: zero is below, infinity above.
    if n.is_nan() || n < -1020.0 {
        return Interval::new(0.0, f64::MIN_POSITIVE);
    }
    if n > 1020.0 {
        return Interval::new(f64::MAX, f64::INFINITY);
    }
    let ln2 = Interval::new(std::f64::consts::LN_2.next_down(), std::f64::consts::LN_2.next_up());
    let r = Interval::point(x) - Interval::point(n) * ln2;
    let one = Interval::point(1.0);
    let mut sum = one;
    for k in (1..=14).rev() {
        sum = one + (r * sum).over(Interval::point(f64::from(k)));
    }
    // |r|¹⁵/15! < 10⁻¹⁹, and what follows is smaller than it.
    let sum = sum + Interval::new(-2e-19, 2e-19);
    let scale = f64::from_bits(((n as i64 + 1023) as u64) << 52);
    Interval::new(sum.low * scale, sum.high * scale)
}

fn ln_point(x: f64) -> Interval {
    // Of a library that computes alike everywhere, so that margins do.
    let guess = libm::log(x);
    let mut reach = 4.0 * f64::EPSILON * guess.abs().max(1.0);
    loop {
        let found = Interval::new(guess - reach, guess + reach);
        if exp_point(found.low).high <= x && x <= exp_point(found.high).low {
            return found;
        }
        reach *= 2.0;
        if reach >= 1.0 || reach.is_nan() {
            return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        }
    }
}

impl Add for Interval {
    type Output = Interval;
    fn add(self, other: Interval) -> Interval {
        Interval::new((self.low + other.low).next_down(), (self.high + other.high).next_up())
    }
}

impl Neg for Interval {
    type Output = Interval;
    fn neg(self) -> Interval {
        Interval::new(-self.high, -self.low)
    }
}

impl Sub for Interval {
    type Output = Interval;
    fn sub(self, other: Interval) -> Interval {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Interval;
    fn mul(self, other: Interval) -> Interval {
        if self == Interval::point(0.0) || other == Interval::point(0.0) {
            return Interval::point(0.0);
        }
        outward([self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holds(i: Interval, x: f64) -> bool {
        i.low <= x && x <= i.high
    }

    #[test]
    fn functions_enclose_what_the_library_computes_and_are_narrow() {
        for x in [-700.0, -30.5, -1.0, -1e-9, 0.0, 0.1, 1.0, 2.5, 30.0, 700.0f64] {
            let e = Interval::point(x).exp();
            assert!(holds(e, x.exp()) && e.high - e.low < 1e-12 * e.high, "{x}: {e:?}");
        }
        for x in [1e-300, 1e-3, 0.5, 1.0, 2.0, 7.3e5f64] {
            let l = Interval::point(x).ln();
            assert!(holds(l, x.ln()) && l.high - l.low < 1e-13 * x.ln().abs().max(1.0), "{x}: {l:?}");
            assert!(holds(Interval::point(x).power(2.0), x * x) && holds(Interval::point(x).power(0.5), x.sqrt()));
        }
        // 0.1 + 0.2 is not 0.3 in floats, but the enclosure knows both.
        let sum = Interval::point(0.1) + Interval::point(0.2);
        assert!(holds(sum, 0.3) && holds(sum, 0.1 + 0.2));
        assert_eq!(Interval::point(0.0).power(7.0), Interval::point(0.0));
    }

    #[test]
    fn division_by_an_interval_with_zero_says_nothing() {
        let all = Interval::point(1.0).over(Interval::new(-1.0, 1.0));
        assert!(all.low == f64::NEG_INFINITY && all.high == f64::INFINITY);
        assert!(holds(Interval::new(1.0, 2.0).over(Interval::new(-4.0, -2.0)), -0.5));
        assert_eq!(Interval::new(-2.0, 1.0).squared().low, 0.0);
    }
}
