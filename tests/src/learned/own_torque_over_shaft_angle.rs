//! Torque over the shaft angle: learned from recordings, then written as its nearest formula.
//!
//! f(x) = 2 cos x − 1.46·10⁻¹⁷ sin x
//!
//! Written by `im learn --rust`. Rename it, say in the card what it is, and give it to the loop: docs/background/extending.md.

#![allow(dead_code, unused_imports, unused_variables)]

use im_model::effects::{About, BaseState, Card, Effect, Hooks, Operating, ParameterInfo, Place, Role, ScaleOf, StateInfo, StateKind, SteadyState};
use im_model::space_vector::{dot, from_phases, j, norm2, to_phases};
use im_model::{Bound, Complex, Currents, Powers, Scalar, TParameters, register_effect};

/// A torque that repeats with the turn of the shaft: slots, poles, a crank, a gear, an unbalance.
#[derive(Clone, Copy)]
struct OwnTorqueOverShaftAngle<T> {
    a: T,
    b: T,
    order: T,
}

impl<T: Scalar> Default for OwnTorqueOverShaftAngle<T> {
    fn default() -> Self {
        Self {
            a: T::from_f64(0.0),
            b: T::from_f64(0.0),
            order: T::from_f64(3.0),
        }
    }
}

impl<T: Scalar> OwnTorqueOverShaftAngle<T> {
    fn formula(&self, x: T) -> T {
        let Self { a, b, order, .. } = *self;
        let one = T::one();
        a * cos(x) + b * sin(x)
    }
}

impl<T: Scalar> Effect<T> for OwnTorqueOverShaftAngle<T> {
    const NAME: &'static str = "own_torque_over_shaft_angle";
    const ABOUT: About = About { steady_state: SteadyState::Ripples, fixed_to_shaft: true, ..About::at(Place::Mechanics) };
    const PARAMETERS: &'static [ParameterInfo] = &[
        ParameterInfo { key: "a", unit: "Nm", meaning: "Of f(x); learned: 2.0.", role: Role::Strength, scale: ScaleOf::One, default: 0.0, typical: (0.2, 6.0), bound: Bound::Within(-1e9, 1e9) },
        ParameterInfo { key: "b", unit: "Nm", meaning: "Of f(x); learned: -1.4623695025512265e-17.", role: Role::Strength, scale: ScaleOf::One, default: 0.0, typical: (1.0000000000000002e-10, 3.0000000000000004e-9), bound: Bound::Within(-1e9, 1e9) },
        ParameterInfo { key: "order", unit: "", meaning: "Of f(x); learned: 3.0.", role: Role::Fixed, scale: ScaleOf::One, default: 3.0, typical: (0.30000000000000004, 9.0), bound: Bound::Within(-1e9, 1e9) },
    ];
    const CARD: Card = Card {
        title: "Torque over the shaft angle",
        what: "A torque that repeats with the turn of the shaft: slots, poles, a crank, a gear, an unbalance. f(x) = 2 cos x − 1.46·10⁻¹⁷ sin x.",
        shows: "What the recordings left that no effect of the library explains; the curve is all that is known of it.",
        rivals: &[],
        test: "Whatever moves the variable over its range while others rest.",
        place: "torque against rotation, Nm",
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

impl<T: Scalar> Hooks<T> for OwnTorqueOverShaftAngle<T> {
    fn braking_torque(&self, torque: T, at: &Operating<T>, own: &[T]) -> T {
        let _ = own;
        let x = self.order * at.state.theta_m();
        torque + self.formula(x)
    }

}

register_effect!(pub OwnTorqueOverShaftAngleEffect: OwnTorqueOverShaftAngle);

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
