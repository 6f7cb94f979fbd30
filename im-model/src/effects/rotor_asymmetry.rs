//! Rotor asymmetry: broken or cracked bars make the rotor resistance depend on direction in the rotor.
//!
//! In the rotor frame: drop = R_r i_r + R_r (δ_d + j δ_q) ī_r; seen from the stator the mirror turns with e^{j2θ_e}.

use num_complex::Complex;

use super::{About, Card, Operating, Place, SteadyState, effect};
use crate::error::Bound;
use crate::space_vector::unit;

effect! {
    /// Unequal rotor phase resistances, fixed to the rotor.
    RotorAsymmetry, "rotor_asymmetry",
    about: About { steady_state: SteadyState::Ripples, fixed_to_shaft: true, ..About::at(Place::Windings) },
    card: Card {
        title: "Rotor asymmetry (broken bars)",
        what: "The rotor resistance depends on the direction in the rotor: R_r(δ_d + jδ_q) times the mirrored rotor current, turning with the rotor.",
        shows: "Under load, sidebands at twice the slip frequency around the supply, (1 ± 2s)f, and a torque and speed ripple at 2sf.",
        rivals: &[
            ("load_torque_ripple", "fixed to the shaft angle, there at no load too; broken bars follow the slip and vanish without load"),
            ("stator_asymmetry", "stands still in the stator: backward sequence at −f, whatever the slip"),
        ],
        test: "Steady high load, long enough to resolve twice the slip frequency.",
        place: "rotor winding, turning with the rotor",
        source: "two-axis model of an asymmetric rotor; sidebands (1 ± 2s)f",
    },
    parameters: {
        /// Resistance unbalance along the rotor's direct axis (phase a at angle zero).
        unbalance_direct: Strength, default 0.0, "", One, typical 0.01 to 0.25, Bound::Within(-0.69, 0.69);
        /// Resistance unbalance along the quadrature axis.
        unbalance_quadrature: Strength, default 0.0, "", One, typical 0.01 to 0.25, Bound::Within(-0.69, 0.69);
    },
    hooks: {
        #[inline(always)]
        fn rotor_drop(&self, drop: Complex<T>, at: &Operating<T>, _own: &[T]) -> Complex<T> {
            let twice = at.state.theta_m.scale(2.0 * at.n_p);
            drop + Complex::new(self.unbalance_direct, self.unbalance_quadrature) * unit(twice) * at.currents.i_r.conj() * at.r_r
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for RotorAsymmetry<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "direction in the rotor, °",
            "rotor resistance, Ω",
            (0.0, 360.0),
            "Rotor resistance by direction in the rotor.",
        )
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        let (sin, cos) = (2.0 * x.to_radians()).sin_cos();
        on.machine.parameters().rotor_resistance_ohm * (1.0 + self.unbalance_direct * cos + self.unbalance_quadrature * sin)
    }
}
