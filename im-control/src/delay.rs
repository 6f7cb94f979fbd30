//! What the machine has of the commands, a delay later.

use im_model::{Complex, Scalar};

/// Commands kept.
const KEPT: usize = 8;

/// Averages of commands delayed by n + f samples: (1 − f)u_{k−n} + f u_{k−n−1}.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Delayed<T> {
    past: [Complex<T>; KEPT],
    whole: usize,
    part: T,
}

impl<T: Scalar> Delayed<T> {
    /// By a number of samples, up to six; what was before the first is zero.
    pub fn new(samples: T) -> Self {
        let z = Complex::new(T::zero(), T::zero());
        let samples = samples.max(T::zero()).min(T::from_f64((KEPT - 2) as f64));
        let whole = (samples.value() as usize).min(KEPT - 2);
        Self { past: [z; KEPT], whole, part: samples - T::from_f64(whole as f64) }
    }

    /// The mean voltage at the machine over the sample that ends, of what was commanded over it and before.
    #[inline]
    pub fn step(&mut self, u: Complex<T>) -> Complex<T> {
        self.past.copy_within(0..KEPT - 1, 1);
        self.past[0] = u;
        // No index is out of bounds, and the compiler sees it.
        let n = self.whole.min(KEPT - 2);
        if self.part > T::zero() { self.past[n] * (T::one() - self.part) + self.past[n + 1] * self.part } else { self.past[n] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_is_shown_as_late_as_it_is() {
        for delay in [0.0, 0.5, 1.0, 1.5, 3.25] {
            let mut d = Delayed::<f64>::new(delay);
            for k in 0..20 {
                let shown = d.step(Complex::new(f64::from(k), 0.0)).re;
                if k > 8 {
                    assert!((shown - (f64::from(k) - delay)).abs() < 1e-12, "{delay} {k}: {shown}");
                }
            }
        }
    }
}
