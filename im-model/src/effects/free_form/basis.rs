//! The functions that a free-form curve is a sum of: cubic B-splines over a range, or a Fourier series over an angle.

use num_complex::Complex;

use super::parameters::COEFFICIENTS;
use crate::scalar::Scalar;

/// Intervals of the spline: each is reached by four of the coefficients.
const INTERVALS: usize = COEFFICIENTS - 3;

/// Σ c_k B_k(x), cubic B-splines on even knots between `from` and `to`; beyond, the value at the end.
#[inline]
pub(super) fn spline<T: Scalar>(c: &[T], from: T, to: T, x: T) -> T {
    let place = (x - from) * (T::from_f64(INTERVALS as f64) / (to - from));
    let last = INTERVALS as f64;
    let (k, t) = if place.value() <= 0.0 {
        (0, T::zero())
    } else if place.value() < last {
        let k = place.value() as usize;
        (k, place - T::from_f64(k as f64))
    } else {
        // Also where x is no number: the end of the range.
        (INTERVALS - 1, T::one())
    };
    let s = T::one() - t;
    let (t2, s2) = (t * t, s * s);
    let two_thirds = T::from_f64(2.0 / 3.0);
    let sixth = 1.0 / 6.0;
    let weights = [
        (s2 * s).scale(sixth),
        two_thirds - t2 + (t2 * t).scale(0.5),
        two_thirds - s2 + (s2 * s).scale(0.5),
        (t2 * t).scale(sixth),
    ];
    let near = c.iter().skip(k).zip(weights);
    near.fold(T::zero(), |sum, (c, w)| sum + *c * w)
}

/// Σ a_h cos hφ + b_h sin hφ for h from 1, with z = e^{jφ}; coefficients in the order a₁, b₁, a₂, b₂ …
#[inline]
pub(super) fn fourier<T: Scalar>(c: &[T], z: Complex<T>) -> T {
    fourier_vector(c, z).re
}

/// The complex series Σ (a_h − j b_h) z^h, of which [`fourier`] is the real part.
#[inline]
pub(super) fn fourier_vector<T: Scalar>(c: &[T], z: Complex<T>) -> Complex<T> {
    let mut turn = z;
    let mut sum = Complex::new(T::zero(), T::zero());
    for pair in c.chunks_exact(2) {
        sum += Complex::new(pair[0], -pair[1]) * turn;
        turn *= z;
    }
    sum
}

/// The derivative of [`fourier`] by φ.
#[inline]
pub(super) fn fourier_slope<T: Scalar>(c: &[T], z: Complex<T>) -> T {
    let mut turn = z;
    let (mut sum, mut h) = (T::zero(), 1.0);
    for pair in c.chunks_exact(2) {
        sum -= (Complex::new(pair[0], -pair[1]) * turn).im.scale(h);
        turn *= z;
        h += 1.0;
    }
    sum
}

/// The precision (inverse covariance) of the coefficients of a curve of size one before any data: what is rough is unlikely.
///
/// Splines: the sum of squares of the second differences, and a twentieth of that of the coefficients themselves. Harmonics: growing
/// with the fourth power of the order, as the integral of the squared second derivative does.
pub(super) fn precision(periodic: bool) -> [[f64; COEFFICIENTS]; COEFFICIENTS] {
    const PLAIN: f64 = 0.05;
    let mut q = [[0.0; COEFFICIENTS]; COEFFICIENTS];
    if periodic {
        for (k, row) in q.iter_mut().enumerate() {
            let h = (k / 2 + 1) as f64;
            row[k] = PLAIN * h * h * h * h;
        }
        return q;
    }
    const SECOND: [f64; 3] = [1.0, -2.0, 1.0];
    for k in 0..COEFFICIENTS {
        q[k][k] += PLAIN;
        if k + 2 < COEFFICIENTS {
            for (i, a) in SECOND.iter().enumerate() {
                for (j, b) in SECOND.iter().enumerate() {
                    q[k + i][k + j] += a * b;
                }
            }
        }
    }
    q
}

#[cfg(test)]
mod tests {
    use super::*;

    /// B-splines sum to one, and coefficients that lie on a line give the line: at the Greville points the argument itself.
    #[test]
    fn splines_reproduce_lines() {
        let (from, to) = (-2.0, 3.0);
        let width = (to - from) / INTERVALS as f64;
        let line: Vec<f64> = (0..COEFFICIENTS).map(|k| 0.5 + 2.0 * (from + (k as f64 - 1.0) * width)).collect();
        for k in 0..=100 {
            let x = from + (to - from) * f64::from(k) / 100.0;
            assert!((spline(&[1.0; COEFFICIENTS], from, to, x) - 1.0).abs() < 1e-14);
            assert!((spline(&line, from, to, x) - (0.5 + 2.0 * x)).abs() < 1e-13);
        }
        assert!((spline(&line, from, to, 9.0) - (0.5 + 2.0 * to)).abs() < 1e-13, "held beyond the range");
        assert!((spline(&line, from, to, -9.0) - (0.5 + 2.0 * from)).abs() < 1e-13, "held before the range");
        assert!(spline(&line, from, to, f64::NAN).is_finite());
    }

    #[test]
    fn splines_are_smooth_across_knots() {
        let c = [0.3, -1.0, 0.7, 2.0, -0.4, 0.9, 1.1, -0.6];
        let f = |x: f64| spline(&c, 0.0, 5.0, x);
        for knot in 1..5 {
            let (x, h) = (f64::from(knot), 1e-4);
            let second = |x: f64| (f(x + h) - 2.0 * f(x) + f(x - h)) / (h * h);
            // Third derivatives of these coefficients are below 20, and 2h away they change the second by 20 · 4h.
            assert!((second(x + 2.0 * h) - second(x - 2.0 * h)).abs() < 0.02, "knot {knot}");
        }
    }

    #[test]
    fn harmonics_are_cosines_and_sines() {
        let c = [0.1, 0.2, -0.3, 0.4, 0.5, -0.6, 0.7, 0.8];
        let phi = 0.77f64;
        let expected: f64 = (0..4)
            .map(|h| {
                let x = f64::from(h + 1) * phi;
                c[2 * h as usize] * x.cos() + c[2 * h as usize + 1] * x.sin()
            })
            .sum();
        let at = |phi: f64| Complex::from_polar(1.0, phi);
        assert!((fourier(&c, at(phi)) - expected).abs() < 1e-14);
        let slope = (fourier(&c, at(phi + 1e-5)) - fourier(&c, at(phi - 1e-5))) / 2e-5;
        assert!((fourier_slope(&c, at(phi)) - slope).abs() < 1e-8, "{slope}");
    }
}
