//! Small helpers on numbers and space vectors.

use im_model::{Complex, Scalar, space_vector};

pub(crate) use space_vector::norm;

/// x within [low, high].
#[inline]
pub(crate) fn clamp<T: Scalar>(x: T, low: T, high: T) -> T {
    if x > high {
        high
    } else if x < low {
        low
    } else {
        x
    }
}

/// x within ±`most`.
#[inline]
pub(crate) fn within<T: Scalar>(x: T, most: T) -> T {
    // What is no number stays so.
    if x.abs() > most { if x > T::zero() { most } else { -most } } else { x }
}

/// e^{jx}: by its series for the angles that a frame turns in a sample (to 1e-7 at 0.3 rad), else by sine and cosine.
#[inline]
pub(crate) fn rotation<T: Scalar>(x: T) -> Complex<T> {
    if x.abs() > T::from_f64(0.3) {
        return space_vector::unit(x);
    }
    let (c, x2) = (T::from_f64, x * x);
    let re = T::one() - x2 * (c(0.5) - x2 * (c(1.0 / 24.0) - x2 * c(1.0 / 720.0)));
    let im = x * (T::one() - x2 * (c(1.0 / 6.0) - x2 * c(1.0 / 120.0)));
    Complex::new(re, im)
}

/// z, shortened to at most `length`.
#[inline]
pub(crate) fn shortened<T: Scalar>(z: Complex<T>, length: T) -> Complex<T> {
    let n2 = space_vector::norm2(z);
    if n2 > length * length { z * (length / n2.sqrt()) } else { z }
}

/// Both parts are finite.
#[inline]
pub(crate) fn is_finite<T: Scalar>(z: Complex<T>) -> bool {
    z.re.is_finite() && z.im.is_finite()
}

/// z within the hexagon of a dc link, in its direction; unlimited for a voltage of zero, which stands for no limit.
#[inline]
pub(crate) fn within_hexagon<T: Scalar>(u: Complex<T>, dc_voltage_v: T) -> Complex<T> {
    if dc_voltage_v > T::zero() { im_model::simulation::Bridge::ideal(dc_voltage_v).limited(u) } else { u }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotation_is_the_unit_vector() {
        for k in -400..=400 {
            let x = f64::from(k) * 0.005;
            let e = (rotation(x) - space_vector::unit(x)).norm();
            assert!(e < 1e-7, "{x}: {e}");
        }
    }

    #[test]
    fn shortened_keeps_the_direction() {
        let z = Complex::new(3.0, -4.0);
        assert_eq!(shortened(z, 10.0), z);
        assert!((shortened(z, 1.0) - z / 5.0).norm() < 1e-15);
    }
}
