//! Exact enough and stable at any step: x' = Mx + b over a sample by the (2,2) Padé approximant of the exponential,
//!
//! ```text
//! x⁺ = x + D⁻¹ h(Mx + b),   D = 1 − N/2 + N²/12,   N = hM   (b held).
//! ```
//!
//! Fourth order, and |r(z)| ≤ 1 in the left half-plane; by von Neumann's theorem it is therefore a contraction in every norm √(xᴴPx)
//! in which the flow of M is one: a Lyapunov certificate of the continuous observer holds for the sampled one at *every* step.

use im_model::{Complex, Scalar};

/// One step of a scalar equation.
#[inline(always)]
pub(crate) fn step1<T: Scalar>(m: Complex<T>, x: Complex<T>, b: Complex<T>, h: T) -> Complex<T> {
    let n = m * h;
    let one = Complex::new(T::one(), T::zero());
    let d = one - n * T::from_f64(0.5) + n * n * T::from_f64(1.0 / 12.0);
    x + (n * x + b * h) * inverse(d)
}

/// One step of a pair of equations.
#[inline(always)]
pub(crate) fn step2<T: Scalar>(m: [[Complex<T>; 2]; 2], x: [Complex<T>; 2], b: [Complex<T>; 2], h: T) -> [Complex<T>; 2] {
    let twelfth = T::from_f64(1.0 / 12.0);
    let n = m.map(|row| row.map(|z| z * h));
    let w = [n[0][0] * x[0] + n[0][1] * x[1] + b[0] * h, n[1][0] * x[0] + n[1][1] * x[1] + b[1] * h];
    let trace = n[0][0] + n[1][1];
    let det = n[0][0] * n[1][1] - n[0][1] * n[1][0];
    // By Cayley and Hamilton D = p + qN, and D⁻¹ = (p + q tr N − qN)/det D.
    let p = Complex::new(T::one() - det.re * twelfth, -det.im * twelfth);
    let q = Complex::new(trace.re * twelfth - T::from_f64(0.5), trace.im * twelfth);
    let i = inverse(p * p + q * (p * trace + q * det));
    let (g, k) = ((p + q * trace) * i, q * i);
    [x[0] + g * w[0] - k * (n[0][0] * w[0] + n[0][1] * w[1]), x[1] + g * w[1] - k * (n[1][0] * w[0] + n[1][1] * w[1])]
}

/// 1/z with one division.
#[inline(always)]
pub(crate) fn inverse<T: Scalar>(z: Complex<T>) -> Complex<T> {
    let i = T::one() / (z.re * z.re + z.im * z.im);
    Complex::new(z.re * i, -z.im * i)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type C = Complex<f64>;

    fn apply(m: &[[C; 2]; 2], x: [C; 2]) -> [C; 2] {
        [m[0][0] * x[0] + m[0][1] * x[1], m[1][0] * x[0] + m[1][1] * x[1]]
    }

    /// e^{hM}x + ∫e^{sM}b ds by its series, in short sub-steps.
    fn exact(m: &[[C; 2]; 2], mut x: [C; 2], b: [C; 2], h: f64) -> [C; 2] {
        let n = 64;
        let s = h / f64::from(n);
        for _ in 0..n {
            let mx = apply(m, x);
            let mut term = [0, 1].map(|k| (mx[k] + b[k]) * s);
            let mut sum = term;
            for order in 2..12 {
                term = apply(m, term).map(|z| z * (s / f64::from(order)));
                sum = [sum[0] + term[0], sum[1] + term[1]];
            }
            x = [x[0] + sum[0], x[1] + sum[1]];
        }
        x
    }

    fn complex(size: f64) -> impl Strategy<Value = C> {
        (-size..size, -size..size).prop_map(|(a, b)| C::new(a, b))
    }

    proptest! {
        #[test]
        fn fourth_order(a in complex(1.0), b in complex(1.0), c in complex(1.0), d in complex(1.0), x in complex(1.0), u in complex(1.0)) {
            let (m, x, u) = ([[a, b], [c, d]], [x, u], [u, x * 0.3]);
            let error = |h: f64| {
                let (p, e) = (step2(m, x, u, h), exact(&m, x, u, h));
                (p[0] - e[0]).norm() + (p[1] - e[1]).norm()
            };
            // r(z) − e^z = z⁵/720 + …, with |M| ≤ 3: 3⁵/720·h⁵ and the like; a factor for the rest of the series.
            prop_assert!(error(0.1) < 1.0 * 0.1f64.powi(5), "{}", error(0.1));
            prop_assert!((step1(a, x[0], u[0], 0.1) - step2([[a, C::new(0.0, 0.0)], [C::new(0.0, 0.0), d]], x, u, 0.1)[0]).norm() < 1e-14);
        }

        /// von Neumann: dissipative M, any step.
        #[test]
        fn a_contraction_at_every_step(
            w1 in -1e4..1e4f64, w2 in -1e4..1e4f64, k in complex(1e4), d1 in 0.0..1e4f64, d2 in 0.0..1e4f64, x in complex(1.0), y in complex(1.0),
            exponent in -6.0..1.0f64,
        ) {
            // M = skew-Hermitian − positive diagonal.
            let m = [[C::new(-d1, w1), k], [-k.conj(), C::new(-d2, w2)]];
            let zero = [C::new(0.0, 0.0); 2];
            let z = step2(m, [x, y], zero, 10f64.powf(exponent));
            prop_assert!(z[0].norm_sqr() + z[1].norm_sqr() <= (x.norm_sqr() + y.norm_sqr()) * (1.0 + 1e-6));
        }
    }
}
