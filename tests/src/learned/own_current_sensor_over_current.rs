//! Current sensor over current: learned from recordings, then written as its nearest formula.
//!
//! f(x) = −0.003 x
//!
//! Written by `im learn --rust`. Rename it, say in the card what it is, and give it to the loop: docs/background/extending.md.

#![allow(dead_code, unused_imports, unused_variables)]

use im_model::effects::{About, BaseState, Card, Effect, Hooks, Operating, ParameterInfo, Place, Role, ScaleOf, StateInfo, StateKind, SteadyState};
use im_model::space_vector::{dot, from_phases, j, norm2, to_phases};
use im_model::{Bound, Complex, Currents, Powers, Scalar, TParameters, register_effect};

/// A current sensor whose gain depends on current: a core that saturates.
#[derive(Clone, Copy)]
struct OwnCurrentSensorOverCurrent<T> {
    a: T,
}

impl<T: Scalar> Default for OwnCurrentSensorOverCurrent<T> {
    fn default() -> Self {
        Self {
            a: T::from_f64(0.0),
        }
    }
}

impl<T: Scalar> OwnCurrentSensorOverCurrent<T> {
    fn formula(&self, x: T) -> T {
        let Self { a, .. } = *self;
        let one = T::one();
        a * x
    }
}

impl<T: Scalar> Effect<T> for OwnCurrentSensorOverCurrent<T> {
    const NAME: &'static str = "own_current_sensor_over_current";
    const ABOUT: About = About { steady_state: SteadyState::Shows, fixed_to_shaft: false, ..About::at(Place::Sensors) };
    const PARAMETERS: &'static [ParameterInfo] = &[
        ParameterInfo { key: "a", unit: "", meaning: "Of f(x); learned: -0.0029999999999999936.", role: Role::Strength, scale: ScaleOf::One, default: 0.0, typical: (0.0002999999999999994, 0.00899999999999998), bound: Bound::Within(-1e9, 1e9) },
    ];
    const CARD: Card = Card {
        title: "Current sensor over current",
        what: "A current sensor whose gain depends on current: a core that saturates. f(x) = −0.003 x.",
        shows: "What the recordings left that no effect of the library explains; the curve is all that is known of it.",
        rivals: &[],
        test: "Whatever moves the variable over its range while others rest.",
        place: "current shown too much, part of it",
        source: "learned from recordings",
    };

    fn get(&self, index: usize) -> T {
        [self.a][index]
    }
    fn set(&mut self, index: usize, value: T) {
        match index {
            0 => self.a = value,
            _ => {}
        }
    }
}

impl<T: Scalar> Hooks<T> for OwnCurrentSensorOverCurrent<T> {
    fn measured_current(&self, i: Complex<T>) -> Complex<T> {
        from_phases(to_phases(i).map(|i| i + i * self.formula(i.abs())))
    }

}

register_effect!(pub OwnCurrentSensorOverCurrentEffect: OwnCurrentSensorOverCurrent);

fn length<T: Scalar>(v: Complex<T>) -> T {
    (norm2(v) + T::from_f64(1e-12)).sqrt()
}
fn sense<T: Scalar>(omega: T) -> T {
    let turning = omega.scale(1.0 / 3.0);
    turning / (turning * turning + T::one()).sqrt()
}
fn cos<T: Scalar>(x: T) -> T {
    x.sin_cos().1
}
fn sin<T: Scalar>(x: T) -> T {
    x.sin_cos().0
}
fn tanh<T: Scalar>(x: T) -> T {
    let e = (-(x.abs() + x.abs())).exp();
    let t = (T::one() - e) / (T::one() + e);
    if x.value() < 0.0 { -t } else { t }
}
fn langevin<T: Scalar>(x: T) -> T {
    if x.value().abs() < 1e-3 { x.scale(1.0 / 3.0) } else { T::one() / tanh(x) - T::one() / x }
}
fn positive<T: Scalar>(x: T) -> T {
    if x.value() > 0.0 { x } else { T::zero() }
}
