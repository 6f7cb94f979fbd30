//! Magnetizing current over flux: learned from recordings, then written as its nearest formula.
//!
//! f(x) = 0.3 x|x|
//!
//! Written by `im learn --rust`. Rename it, say in the card what it is, and give it to the loop: docs/background/extending.md.

#![allow(dead_code, unused_imports, unused_variables)]

use im_model::effects::{About, BaseState, Card, Effect, Hooks, Operating, ParameterInfo, Place, Role, ScaleOf, StateInfo, StateKind, SteadyState};
use im_model::space_vector::{dot, from_phases, j, norm2, to_phases};
use im_model::{Bound, Complex, Currents, Powers, Scalar, TParameters, register_effect};

/// A magnetizing current that grows otherwise than the flux: saturation.
#[derive(Clone, Copy)]
struct OwnMagnetizingCurrentOverFlux<T> {
    a: T,
}

impl<T: Scalar> Default for OwnMagnetizingCurrentOverFlux<T> {
    fn default() -> Self {
        Self {
            a: T::from_f64(0.0),
        }
    }
}

impl<T: Scalar> OwnMagnetizingCurrentOverFlux<T> {
    fn formula(&self, x: T) -> T {
        let Self { a, .. } = *self;
        let one = T::one();
        a * x * x.abs()
    }
}

impl<T: Scalar> Effect<T> for OwnMagnetizingCurrentOverFlux<T> {
    const NAME: &'static str = "own_magnetizing_current_over_flux";
    const ABOUT: About = About { steady_state: SteadyState::Shows, fixed_to_shaft: false, ..About::at(Place::FluxMap) };
    const PARAMETERS: &'static [ParameterInfo] = &[
        ParameterInfo { key: "a", unit: "", meaning: "Of f(x); learned: 0.3000000000000017.", role: Role::Strength, scale: ScaleOf::One, default: 0.0, typical: (0.030000000000000172, 0.9000000000000051), bound: Bound::Within(-1e9, 1e9) },
    ];
    const CARD: Card = Card {
        title: "Magnetizing current over flux",
        what: "A magnetizing current that grows otherwise than the flux: saturation. f(x) = 0.3 x|x|.",
        shows: "What the recordings left that no effect of the library explains; the curve is all that is known of it.",
        rivals: &[],
        test: "Whatever moves the variable over its range while others rest.",
        place: "magnetizing current added, part of it",
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

impl<T: Scalar> Hooks<T> for OwnMagnetizingCurrentOverFlux<T> {
    fn added_currents(&self, c: Currents<T>, x: BaseState<T>, p: &TParameters<T>, n_p: f64) -> Currents<T> {
        let _ = (p, n_p);
        c.drawn_at_gap(c.psi_m * (self.formula(length(c.psi_m)) / p.magnetizing_inductance_h), p)
    }

}

register_effect!(pub OwnMagnetizingCurrentOverFluxEffect: OwnMagnetizingCurrentOverFlux);

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
