//! Stator asymmetry: unequal phase impedances.
//!
//! Drop = R_s i_s + R_s (δ_α + j δ_β) ī_s. Phase resistances R_s(1 + δ_a), … with zero mean deviation give
//! δ_α + j δ_β = (δ_a + a δ_b + a² δ_c)/3: 2δ_α + 1 is phase a's resistance over the mean. A phase with a longer cable or with shorted
//! turns has another leakage too, in proportion: κ L_ls (δ_α + j δ_β) ī_s of flux, in series with the winding.

use num_complex::Complex;

use super::{About, Card, Operating, Place, SteadyState, effect};
use crate::error::Bound;

effect! {
    /// Unequal stator phase impedances: a bad joint, an early turn fault, unequal cables.
    StatorAsymmetry, "stator_asymmetry",
    about: About { steady_state: SteadyState::Ripples, ..About::at(Place::Windings) },
    card: Card {
        title: "Stator asymmetry",
        what: "The phase resistances differ: R_s(δ_α + jδ_β) times the mirrored current is dropped in addition; and the leakages by κ times as much.",
        shows: "Negative-sequence current in proportion to load current, largest at low speed; torque ripple at twice the supply frequency.",
        rivals: &[
            ("current_sensor_gain", "the same relative unbalance at every speed and no torque ripple"),
            ("rotor_asymmetry", "sidebands at twice the slip frequency; stator asymmetry stands still in the stator"),
        ],
        test: "Load at low speed, then at high speed; or direct current in three directions at standstill.",
        place: "stator winding",
        source: "symmetrical components of a three-phase winding with floating star point",
    },
    parameters: {
        /// Resistance unbalance, α part.
        unbalance_alpha: Strength, default 0.0, "", One, typical 0.005 to 0.15, Bound::Within(-0.49, 0.49);
        /// Resistance unbalance, β part.
        unbalance_beta: Strength, default 0.0, "", One, typical 0.005 to 0.15, Bound::Within(-0.49, 0.49);
        /// Unbalance of the leakage over that of the resistance: 0 of a bad joint, 1 of a whole coil, 2 of shorted turns.
        leakage_share: Shape, default 0.0, "", One, typical 0.0 to 2.0, Bound::Within(-2.0, 2.0);
    },
    hooks: {
        #[inline(always)]
        fn stator_drop(&self, drop: Complex<T>, at: &Operating<T>, _own: &[T]) -> Complex<T> {
            drop + Complex::new(self.unbalance_alpha, self.unbalance_beta) * at.currents.i_s.conj() * at.r_s
        }

        #[inline(always)]
        fn stator_mirrored_inductance(&self, l: Complex<T>, l_ls: T) -> Complex<T> {
            l + Complex::new(self.unbalance_alpha, self.unbalance_beta) * (self.leakage_share * l_ls)
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for StatorAsymmetry<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "direction of the current, °",
            "stator resistance, Ω",
            (0.0, 360.0),
            "Stator resistance by direction (0° is phase a).",
        )
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        let (sin, cos) = (2.0 * x.to_radians()).sin_cos();
        on.parameters.stator_resistance_ohm * (1.0 + self.unbalance_alpha * cos + self.unbalance_beta * sin)
    }
}

#[cfg(test)]
mod tests {
    use super::super::trying::*;
    use super::*;
    use crate::machines::MOTULATOR_2_2_KW;
    use crate::space_vector::j;

    /// Forward and backward currents of two coupled T circuits, Z₁I₁ + z Ī₂ = U, Z₂I₂ + z' Ī₁ = 0, with z = (R_s ± jωκL_ls)(δ_α + jδ_β).
    #[test]
    fn forward_and_backward_currents_are_those_of_coupled_circuits() {
        let p = MOTULATOR_2_2_KW.parameters();
        let (omega, slip) = (2.0 * SYNCHRONOUS, 0.04);
        let delta = Complex::new(0.06, -0.03);
        for share in [0.0, 0.5, 1.0, -0.7] {
            let m = machine(|e| {
                (e.stator_asymmetry.unbalance_alpha, e.stator_asymmetry.unbalance_beta) = (delta.re, delta.im);
                e.stator_asymmetry.leakage_share = share;
            });
            let circuit = |w: f64, slip: f64| {
                let rotor = Complex::new(p.rotor_resistance_ohm / slip, w * p.rotor_leakage_inductance_h);
                let magnetizing = Complex::new(0.0, w * p.magnetizing_inductance_h);
                Complex::new(p.stator_resistance_ohm, w * p.stator_leakage_inductance_h)
                    + magnetizing * rotor / (magnetizing + rotor)
            };
            let z_1 = circuit(omega, slip);
            let z_2 = circuit(-omega, 2.0 - slip);
            let reactance = delta * (omega * share * p.stator_leakage_inductance_h);
            let (ahead, back) = (delta * p.stator_resistance_ohm + j(reactance), delta * p.stator_resistance_ohm - j(reactance));
            // I₂ = −z' Ī₁/Z₂, and with it (Z₁ − z z̄'/Z̄₂) I₁ = U.
            let i_1 = RATED_V / (z_1 - ahead * back.conj() / z_2.conj());
            let i_2 = -back * i_1.conj() / z_2;
            let shown = running(&m, RATED_V, (1.0 - slip) * SYNCHRONOUS);
            let (f, b) = (current(&shown, 50.0), current(&shown, -50.0));
            assert!((f - i_1).norm() < 1e-3 * i_1.norm(), "share {share}: {f} A, {i_1}");
            assert!((b - i_2).norm() < 5e-3 * i_2.norm(), "share {share}: {b} A, {i_2}");
        }
    }
}
