//! Magnetizing current over the shaft angle: learned from recordings, then written as its nearest formula.
//!
//! f(x) = 0.03 cos x − 1.03·10⁻¹⁸ sin x
//!
//! Written by `im learn --rust`. Rename it, say in the card what it is, and give it to the loop: docs/background/extending.md.

#![allow(dead_code, unused_imports, unused_variables)]

use im_model::effects::{About, BaseState, Card, Effect, Hooks, Operating, ParameterInfo, Place, Role, ScaleOf, StateInfo, StateKind, SteadyState};
use im_model::space_vector::{dot, from_phases, j, norm2, to_phases};
use im_model::{Bound, Complex, Currents, Powers, Scalar, TParameters, register_effect};

/// An air gap that changes with the turn of the shaft: slots, an eccentric rotor.
#[derive(Clone, Copy)]
struct OwnMagnetizingCurrentOverShaftAngle<T> {
    a: T,
    b: T,
    order: T,
}

impl<T: Scalar> Default for OwnMagnetizingCurrentOverShaftAngle<T> {
    fn default() -> Self {
        Self {
            a: T::from_f64(0.0),
            b: T::from_f64(0.0),
            order: T::from_f64(28.0),
        }
    }
}

impl<T: Scalar> OwnMagnetizingCurrentOverShaftAngle<T> {
    fn formula(&self, x: T) -> T {
        let Self { a, b, order, .. } = *self;
        let one = T::one();
        a * cos(x) + b * sin(x)
    }
}

impl<T: Scalar> Effect<T> for OwnMagnetizingCurrentOverShaftAngle<T> {
    const NAME: &'static str = "own_magnetizing_current_over_shaft_angle";
    const ABOUT: About = About { steady_state: SteadyState::Ripples, fixed_to_shaft: true, ..About::at(Place::FluxMap) };
    const PARAMETERS: &'static [ParameterInfo] = &[
        ParameterInfo { key: "a", unit: "", meaning: "Of f(x); learned: 0.03.", role: Role::Strength, scale: ScaleOf::One, default: 0.0, typical: (0.003, 0.09), bound: Bound::Within(-1e9, 1e9) },
        ParameterInfo { key: "b", unit: "", meaning: "Of f(x); learned: -1.0270570044658509e-18.", role: Role::Strength, scale: ScaleOf::One, default: 0.0, typical: (1.0000000000000002e-10, 3.0000000000000004e-9), bound: Bound::Within(-1e9, 1e9) },
        ParameterInfo { key: "order", unit: "", meaning: "Of f(x); learned: 28.0.", role: Role::Fixed, scale: ScaleOf::One, default: 28.0, typical: (2.8000000000000003, 84.0), bound: Bound::Within(-1e9, 1e9) },
    ];
    const CARD: Card = Card {
        title: "Magnetizing current over the shaft angle",
        what: "An air gap that changes with the turn of the shaft: slots, an eccentric rotor. f(x) = 0.03 cos x − 1.03·10⁻¹⁸ sin x.",
        shows: "What the recordings left that no effect of the library explains; the curve is all that is known of it.",
        rivals: &[],
        test: "Whatever moves the variable over its range while others rest.",
        place: "magnetizing current added, part of it",
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

impl<T: Scalar> Hooks<T> for OwnMagnetizingCurrentOverShaftAngle<T> {
    fn added_currents(&self, c: Currents<T>, x: BaseState<T>, p: &TParameters<T>, n_p: f64) -> Currents<T> {
        let _ = (p, n_p);
        c.drawn_at_gap(c.psi_m * (self.formula(self.order * x.theta_m()) / p.magnetizing_inductance_h), p)
    }
    fn braking_torque(&self, torque: T, at: &Operating<T>, own: &[T]) -> T {
        let _ = own;
        let x = self.order * at.state.theta_m();
        torque + {
            let (p, h) = (at.parameters, T::from_f64(1e-4));
            let slope = self.order * (self.formula(x + h) - self.formula(x - h)) / (h + h);
            (norm2(at.currents.psi_m) / p.magnetizing_inductance_h * slope).scale(0.75)
        }
    }

}

register_effect!(pub OwnMagnetizingCurrentOverShaftAngleEffect: OwnMagnetizingCurrentOverShaftAngle);

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
