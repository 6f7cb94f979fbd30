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
    let number = <T::Real as Scalar>::from_f64;
    let (zero, one) = (number(0.0), number(1.0));
    let u = place.real();
    let (k, t, inside) = if u <= zero {
        (0, zero, zero)
    } else if u < number(INTERVALS as f64) {
        let k = u.value() as usize;
        (k, u - number(k as f64), one)
    } else {
        // Also where x is no number: the end of the range.
        (INTERVALS - 1, one, zero)
    };
    let s = one - t;
    let (t2, s2) = (t * t, s * s);
    let (sixth, half, two_thirds) = (number(1.0 / 6.0), number(0.5), number(2.0 / 3.0));
    let weights = [s2 * s * sixth, two_thirds - t2 + t2 * t * half, two_thirds - s2 + s2 * s * half, t2 * t * sixth];
    let near = || c.iter().skip(k);
    let value = near().zip(weights).fold(T::zero(), |sum, (c, w)| sum + c.scale(w.value()));
    if !T::DERIVATIVES {
        return value;
    }
    let (two, more) = (number(2.0), number(1.5));
    let slopes = [-s2 * half, t * (more * t - two), s * (two - more * s), t2 * half];
    let slope = near().zip(slopes).fold(zero, |sum, (c, w)| sum + c.real() * w);
    value + place.chain(zero, inside * slope)
}

/// Σ a_h cos hφ + b_h sin hφ for h from 1, with z = e^{jφ}; coefficients in the order a₁, b₁, a₂, b₂ …
#[inline]
pub(super) fn fourier<T: Scalar>(c: &[T], z: Complex<T>) -> T {
    fourier_vector(c, z).re
}

/// The complex series Σ (a_h − j b_h) z^h, of which [`fourier`] is the real part.
#[inline]
pub(super) fn fourier_vector<T: Scalar>(c: &[T], z: Complex<T>) -> Complex<T> {
    series(c, z, |_| 1.0)
}

/// The derivative of [`fourier`] by φ.
#[inline]
pub(super) fn fourier_slope<T: Scalar>(c: &[T], z: Complex<T>) -> T {
    -series(c, z, |h| h).im
}

/// Σ w_h (a_h − j b_h) z^h. The powers are those of plain numbers: of derivatives carried along, those of z follow by the chain rule.
#[inline(always)]
fn series<T: Scalar>(c: &[T], z: Complex<T>, weight: impl Fn(f64) -> f64) -> Complex<T> {
    let number = <T::Real as Scalar>::from_f64;
    let none = number(0.0);
    let at = Complex::new(z.re.real(), z.im.real());
    // z^(h−1), and the derivative of the sum by z.
    let mut before = Complex::new(number(1.0), none);
    let mut slope = Complex::new(none, none);
    let mut sum = Complex::new(T::zero(), T::zero());
    let mut h = 1.0;
    for pair in c.chunks_exact(2) {
        let (w, turn) = (weight(h), before * at);
        let (cos, sin) = (turn.re.value() * w, turn.im.value() * w);
        sum.re += pair[0].scale(cos) + pair[1].scale(sin);
        sum.im += pair[0].scale(sin) - pair[1].scale(cos);
        if T::DERIVATIVES {
            let of_power = before * number(w * h);
            slope += Complex::new(pair[0].real(), -pair[1].real()) * of_power;
        }
        before = turn;
        h += 1.0;
    }
    if T::DERIVATIVES {
        sum.re += z.re.chain(none, slope.re) - z.im.chain(none, slope.im);
        sum.im += z.re.chain(none, slope.im) + z.im.chain(none, slope.re);
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

    /// Derivatives by coefficients and variable are those of differences.
    #[test]
    fn derivatives_are_carried_along() {
        type D = crate::Dual<2>;
        let c: [f64; COEFFICIENTS] = [0.3, -1.0, 0.7, 2.0, -0.4, 0.9, 1.1, -0.6];
        let h = 1e-6;
        // The third coefficient and the variable are moved.
        let moved = |by: f64| core::array::from_fn::<f64, COEFFICIENTS, _>(|k| if k == 2 { c[k] + by } else { c[k] });
        let dual = |x: f64, k: usize| D::seeded(x, k, 1.0);
        let of_dual = core::array::from_fn::<D, COEFFICIENTS, _>(|k| if k == 2 { dual(c[k], 0) } else { D::from_f64(c[k]) });
        let polar = |phi: f64| Complex::from_polar(1.0, phi);
        let check = |name: &str, dual: D, plain: &dyn Fn(&[f64], f64) -> f64, x: f64| {
            assert!((dual.re - plain(&c, x)).abs() < 1e-14, "{name} at {x}");
            let by =
                [(plain(&moved(h), x) - plain(&moved(-h), x)) / (2.0 * h), (plain(&c, x + h) - plain(&c, x - h)) / (2.0 * h)];
            for (found, expected) in dual.eps.iter().zip(by) {
                assert!((found - expected).abs() < 1e-8 * (1.0 + expected.abs()), "{name} at {x}: {found} for {expected}");
            }
        };
        for x in [-1.5, 0.4, 2.3, 4.9, 6.5] {
            let (sin, cos) = Scalar::sin_cos(dual(x, 1));
            let z = Complex::new(cos, sin);
            check("spline", spline(&of_dual, D::from_f64(0.0), D::from_f64(5.0), dual(x, 1)), &|c, x| spline(c, 0.0, 5.0, x), x);
            check("series", fourier(&of_dual, z), &|c, x| fourier(c, polar(x)), x);
            check("its imaginary part", fourier_vector(&of_dual, z).im, &|c, x| fourier_vector(c, polar(x)).im, x);
            check("its slope", fourier_slope(&of_dual, z), &|c, x| fourier_slope(c, polar(x)), x);
        }
    }
}
