//! Speed-sensor scale: the speed shown is a constant multiple of the true one. ω_shown = (1 + g) ω.
//!
//! A wrong number of lines or gear ratio, or a tachogenerator off its constant. Without load the slip is next to nothing, so that the
//! supply frequency says what the speed is; the slip that a model needs for its torque says it at every load.

use super::{About, Card, Place, SteadyState, effect};
use crate::error::Bound;

effect! {
    /// Gain error of the speed sensor.
    SpeedSensorScale, "speed_sensor_scale",
    about: About { steady_state: SteadyState::Hides, ..About::at(Place::Sensors) },
    card: Card {
        title: "Speed-sensor scale",
        what: "The speed shown is (1+g) times the true one: wrong line count, gear ratio or tachogenerator constant.",
        shows: "A speed error in proportion to the speed, at any load and in the steady state, too; the currents are right.",
        rivals: &[
            ("speed_sensor_lag", "only while the speed changes; a wrong scale is there at constant speed"),
            ("rotor_heating", "changes the slip under load only; a wrong scale shows without load"),
        ],
        test: "Run without load at several frequencies: the slip is next to nothing.",
        place: "speed sensor",
        source: "linear sensor model",
    },
    parameters: {
        /// Fraction by which the speed shown is too high.
        gain: Strength, default 0.0, "", One, typical 0.002 to 0.05, Bound::Within(-0.5, 0.5);
    },
    hooks: {
        #[inline(always)]
        fn measured_speed(&self, omega_m: T, _filter: &[T]) -> T {
            omega_m * (T::one() + self.gain)
        }

        #[inline(always)]
        fn speed_behind(&self, shown: [T; 3]) -> [T; 3] {
            shown.map(|w| w / (T::one() + self.gain))
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for SpeedSensorScale<f64> {
    fn frame(&self, on: &super::Rated) -> super::Frame {
        let caption = "Speed shown less true speed, over the true speed.";
        super::Frame::new("speed, rad/s", "shown minus true, rad/s", (0.0, 1.1 * on.speed_rad_s), caption)
    }

    fn law(&self, _on: &super::Rated, x: f64) -> f64 {
        self.gain * x
    }
}

#[cfg(test)]
mod tests {
    use super::super::trying::*;
    use crate::EffectId::{RotorHeating, SpeedSensorLag, SpeedSensorScale};

    #[test]
    fn the_speed_is_scaled_and_the_currents_are_right() {
        let m = with(SpeedSensorScale);
        let gain = m.effects().speed_sensor_scale.gain;
        for speed in [0.95 * SYNCHRONOUS, -40.0] {
            let (shown, base) = (running(&m, RATED_V, speed), running(&machine(|_| ()), RATED_V, speed));
            for (a, b) in shown.iter().zip(&base) {
                assert!(a.i_s == b.i_s && (a.omega_m - (1.0 + gain) * b.omega_m).abs() < 1e-12 * speed.abs());
            }
        }
    }

    #[test]
    fn differs_from_speed_sensor_lag() {
        let error = |id| running(&with(id), RATED_V, SYNCHRONOUS)[0].omega_m - SYNCHRONOUS;
        assert!(error(SpeedSensorScale) > 0.5 && error(SpeedSensorLag).abs() < 1e-9);
    }

    #[test]
    fn differs_from_rotor_heating() {
        // No load, no slip, no rotor loss.
        let error = |id| running(&with(id), RATED_V, SYNCHRONOUS)[0].omega_m - SYNCHRONOUS;
        assert!(error(SpeedSensorScale) > 0.5 && error(RotorHeating).abs() < 1e-9);
    }
}
