//! Current-sensor gain: i_shown = (1 + g + j q) i + (g_α + j g_β) ī.
//!
//! Three phase sensors with gains 1 + g_a, 1 + g_b, 1 + g_c give g = (g_a+g_b+g_c)/3, q = 0 and the unbalance g_α + j g_β =
//! (g_a + a² g_b + a g_c)/3: the image of the current in the negative sequence.
//!
//! Most drives have two sensors and take the third current for −i₁ − i₂. Gains 1 + g₁, 1 + g₂ of the two phases after the computed one then
//! give g = (g₁+g₂)/2, the unbalance d(g₁−g₂)/√3 with d = e^{j270°}, e^{j150°}, e^{j30°} for phase a, b or c computed, and, because its
//! error falls on the third phase, too, a turn of q = (g₁−g₂)/(2√3).

use num_complex::Complex;

use super::{About, Card, Place, SteadyState, effect};
use crate::Scalar;
use crate::error::Bound;

effect! {
    /// Gain errors of the phase-current sensors.
    CurrentSensorGain, "current_sensor_gain",
    about: About { steady_state: SteadyState::Hides, ..About::at(Place::Sensors) },
    card: Card {
        title: "Current-sensor gain",
        what: "The phase-current sensors have gain errors: a common one scales the current, unequal ones add its mirror image (negative sequence), and turn it a little where the third phase is computed from two.",
        shows: "Unbalance: the error turns backwards at supply frequency, in proportion to current (second harmonic in the rotating frame). Common gain: torque and current disagree by one factor.",
        rivals: &[
            ("stator_asymmetry", "unbalances the real current, less at high speed; a sensor gain unbalances what is shown, the same at every speed"),
            ("current_sensor_offset", "constant, whatever the current; turns at once, not twice, the supply frequency in the rotating frame"),
            ("voltage_gain", "scales the voltage; torque stays in proportion to the currents"),
        ],
        test: "Load steps at two speeds; exchange of two sensors.",
        place: "current sensors",
        source: "linear sensor model; symmetrical components",
    },
    parameters: {
        /// Common gain error.
        common: Strength, default 0.0, "", One, typical 0.005 to 0.1, Bound::Within(-0.9, 9.0);
        /// Unbalance, α part.
        unbalance_alpha: Strength, default 0.0, "", One, typical 0.003 to 0.06, Bound::Within(-0.9, 0.9);
        /// Unbalance, β part.
        unbalance_beta: Strength, default 0.0, "", One, typical 0.003 to 0.06, Bound::Within(-0.9, 0.9);
        /// Phase without a sensor, computed from the other two: 1, 2 or 3; 0 where all three have one.
        computed_phase: Order, default 0.0, "", One, typical 0.0 to 3.0, Bound::Whole(0, 3);
    },
    hooks: {
        #[inline(always)]
        fn measured_current(&self, i: Complex<T>) -> Complex<T> {
            i * Complex::new(T::one() + self.common, self.turn()) + Complex::new(self.unbalance_alpha, self.unbalance_beta) * i.conj()
        }
    }
}

impl<T: Scalar> CurrentSensorGain<T> {
    /// q: half of what of the unbalance lies along d.
    #[inline(always)]
    fn turn(&self) -> T {
        let along = |d: [f64; 2]| (self.unbalance_alpha.scale(d[0]) + self.unbalance_beta.scale(d[1])).scale(0.5);
        match self.computed_phase.value() {
            p if p < 0.5 => T::zero(),
            p if p < 1.5 => along([0.0, -1.0]),
            p if p < 2.5 => along([-0.5 * SQRT_3, 0.5]),
            _ => along([0.5 * SQRT_3, 0.5]),
        }
    }
}

const SQRT_3: f64 = 1.732_050_807_568_877_2;

#[cfg(feature = "std")]
impl super::Drawn for CurrentSensorGain<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "direction of the current, °",
            "shown minus true, %",
            (0.0, 360.0),
            "Error of the magnitude shown over the direction of the current.",
        )
    }

    fn law(&self, _on: &super::Rated, x: f64) -> f64 {
        let image = Complex::from_polar(1.0, -2.0 * x.to_radians()) * Complex::new(self.unbalance_alpha, self.unbalance_beta);
        100.0 * ((image + 1.0 + self.common).norm() - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Hooks;

    /// What two sensors show, phase by phase, and the effect with the gains of its card.
    #[test]
    fn two_sensors_show_what_their_phases_do() {
        let a = Complex::from_polar(1.0, core::f64::consts::TAU / 3.0);
        let direction = |degrees: f64| Complex::from_polar(1.0, degrees.to_radians());
        let (first, second) = (0.04, -0.025);
        for (computed, d) in [(0, direction(270.0)), (1, direction(150.0)), (2, direction(30.0))] {
            let unbalance = d * (first - second) / SQRT_3;
            let effect = CurrentSensorGain {
                common: 0.5 * (first + second),
                unbalance_alpha: unbalance.re,
                unbalance_beta: unbalance.im,
                computed_phase: f64::from(computed + 1),
            };
            for i in [Complex::new(3.0, 1.0), Complex::new(-1.0, 2.5)] {
                let phase = |k: i32| (i * a.powi(-k)).re;
                let shown = [(1.0 + first) * phase(computed + 1), (1.0 + second) * phase(computed + 2)];
                let vector = (a.powi(computed + 1) * shown[0] + a.powi(computed + 2) * shown[1]
                    - a.powi(computed) * (shown[0] + shown[1]))
                    * (2.0 / 3.0);
                assert!((effect.measured_current(i) - vector).norm() < 1e-12, "phase {computed}: {vector}");
            }
        }
    }
}
