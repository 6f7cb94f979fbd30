//! How a leakage branch saturates by its own current: i = (ψ_σ/L_l) φ(q), φ = 1 + κ q/(1 + q), q = (|ψ_σ|/(L_l I_k))².

use num_complex::Complex;

use crate::scalar::Scalar;
use crate::space_vector::norm2;

/// The saturation of one leakage branch, prepared; the default does not saturate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeakageLaw<T> {
    /// κ/L_l.
    pub(super) strength: T,
    /// 1/(L_l I_k)².
    pub(super) scale: T,
}

impl<T: Scalar> Default for LeakageLaw<T> {
    fn default() -> Self {
        Self { strength: T::zero(), scale: T::one() }
    }
}

impl<T: Scalar> LeakageLaw<T> {
    pub(crate) fn real(&self) -> LeakageLaw<T::Real> {
        LeakageLaw { strength: self.strength.real(), scale: self.scale.real() }
    }

    /// κ of a branch whose 1/L_l is given.
    pub(crate) fn drop(&self, inv_l: T) -> T {
        self.strength / inv_l
    }

    /// (φ − 1) ψ/L_l at a leakage flux, A.
    #[inline(always)]
    pub(crate) fn correction(&self, psi: Complex<T>) -> Complex<T> {
        let q = norm2(psi) * self.scale;
        psi * (self.strength * q / (T::one() + q))
    }

    /// The same with its derivative by ψ, a symmetric matrix (αα, αβ, ββ).
    #[inline(always)]
    pub(crate) fn correction_and_slope(&self, psi: Complex<T>) -> (Complex<T>, [T; 3]) {
        let q = norm2(psi) * self.scale;
        let d = T::one() / (T::one() + q);
        let a = self.strength * q * d;
        let b = self.strength * self.scale * d * d;
        let b = b + b;
        (psi * a, [a + b * psi.re * psi.re, b * psi.re * psi.im, a + b * psi.im * psi.im])
    }

    /// ∫ (φ − 1) ψ dψ/L_l: the extra magnetic energy over 3/2, J.
    pub(crate) fn energy(&self, psi_squared: T) -> T {
        let q = psi_squared * self.scale;
        self.strength / self.scale * T::from_f64(0.5) * (q - (T::one() + q).ln())
    }
}
