//! Torque over speed: learned from recordings, then written as its nearest formula.
//!
//! f(x) = 2 2(x/40.2)/(1 + (x/40.2)²)
//!
//! Written by `im learn --rust`. Rename it, say in the card what it is, and give it to the loop: docs/background/extending.md.

#![allow(dead_code, unused_imports, unused_variables)]

use im_model::effects::{About, BaseState, Card, Effect, Hooks, Operating, ParameterInfo, Place, Role, ScaleOf, StateInfo, StateKind, SteadyState};
use im_model::space_vector::{dot, from_phases, j, norm2, to_phases};
use im_model::{Bound, Complex, Currents, Powers, Scalar, TParameters, register_effect};

/// A torque that depends on speed: friction, a fan, a load of another form.
#[derive(Clone, Copy)]
struct OwnTorqueOverSpeed<T> {
    a: T,
    s: T,
}

impl<T: Scalar> Default for OwnTorqueOverSpeed<T> {
    fn default() -> Self {
        Self {
            a: T::from_f64(0.0),
            s: T::from_f64(40.200550121202554),
        }
    }
}

impl<T: Scalar> OwnTorqueOverSpeed<T> {
    fn formula(&self, x: T) -> T {
        let Self { a, s, .. } = *self;
        let one = T::one();
        a * (x / s + x / s) / (one + x / s * x / s)
    }
}

impl<T: Scalar> Effect<T> for OwnTorqueOverSpeed<T> {
    const NAME: &'static str = "own_torque_over_speed";
    const ABOUT: About = About { steady_state: SteadyState::Shows, fixed_to_shaft: false, ..About::at(Place::Mechanics) };
    const PARAMETERS: &'static [ParameterInfo] = &[
        ParameterInfo { key: "a", unit: "Nm", meaning: "Of f(x); learned: 2.001607562884593.", role: Role::Strength, scale: ScaleOf::One, default: 0.0, typical: (0.2001607562884593, 6.004822688653779), bound: Bound::Within(-1e9, 1e9) },
        ParameterInfo { key: "s", unit: "", meaning: "Of f(x); learned: 40.200550121202554.", role: Role::Shape, scale: ScaleOf::One, default: 40.200550121202554, typical: (4.020055012120255, 120.60165036360766), bound: Bound::Within(-1e9, 1e9) },
    ];
    const CARD: Card = Card {
        title: "Torque over speed",
        what: "A torque that depends on speed: friction, a fan, a load of another form. f(x) = 2 2(x/40.2)/(1 + (x/40.2)²).",
        shows: "What the recordings left that no effect of the library explains; the curve is all that is known of it.",
        rivals: &[],
        test: "Whatever moves the variable over its range while others rest.",
        place: "torque against rotation, Nm",
        source: "learned from recordings",
    };

    fn get(&self, index: usize) -> T {
        [self.a, self.s][index]
    }
    fn set(&mut self, index: usize, value: T) {
        match index {
            0 => self.a = value,
            1 => self.s = value,
            _ => {}
        }
    }
}

impl<T: Scalar> Hooks<T> for OwnTorqueOverSpeed<T> {
    fn braking_torque(&self, torque: T, at: &Operating<T>, own: &[T]) -> T {
        let _ = own;
        let x = at.state.omega_m();
        torque + self.formula(x)
    }

}

register_effect!(pub OwnTorqueOverSpeedEffect: OwnTorqueOverSpeed);

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
