//! The state of the machine, and which parts of it a set of effects uses.

use num_complex::Complex;
use num_traits::Zero;

use crate::effects::{EffectId, Effects, MAX_CUSTOM};
use crate::scalar::Scalar;

/// Fluxes, speed, angle, and what the effects add. Everything in the stator frame, SI. `default` is standstill, cold, unmagnetized.
///
/// The same type holds rates of change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<T> {
    /// Stator flux linkage, Vs.
    pub psi_s: Complex<T>,
    /// Rotor flux linkage, Vs.
    pub psi_r: Complex<T>,
    /// Mechanical speed of the rotor, rad/s.
    pub omega_m: T,
    /// Mechanical angle of the rotor, rad.
    pub theta_m: T,
    /// Flux diffused into the laminations, Vs ([`IronLoss`](crate::effects::IronLoss)).
    pub psi_fe: Complex<T>,
    /// Rotor current diffused into the bars, A ([`RotorSkinEffect`](crate::effects::RotorSkinEffect)).
    pub i_bar: Complex<T>,
    /// Speed of the load, rad/s ([`ShaftCompliance`](crate::effects::ShaftCompliance)).
    pub omega_load: T,
    /// Twist of the shaft, rad.
    pub twist: T,
    /// Temperature rise of the stator winding, K ([`StatorHeating`](crate::effects::StatorHeating)).
    pub stator_rise_k: T,
    /// Temperature rise of the rotor cage, K ([`RotorHeating`](crate::effects::RotorHeating)).
    pub rotor_rise_k: T,
    /// Own states of the user's effects.
    pub own: [[T; 2]; MAX_CUSTOM],
}

impl<T: Scalar> Default for State<T> {
    fn default() -> Self {
        let z = Complex::zero();
        let o = T::zero();
        Self {
            psi_s: z,
            psi_r: z,
            omega_m: o,
            theta_m: o,
            psi_fe: z,
            i_bar: z,
            omega_load: o,
            twist: o,
            stator_rise_k: o,
            rotor_rise_k: o,
            own: [[o; 2]; MAX_CUSTOM],
        }
    }
}

/// Which optional parts of the state are integrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) struct Parts {
    pub iron: bool,
    pub skin: bool,
    pub shaft: bool,
    pub thermal: bool,
    pub own: bool,
}

impl Parts {
    pub fn of<T: Scalar>(effects: &Effects<T>) -> Self {
        let on = |id| effects.is_on(id);
        Self {
            iron: on(EffectId::IronLoss),
            skin: on(EffectId::RotorSkinEffect),
            shaft: on(EffectId::ShaftCompliance),
            thermal: on(EffectId::StatorHeating) || on(EffectId::RotorHeating),
            own: effects.custom.iter().flatten().any(|c| !c.is_off()),
        }
    }
}

impl<T: Scalar> State<T> {
    /// self = from + h·rates on the parts in use; the other parts stay as they are. In place, part by part: states with
    /// derivatives are too large to be copied in passing.
    #[inline(always)]
    pub(crate) fn set_advanced(&mut self, from: &Self, rates: &Self, h: f64, parts: Parts) {
        let real = |x: &mut T, from: T, r: T| *x = from + r.scale(h);
        let complex = |x: &mut Complex<T>, from: Complex<T>, r: Complex<T>| {
            x.re = from.re + r.re.scale(h);
            x.im = from.im + r.im.scale(h);
        };
        complex(&mut self.psi_s, from.psi_s, rates.psi_s);
        complex(&mut self.psi_r, from.psi_r, rates.psi_r);
        real(&mut self.omega_m, from.omega_m, rates.omega_m);
        real(&mut self.theta_m, from.theta_m, rates.theta_m);
        if parts.iron {
            complex(&mut self.psi_fe, from.psi_fe, rates.psi_fe);
        }
        if parts.skin {
            complex(&mut self.i_bar, from.i_bar, rates.i_bar);
        }
        if parts.shaft {
            real(&mut self.omega_load, from.omega_load, rates.omega_load);
            real(&mut self.twist, from.twist, rates.twist);
        }
        if parts.thermal {
            real(&mut self.stator_rise_k, from.stator_rise_k, rates.stator_rise_k);
            real(&mut self.rotor_rise_k, from.rotor_rise_k, rates.rotor_rise_k);
        }
        if parts.own {
            for c in 0..MAX_CUSTOM {
                for k in 0..2 {
                    self.own[c][k] = from.own[c][k] + rates.own[c][k].scale(h);
                }
            }
        }
    }

    /// self += h·rates on the parts in use.
    #[inline(always)]
    pub(crate) fn accumulate(&mut self, rates: &Self, h: f64, parts: Parts) {
        let real = |x: &mut T, r: T| *x += r.scale(h);
        let complex = |x: &mut Complex<T>, r: Complex<T>| {
            x.re += r.re.scale(h);
            x.im += r.im.scale(h);
        };
        complex(&mut self.psi_s, rates.psi_s);
        complex(&mut self.psi_r, rates.psi_r);
        real(&mut self.omega_m, rates.omega_m);
        real(&mut self.theta_m, rates.theta_m);
        if parts.iron {
            complex(&mut self.psi_fe, rates.psi_fe);
        }
        if parts.skin {
            complex(&mut self.i_bar, rates.i_bar);
        }
        if parts.shaft {
            real(&mut self.omega_load, rates.omega_load);
            real(&mut self.twist, rates.twist);
        }
        if parts.thermal {
            real(&mut self.stator_rise_k, rates.stator_rise_k);
            real(&mut self.rotor_rise_k, rates.rotor_rise_k);
        }
        if parts.own {
            for (x, r) in self.own.iter_mut().flatten().zip(rates.own.iter().flatten()) {
                *x += r.scale(h);
            }
        }
    }

    /// Whether every part is finite.
    pub fn is_finite(&self) -> bool {
        [self.psi_s, self.psi_r, self.psi_fe, self.i_bar].iter().all(|z| z.re.is_finite() && z.im.is_finite())
            && [self.omega_m, self.theta_m, self.omega_load, self.twist, self.stator_rise_k, self.rotor_rise_k]
                .iter()
                .chain(self.own.iter().flatten())
                .all(|x| x.is_finite())
    }

    /// The state seen from a frame at electrical angle `theta`: complex parts turned by −theta.
    pub fn in_frame(&self, theta: T) -> Self {
        let turn = crate::space_vector::unit(-theta);
        Self { psi_s: self.psi_s * turn, psi_r: self.psi_r * turn, psi_fe: self.psi_fe * turn, i_bar: self.i_bar * turn, ..*self }
    }
}
