//! The one number type bound of the workspace: `f32` in firmware, `f64` on the host, [`Dual`](crate::Dual) for sensitivities.

use core::fmt::Debug;
use core::ops::Neg;

use num_traits::NumAssign;

/// A real number that the equations of motion can be written in.
///
/// Implemented for `f32`, `f64` and [`Dual`](crate::Dual). [`is_zero`](num_traits::Zero::is_zero) is true only when the value
/// *and all its derivatives* vanish: this is how an effect knows that it is switched off.
pub trait Scalar: NumAssign + Neg<Output = Self> + PartialOrd + Copy + Debug + Send + Sync + 'static {
    /// The number type of the value: the type itself, or what a dual number carries. Iterations run in it.
    type Real: Scalar<Real = Self::Real>;
    /// Whether derivatives are carried along.
    const DERIVATIVES: bool = false;

    /// The constant `x`.
    fn from_f64(x: f64) -> Self;
    /// The value without derivatives.
    fn value(self) -> f64;
    /// The value without derivatives, in its own precision.
    fn real(self) -> Self::Real;
    /// The constant `x`, in its own precision.
    fn from_real(x: Self::Real) -> Self;
    /// f(x), given f and f' at the value of x: how a function evaluated without derivatives gets them.
    fn chain(self, f: Self::Real, df: Self::Real) -> Self;
    /// x·k for a constant k: cheaper than a product where derivatives are carried along.
    fn scale(self, k: f64) -> Self;
    /// √x.
    fn sqrt(self) -> Self;
    /// (sin x, cos x), x in rad.
    fn sin_cos(self) -> (Self, Self);
    /// eˣ.
    fn exp(self) -> Self;
    /// ln x.
    fn ln(self) -> Self;
    /// xʸ for x ≥ 0; zero at x = 0 for y > 0.
    fn powf(self, y: Self) -> Self;
    /// |x|.
    fn abs(self) -> Self;

    /// Whether the value is neither infinite nor NaN.
    fn is_finite(self) -> bool {
        self.value().is_finite()
    }
    /// The smaller of two numbers.
    fn min(self, other: Self) -> Self {
        if other < self { other } else { self }
    }
    /// The larger of two numbers.
    fn max(self, other: Self) -> Self {
        if other > self { other } else { self }
    }
}

#[cfg(not(feature = "std"))]
use libm::sqrt;
// libm computes it bit by bit on integers: 25 instructions and more where ARM has one.
#[cfg(all(target_arch = "arm", target_abi = "eabihf", not(feature = "std")))]
use im_sqrt::sqrtf;
#[cfg(all(not(all(target_arch = "arm", target_abi = "eabihf")), not(feature = "std")))]
use libm::sqrtf;

macro_rules! scalar {
    ($t:ty, $sqrt:ident, $sincos:ident, $exp:ident, $ln:ident, $pow:ident) => {
        impl Scalar for $t {
            type Real = Self;

            #[inline(always)]
            fn real(self) -> Self {
                self
            }
            #[inline(always)]
            fn from_real(x: Self) -> Self {
                x
            }
            #[inline(always)]
            fn chain(self, f: Self, _df: Self) -> Self {
                f
            }
            #[inline]
            fn from_f64(x: f64) -> Self {
                x as $t
            }
            #[inline]
            fn value(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn scale(self, k: f64) -> Self {
                self * k as $t
            }
            #[inline]
            fn sqrt(self) -> Self {
                #[cfg(feature = "std")]
                return <$t>::sqrt(self);
                #[cfg(not(feature = "std"))]
                $sqrt(self)
            }
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                #[cfg(feature = "std")]
                return <$t>::sin_cos(self);
                #[cfg(not(feature = "std"))]
                libm::$sincos(self)
            }
            #[inline]
            fn exp(self) -> Self {
                #[cfg(feature = "std")]
                return <$t>::exp(self);
                #[cfg(not(feature = "std"))]
                libm::$exp(self)
            }
            #[inline]
            fn ln(self) -> Self {
                #[cfg(feature = "std")]
                return <$t>::ln(self);
                #[cfg(not(feature = "std"))]
                libm::$ln(self)
            }
            #[inline]
            fn powf(self, y: Self) -> Self {
                #[cfg(feature = "std")]
                return <$t>::powf(self, y);
                #[cfg(not(feature = "std"))]
                libm::$pow(self, y)
            }
            #[inline]
            fn abs(self) -> Self {
                <$t>::abs(self)
            }
        }
    };
}
scalar!(f32, sqrtf, sincosf, expf, logf, powf);
scalar!(f64, sqrt, sincos, exp, log, pow);
