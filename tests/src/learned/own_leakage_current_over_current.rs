//! Leakage over current: learned from recordings, then written as its nearest formula.
//!
//! f(x) = 0.01 x
//!
//! Written by `im learn --rust`. Rename it, say in the card what it is, and give it to the loop: docs/background/extending.md.

#![allow(dead_code, unused_imports, unused_variables)]

use im_model::effects::{About, BaseState, Card, Effect, Hooks, Operating, ParameterInfo, Place, Role, ScaleOf, StateInfo, StateKind, SteadyState};
use im_model::space_vector::{dot, from_phases, j, norm2, to_phases};
use im_model::{Bound, Complex, Currents, Powers, Scalar, TParameters, register_effect};

/// A leakage that changes with current: tooth tips, slot bridges.
#[derive(Clone, Copy)]
struct OwnLeakageCurrentOverCurrent<T> {
    a: T,
}

impl<T: Scalar> Default for OwnLeakageCurrentOverCurrent<T> {
    fn default() -> Self {
        Self {
            a: T::from_f64(0.0),
        }
    }
}

impl<T: Scalar> OwnLeakageCurrentOverCurrent<T> {
    fn formula(&self, x: T) -> T {
        let Self { a, .. } = *self;
        let one = T::one();
        a * x
    }
}

impl<T: Scalar> Effect<T> for OwnLeakageCurrentOverCurrent<T> {
    const NAME: &'static str = "own_leakage_current_over_current";
    const ABOUT: About = About { steady_state: SteadyState::Shows, fixed_to_shaft: false, ..About::at(Place::FluxMap) };
    const PARAMETERS: &'static [ParameterInfo] = &[
        ParameterInfo { key: "a", unit: "", meaning: "Of f(x); learned: 0.010000000000000068.", role: Role::Strength, scale: ScaleOf::One, default: 0.0, typical: (0.0010000000000000067, 0.030000000000000204), bound: Bound::Within(-1e9, 1e9) },
    ];
    const CARD: Card = Card {
        title: "Leakage over current",
        what: "A leakage that changes with current: tooth tips, slot bridges. f(x) = 0.01 x.",
        shows: "What the recordings left that no effect of the library explains; the curve is all that is known of it.",
        rivals: &[],
        test: "Whatever moves the variable over its range while others rest.",
        place: "leakage current added, part of it",
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

impl<T: Scalar> Hooks<T> for OwnLeakageCurrentOverCurrent<T> {
    fn added_currents(&self, c: Currents<T>, x: BaseState<T>, p: &TParameters<T>, n_p: f64) -> Currents<T> {
        let _ = (p, n_p);
        let through = (x.psi_s() - x.psi_r()) * (self.formula(length(c.i_s)) / (p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h));
        Currents { i_s: c.i_s + through, i_r: c.i_r - through, ..c }
    }

}

register_effect!(pub OwnLeakageCurrentOverCurrentEffect: OwnLeakageCurrentOverCurrent);

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
