//! Speed sensor over the shaft angle: learned from recordings, then written as its nearest formula.
//!
//! f(x) = −4.88·10⁻¹⁹ cos x + 0.02 sin x
//!
//! Written by `im learn --rust`. Rename it, say in the card what it is, and give it to the loop: docs/background/extending.md.

#![allow(dead_code, unused_imports, unused_variables)]

use im_model::effects::{About, BaseState, Card, Effect, Hooks, Operating, ParameterInfo, Place, Role, ScaleOf, StateInfo, StateKind, SteadyState};
use im_model::space_vector::{dot, from_phases, j, norm2, to_phases};
use im_model::{Bound, Complex, Currents, Powers, Scalar, TParameters, register_effect};

/// A speed sensor whose gain changes over the turn: an encoder disc off centre, a bent coupling.
#[derive(Clone, Copy)]
struct OwnSpeedSensorOverShaftAngle<T> {
    a: T,
    b: T,
    order: T,
}

impl<T: Scalar> Default for OwnSpeedSensorOverShaftAngle<T> {
    fn default() -> Self {
        Self {
            a: T::from_f64(0.0),
            b: T::from_f64(0.0),
            order: T::from_f64(1.0),
        }
    }
}

impl<T: Scalar> OwnSpeedSensorOverShaftAngle<T> {
    fn formula(&self, x: T) -> T {
        let Self { a, b, order, .. } = *self;
        let one = T::one();
        a * cos(x) + b * sin(x)
    }
}

impl<T: Scalar> Effect<T> for OwnSpeedSensorOverShaftAngle<T> {
    const NAME: &'static str = "own_speed_sensor_over_shaft_angle";
    const ABOUT: About = About { steady_state: SteadyState::Ripples, fixed_to_shaft: true, ..About::at(Place::Sensors) };
    const PARAMETERS: &'static [ParameterInfo] = &[
        ParameterInfo { key: "a", unit: "", meaning: "Of f(x); learned: -4.882495228601957e-19.", role: Role::Strength, scale: ScaleOf::One, default: 0.0, typical: (1.0000000000000002e-10, 3.0000000000000004e-9), bound: Bound::Within(-1e9, 1e9) },
        ParameterInfo { key: "b", unit: "", meaning: "Of f(x); learned: 0.019999999999999993.", role: Role::Strength, scale: ScaleOf::One, default: 0.0, typical: (0.0019999999999999996, 0.059999999999999984), bound: Bound::Within(-1e9, 1e9) },
        ParameterInfo { key: "order", unit: "", meaning: "Of f(x); learned: 1.0.", role: Role::Fixed, scale: ScaleOf::One, default: 1.0, typical: (0.1, 3.0), bound: Bound::Within(-1e9, 1e9) },
    ];
    const CARD: Card = Card {
        title: "Speed sensor over the shaft angle",
        what: "A speed sensor whose gain changes over the turn: an encoder disc off centre, a bent coupling. f(x) = −4.88·10⁻¹⁹ cos x + 0.02 sin x.",
        shows: "What the recordings left that no effect of the library explains; the curve is all that is known of it.",
        rivals: &[],
        test: "Whatever moves the variable over its range while others rest.",
        place: "speed shown too much, part of it",
        source: "learned from recordings",
    };

    fn get(&self, index: usize) -> T {
        [self.a, self.b, self.order][index]
    }
    fn set(&mut self, index: usize, value: T) {
        match index {
            0 => self.a = value,
            1 => self.b = value,
            2 => self.order = value,
            _ => {}
        }
    }
}

impl<T: Scalar> Hooks<T> for OwnSpeedSensorOverShaftAngle<T> {
    fn shown_speed(&self, omega_m: T, theta_m: T) -> T {
        let _ = theta_m;
        omega_m + omega_m * self.formula(self.order * theta_m)
    }

}

register_effect!(pub OwnSpeedSensorOverShaftAngleEffect: OwnSpeedSensorOverShaftAngle);

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
