//! The trapezoidal rule, warped to be exact at the rotor's frequency: x' = Mx + b over a sample, b held,
//!
//! ```text
//! x⁺ = x + (1 − h'M/2)⁻¹ h'(Mx + b),   h' = (2/ω) tan(hω/2) ≈ h(1 + (hω)²/12),   ω = n_pω̂.
//! ```
//!
//! |r(z)| ≤ 1 in the left half-plane; by von Neumann's theorem it is therefore a contraction in every norm √(xᴴPx) in which the
//! flow of M is one: a Lyapunov certificate of the continuous observer holds for the sampled one at *every* step. Unwarped, a pole jω is
//! taken for jω(1 − (hω)²/12), which would be seen as an error of the speed: 2 ‰ at 1000 rad/s and 160 µs.

use im_model::{Complex, Scalar};

/// h'.
#[inline(always)]
pub(crate) fn warped<T: Scalar>(h: T, omega_e: T) -> T {
    let angle = h * omega_e;
    h + h * angle * angle * T::from_f64(1.0 / 12.0)
}

/// One step of x' = mx + b.
#[inline(always)]
pub(crate) fn step1<T: Scalar>(m: Complex<T>, x: Complex<T>, b: Complex<T>, h: T) -> Complex<T> {
    let half = h * T::from_f64(0.5);
    let d = Complex::new(T::one() - m.re * half, -m.im * half);
    x + (m * x + b) * inverse(d).scale(h)
}

/// The flow of every full-order observer here, M = [a, c; −βa, −d] on (λ̂, î).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flow<T> {
    /// −η + jn_pω̂.
    pub a: Complex<T>,
    /// ηL_m − l₁.
    pub c: Complex<T>,
    /// γ + l₂.
    pub d: Complex<T>,
    pub beta: T,
}

impl<T: Scalar> Flow<T> {
    /// Mx.
    #[inline(always)]
    pub fn apply(&self, [lambda, i]: [Complex<T>; 2]) -> [Complex<T>; 2] {
        let turned = self.a * lambda;
        [turned + self.c * i, -(turned.scale(self.beta) + self.d * i)]
    }

    /// Its trace.
    #[inline(always)]
    pub fn trace(&self) -> Complex<T> {
        self.a - self.d
    }

    /// Its determinant: a(βc − d).
    #[inline(always)]
    pub fn determinant(&self) -> Complex<T> {
        self.a * (self.c.scale(self.beta) - self.d)
    }

    /// One step of x' = Mx + b from its rate `v` at the beginning, Mx + b.
    #[inline(always)]
    pub fn step(&self, x: [Complex<T>; 2], v: [Complex<T>; 2], h: T) -> [Complex<T>; 2] {
        let k = h * T::from_f64(0.5);
        // By Cayley and Hamilton (1 − kM)⁻¹ = (1 − k tr M + kM)/(1 − k tr M + k² det M).
        let trace = self.trace().scale(k);
        let rest = Complex::new(T::one() - trace.re, -trace.im);
        let scale = inverse(rest + self.determinant().scale(k * k)).scale(h);
        let mv = self.apply(v);
        [0, 1].map(|n| x[n] + (rest * v[n] + mv[n].scale(k)) * scale)
    }
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

    fn complex(size: f64) -> impl Strategy<Value = C> {
        (-size..size, -size..size).prop_map(|(a, b)| C::new(a, b))
    }

    proptest! {
        /// (1 − h/2 M)(x⁺ − x) = h(Mx + b), by its own definition.
        #[test]
        fn it_is_the_trapezoidal_rule(a in complex(50.0), c in complex(50.0), d in complex(50.0), beta in 0.1..10.0f64, x in complex(1.0), u in complex(1.0)) {
            let (f, h, b) = (Flow { a, c, d, beta }, 1e-2, [u, x * 0.3]);
            let x = [x, u * 2.0];
            let mx = f.apply(x);
            let y = f.step(x, [mx[0] + b[0], mx[1] + b[1]], h);
            let my = f.apply(y);
            for k in 0..2 {
                let mean = (mx[k] + my[k]) * 0.5 + b[k];
                prop_assert!((y[k] - x[k] - mean * h).norm() < 1e-9 * (1.0 + y[k].norm()), "{k}");
            }
        }

        /// A pole at jω and a held input are taken exactly, to the fourth order that the series for the tangent keeps.
        #[test]
        fn a_turning_flux_is_exact(omega in 1.0..1000.0f64, h in 1e-5..2e-4f64, x in complex(1.0), b in complex(1000.0)) {
            let m = C::new(0.0, omega);
            let turn = C::new((h * omega).cos(), (h * omega).sin());
            let exact = x * turn + (turn - 1.0) / m * b;
            let got = step1(m, x, b, warped(h, omega));
            let angle = h * omega;
            prop_assert!((got - exact).norm() <= 0.02 * angle.powi(5) * (x.norm() + b.norm() / omega) + 1e-12);
        }

        /// von Neumann: a dissipative M contracts at any step. In the norm |e_i|² + ρ|e_i + βe_λ|² of the mended gain.
        #[test]
        fn a_contraction_at_every_step(eta in 0.1..20.0f64, w in -1000.0..1000.0f64, rho in 0.05..2.0f64, beta in 1.0..200.0f64, gamma in 1.0..500.0f64,
            x in complex(1.0), y in complex(10.0), exponent in -6.0..1.0f64,
        ) {
            let a = C::new(-eta, w);
            // r + g = (η + jw)/ρ with l₂ = 0: βc = γ − (η + jw)/ρ.
            let f = Flow { a, c: (C::new(gamma, 0.0) - C::new(eta, w) / rho) / beta, d: C::new(gamma, 0.0), beta };
            let norm = |[l, i]: [C; 2]| i.norm_sqr() + rho * (i + l * beta).norm_sqr();
            prop_assert!(norm(f.step([x, y], f.apply([x, y]), 10f64.powf(exponent))) <= norm([x, y]) * (1.0 + 1e-6));
        }
    }
}
