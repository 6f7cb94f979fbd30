//! Load-torque ripple: a torque fixed to the angle of the load's shaft, of order n and its second harmonic.
//!
//! τ = c₁ cos nθ + s₁ sin nθ + c₂ cos 2nθ + s₂ sin 2nθ

use super::{About, Card, Place, SteadyState, effect};
use crate::error::Bound;

effect! {
    /// A load torque periodic in the shaft angle: unbalance, misalignment, crank drives.
    LoadTorqueRipple, "load_torque_ripple",
    about: About { steady_state: SteadyState::Ripples, fixed_to_shaft: true, ..About::at(Place::Mechanics) },
    card: Card {
        title: "Load-torque ripple",
        what: "The load adds a torque fixed to the shaft angle, n times per revolution (once: unbalance; twice: misalignment) and at twice that: c₁ cos nθ + s₁ sin nθ + c₂ cos 2nθ + s₂ sin 2nθ.",
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
        /// Cosine amplitude of the second harmonic.
        second_cosine_nm: Strength, default 0.0, "Nm", Torque, typical 0.01 to 0.3, Bound::Within(-1e6, 1e6);
        /// Sine amplitude of the second harmonic.
        second_sine_nm: Strength, default 0.0, "Nm", Torque, typical 0.01 to 0.3, Bound::Within(-1e6, 1e6);
        /// Order of the fundamental: ripples per revolution.
        order: Order, default 1.0, "", One, typical 1.0 to 3.0, Bound::Within(0.05, 100.0);
    },
    hooks: {
        #[inline(always)]
        fn load_torque(&self, torque: T, load_angle: T) -> T {
            let (s, c) = (self.order * load_angle).sin_cos();
            let (s2, c2) = (T::from_f64(2.0) * s * c, c * c - s * s);
            torque + self.cosine_nm * c + self.sine_nm * s + self.second_cosine_nm * c2 + self.second_sine_nm * s2
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for LoadTorqueRipple<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        super::Frame::new("shaft angle, °", "load torque added, Nm", (0.0, 360.0), "Torque that the load adds over one turn.")
    }

    fn law(&self, _on: &super::Rated, x: f64) -> f64 {
        let (sin, cos) = (self.order * x.to_radians()).sin_cos();
        self.cosine_nm * cos + self.sine_nm * sin
    }
}
