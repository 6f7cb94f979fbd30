//! The high-gain observer (29), (30) of Kenné et al., x̂' = −Γ(x̂ − x), advanced exactly over a sample.
//!
//! It is a low-pass of time constant 1/Γ; Γ(x − x̂) is the derivative of its output. Exact means: for a voltage held over the sample, and
//! for a current on a straight line between samples (which it leaves by h²/8 of its second derivative). Unlike forward Euler, stable only
//! for Γh < 2, it has no limit.

use im_model::{Complex, Scalar};

/// Γ and the sampling time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HighGain<T> {
    /// Γ, 1/s.
    gain: T,
    inverse_gain: T,
    sample_time: T,
    inverse_sample_time: T,
    /// e^{−Γh}.
    decay: T,
    /// c/h, s.
    chord: T,
}

/// What happened to the filtered signal over a sample.
#[derive(Clone, Copy, Debug)]
pub struct Filtered<T> {
    /// Its change.
    pub change: Complex<T>,
    /// Its integral.
    pub integral: Complex<T>,
}

impl<T: Scalar> HighGain<T> {
    pub fn new(gain_per_s: T, sample_time_s: T) -> Self {
        Self {
            gain: gain_per_s,
            inverse_gain: T::one() / gain_per_s,
            sample_time: sample_time_s,
            inverse_sample_time: T::one() / sample_time_s,
            decay: (-gain_per_s * sample_time_s).exp(),
            chord: sample_time_s * T::from_f64(chord((gain_per_s * sample_time_s).value())),
        }
    }

    /// Γ, 1/s.
    pub fn gain(&self) -> T {
        self.gain
    }

    /// c/h, s: an input that bends by κ s(h − s)/2 below its chord shifts the output by cκ.
    pub fn chord(&self) -> T {
        self.chord
    }

    /// h, s.
    pub fn sample_time(&self) -> T {
        self.sample_time
    }

    /// 1 − e^{−Γh}: how much of a held input reaches the output in a sample.
    pub fn share(&self) -> T {
        T::one() - self.decay
    }

    /// The derivative of the output for the input x, 1/s.
    #[inline]
    pub fn derivative(&self, output: Complex<T>, x: Complex<T>) -> Complex<T> {
        (x - output) * self.gain
    }

    /// Advances over a sample in which x is held.
    #[inline]
    pub fn held(&self, output: &mut Complex<T>, x: Complex<T>) -> Filtered<T> {
        let change = (x - *output) * self.share();
        *output += change;
        // x̂' = Γ(x − x̂), integrated.
        Filtered { change, integral: x * self.sample_time - change * self.inverse_gain }
    }

    /// Advances over a sample in which x goes straight from `before` to `now`.
    #[inline]
    pub fn ramp(&self, output: &mut Complex<T>, before: Complex<T>, now: Complex<T>) -> Filtered<T> {
        // A ramp is followed 1/Γ late.
        let late = (now - before) * (self.inverse_sample_time * self.inverse_gain);
        let after = (now - late) + (*output - (before - late)) * self.decay;
        let change = after - *output;
        *output = after;
        let half = T::from_f64(0.5) * self.sample_time;
        Filtered { change, integral: (before + now) * half - change * self.inverse_gain }
    }
}

/// c/h² for z = Γh: the stationary response to the same bend in every sample, ∫₀^z e^{−τ}(z − τ)τ dτ/(2z²(1 − e^{−z})).
fn chord(z: f64) -> f64 {
    // ¹⁄₁₂(1 − z²/60 + …); the closed form cancels for small z.
    if z < 0.05 {
        return (1.0 - z * z / 60.0) / 12.0;
    }
    let decay = Scalar::exp(-z);
    let first = 1.0 - decay * (1.0 + z);
    let second = 2.0 - decay * (z * z + 2.0 * z + 2.0);
    (z * first - second) / (2.0 * z * z * (1.0 - decay))
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::space_vector::unit;

    /// Against the closed form for a rotating vector: x̂ = Γ/(Γ + jω) x.
    #[test]
    fn follows_a_rotating_vector_as_the_continuous_filter_does() {
        let (gain, omega) = (1000.0, 314.0);
        for h in [10e-6, 106e-6, 200e-6f64] {
            let f = HighGain::new(gain, h);
            let response = Complex::new(gain, 0.0) / Complex::new(gain, omega);
            let mut output = response;
            let n = (0.1 / h) as usize;
            for k in 0..n {
                f.ramp(&mut output, unit(omega * h * k as f64), unit(omega * h * (k + 1) as f64));
            }
            let truth = response * unit(omega * h * n as f64);
            // Straight lines between samples shorten the vector by (ωh)²/12.
            assert!((output - truth).norm() < 1.1 * (omega * h).powi(2) / 12.0 + 1e-9, "{h}: {}", (output - truth).norm());
        }
    }

    #[test]
    fn shift_by_a_bent_input_is_that_of_the_integral() {
        for z in [1e-3, 0.0499, 0.0501, 0.3, 3.3f64] {
            // One sample from rest in steps of h/20,000, then the geometric sum over all samples before.
            let n = 20_000;
            let x = |k: usize| (k as f64 + 0.5) / n as f64;
            let sum: f64 = (0..n).map(|k| z * (-z * (1.0 - x(k))).exp() * 0.5 * x(k) * (1.0 - x(k))).sum();
            let truth = sum / n as f64 / (1.0 - (-z).exp());
            assert!((chord(z) / truth - 1.0).abs() < 1e-6, "{z}: {} {truth}", chord(z));
        }
    }

    #[test]
    fn integral_is_that_of_the_output() {
        let (f, mut whole) = (HighGain::new(5000.0, 200e-6), Complex::new(0.3, 0.0));
        let fine = HighGain::new(5000.0, 2e-8);
        let (a, b) = (Complex::new(1.0, -2.0), Complex::new(3.0, 1.0));
        let mut part = whole;
        let sum: Complex<f64> = (0..10_000).map(|_| fine.held(&mut part, a).integral).sum();
        let coarse = f.held(&mut whole, a);
        assert!((sum - coarse.integral).norm() < 1e-12 && (part - whole).norm() < 1e-9);
        let at = |k: usize| a + (b - a) * (k as f64 / 10_000.0);
        let sum: Complex<f64> = (0..10_000).map(|k| fine.ramp(&mut part, at(k), at(k + 1)).integral).sum();
        let coarse = f.ramp(&mut whole, a, b);
        assert!((sum - coarse.integral).norm() < 1e-12 && (part - whole).norm() < 1e-9);
    }
}
