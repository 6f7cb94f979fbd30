//! An effect of a user's own, for showing that it takes part in the loop: a tachometer whose scale is wrong.

use im_model::effects::{Card, Effect, Hooks, ParameterInfo, Role, ScaleOf};
use im_model::{Bound, Scalar, register_effect};

/// ω_shown = (1 + g) ω.
#[derive(Clone, Copy)]
struct TachometerScale<T> {
    gain: T,
}

impl<T: Scalar> Default for TachometerScale<T> {
    fn default() -> Self {
        Self { gain: T::zero() }
    }
}

impl<T: Scalar> Effect<T> for TachometerScale<T> {
    const NAME: &'static str = "tachometer_scale";
    const PARAMETERS: &'static [ParameterInfo] = &[ParameterInfo {
        key: "gain",
        unit: "",
        meaning: "Fraction by which the speed shown is too high.",
        role: Role::Strength,
        scale: ScaleOf::One,
        default: 0.0,
        typical: (0.002, 0.05),
        bound: Bound::Within(-0.5, 0.5),
    }];
    const CARD: Card = Card {
        title: "Tachometer scale",
        what: "The speed shown is a constant multiple of the true one: ω_shown = (1 + g) ω.",
        shows: "A speed error in proportion to the speed; the currents are right.",
        rivals: &[("speed_sensor_lag", "only while the speed changes")],
        test: "Run without load at several frequencies: the slip is next to nothing.",
        place: "speed sensor",
        source: "linear sensor model",
    };

    fn get(&self, _: usize) -> T {
        self.gain
    }
    fn set(&mut self, _: usize, value: T) {
        self.gain = value;
    }
}

impl<T: Scalar> Hooks<T> for TachometerScale<T> {
    fn measured_speed(&self, omega_m: T, _filter: &[T]) -> T {
        omega_m * (T::one() + self.gain)
    }
}

register_effect!(pub TachometerScaleEffect: TachometerScale);
