//! Stator heating: the winding warms with its losses and its resistance rises.
//!
//! R_s(ϑ) = R_s (1 + α ϑ),  dϑ/dt = a P_s − ϑ/τ,  P_s = (3/2) R_s(ϑ) |i_s|²
//!
//! a = 1/C is the inverse heat capacity: the steady thermal resistance is aτ. In a recording much shorter than τ only a is seen.

use super::{About, Card, Operating, Place, SteadyState, effect};
use crate::error::Bound;
use crate::instant::Powers;

effect! {
    /// Temperature of the stator winding; one thermal mass, cooled to where it started.
    StatorHeating, "stator_heating",
    about: About { steady_state: SteadyState::Hides, ..About::at(Place::Temperature) },
    card: Card {
        title: "Stator heating",
        what: "Copper loss warms the stator winding: R_s rises by 0.393 % per kelvin. One thermal mass with heat capacity C and cooling time constant τ.",
        shows: "A current error that drifts over seconds to minutes with the losses, strongest at low speed where the resistive drop is a large part of the voltage.",
        rivals: &[
            ("rotor_heating", "shows in slip and torque under load; stator heating shows at low speed and no load too"),
            ("inverter_nonlinearity", "changes the voltage at once and near zero currents; heating is slow and smooth"),
        ],
        test: "Hold a high current at low speed for a minute, with a short low-speed test before and after.",
        place: "winding temperature (adds one state)",
        source: "one-body thermal model; copper α = 0.00393 1/K at 20 °C",
    },
    parameters: {
        /// Inverse heat capacity: temperature rise per joule of loss.
        inverse_heat_capacity_k_per_j: Strength, default 0.0, "K/J", StatorHeating, typical 0.05 to 20.0, Bound::Within(0.0, 1e3);
        /// Cooling time constant.
        time_constant_s: Shape, default 20.0, "s", One, typical 3.0 to 3000.0, Bound::Within(0.1, 1e5);
        /// Temperature coefficient of the resistance.
        temperature_coefficient_per_k: Fixed, default 0.00393, "1/K", One, typical 0.0039 to 0.0041, Bound::Positive;
    },
    states: ["stator_rise_K": Drifts],
    hooks: {
        #[inline(always)]
        fn stator_resistance(&self, r: T, own: &[T]) -> T {
            r * (T::one() + self.temperature_coefficient_per_k * own[0])
        }

        #[inline(always)]
        fn rates(&self, rates: &mut [T], _at: &Operating<T>, powers: &Powers<T>, own: &[T]) {
            rates[0] = self.inverse_heat_capacity_k_per_j * powers.stator_copper - own[0] * (T::one() / self.time_constant_s);
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for StatorHeating<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "time at rated loss, s",
            "stator resistance, Ω",
            (0.0, 2.0 * self.time_constant_s.min(30.0)),
            "Stator resistance from cold at rated current.",
        )
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        let cold = on.parameters.stator_resistance_ohm;
        let loss = 1.5 * cold * on.current_a * on.current_a;
        let rise = self.inverse_heat_capacity_k_per_j * loss * self.time_constant_s * (1.0 - (-x / self.time_constant_s).exp());
        cold * (1.0 + self.temperature_coefficient_per_k * rise)
    }
}
