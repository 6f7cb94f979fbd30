//! Rotor heating: the cage warms with its losses and its resistance rises.
//!
//! R_r(ϑ) = R_r (1 + α ϑ),  dϑ/dt = a P_r − ϑ/τ,  P_r = (3/2) R_r(ϑ) |i_r|²
//!
//! a = 1/C is the inverse heat capacity: the steady thermal resistance is aτ. In a recording much shorter than τ only a is seen.

use super::{About, Card, Operating, Place, SteadyState, effect};
use crate::error::Bound;
use crate::instant::Powers;

effect! {
    /// Temperature of the rotor cage; one thermal mass, cooled to where it started.
    RotorHeating, "rotor_heating",
    about: About { steady_state: SteadyState::Hides, ..About::at(Place::Temperature) },
    card: Card {
        title: "Rotor heating",
        what: "Cage loss warms the rotor cage: R_r rises by 0.40 % per kelvin. One thermal mass with heat capacity C and cooling time constant τ.",
        shows: "Slip for the same torque grows over seconds to minutes under load; a speed and torque-current error that drifts with the rotor losses, none at no load.",
        rivals: &[
            ("stator_heating", "shows at low speed without load too; rotor heating only under load, as slip"),
            ("rotor_skin_effect", "follows slip frequency at once and is gone when running; heating stays"),
        ],
        test: "Hold rated load at constant speed for a minute: the slip grows at constant torque.",
        place: "cage temperature (adds one state)",
        source: "one-body thermal model; aluminium α = 0.0040 1/K at 20 °C",
    },
    parameters: {
        /// Inverse heat capacity: temperature rise per joule of loss.
        inverse_heat_capacity_k_per_j: Strength, default 0.0, "K/J", RotorHeating, typical 0.05 to 20.0, Bound::Within(0.0, 1e3);
        /// Cooling time constant.
        time_constant_s: Shape, default 20.0, "s", One, typical 3.0 to 3000.0, Bound::Within(0.1, 1e5);
        /// Temperature coefficient of the resistance.
        temperature_coefficient_per_k: Fixed, default 0.0040, "1/K", One, typical 0.0036 to 0.0045, Bound::Positive;
    },
    states: ["rotor_rise_K": Drifts],
    hooks: {
        #[inline(always)]
        fn rotor_resistance(&self, r: T, own: &[T]) -> T {
            r * (T::one() + self.temperature_coefficient_per_k * own[0])
        }

        #[inline(always)]
        fn rates(&self, rates: &mut [T], _at: &Operating<T>, powers: &Powers<T>, own: &[T]) {
            rates[0] = self.inverse_heat_capacity_k_per_j * powers.rotor_copper - own[0] * (T::one() / self.time_constant_s);
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for RotorHeating<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "time at rated loss, s",
            "rotor resistance, Ω",
            (0.0, 2.0 * self.time_constant_s.min(30.0)),
            "Rotor resistance from cold at rated current.",
        )
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        let cold = on.parameters.rotor_resistance_ohm;
        let loss = 1.5 * cold * on.current_a * on.current_a;
        let rise = self.inverse_heat_capacity_k_per_j * loss * self.time_constant_s * (1.0 - (-x / self.time_constant_s).exp());
        cold * (1.0 + self.temperature_coefficient_per_k * rise)
    }
}
