//! Voltage gain: what reaches the terminals is not what was recorded, by a constant factor. u = (1 + g) u*.

use num_complex::Complex;

use super::{About, Card, Place, SteadyState, effect};
use crate::error::Bound;

effect! {
    /// Gain error of the voltage channel or of the inverter's DC-link measurement.
    VoltageGain, "voltage_gain",
    about: About { steady_state: SteadyState::Hides, ..About::at(Place::Voltage) },
    card: Card {
        title: "Voltage gain",
        what: "The terminals see (1+g) times the recorded voltage: a wrong DC-link measurement, transducer ratio or modulator gain.",
        shows: "All impedances and the flux seem wrong by one factor; the torque computed from the currents disagrees with the shaft by the same factor.",
        rivals: &[
            ("current_sensor_gain", "scales the currents, and the torque with them; a voltage gain leaves the currents' own ratio to torque"),
            ("main_flux_saturation", "depends on flux; a gain is the same at every flux"),
        ],
        test: "Known load torque at several speeds: without it a voltage gain is the same as scaled impedances.",
        place: "applied voltage",
        source: "linear sensor model",
    },
    parameters: {
        /// Relative gain error.
        gain: Strength, default 0.0, "", One, typical 0.005 to 0.1, Bound::Within(-0.9, 9.0);
    },
    hooks: {
        #[inline(always)]
        fn applied_voltage(&self, u: Complex<T>, _i_s: Complex<T>) -> Complex<T> {
            u * (T::one() + self.gain)
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for VoltageGain<f64> {
    fn frame(&self, on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "recorded voltage, V",
            "missing at the terminals, V",
            (0.0, on.rating.phase_voltage_peak_v),
            "Recorded minus real voltage, over the recorded voltage.",
        )
    }

    fn law(&self, _on: &super::Rated, x: f64) -> f64 {
        -self.gain * x
    }
}
