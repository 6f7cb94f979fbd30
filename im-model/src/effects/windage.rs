//! Windage: fan and air friction, τ = c ω|ω|.

use super::{About, Card, Operating, Place, effect};
use crate::error::Bound;

effect! {
    /// Torque of the fan and of the air, quadratic in speed.
    Windage, "windage",
    about: About::at(Place::Mechanics),
    card: Card {
        title: "Windage",
        what: "Fan and air take a torque c ω|ω| against motion.",
        shows: "Speed error that grows with the square of speed, at any flux; power missing with the cube of speed.",
        rivals: &[
            ("coulomb_friction", "the same at every speed; windage vanishes at low speed"),
            ("iron_loss", "needs flux and shows in the current; windage does not change when flux is stepped at constant speed"),
        ],
        test: "Coasting down from full speed, or no-load speed steps up to the highest speed.",
        place: "torque balance",
        source: "aerodynamic drag of a rotating body, cubic power law",
    },
    parameters: {
        /// Torque over squared speed.
        coefficient_nm_s2: Strength, default 0.0, "Nm s²/rad²", TorquePerSpeedSquared, typical 0.005 to 0.3, Bound::Within(0.0, 1e3);
    },
    hooks: {
        #[inline(always)]
        fn braking_torque(&self, torque: T, at: &Operating<T>, _own: &[T]) -> T {
            torque + self.coefficient_nm_s2 * at.state.omega_m() * at.state.omega_m().abs()
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for Windage<f64> {
    fn frame(&self, on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "speed, rad/s",
            "friction torque, Nm",
            (0.0, 1.1 * on.speed_rad_s),
            "Friction over speed. Dashed: the viscous part alone.",
        )
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        on.parameters.viscous_friction_nm_s_per_rad * x + self.coefficient_nm_s2 * x * x.abs()
    }
}
