//! Current-sensor gain: i_shown = (1 + g) i + (g_α + j g_β) ī.
//!
//! Three phase sensors with gains 1 + g_a, 1 + g_b, 1 + g_c give g = (g_a+g_b+g_c)/3 and the unbalance g_α + j g_β =
//! (g_a + a g_b + a² g_c)/3: the image of the current in the negative sequence.

use num_complex::Complex;

use super::effect;
use crate::error::Bound;

effect! {
    /// Gain errors of the phase-current sensors.
    CurrentSensorGain, "current_sensor_gain",
    card: super::Card {
        title: "Current-sensor gain",
        what: "The phase-current sensors have gain errors: a common one scales the current, unequal ones add its mirror image (negative sequence).",
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
    },
    hooks: {
        #[inline(always)]
        fn measured_current(&self, i: Complex<T>) -> Complex<T> {
            if self.common.is_zero() && self.unbalance_alpha.is_zero() && self.unbalance_beta.is_zero() {
                return i;
            }
            i * (T::one() + self.common) + Complex::new(self.unbalance_alpha, self.unbalance_beta) * i.conj()
        }
    }
}
