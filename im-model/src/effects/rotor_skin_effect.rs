//! Rotor skin effect: at high slip frequency the bar current crowds to the top of the slot.
//!
//! A two-branch (double-cage) rotor: rotor drop = R_r i_r + k R_r (i_r − z),  dz/dt = jω_e z + (i_r − z)/τ  (stator frame).
//!
//! z is the rotor current seen through the bar's diffusion time τ. At low slip z = i_r and the base machine remains; at high
//! slip the resistance is R_r(1 + k). Equal to a branch L_b + R_b in parallel with R_t = R_r(1+k): R_b = R_t/k, L_b = τ(R_t + R_b).

use num_complex::Complex;

use super::{About, Card, Operating, Place, effect};
use crate::error::Bound;
use crate::instant::Powers;
use crate::scalar::Scalar;
use crate::space_vector::{dot, j, norm2};

effect! {
    /// Current displacement in deep bars or a double cage.
    RotorSkinEffect, "rotor_skin_effect",
    about: About::at(Place::Windings),
    card: Card {
        title: "Rotor skin effect (deep bars)",
        what: "Rotor resistance rises from R_r to R_r(1+k) and rotor leakage falls as slip frequency exceeds 1/(2πτ): a second cage.",
        shows: "Starting torque and locked-rotor power, at the same current, higher than running tests predict; errors at high slip (start, reversal, plugging), none at running slip.",
        rivals: &[
            ("leakage_flux_saturation", "acts with current, whatever the slip; skin effect with slip frequency, whatever the current"),
            ("rotor_heating", "slow and stays after the start; skin effect follows slip at once"),
        ],
        test: "A start or reversal with the full range of slip, at reduced current; or locked rotor at two frequencies.",
        place: "extra rotor branch (adds one complex state)",
        source: "double-cage equivalent; cf. the three-branch Y_r(s) of Kwon et al., Table V",
    },
    parameters: {
        /// Relative rise of the rotor resistance at high slip frequency.
        resistance_rise: Strength, default 0.0, "", One, typical 0.2 to 4.0, Bound::NotNegative;
        /// Diffusion time of the bar.
        time_constant_s: Shape, default 3e-3, "s", One, typical 1e-3 to 1e-2, Bound::Within(1e-4, 1.0);
    },
    states: ["i_bar_A": Vector],
    hooks: {
        #[inline(always)]
        fn rotor_drop(&self, drop: Complex<T>, at: &Operating<T>, own: &[T]) -> Complex<T> {
            drop + (at.currents.i_r - i_bar(own)) * (self.resistance_rise * at.parameters.rotor_resistance_ohm)
        }

        #[inline(always)]
        fn rates(&self, rates: &mut [T], at: &Operating<T>, _powers: &Powers<T>, own: &[T]) {
            let z = i_bar(own);
            let rate = j(z) * at.omega_e() + (at.currents.i_r - z) * (T::one() / self.time_constant_s);
            (rates[0], rates[1]) = (rate.re, rate.im);
        }

        fn settled(&self, own: &mut [T], at: &Operating<T>, _psi_m_rate: Complex<T>) {
            (own[0], own[1]) = (at.currents.i_r.re, at.currents.i_r.im);
        }

        /// Power stored in the bars does not leave.
        #[inline(always)]
        fn powers(&self, powers: &mut Powers<T>, at: &Operating<T>, own: &[T]) {
            let z = i_bar(own);
            powers.rotor_copper -= (self.resistance_rise * at.parameters.rotor_resistance_ohm * dot(at.currents.i_r - z, z)).scale(1.5);
        }

        /// (3/2)·½ L_b|i_b|², i_b = z·k/(1+k), L_b = τR_r(1+k)²/k.
        fn stored_energy(&self, energy: T, at: &Operating<T>, own: &[T]) -> T {
            energy + T::from_f64(0.75) * self.time_constant_s * self.resistance_rise * at.parameters.rotor_resistance_ohm * norm2(i_bar(own))
        }

        fn added_resistance(&self, cold_r_r: f64) -> f64 {
            self.resistance_rise.value() * cold_r_r
        }

        fn fastest_rate(&self, _rotor_inertia: f64) -> f64 {
            1.0 / self.time_constant_s.value()
        }
    }
}

/// z, the rotor current diffused into the bars, A.
#[inline(always)]
fn i_bar<T: Scalar>(own: &[T]) -> Complex<T> {
    Complex::new(own[0], own[1])
}

impl<T: Scalar> RotorSkinEffect<T> {
    /// Leakage that the branch adds at low slip frequency, H: i_r − z = jωτ i_r there, so that the drop is jω k R_r τ i_r.
    pub fn low_slip_leakage_h(&self, rotor_resistance_ohm: T) -> T {
        self.resistance_rise * rotor_resistance_ohm * self.time_constant_s
    }
}

#[cfg(feature = "std")]
impl super::Drawn for RotorSkinEffect<f64> {
    fn frame(&self, on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "slip frequency, Hz",
            "rotor resistance, Ω",
            (0.0, 1.2 * on.frequency_hz),
            "Rotor resistance over slip frequency. Dashed: without current displacement.",
        )
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        let q = (core::f64::consts::TAU * x * self.time_constant_s).powi(2);
        on.parameters.rotor_resistance_ohm * (1.0 + self.resistance_rise * q / (1.0 + q))
    }
}
