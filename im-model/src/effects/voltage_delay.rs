//! Voltage delay: the recorded command reaches the terminals later (computation and modulation delay).
//!
//! With inputs held over the sample T, a delay D = (n + f)T, 0 ≤ f < 1, gives the mean voltage
//! ū_k = (1 − f) u_{k−n} + f u_{k−n−1}. The [`Bench`](crate::Bench) keeps the past commands.

use super::{About, Card, Place, SteadyState, effect};
use crate::error::Bound;

effect! {
    /// Dead time of the voltage path, as transport delay.
    VoltageDelay, "voltage_delay",
    about: About { steady_state: SteadyState::Hides, ..About::at(Place::Command) },
    card: Card {
        title: "Voltage delay",
        what: "The voltage acts D later than recorded: one and a half control periods in a usual drive.",
        shows: "An error in proportion to the change of voltage per sample: grows with frequency, large at voltage steps; looks like a rotation of the voltage by ωD.",
        rivals: &[
            ("speed_sensor_lag", "delays the speed only"),
            ("iron_loss", "also turns the current with frequency, but its power is real"),
        ],
        test: "Voltage steps or high frequency at low current.",
        place: "applied voltage, by past commands",
        source: "zero-order hold with transport delay",
    },
    parameters: {
        /// Delay.
        delay_s: Strength, default 0.0, "s", One, typical 2e-5 to 5e-4, Bound::Within(0.0, 3e-3);
    },
    hooks: {
        fn transport_delay(&self, delay: T) -> T {
            delay + self.delay_s
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for VoltageDelay<f64> {
    fn frame(&self, on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "supply frequency, Hz",
            "lag of the voltage, °",
            (0.0, 1.2 * on.frequency_hz),
            "By how much the delay turns the voltage.",
        )
    }

    fn law(&self, _on: &super::Rated, x: f64) -> f64 {
        (core::f64::consts::TAU * x * self.delay_s).to_degrees()
    }
}
