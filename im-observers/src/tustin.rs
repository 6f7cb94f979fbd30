//! The trapezoidal rule, warped to be exact at the rotor's frequency: x' = Mx + b over a sample, b held,
//!
//! ```text
//! x⁺ = x + (1 − h'M/2)⁻¹ h'(Mx + b),   h' = (2/ω) tan(hω/2) ≈ h(1 + (hω)²/12),   ω = n_pω̂.
//! ```
//!
//! |r(z)| ≤ 1 in the left half-plane; by von Neumann's theorem it is therefore a contraction in every norm √(xᴴPx) in which the
//! flow of M is one: a Lyapunov certificate of the continuous observer holds for the sampled one at *every* step. Unwarped, a pole jω is
//! taken for jω(1 − (hω)²/12), which would be seen as an error of the speed: 2 ‰ at 1000 rad/s and 160 µs.

use im_model::space_vector::norm2;
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

/// The flow of every full-order observer here, in rotor flux and ψ_s/σL_s = i + βλ:
///
/// ```text
/// λ' = aλ + c i + b_λ,   (i + βλ)' = −g i + b_ψ
/// ```
///
/// `C` is the type of `c` and `g`: real for the machine, complex with a gain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flow<T, C> {
    /// −η + jn_pω̂.
    pub a: Complex<T>,
    /// ηL_m, less the gain on λ̂.
    pub c: C,
    /// R_s/σL_s, plus the gain on î + βλ̂.
    pub g: C,
    pub beta: T,
}

impl<T: Scalar, C: Coefficient<T>> Flow<T, C> {
    /// One step of (λ, i) from the rates [λ', (i + βλ)'] at its beginning.
    #[inline(always)]
    pub fn step(&self, [lambda, i]: [Complex<T>; 2], [v_lambda, v_psi]: [Complex<T>; 2], h: T) -> [Complex<T>; 2] {
        let k = h * T::from_f64(0.5);
        // [1 − ka, −kc; β, 1 + kg] (Δλ, Δi) = h (v_λ, v_ψ), by Cramer's rule.
        let p = Complex::new(T::one() - k * self.a.re, -k * self.a.im);
        let (q, kc) = (self.g.scaled(k).plus_one(), self.c.scaled(k));
        let d = kc.scaled(self.beta).added_to(q.times(p));
        // h/d with one division.
        let h_over_d = d.conj() * (h / norm2(d));
        let d_lambda = q.times(v_lambda) + kc.times(v_psi);
        let d_i = p * v_psi - v_lambda * self.beta;
        [lambda + d_lambda * h_over_d, i + d_i * h_over_d]
    }
}

impl<T: Scalar> Flow<T, T> {
    /// One step of the machine's (λ, i), its voltage held, from the rates at its beginning: e^{hM} by Padé's quotient of the second order,
    ///
    /// ```text
    /// x⁺ = x + (1 − hM/2 + (hM)²/12)⁻¹ h(Mx + b)
    /// ```
    ///
    /// which takes a pole s for s(1 − (hs)⁴/720) and the left half-plane into the unit circle.
    #[inline(always)]
    pub fn exact(&self, [lambda, i]: [Complex<T>; 2], [v_lambda, v_psi]: [Complex<T>; 2], h: T) -> [Complex<T>; 2] {
        let (k, beta, c, g) = (h * T::from_f64(0.5), self.beta, self.c, self.g);
        // In λ and ψ = i + βλ: M = [m, c; gβ, −g], m = a − cβ, and what is inverted is [p, −cq; −gβq, r].
        let third = k * k * T::from_f64(1.0 / 3.0);
        let (m, turned) = (self.a - c * beta, c * g * beta);
        let q = (m - g) * -third + k;
        let p = (m * m + turned) * third - m * k + T::one();
        let r = (g * g + turned) * third + g * k + T::one();
        let d = p * r - q * q * turned;
        let h_over_d = d.conj() * (h / norm2(d));
        let d_lambda = (v_lambda * r + q * v_psi * c) * h_over_d;
        let d_psi = (p * v_psi + q * v_lambda * (g * beta)) * h_over_d;
        [lambda + d_lambda, i + d_psi - d_lambda * beta]
    }
}

/// A coefficient of [`Flow`].
pub(crate) trait Coefficient<T: Scalar>: Copy {
    fn scaled(self, k: T) -> Self;
    fn plus_one(self) -> Self;
    fn times(self, z: Complex<T>) -> Complex<T>;
    fn added_to(self, z: Complex<T>) -> Complex<T>;
}

impl<T: Scalar> Coefficient<T> for T {
    #[inline(always)]
    fn scaled(self, k: T) -> T {
        self * k
    }
    #[inline(always)]
    fn plus_one(self) -> T {
        self + T::one()
    }
    #[inline(always)]
    fn times(self, z: Complex<T>) -> Complex<T> {
        z * self
    }
    #[inline(always)]
    fn added_to(self, z: Complex<T>) -> Complex<T> {
        z + self
    }
}

impl<T: Scalar> Coefficient<T> for Complex<T> {
    #[inline(always)]
    fn scaled(self, k: T) -> Self {
        self * k
    }
    #[inline(always)]
    fn plus_one(self) -> Self {
        self + T::one()
    }
    #[inline(always)]
    fn times(self, z: Self) -> Self {
        self * z
    }
    #[inline(always)]
    fn added_to(self, z: Self) -> Self {
        self + z
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
        /// x⁺ − x = h(M(x⁺ + x)/2 + b), by its own definition.
        #[test]
        fn it_is_the_trapezoidal_rule(a in complex(50.0), c in complex(50.0), g in complex(50.0), beta in 0.1..10.0f64, x in complex(1.0), u in complex(1.0)) {
            let (f, h, b) = (Flow { a, c, g, beta }, 1e-2, [u, x * 0.3]);
            let x = [x, u * 2.0];
            let rates = |[lambda, i]: [C; 2]| [a * lambda + c * i + b[0], b[1] - g * i];
            let y = f.step(x, rates(x), h);
            let mean = rates([0, 1].map(|k| (x[k] + y[k]) * 0.5));
            let change = [0, 1].map(|k| y[k] - x[k]);
            let size = 1.0 + y[0].norm() + y[1].norm();
            prop_assert!((change[0] - mean[0] * h).norm() < 1e-9 * size);
            prop_assert!((change[1] + change[0] * beta - mean[1] * h).norm() < 1e-9 * size);
        }

        /// Against the matrix exponential by its series, the voltage held: to the fifth power of the step.
        #[test]
        fn the_machine_s_flow_is_exact(eta in 0.1..30.0f64, w in -1000.0..1000.0f64, c in 0.1..50.0f64, g in 1.0..500.0f64, beta in 1.0..200.0f64,
            x in complex(1.0), y in complex(10.0), u in complex(5e4), h in 1e-5..3e-4f64,
        ) {
            let f = Flow { a: C::new(-eta, w), c: c / beta, g, beta };
            let rates = |[l, i]: [C; 2], u: C| [f.a * l + i * f.c, u - i * g];
            let got = f.exact([x, y], rates([x, y], u), h);
            // x' and its derivatives, in λ and i.
            let (mut d, mut sum, mut factor) = (rates([x, y], u), [x, y], 1.0);
            for k in 1..30 {
                d[1] = if k == 1 { d[1] - d[0] * beta } else { d[1] };
                factor *= h / f64::from(k);
                sum = [0, 1].map(|n| sum[n] + d[n] * factor);
                let next = rates(d, C::new(0.0, 0.0));
                d = [next[0], next[1] - next[0] * beta];
            }
            let z = h * (f.a.norm() + c + g);
            let size = [x.norm() + h * u.norm() / beta, y.norm() + beta * x.norm() + h * u.norm()];
            for n in [0, 1] {
                prop_assert!((got[n] - sum[n]).norm() < 0.01 * z.powi(5) * size[n] + 1e-12 * size[n], "{n}: {} {}, {z}", got[n], sum[n]);
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

        /// von Neumann: a dissipative M contracts at any step. In the norm |e_i|² + ρ|e_i + βe_λ|² of the stabilized gain.
        #[test]
        fn a_contraction_at_every_step(eta in 0.1..20.0f64, w in -1000.0..1000.0f64, rho in 0.05..2.0f64, beta in 1.0..200.0f64, gamma in 1.0..500.0f64,
            x in complex(1.0), y in complex(10.0), exponent in -6.0..1.0f64,
        ) {
            let a = C::new(-eta, w);
            // g = (η + jw)/ρ with l₂ = 0: βc = γ − g.
            let g = C::new(eta, w) / rho;
            let c = (C::new(gamma, 0.0) - g) / beta;
            let norm = |[l, i]: [C; 2]| i.norm_sqr() + rho * (i + l * beta).norm_sqr();
            let rates = [a * x + c * y, -(g * y)];
            let after = Flow { a, c, g, beta }.step([x, y], rates, 10f64.powf(exponent));
            prop_assert!(norm(after) <= norm([x, y]) * (1.0 + 1e-6));
        }
    }
}
