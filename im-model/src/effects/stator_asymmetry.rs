//! Stator asymmetry: unequal phase resistances.
//!
//! Drop = R_s i_s + R_s (δ_α + j δ_β) ī_s. Phase resistances R_s(1 + δ_a), … with zero mean deviation give
//! δ_α + j δ_β = (δ_a + a δ_b + a² δ_c)/3: 2δ_α + 1 is phase a's resistance over the mean.

use num_complex::Complex;

use super::{About, Card, Operating, Place, SteadyState, effect};
use crate::error::Bound;

effect! {
    /// Unequal stator phase resistances: a bad joint, an early turn fault, unequal cables.
    StatorAsymmetry, "stator_asymmetry",
    about: About { steady_state: SteadyState::Ripples, ..About::at(Place::Windings) },
    card: Card {
        title: "Stator asymmetry",
        what: "The phase resistances differ: R_s(δ_α + jδ_β) times the mirrored current is dropped in addition.",
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
    },
    hooks: {
        #[inline(always)]
        fn stator_drop(&self, drop: Complex<T>, at: &Operating<T>, _own: &[T]) -> Complex<T> {
            drop + Complex::new(self.unbalance_alpha, self.unbalance_beta) * at.currents.i_s.conj() * at.r_s
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
        on.machine.parameters().stator_resistance_ohm * (1.0 + self.unbalance_alpha * cos + self.unbalance_beta * sin)
    }
}
