//! The four parameters (7), and the regressor (33) in the steady state.

use im_model::space_vector::{j, norm2};
use im_model::{Bound, Complex, InverseGammaParameters, ModelError, Scalar};

/// R_req, L, R_s, L_f of (7): the inverse-Γ circuit, in the order of the paper's figures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegulationParameters<T> {
    /// R_req = R_r L_m²/L_r², Ω.
    pub rotor_resistance_ohm: T,
    /// L = L_m²/L_r, H.
    pub magnetizing_inductance_h: T,
    /// R_s, Ω.
    pub stator_resistance_ohm: T,
    /// L_f = L_s − L_m²/L_r, H.
    pub leakage_inductance_h: T,
}

impl<T: Scalar> From<InverseGammaParameters<T>> for RegulationParameters<T> {
    fn from(g: InverseGammaParameters<T>) -> Self {
        Self {
            rotor_resistance_ohm: g.rotor_resistance_ohm,
            magnetizing_inductance_h: g.magnetizing_inductance_h,
            stator_resistance_ohm: g.stator_resistance_ohm,
            leakage_inductance_h: g.leakage_inductance_h,
        }
    }
}

impl<T: Scalar> RegulationParameters<T> {
    /// Names, with units, in the order of [`values`](Self::values).
    pub const NAMES: [&'static str; 4] =
        ["rotor_resistance_ohm", "magnetizing_inductance_h", "stator_resistance_ohm", "leakage_inductance_h"];
    /// Symbols of the paper, in the same order.
    pub const SYMBOLS: [&'static str; 4] = ["R_req", "L", "R_s", "L_f"];

    /// In the order R_req, L, R_s, L_f.
    pub fn values(&self) -> [T; 4] {
        [self.rotor_resistance_ohm, self.magnetizing_inductance_h, self.stator_resistance_ohm, self.leakage_inductance_h]
    }

    /// From the order R_req, L, R_s, L_f.
    pub fn from_values([r_req, l, r_s, l_f]: [T; 4]) -> Self {
        Self { rotor_resistance_ohm: r_req, magnetizing_inductance_h: l, stator_resistance_ohm: r_s, leakage_inductance_h: l_f }
    }

    /// Each times a factor.
    pub fn scaled(&self, factors: [T; 4]) -> Self {
        let v = self.values();
        Self::from_values(core::array::from_fn(|k| v[k] * factors[k]))
    }

    /// 1/T_r = R_req/L, 1/s.
    pub fn inverse_rotor_time_constant(&self) -> T {
        self.rotor_resistance_ohm / self.magnetizing_inductance_h
    }

    /// Checks that every parameter is positive and finite.
    ///
    /// # Errors
    /// Names the one that is not.
    pub fn validate(&self) -> Result<(), ModelError> {
        Self::NAMES.into_iter().zip(self.values()).try_for_each(|(name, x)| Bound::Positive.check(name, x.value()))
    }
}

/// B of (33), V: the voltage that the integral action holds per relative error of R_req, L, R_s, L_f, in the steady state.
///
/// `phi` is the equivalent rotor flux, Vs, `i_s` the current, A, both in a frame at ω_s = ω_r + ω_g, electrical rad/s.
pub fn steady_regressor<T: Scalar>(
    p: &RegulationParameters<T>,
    phi: Complex<T>,
    i_s: Complex<T>,
    omega_s: T,
    omega_g: T,
) -> [Complex<T>; 4] {
    let a = p.inverse_rotor_time_constant();
    // ω_s φ/(T_r⁻¹ + jω_g)
    let turned = phi * Complex::new(a, -omega_g) * (omega_s / (a * a + omega_g * omega_g));
    [turned * omega_g, -j(turned) * a, -i_s * p.stator_resistance_ohm, -j(i_s) * (omega_s * p.leakage_inductance_h)]
}

/// |B|/‖B‖ at a speed ω_r and a slip ω_g (electrical rad/s), flux along d: Fig. 2 of the paper. Zero where B vanishes.
pub fn relative_sensitivity<T: Scalar>(p: &RegulationParameters<T>, flux_vs: T, omega_r: T, omega_g: T) -> [T; 4] {
    // (15): R_req i = (T_r⁻¹ + jω_g) φ
    let i_s = Complex::new(p.inverse_rotor_time_constant(), omega_g) * (flux_vs / p.rotor_resistance_ohm);
    let b = steady_regressor(p, Complex::new(flux_vs, T::zero()), i_s, omega_r + omega_g, omega_g);
    let size = b.iter().fold(T::zero(), |s, x| s + norm2(*x)).sqrt();
    b.map(|x| if size > T::zero() { norm2(x).sqrt() / size } else { T::zero() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type C = Complex<f64>;

    /// The steady state of the reference generator that follows the machine without current error: K_Pη of (30), solved as it stands.
    fn held_voltage(truth: &RegulationParameters<f64>, estimate: &RegulationParameters<f64>, w_s: f64, w_g: f64) -> (C, C, C) {
        let (a, a_hat) = (truth.inverse_rotor_time_constant(), estimate.inverse_rotor_time_constant());
        let i = C::new(2.0, 1.5);
        let phi_ref = i * estimate.rotor_resistance_ohm / C::new(a_hat, w_g);
        let phi = i * truth.rotor_resistance_ohm / C::new(a, w_g);
        // Stator equations of both at the same current; u_s is common, v_s = −K_Pη.
        let stator = |p: &RegulationParameters<f64>, a: f64, phi: C| {
            i * C::new(p.stator_resistance_ohm + p.rotor_resistance_ohm, w_s * p.leakage_inductance_h)
                - phi * C::new(a, w_g - w_s)
        };
        (stator(estimate, a_hat, phi_ref) - stator(truth, a, phi), phi_ref, i)
    }

    proptest! {
        /// (32) with B of (33): K_Pη = BᵀΔθ to first order, errors relative, truth less estimate. Halving the errors quarters the rest.
        #[test]
        fn integral_voltage_is_the_regressor_times_the_relative_errors(
            r_req in 0.1..5.0f64, l in 0.02..0.5f64, r_s in 0.1..5.0f64, l_f in 0.001..0.05f64,
            w_s in -400.0..400.0f64, w_g in -20.0..20.0f64, d in prop::array::uniform4(-1.0..1.0f64),
        ) {
            let truth = RegulationParameters::from_values([r_req, l, r_s, l_f]);
            let rest = |size: f64| {
                let estimate = truth.scaled(d.map(|x| 1.0 - size * x));
                let (v, phi_ref, i) = held_voltage(&truth, &estimate, w_s, w_g);
                let b = steady_regressor(&estimate, phi_ref, i, w_s, w_g);
                let predicted: C = b.iter().zip(d).map(|(b, d)| *b * (size * d)).sum();
                let scale: f64 = b.iter().map(|b| b.norm()).sum();
                (v - predicted).norm() / scale
            };
            let (coarse, fine) = (rest(1e-2), rest(5e-3));
            prop_assert!(coarse < 1e-3, "{coarse}");
            prop_assert!(fine < 0.3 * coarse + 1e-12, "{coarse} {fine}");
        }
    }

    #[test]
    fn regressors_of_rotor_resistance_and_inductance_are_at_right_angles() {
        let p = RegulationParameters::from_values([0.855, 0.152, 1.5, 0.0079]);
        let [b1, b2, ..] = steady_regressor(&p, C::new(0.9, 0.1), C::new(5.0, 8.0), 200.0, 7.0);
        assert!((b1 * b2.conj()).re.abs() < 1e-9 && b1.norm() > 1.0 && b2.norm() > 1.0);
    }

    /// |B| of (33) with i of (15), s = √(a² + ω_g²): |ω_sω_g|φ/s, |ω_s|aφ/s, R_s sφ/R_req, |ω_s|L_f sφ/R_req; at standstill R_s alone.
    #[test]
    fn shares_are_the_sizes_of_33_over_their_root_sum_of_squares() {
        let p = RegulationParameters::<f64>::from_values([0.855, 0.152, 1.5, 0.0079]);
        let a = p.inverse_rotor_time_constant();
        for (omega_r, omega_g) in [(200.0, 7.0), (-150.0, 4.0), (3.0, -12.0), (0.0, 5.0), (-5.0, 5.0)] {
            let (omega_s, s) = (f64::abs(omega_r + omega_g), a.hypot(omega_g));
            let sizes = [
                omega_s * omega_g.abs() / s,
                omega_s * a / s,
                p.stator_resistance_ohm * s / p.rotor_resistance_ohm,
                omega_s * p.leakage_inductance_h * s / p.rotor_resistance_ohm,
            ];
            let whole = sizes.iter().map(|x| x * x).sum::<f64>().sqrt();
            let got = relative_sensitivity(&p, 0.9, omega_r, omega_g);
            assert!(got.iter().zip(sizes).all(|(g, x)| (g - x / whole).abs() < 1e-12), "{omega_r} {omega_g}: {got:?}");
        }
        assert_eq!(relative_sensitivity(&p, 0.0, 200.0, 7.0), [0.0; 4], "without flux there is nothing to see");
    }
}
