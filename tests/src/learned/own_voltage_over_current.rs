//! Voltage over current: learned from recordings, then written as its nearest formula.
//!
//! f(x) = −0.001 x
//!
//! Written by `im learn --rust`. Rename it, say in the card what it is, and give it to the loop: docs/background/extending.md.

#![allow(dead_code, unused_imports, unused_variables)]

use im_model::effects::{About, BaseState, Card, Effect, Hooks, Operating, ParameterInfo, Place, Role, ScaleOf, StateInfo, StateKind, SteadyState};
use im_model::space_vector::{dot, from_phases, j, norm2, to_phases};
use im_model::{Bound, Complex, Currents, Powers, Scalar, TParameters, register_effect};

/// A voltage error that depends on current: the DC link or the supply sags.
#[derive(Clone, Copy)]
struct OwnVoltageOverCurrent<T> {
    a: T,
}

impl<T: Scalar> Default for OwnVoltageOverCurrent<T> {
    fn default() -> Self {
        Self {
            a: T::from_f64(0.0),
        }
    }
}

impl<T: Scalar> OwnVoltageOverCurrent<T> {
    fn formula(&self, x: T) -> T {
        let Self { a, .. } = *self;
        let one = T::one();
        a * x
    }
}

impl<T: Scalar> Effect<T> for OwnVoltageOverCurrent<T> {
    const NAME: &'static str = "own_voltage_over_current";
    const ABOUT: About = About { steady_state: SteadyState::Shows, fixed_to_shaft: false, ..About::at(Place::Voltage) };
    const PARAMETERS: &'static [ParameterInfo] = &[
        ParameterInfo { key: "a", unit: "", meaning: "Of f(x); learned: -0.0009999999999999976.", role: Role::Strength, scale: ScaleOf::One, default: 0.0, typical: (9.999999999999977e-5, 0.002999999999999993), bound: Bound::Within(-1e9, 1e9) },
    ];
    const CARD: Card = Card {
        title: "Voltage over current",
        what: "A voltage error that depends on current: the DC link or the supply sags. f(x) = −0.001 x.",
        shows: "What the recordings left that no effect of the library explains; the curve is all that is known of it.",
        rivals: &[],
        test: "Whatever moves the variable over its range while others rest.",
        place: "voltage added, part of it",
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

impl<T: Scalar> Hooks<T> for OwnVoltageOverCurrent<T> {
    fn stator_drop(&self, drop: Complex<T>, at: &Operating<T>, own: &[T]) -> Complex<T> {
        let _ = own;
        let x = length(at.currents.i_s);
        drop - at.input.u_s * self.formula(x)
    }

}

register_effect!(pub OwnVoltageOverCurrentEffect: OwnVoltageOverCurrent);

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
