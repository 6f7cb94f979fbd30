//! Space vectors: amplitude-invariant, star-equivalent, complex (α + jβ), positive sequence a-b-c.
//!
//! x = (2/3)(x_a + a x_b + a² x_c),  a = e^{j2π/3}. The zero sequence is not represented: the star point floats.

use num_complex::Complex;

use crate::scalar::Scalar;

/// √3/2.
const SIN_60: f64 = 0.866_025_403_784_438_6;

/// Space vector of three phase quantities.
#[inline]
pub fn from_phases<T: Scalar>([a, b, c]: [T; 3]) -> Complex<T> {
    let third = T::from_f64(1.0 / 3.0);
    Complex::new((a + a - b - c) * third, (b - c) * T::from_f64(0.5 / SIN_60))
}

/// Phase quantities of a space vector (their sum is zero).
#[inline]
pub fn to_phases<T: Scalar>(x: Complex<T>) -> [T; 3] {
    let half = x.re * T::from_f64(0.5);
    let q = x.im * T::from_f64(SIN_60);
    [x.re, q - half, -q - half]
}

/// e^{jθ}, θ in rad.
#[inline]
pub fn unit<T: Scalar>(theta: T) -> Complex<T> {
    let (s, c) = theta.sin_cos();
    Complex::new(c, s)
}

/// e^{jθ} for an angle that is mostly small: the turn of a frame in a sample. Within 0.25 rad by its series, to 2e-8 in angle and 1e-9 in
/// length; beyond that as [`unit()`].
#[inline]
pub fn turn<T: Scalar>(theta: T) -> Complex<T> {
    let c = T::from_f64;
    if theta.abs() > c(0.25) {
        return unit(theta);
    }
    let x = theta * theta;
    let re = T::one() - x * (c(1.0 / 2.0) - x * (c(1.0 / 24.0) - x * c(1.0 / 720.0)));
    let im = theta * (T::one() - x * (c(1.0 / 6.0) - x * c(1.0 / 120.0)));
    Complex::new(re, im)
}

/// jx.
#[inline]
pub fn j<T: Scalar>(x: Complex<T>) -> Complex<T> {
    Complex::new(-x.im, x.re)
}

/// Re(x ȳ): the inner product of two space vectors.
#[inline]
pub fn dot<T: Scalar>(x: Complex<T>, y: Complex<T>) -> T {
    x.re * y.re + x.im * y.im
}

/// Im(x̄ y) = x × y: the cross product of two space vectors.
#[inline]
pub fn cross<T: Scalar>(x: Complex<T>, y: Complex<T>) -> T {
    x.re * y.im - x.im * y.re
}

/// |x|².
#[inline]
pub fn norm2<T: Scalar>(x: Complex<T>) -> T {
    dot(x, x)
}

/// |x|.
#[inline]
pub fn norm<T: Scalar>(x: Complex<T>) -> T {
    norm2(x).sqrt()
}

/// Voltage space vector from the line-to-line voltages u_ab and u_bc.
#[inline]
pub fn from_line_to_line<T: Scalar>(u_ab: T, u_bc: T) -> Complex<T> {
    // u_a = (2 u_ab + u_bc)/3, u_b − u_c = u_bc
    let third = T::from_f64(1.0 / 3.0);
    Complex::new((u_ab + u_ab + u_bc) * third, u_bc * T::from_f64(0.5 / SIN_60))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn phases_round_trip(re in -1e3..1e3f64, im in -1e3..1e3f64) {
            let x = Complex::new(re, im);
            let p = to_phases(x);
            let y = from_phases(p);
            assert_relative_eq!(x.re, y.re, epsilon = 1e-10);
            assert_relative_eq!(x.im, y.im, epsilon = 1e-10);
            let z = from_line_to_line(p[0] - p[1], p[1] - p[2]);
            assert_relative_eq!(x.re, z.re, epsilon = 1e-10);
            assert_relative_eq!(x.im, z.im, epsilon = 1e-10);
        }

        #[test]
        fn three_phase_power_is_three_halves_of_the_inner_product(u in -9.0..9.0f64, v in -9.0..9.0f64, i in -9.0..9.0f64, k in -9.0..9.0f64) {
            let (u, i) = (Complex::new(u, v), Complex::new(i, k));
            let p: f64 = to_phases(u).iter().zip(to_phases(i)).map(|(a, b)| a * b).sum();
            assert_relative_eq!(p, 1.5 * dot(u, i), epsilon = 1e-10);
        }
    }

    proptest! {
        /// What the series leave out, θ⁷/5040 and θ⁸/40320, and the same beyond them.
        #[test]
        fn a_turn_is_the_unit_vector_within_its_stated_error(theta in -0.5..0.5f64) {
            let (z, truth) = (turn(theta), unit(theta));
            prop_assert!((z * truth.conj()).arg().abs() < 2e-8, "angle {}", (z * truth.conj()).arg());
            prop_assert!((z.norm() - 1.0).abs() < 1e-9 + 2e-8 * theta.abs(), "length {}", z.norm());
        }
    }

    #[test]
    fn positive_sequence_turns_forward() {
        let at = |t: f64| {
            from_phases([t.cos(), (t - 2.0 * core::f64::consts::FRAC_PI_3).cos(), (t + 2.0 * core::f64::consts::FRAC_PI_3).cos()])
        };
        let x = at(0.3);
        assert_relative_eq!(x.re, 0.3f64.cos(), epsilon = 1e-12);
        assert_relative_eq!(x.im, 0.3f64.sin(), epsilon = 1e-12);
    }
}
