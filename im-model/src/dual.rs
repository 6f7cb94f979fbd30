//! Dual numbers: a value and its derivatives with respect to N parameters, carried through every operation.
//!
//! (a + ε a')(b + ε b') = ab + ε (a b' + a' b),  ε² = 0.
//!
//! Exact forward sensitivities of a simulation come from running it once in `Dual<N>`. Plain arrays on purpose: the compiler
//! turns the loops over N into vector instructions, and a step costs a few times that of `f64` (see `docs/background/performance.md`);
//! a general dual-number library measured about ten times slower here.

#![allow(clippy::needless_range_loop, reason = "three arrays at one index read best so, and compile best so")]

use core::cmp::Ordering;
use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Rem, RemAssign, Sub, SubAssign};

use num_traits::{Float, Num, One, Zero};

use crate::scalar::Scalar;

/// A value `re` with N first derivatives `eps`, which are rounded to D, `f64` or `f32`.
#[derive(Clone, Copy, Debug)]
pub struct DualNumber<const N: usize, D> {
    /// The value.
    pub re: f64,
    /// The derivatives with respect to the N seeded quantities.
    pub eps: [D; N],
}

/// Derivatives as exact as the value. A user's effects act in `f32`, `f64` and the widths that the workspace simulates in
/// ([`CustomEffect`](crate::effects::CustomEffect)), and in no other.
pub type Dual<const N: usize> = DualNumber<N, f64>;

/// Derivatives to seven digits, in half of the memory: enough for the slopes of a fit, whose end they do not move. The value is that of `f64`.
pub type SingleDual<const N: usize> = DualNumber<N, f32>;

/// What derivatives are rounded to.
pub trait Derivative: Float + Debug + Send + Sync + 'static {
    /// Zero.
    const ZERO: Self;
    /// Rounds.
    fn rounded(x: f64) -> Self;
}

impl Derivative for f64 {
    const ZERO: Self = 0.0;
    #[inline(always)]
    fn rounded(x: f64) -> Self {
        x
    }
}

impl Derivative for f32 {
    const ZERO: Self = 0.0;
    #[inline(always)]
    fn rounded(x: f64) -> Self {
        x as Self
    }
}

impl<const N: usize, D: Derivative> DualNumber<N, D> {
    /// A constant: no derivative.
    #[inline]
    pub const fn constant(re: f64) -> Self {
        Self { re, eps: [D::ZERO; N] }
    }

    /// The value `re` with derivative `slope` in direction `index` (nothing is seeded when `index ≥ N`).
    #[inline]
    pub fn seeded(re: f64, index: usize, slope: f64) -> Self {
        let mut x = Self::constant(re);
        if let Some(e) = x.eps.get_mut(index) {
            *e = D::rounded(slope);
        }
        x
    }
}

impl<const N: usize, D: Derivative> PartialEq for DualNumber<N, D> {
    fn eq(&self, other: &Self) -> bool {
        self.re == other.re && self.eps == other.eps
    }
}

/// Ordered by value.
impl<const N: usize, D: Derivative> PartialOrd for DualNumber<N, D> {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.re.partial_cmp(&other.re)
    }
}

impl<const N: usize, D: Derivative> Add for DualNumber<N, D> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, b: Self) -> Self {
        self.re += b.re;
        for i in 0..N {
            self.eps[i] = self.eps[i] + b.eps[i];
        }
        self
    }
}

impl<const N: usize, D: Derivative> Sub for DualNumber<N, D> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, b: Self) -> Self {
        self.re -= b.re;
        for i in 0..N {
            self.eps[i] = self.eps[i] - b.eps[i];
        }
        self
    }
}

impl<const N: usize, D: Derivative> Mul for DualNumber<N, D> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        let (x, y) = (D::rounded(self.re), D::rounded(b.re));
        let mut eps = [D::ZERO; N];
        for i in 0..N {
            eps[i] = x * b.eps[i] + self.eps[i] * y;
        }
        Self { re: self.re * b.re, eps }
    }
}

impl<const N: usize, D: Derivative> Div for DualNumber<N, D> {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        let inv = 1.0 / b.re;
        let (re, by) = (D::rounded(self.re * inv), D::rounded(inv));
        let mut eps = [D::ZERO; N];
        for i in 0..N {
            eps[i] = (self.eps[i] - re * b.eps[i]) * by;
        }
        // The quotient itself is divided once, so that the value is bit-identical to f64's.
        Self { re: self.re / b.re, eps }
    }
}

impl<const N: usize, D: Derivative> Rem for DualNumber<N, D> {
    type Output = Self;
    fn rem(self, b: Self) -> Self {
        self - b * Self::constant((self.re - self.re % b.re) / b.re)
    }
}

impl<const N: usize, D: Derivative> Neg for DualNumber<N, D> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        self.re = -self.re;
        for e in &mut self.eps {
            *e = -*e;
        }
        self
    }
}

macro_rules! assign {
    ($($trait:ident $method:ident $op:tt),*) => {$(
        impl<const N: usize, D: Derivative> $trait for DualNumber<N, D> {
            #[inline(always)]
            fn $method(&mut self, b: Self) {
                *self = *self $op b;
            }
        }
    )*};
}
assign!(AddAssign add_assign +, SubAssign sub_assign -, MulAssign mul_assign *, DivAssign div_assign /, RemAssign rem_assign %);

impl<const N: usize, D: Derivative> Zero for DualNumber<N, D> {
    #[inline]
    fn zero() -> Self {
        Self::constant(0.0)
    }
    #[inline]
    fn is_zero(&self) -> bool {
        self.re == 0.0 && self.eps == [D::ZERO; N]
    }
}

impl<const N: usize, D: Derivative> One for DualNumber<N, D> {
    #[inline]
    fn one() -> Self {
        Self::constant(1.0)
    }
}

impl<const N: usize, D: Derivative> Num for DualNumber<N, D> {
    type FromStrRadixErr = <f64 as Num>::FromStrRadixErr;
    fn from_str_radix(str: &str, radix: u32) -> Result<Self, Self::FromStrRadixErr> {
        f64::from_str_radix(str, radix).map(Self::constant)
    }
}

impl<const N: usize, D: Derivative> Scalar for DualNumber<N, D> {
    type Real = f64;
    const DERIVATIVES: bool = true;

    #[inline(always)]
    fn real(self) -> f64 {
        self.re
    }
    #[inline(always)]
    fn from_real(x: f64) -> Self {
        Self::constant(x)
    }
    #[inline(always)]
    fn chain(self, f: f64, df: f64) -> Self {
        let (mut eps, df) = (self.eps, D::rounded(df));
        for e in &mut eps {
            *e = *e * df;
        }
        Self { re: f, eps }
    }
    #[inline]
    fn from_f64(x: f64) -> Self {
        Self::constant(x)
    }
    #[inline]
    fn value(self) -> f64 {
        self.re
    }
    #[inline(always)]
    fn scale(self, k: f64) -> Self {
        self.chain(self.re * k, k)
    }
    #[inline]
    fn sqrt(self) -> Self {
        let s = Scalar::sqrt(self.re);
        self.chain(s, 0.5 / s)
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = Scalar::sin_cos(self.re);
        (self.chain(s, c), self.chain(c, -s))
    }
    #[inline]
    fn exp(self) -> Self {
        let e = Scalar::exp(self.re);
        self.chain(e, e)
    }
    #[inline]
    fn ln(self) -> Self {
        self.chain(Scalar::ln(self.re), 1.0 / self.re)
    }
    #[inline]
    fn powf(self, y: Self) -> Self {
        let p = Scalar::powf(self.re, y.re);
        if self.re <= 0.0 {
            return Self::constant(p);
        }
        let by_base = D::rounded(p * y.re / self.re);
        let by_exponent = if y.eps == [D::ZERO; N] { D::ZERO } else { D::rounded(p * Scalar::ln(self.re)) };
        let mut eps = [D::ZERO; N];
        for i in 0..N {
            eps[i] = by_base * self.eps[i] + by_exponent * y.eps[i];
        }
        Self { re: p, eps }
    }
    #[inline]
    fn abs(self) -> Self {
        if self.re < 0.0 { -self } else { self }
    }
    #[inline]
    fn is_finite(self) -> bool {
        self.re.is_finite() && self.eps.iter().all(|e| e.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn slope(f: impl Fn(Dual<1>) -> Dual<1>, x: f64) -> (f64, f64) {
        let d = f(Dual::seeded(x, 0, 1.0)).eps[0];
        let h = 1e-6 * x.abs().max(1.0);
        let fd = (f(Dual::constant(x + h)).re - f(Dual::constant(x - h)).re) / (2.0 * h);
        (d, fd)
    }

    proptest! {
        #[test]
        fn derivatives_agree_with_central_differences(x in 0.2..3.0f64, y in 0.5..4.0f64) {
            let c = |v| Dual::<1>::constant(v);
            let functions: [&dyn Fn(Dual<1>) -> Dual<1>; 8] = [
                &|x| x.sqrt(),
                &|x| x.exp() / (c(1.0) + x * x),
                &|x| x.ln() * x.sin_cos().0,
                &|x| x.sin_cos().1 - x * c(y),
                &|x| x.powf(c(y)),
                &|x| c(y).powf(x),
                &|x| (x - c(1.7)).abs() * x,
                &|x| -x / (x + c(y)),
            ];
            for f in functions {
                let (d, fd) = slope(f, x);
                if (x - 1.7).abs() > 1e-3 {
                    prop_assert!((d - fd).abs() < 1e-7 * (1.0 + d.abs()), "{d} {fd}");
                }
            }
        }

        #[test]
        fn values_are_those_of_f64(a in -5.0..5.0f64, b in 0.1..5.0f64) {
            let (x, y) = (Dual::<3>::seeded(a, 0, 1.0), Dual::<3>::seeded(b, 1, 1.0));
            prop_assert_eq!((x * y + x / y - y).re, a * b + a / b - b);
            prop_assert_eq!((x % y).re, a - b * ((a - a % b) / b));
        }
    }

    #[test]
    fn duals_are_ordered_by_value_and_not_at_all_without_one() {
        let (small, large) = (Dual::<1>::seeded(1.0, 0, 9.0), Dual::<1>::seeded(2.0, 0, -9.0));
        assert!(small < large);
        assert_eq!((Scalar::max(small, large), Scalar::min(small, large)), (large, small));
        assert_eq!(small.partial_cmp(&Dual::constant(f64::NAN)), None);
    }
}
