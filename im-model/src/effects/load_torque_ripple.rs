//! Load-torque ripple: a torque fixed to the shaft angle. τ = c_1 cos nθ + s_1 sin nθ.

use super::effect;
use crate::error::Bound;

effect! {
    /// A load torque periodic in the shaft angle: unbalance, misalignment, crank drives.
    LoadTorqueRipple, "load_torque_ripple",
    card: super::Card {
        title: "Load-torque ripple",
        what: "The load adds a torque c cos(nθ) + s sin(nθ), fixed to the shaft angle: n = 1 for unbalance, 2 for misalignment.",
        shows: "A speed and current ripple at n times the rotational frequency, whatever the slip and the flux; largest in speed at low speed.",
        rivals: &[
            ("rotor_asymmetry", "follows twice the slip frequency and needs load"),
            ("shaft_compliance", "rings at a fixed frequency after steps; ripple follows speed"),
        ],
        test: "Slow, steady rotation at two speeds.",
        place: "torque balance, by shaft angle",
        source: "Fourier component of an angle-dependent load",
    },
    parameters: {
        /// Cosine amplitude.
        cosine_nm: Strength, default 0.0, "Nm", Torque, typical 0.01 to 0.3, Bound::Within(-1e6, 1e6);
        /// Sine amplitude.
        sine_nm: Strength, default 0.0, "Nm", Torque, typical 0.01 to 0.3, Bound::Within(-1e6, 1e6);
        /// Order: ripples per revolution.
        order: Fixed, default 1.0, "", One, typical 1.0 to 2.0, Bound::Within(0.1, 6.0);
    },
    hooks: {
        #[inline(always)]
        fn braking_torque(&self, torque: T, at: &super::Operating<T>) -> T {
            if self.cosine_nm.is_zero() && self.sine_nm.is_zero() {
                return torque;
            }
            let (s, c) = (self.order * at.theta_m).sin_cos();
            torque + self.cosine_nm * c + self.sine_nm * s
        }
    }
}
