//! A linear filter as what it is made of: parts of a signal that pass through first-order lags, the rest at once.
//!
//! y = x + Σ w_k (y_k − x),   τ_k ẏ_k = x − y_k
//!
//! The time constants τ_k lie evenly over the logarithm of time, and the parts w_k on the curve: a distribution of time constants, smooth as every curve.
//! Each lag is solved exactly over a sample, so that it is the same filter in longer steps.

use num_complex::Complex;
use num_traits::Zero;

use crate::effects::Memory;
use crate::effects::lag::behind_ramp;
use crate::scalar::Scalar;

/// How many lags.
const LAGS: usize = 8;

/// The lags of a curve.
pub(super) struct Lags<T: Scalar> {
    /// Time constants, s.
    tau: [T::Real; LAGS],
    /// The part through each.
    parts: [T; LAGS],
}

impl<T: Scalar> Lags<T> {
    /// Of parts over a range of time constants, given as decadic logarithms in s.
    pub(super) fn new(range: [T; 2], part: impl Fn(T) -> T) -> Self {
        let [from, to] = range.map(Scalar::real);
        let ten = T::Real::from_f64(core::f64::consts::LN_10);
        let ratio = ((to - from) * ten.scale(1.0 / (LAGS - 1) as f64)).exp();
        let (mut tau, mut parts) = ([(from * ten).exp(); LAGS], [T::zero(); LAGS]);
        for k in 0..LAGS {
            if k > 0 {
                tau[k] = tau[k - 1] * ratio;
            }
            let along = T::from_real(to - from).scale(k as f64 / (LAGS - 1) as f64);
            parts[k] = part(T::from_real(from) + along);
        }
        Self { tau, parts }
    }

    /// Σ w_k τ_k, s.
    #[cfg(feature = "std")]
    pub(super) fn delay_s(&self) -> f64 {
        self.parts.iter().zip(self.tau).map(|(w, tau)| w.value() * tau.value()).sum()
    }

    /// After a sample of length `t`, s, over which the signal went linearly from the first reading to the second; the memory holds y_k − x.
    pub(super) fn follow(&self, memory: &mut Option<Memory<T>>, [before, now]: [Complex<T>; 2], t: T) {
        let behind = memory.get_or_insert_with(|| self.tau.map(|tau| settled(T::from_real(tau), [before, now], t)));
        for (d, tau) in behind.iter_mut().zip(self.tau) {
            *d = behind_ramp(*d, now - before, T::from_real(tau) / t, decay(tau, t));
        }
    }

    /// Σ w_k (y_k − x).
    pub(super) fn behind(&self, memory: &Memory<T>) -> Complex<T> {
        self.parts.iter().zip(memory).fold(Complex::zero(), |sum, (w, d)| sum + *d * *w)
    }

    /// The mean over a sample of length `t`, s, of what passes of a voltage held over it; the memory holds y_k, at first the voltage before.
    pub(super) fn mean_passed(&self, [before, u]: [Complex<T>; 2], memory: &mut Option<Memory<T>>, t: T) -> Complex<T> {
        let mut mean = u;
        for ((y, tau), w) in memory.get_or_insert([before; LAGS]).iter_mut().zip(self.tau).zip(self.parts) {
            let (off, decay) = (*y - u, decay::<T>(tau, t));
            mean += off * (w * T::from_real(tau) * (T::one() - decay) / t);
            *y = u + off * decay;
        }
        mean
    }
}

/// e^{−t/τ}.
fn decay<T: Scalar>(tau: T::Real, t: T) -> T {
    T::from_real((-t.real() / tau).exp())
}

/// y − x of a lag that has long followed a signal which now goes from one reading to the next, growing, falling or turning as x ~ e^{λt}:
/// y = x/(1 + τλ). At rest, and where no signal would be so, y is x.
fn settled<T: Scalar>(tau: T, [before, now]: [Complex<T>; 2], t: T) -> Complex<T> {
    let mean = before + now;
    let size = mean.re * mean.re + mean.im * mean.im;
    if size.value() <= 0.0 {
        return Complex::zero();
    }
    let rate = (now - before) * mean.conj() * (tau.scale(2.0) / (size * t));
    let one = Complex::new(T::one(), T::zero()) + rate;
    let size = one.re * one.re + one.im * one.im;
    if size.value() < 0.25 { Complex::zero() } else { -(before * rate * one.conj()) * (T::one() / size) }
}
