//! Stator resistance over time: learned from recordings, then written as its nearest formula.
//!
//! f(x) = 0.401 exp(−x/0.0413)
//!
//! Written by `im learn --rust`. Rename it, say in the card what it is, and give it to the loop: docs/background/extending.md.

#![allow(dead_code, unused_imports, unused_variables)]

use im_model::effects::{About, BaseState, Card, Effect, Hooks, Operating, ParameterInfo, Place, Role, ScaleOf, StateInfo, StateKind, SteadyState};
use im_model::space_vector::{dot, from_phases, j, norm2, to_phases};
use im_model::{Bound, Complex, Currents, Powers, Scalar, TParameters, register_effect};

/// A stator resistance that changes with time: heat, a contact.
#[derive(Clone, Copy)]
struct OwnStatorResistanceOverTime<T> {
    a: T,
    s: T,
}

impl<T: Scalar> Default for OwnStatorResistanceOverTime<T> {
    fn default() -> Self {
        Self {
            a: T::from_f64(0.0),
            s: T::from_f64(0.04125854057718405),
        }
    }
}

impl<T: Scalar> OwnStatorResistanceOverTime<T> {
    fn formula(&self, x: T) -> T {
        let Self { a, s, .. } = *self;
        let one = T::one();
        a * (-x / s).exp()
    }
}

impl<T: Scalar> Effect<T> for OwnStatorResistanceOverTime<T> {
    const NAME: &'static str = "own_stator_resistance_over_time";
    const ABOUT: About = About { steady_state: SteadyState::Hides, fixed_to_shaft: false, ..About::at(Place::Windings) };
    const PARAMETERS: &'static [ParameterInfo] = &[
        ParameterInfo { key: "a", unit: "", meaning: "Of f(x); learned: 0.40142144489260423.", role: Role::Strength, scale: ScaleOf::One, default: 0.0, typical: (0.04014214448926043, 1.2042643346778128), bound: Bound::Within(-1e9, 1e9) },
        ParameterInfo { key: "s", unit: "", meaning: "Of f(x); learned: 0.04125854057718405.", role: Role::Shape, scale: ScaleOf::One, default: 0.04125854057718405, typical: (0.004125854057718405, 0.12377562173155214), bound: Bound::Within(-1e9, 1e9) },
    ];
    const CARD: Card = Card {
        title: "Stator resistance over time",
        what: "A stator resistance that changes with time: heat, a contact. f(x) = 0.401 exp(−x/0.0413).",
        shows: "What the recordings left that no effect of the library explains; the curve is all that is known of it.",
        rivals: &[],
        test: "Whatever moves the variable over its range while others rest.",
        place: "stator resistance added, part of it",
        source: "learned from recordings",
    };
    const STATES: &'static [StateInfo] = &[StateInfo { name: "time_s", kind: StateKind::Drifts }];

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

impl<T: Scalar> Hooks<T> for OwnStatorResistanceOverTime<T> {
    fn stator_drop(&self, drop: Complex<T>, at: &Operating<T>, own: &[T]) -> Complex<T> {
        let _ = own;
        let x = own[0];
        drop + at.currents.i_s * (at.r_s * self.formula(x))
    }

    fn rates(&self, rates: &mut [T], _at: &Operating<T>, _powers: &Powers<T>, _own: &[T]) {
        rates[0] = T::one();
    }
}

register_effect!(pub OwnStatorResistanceOverTimeEffect: OwnStatorResistanceOverTime);

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
