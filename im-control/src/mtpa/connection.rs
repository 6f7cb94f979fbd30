//! Star and delta, and the q-d transformations of Kwon et al.
//!
//! With u_ab = u_a − u_b across the first winding of a delta: u_Δ = √3 e^{jπ/6} u_Y, i_Y = √3 e^{−jπ/6} i_Δ; powers agree.
//!
//! Their synchronous frame: i_a = i_d sin θ_e + i_q cos θ_e, so that i e^{−jθ_e} = i_q − ji_d. K_{s,i}^e and its inverse hold as printed.
//! K_{s,v}^s has −1/2 where it must be +1/2, as its inputs are u_ab and u_bc: u_a = (2u_ab + u_bc)/3.

use im_model::space_vector::{from_line_to_line, to_phases};
use im_model::{Complex, Scalar};

/// How the windings are connected to the terminals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Connection {
    /// Winding currents are the line currents.
    Star,
    /// Winding voltages are the line-to-line voltages.
    Delta,
}

/// √3 e^{jπ/6}.
fn to_delta<T: Scalar>() -> Complex<T> {
    Complex::new(T::from_f64(1.5), T::from_f64(0.866_025_403_784_438_6))
}

impl Connection {
    /// Line current (star-equivalent) from the current of the windings.
    #[inline]
    pub fn line_current<T: Scalar>(self, winding: Complex<T>) -> Complex<T> {
        match self {
            Self::Star => winding,
            Self::Delta => winding * to_delta::<T>().conj(),
        }
    }

    /// Current of the windings from the line current.
    #[inline]
    pub fn winding_current<T: Scalar>(self, line: Complex<T>) -> Complex<T> {
        match self {
            Self::Star => line,
            Self::Delta => line * to_delta::<T>() * T::from_f64(1.0 / 3.0),
        }
    }

    /// Voltage of the windings from the line-to-line voltages u_ab, u_bc: K_{s,v}^s, then the wye-delta conversion.
    #[inline]
    pub fn winding_voltage<T: Scalar>(self, u_ab: T, u_bc: T) -> Complex<T> {
        let star = from_line_to_line(u_ab, u_bc);
        match self {
            Self::Star => star,
            Self::Delta => star * to_delta::<T>(),
        }
    }
}

/// K_{s,i}^e: (i_d, i_q) from the currents of the phases a and b, with `direction` e^{jθ_e}.
#[inline]
pub fn to_synchronous<T: Scalar>(i_a: T, i_b: T, direction: Complex<T>) -> (T, T) {
    let beta = (i_a + i_b + i_b) * T::from_f64(1.0 / 1.732_050_807_568_877_2);
    let z = Complex::new(i_a, beta) * direction.conj();
    (-z.im, z.re)
}

/// Its inverse, the first two columns of (K_s^e)⁻¹: the phase currents.
#[inline]
pub fn from_synchronous<T: Scalar>(i_d: T, i_q: T, direction: Complex<T>) -> [T; 3] {
    to_phases(Complex::new(i_q, -i_d) * direction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::space_vector::{dot, unit};
    use proptest::prelude::*;

    proptest! {
        /// The printed matrices, entry by entry.
        #[test]
        fn the_transformations_are_the_printed_ones(i_d in -9.0..9.0f64, i_q in -9.0..9.0f64, theta in -4.0..4.0f64) {
            let direction = unit(theta);
            let [a, b, c] = from_synchronous(i_d, i_q, direction);
            let third = 2.0 * std::f64::consts::FRAC_PI_3;
            for (x, angle) in [(a, theta), (b, theta - third), (c, theta + third)] {
                prop_assert!((x - (angle.sin() * i_d + angle.cos() * i_q)).abs() < 1e-12);
            }
            let k = 2.0 / 3f64.sqrt();
            let sixth = std::f64::consts::FRAC_PI_6;
            let d = k * ((theta - sixth).sin() * a - theta.cos() * b);
            let q = k * ((theta - sixth).cos() * a + theta.sin() * b);
            let (d2, q2) = to_synchronous(a, b, direction);
            prop_assert!((d - i_d).abs() < 1e-12 && (q - i_q).abs() < 1e-12 && (d2 - d).abs() < 1e-12 && (q2 - q).abs() < 1e-12);
        }

        #[test]
        fn delta_windings_see_line_to_line_voltage_and_the_same_power(u in -9.0..9.0f64, v in -9.0..9.0f64, i in -9.0..9.0f64, k in -9.0..9.0f64) {
            let (star, line) = (Complex::new(u, v), Complex::new(i, k));
            let [a, b, c] = to_phases(star);
            let delta = Connection::Delta.winding_voltage(a - b, b - c);
            prop_assert!((to_phases(delta)[0] - (a - b)).abs() < 1e-12 && (to_phases(delta)[1] - (b - c)).abs() < 1e-12);
            let winding = Connection::Delta.winding_current(line);
            prop_assert!((Connection::Delta.line_current(winding) - line).norm() < 1e-12);
            prop_assert!((dot(delta, winding) - dot(star, line)).abs() < 1e-9);
            // The line current is the difference of two winding currents.
            let w = to_phases(winding);
            prop_assert!((w[0] - w[2] - to_phases(line)[0]).abs() < 1e-12);
        }
    }
}
