//! Current-sensor offset: i_shown = i + i_0.

use num_complex::Complex;

use super::{About, Card, Place, SteadyState, effect};
use crate::error::Bound;

effect! {
    /// Constant error of the current sensors.
    CurrentSensorOffset, "current_sensor_offset",
    about: About { steady_state: SteadyState::Hides, ..About::at(Place::Sensors) },
    card: Card {
        title: "Current-sensor offset",
        what: "The sensors show a constant current that does not flow.",
        shows: "A constant current error, at standstill too; first harmonic of the supply in the rotating frame.",
        rivals: &[
            ("current_sensor_gain", "in proportion to the current"),
            ("inverter_nonlinearity", "changes sign with the phase current"),
        ],
        test: "A second at standstill without voltage.",
        place: "current sensors",
        source: "linear sensor model",
    },
    parameters: {
        /// Offset, α.
        alpha_a: Strength, default 0.0, "A", Current, typical 0.002 to 0.05, Bound::Within(-1e4, 1e4);
        /// Offset, β.
        beta_a: Strength, default 0.0, "A", Current, typical 0.002 to 0.05, Bound::Within(-1e4, 1e4);
    },
    hooks: {
        #[inline(always)]
        fn measured_current(&self, i: Complex<T>) -> Complex<T> {
            i + Complex::new(self.alpha_a, self.beta_a)
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for CurrentSensorOffset<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "direction, °",
            "offset in that direction, A",
            (0.0, 360.0),
            "Current shown where none flows, by direction (0° is phase a).",
        )
    }

    fn law(&self, _on: &super::Rated, x: f64) -> f64 {
        let (sin, cos) = x.to_radians().sin_cos();
        self.alpha_a * cos + self.beta_a * sin
    }
}
