//! Stray-load torque: loss in the surfaces of the teeth, in the end regions and by cross currents between bars, which grows with the
//! square of the load current and is supplied by the shaft.
//!
//! τ = T (|i_s|/I_N)² y/(y² + y_0²)^((1−p)/2),   y = ω/ω_N,   P = τω ∝ |i_s|² |ω|^(1+p)
//!
//! The harmonic fields that cause it turn with the rotor's speed against iron and bars: hysteresis alone would give p = 0, eddy currents
//! alone p = 1; y_0 = 0.02 keeps the sign smooth.

use super::{About, Card, Operating, Place, effect};
use crate::error::Bound;
use crate::space_vector::norm2;

effect! {
    /// Braking torque of the additional load losses.
    StrayLoadTorque, "stray_load_torque",
    about: About::at(Place::Mechanics),
    card: Card {
        title: "Stray-load torque",
        what: "Additional load losses brake the shaft: T(|i_s|/I_N)²·|ω/ω_N|^p against motion.",
        shows: "Torque missing under load, with the square of the current and more at higher speed; next to nothing without load current, and nothing in the currents at a given speed.",
        rivals: &[
            ("windage", "is there without any current"),
            ("coulomb_friction", "is there without any current, at the lowest speed, too"),
            ("iron_loss", "shows in the current at the terminals, without load, too"),
        ],
        test: "Load steps at two speeds with the shaft torque measured: the torque that is missing goes with the square of the current.",
        place: "torque balance",
        source: "Modelica Standard Library, Machines.Losses.InductionMachines.StrayLoad: P ∝ i² ω^power; IEC 60034-2-1: additional load losses ∝ I²",
    },
    parameters: {
        /// Braking torque at reference current and speed.
        torque_nm: Strength, default 0.0, "Nm", Torque, typical 0.003 to 0.06, Bound::NotNegative;
        /// Exponent of the speed in the torque.
        speed_exponent: Shape, default 0.6, "", One, typical 0.3 to 1.0, Bound::Within(0.0, 2.0);
        /// Current at which the strength is measured: rated phase current, peak.
        reference_current_a: Fixed, default 1.0, "A", Current, typical 0.9 to 1.1, Bound::Positive;
        /// Speed at which the strength is measured: synchronous speed.
        reference_speed_rad_s: Fixed, default 1.0, "rad/s", Speed, typical 0.9 to 1.1, Bound::Positive;
    },
    hooks: {
        #[inline(always)]
        fn braking_torque(&self, torque: T, at: &Operating<T>, _own: &[T]) -> T {
            let y = at.state.omega_m() / self.reference_speed_rad_s;
            let with_speed = y * (y * y + T::from_f64(Y_0 * Y_0)).powf((self.speed_exponent - T::one()).scale(0.5));
            let load = norm2(at.currents.i_s) / (self.reference_current_a * self.reference_current_a);
            torque + self.torque_nm * load * with_speed
        }
    }
}

/// Speed over the reference speed within which the sign is smooth.
const Y_0: f64 = 0.02;

#[cfg(feature = "std")]
impl super::Drawn for StrayLoadTorque<f64> {
    fn frame(&self, on: &super::Rated) -> super::Frame {
        let caption = "Braking torque of the stray load at synchronous speed over the stator current.";
        super::Frame::new("stator current (peak), A", "braking torque, Nm", (0.0, 2.0 * on.current_a), caption)
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        let y = on.speed_rad_s / self.reference_speed_rad_s;
        self.torque_nm * (x / self.reference_current_a).powi(2) * y * (y * y + Y_0 * Y_0).powf(0.5 * (self.speed_exponent - 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::trying::*;
    use crate::EffectId::{self, CoulombFriction, IronLoss, StrayLoadTorque, Windage};
    use crate::{Complex, Plant, PlantInput, State};

    /// What brakes beside the machine without effects, Nm, with and without flux and current.
    fn brake(id: EffectId, flux: f64, speed: f64) -> f64 {
        let x = State { psi_s: Complex::new(flux, 0.0), ..State::turning(speed) };
        let input = PlantInput::new(Complex::new(0.0, 0.0), 0.0);
        let friction = |m| Plant::new(m).evaluate(&x, &input).powers.friction / speed;
        friction(&with(id)) - friction(&machine(|_| ()))
    }

    #[test]
    fn it_brakes_with_the_square_of_the_current_and_more_at_speed() {
        let at = |flux, speed| brake(StrayLoadTorque, flux, speed);
        assert!((at(0.4, 100.0) / at(0.2, 100.0) - 4.0).abs() < 1e-9);
        let p = with(StrayLoadTorque).effects().stray_load_torque.speed_exponent;
        assert!((at(0.4, 150.0) / at(0.4, 75.0) / 2.0f64.powf(p) - 1.0).abs() < 1e-3);
        assert!(at(0.4, -100.0) == -at(0.4, 100.0).abs() && at(0.4, 100.0) > 0.0);
    }

    #[test]
    fn differs_from_windage() {
        assert!(brake(StrayLoadTorque, 0.0, 150.0) == 0.0 && brake(Windage, 0.0, 150.0) > 0.0);
    }

    #[test]
    fn differs_from_coulomb_friction() {
        assert!(brake(StrayLoadTorque, 0.0, 5.0) == 0.0 && brake(CoulombFriction, 0.0, 5.0) > 0.0);
    }

    #[test]
    fn differs_from_iron_loss() {
        let added = |id| {
            let i = |m: &_| current(&running(m, RATED_V, SYNCHRONOUS), 50.0);
            (i(&with(id)) - i(&machine(|_| ()))).norm()
        };
        assert!(added(StrayLoadTorque) < 1e-12 && added(IronLoss) > 1e-2);
    }
}
