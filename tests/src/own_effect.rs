//! An effect of a user's own, for showing that it takes part in the loop: current sensors that saturate.

use im_model::effects::{About, Card, Effect, Hooks, ParameterInfo, Place, Role, ScaleOf};
use im_model::space_vector::{from_phases, to_phases};
use im_model::{Bound, Complex, Scalar, register_effect};

/// i_shown = i/(1 + (i/I_max)^16)^(1/16) in each phase: next to nothing below three quarters of I_max, and never more than I_max.
#[derive(Clone, Copy)]
struct SaturatedSensors<T> {
    inverse_level_per_a: T,
}

impl<T: Scalar> Default for SaturatedSensors<T> {
    fn default() -> Self {
        Self { inverse_level_per_a: T::zero() }
    }
}

impl<T: Scalar> Effect<T> for SaturatedSensors<T> {
    const NAME: &'static str = "saturated_sensors";
    const ABOUT: About = About::at(Place::Sensors);
    const PARAMETERS: &'static [ParameterInfo] = &[ParameterInfo {
        key: "inverse_level_per_a",
        unit: "1/A",
        meaning: "One over the largest current that a sensor shows.",
        role: Role::Strength,
        scale: ScaleOf::One,
        default: 0.0,
        typical: (0.01, 0.5),
        bound: Bound::NotNegative,
    }];
    const CARD: Card = Card {
        title: "Saturated current sensors",
        what: "The phase-current sensors show no more than I_max.",
        shows: "A current error at the peaks of the largest currents, and nowhere else.",
        rivals: &[("current_sensor_gain", "in proportion to the current")],
        test: "A start: the current is several times the rated one.",
        place: "current sensors",
        source: "an example",
    };

    fn get(&self, _: usize) -> T {
        self.inverse_level_per_a
    }
    fn set(&mut self, _: usize, value: T) {
        self.inverse_level_per_a = value;
    }
}

impl<T: Scalar> Hooks<T> for SaturatedSensors<T> {
    fn measured_current(&self, i: Complex<T>) -> Complex<T> {
        let shown = |i: T| {
            let x = i * self.inverse_level_per_a;
            i / (T::one() + (x * x).powf(T::from_f64(8.0))).powf(T::from_f64(1.0 / 16.0))
        };
        from_phases(to_phases(i).map(shown))
    }
}

register_effect!(pub SaturatedSensorsEffect: SaturatedSensors);
