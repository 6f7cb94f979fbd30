//! Coulomb friction with Stribeck rise: a torque that opposes motion whatever the speed, a little larger near standstill.
//!
//! τ_C(ω) = T_C (1 + s e^{−(ω/ω_s)²}) ω/√(ω² + ω_0²)

use super::{About, Card, Operating, Place, effect};
use crate::error::Bound;

effect! {
    /// Dry friction of bearings, seals, gears and brushes.
    CoulombFriction, "coulomb_friction",
    about: About::at(Place::Mechanics),
    card: Card {
        title: "Coulomb friction (with Stribeck rise)",
        what: "A torque T_C against motion, independent of speed, rising by the Stribeck fraction towards standstill.",
        shows: "Speed error whose sign follows the sign of speed: late break-away, too slow reversal, coasting down in a straight line.",
        rivals: &[
            ("windage", "grows with the square of speed; dry friction is the same at low speed"),
            ("iron_loss", "depends on flux and shows in the current; friction only in torque"),
        ],
        test: "Slow reversals through standstill, and coasting down without voltage.",
        place: "torque balance",
        source: "Stribeck model with smooth sign; H. Olsson et al., Friction models and friction compensation, 1998",
    },
    parameters: {
        /// Dry friction torque.
        torque_nm: Strength, default 0.0, "Nm", Torque, typical 0.005 to 0.15, Bound::NotNegative;
        /// Rise at standstill as a fraction of the torque.
        stribeck_rise: Shape, default 0.2, "", One, typical 0.0 to 1.0, Bound::Within(0.0, 5.0);
        /// Speed over which the rise dies away.
        stribeck_speed_rad_s: Fixed, default 0.03, "rad/s", Speed, typical 0.005 to 0.1, Bound::Positive;
        /// Speed below which the sign is smooth.
        smoothing_speed_rad_s: Fixed, default 0.003, "rad/s", Speed, typical 0.0005 to 0.01, Bound::Positive;
    },
    hooks: {
        #[inline(always)]
        fn braking_torque(&self, torque: T, at: &Operating<T>, _own: &[T]) -> T {
            let w2 = at.state.omega_m() * at.state.omega_m();
            let sign = at.state.omega_m() / (w2 + self.smoothing_speed_rad_s * self.smoothing_speed_rad_s).sqrt();
            let rise = self.stribeck_rise * (-w2 / (self.stribeck_speed_rad_s * self.stribeck_speed_rad_s)).exp();
            torque + self.torque_nm * (T::one() + rise) * sign
        }

        fn fastest_rate(&self, rotor_inertia: f64) -> f64 {
            let slope = self.torque_nm.value() * (1.0 + self.stribeck_rise.value()) / self.smoothing_speed_rad_s.value();
            slope * (1.0 / rotor_inertia)
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for CoulombFriction<f64> {
    fn frame(&self, on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "speed, rad/s",
            "friction torque, Nm",
            (-0.4 * on.speed_rad_s, 0.4 * on.speed_rad_s),
            "Friction over speed. Dashed: the viscous part alone.",
        )
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        let sign = x / x.hypot(self.smoothing_speed_rad_s);
        let rise = self.stribeck_rise * (-(x / self.stribeck_speed_rad_s).powi(2)).exp();
        on.parameters.viscous_friction_nm_s_per_rad * x + self.torque_nm * (1.0 + rise) * sign
    }
}
