//! The state of the machine, and what the effects add to it.

use num_complex::Complex;
use num_traits::Zero;

use crate::effects::{Active, BaseState, EffectId, Extra, StateKind};
use crate::scalar::Scalar;

/// A load torque of known form whose sizes are unknown: τ_c + c ω|ω|. It rides along with the state, as what a run does not change and
/// a fit finds for each run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadLaw<T> {
    /// τ_c: the same at every speed, Nm.
    pub constant_nm: T,
    /// c: of a fan or a pump, Nm s²/rad².
    pub fan_nm_s2: T,
}

impl<T: Scalar> LoadLaw<T> {
    /// As where the load is measured.
    #[inline(always)]
    fn is_zero(&self) -> bool {
        self.constant_nm.is_zero() && self.fan_nm_s2.is_zero()
    }

    /// A torque τ, Nm, with that of the law at a speed of the load, rad/s.
    #[inline(always)]
    pub fn beside(&self, tau: T, omega: T) -> T {
        if self.is_zero() { tau } else { tau + self.constant_nm + self.fan_nm_s2 * omega * omega.abs() }
    }
}

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
    /// Load torque by its law, beside what the input says.
    pub load: LoadLaw<T>,
    /// States of the effects.
    pub extra: Extra<T>,
}

impl<T: Scalar> Default for State<T> {
    fn default() -> Self {
        let (z, o) = (Complex::zero(), T::zero());
        Self {
            psi_s: z,
            psi_r: z,
            omega_m: o,
            theta_m: o,
            load: LoadLaw { constant_nm: o, fan_nm_s2: o },
            extra: Extra::default(),
        }
    }
}

impl<T: Scalar> State<T> {
    /// Turning at a speed, rad/s, every mass; unmagnetized.
    pub fn turning(omega_m: T) -> Self {
        let mut x = Self::default();
        x.change_speed(|w| *w = omega_m);
        x
    }

    /// self = from + h·rates on the parts in use; the other parts stay as they are. In place, part by part: states with
    /// derivatives are too large to be copied in passing.
    #[inline(always)]
    pub(crate) fn set_advanced(&mut self, from: &Self, rates: &Self, h: f64, on: Active) {
        let real = |x: &mut T, from: T, r: T| *x = from + r.scale(h);
        let complex = |x: &mut Complex<T>, from: Complex<T>, r: Complex<T>| {
            x.re = from.re + r.re.scale(h);
            x.im = from.im + r.im.scale(h);
        };
        complex(&mut self.psi_s, from.psi_s, rates.psi_s);
        complex(&mut self.psi_r, from.psi_r, rates.psi_r);
        real(&mut self.omega_m, from.omega_m, rates.omega_m);
        real(&mut self.theta_m, from.theta_m, rates.theta_m);
        self.extra.set_advanced(&from.extra, &rates.extra, h, on);
    }

    /// self += h·rates on the parts in use.
    #[inline(always)]
    pub(crate) fn accumulate(&mut self, rates: &Self, h: f64, on: Active) {
        let real = |x: &mut T, r: T| *x += r.scale(h);
        let complex = |x: &mut Complex<T>, r: Complex<T>| {
            x.re += r.re.scale(h);
            x.im += r.im.scale(h);
        };
        complex(&mut self.psi_s, rates.psi_s);
        complex(&mut self.psi_r, rates.psi_r);
        real(&mut self.omega_m, rates.omega_m);
        real(&mut self.theta_m, rates.theta_m);
        self.extra.accumulate(&rates.extra, h, on);
    }

    /// Whether every part is finite.
    pub fn is_finite(&self) -> bool {
        let vectors = [self.psi_s, self.psi_r];
        vectors.iter().all(|z| z.re.is_finite() && z.im.is_finite())
            && [self.omega_m, self.theta_m, self.load.constant_nm, self.load.fan_nm_s2]
                .iter()
                .chain(self.extra.values())
                .all(|x| x.is_finite())
    }

    /// The state seen from a frame at electrical angle `theta`: space vectors turned by −theta.
    pub fn in_frame(&self, theta: T) -> Self {
        let turn = crate::space_vector::unit(-theta);
        let mut seen = Self { psi_s: self.psi_s * turn, psi_r: self.psi_r * turn, ..*self };
        seen.extra.each_vector(&self.extra, |v, _| v * turn);
        seen
    }
}

impl<T> State<T> {
    /// What effects see of it.
    #[inline(always)]
    pub(crate) fn base(&self) -> BaseState<'_, T> {
        BaseState { fluxes: [&self.psi_s, &self.psi_r], motion: [&self.omega_m, &self.theta_m] }
    }

    /// Changes the speed of every mass in the same way.
    pub fn change_speed(&mut self, change: impl Fn(&mut T)) {
        change(&mut self.omega_m);
        self.extra.each_mut(|_, kind, state| {
            if kind == StateKind::Speed {
                state.iter_mut().for_each(&change);
            }
        });
    }

    /// The same state in other numbers.
    pub fn map<U>(&self, f: impl Fn(&T) -> U + Copy) -> State<U> {
        let vector = |z: &Complex<T>| Complex::new(f(&z.re), f(&z.im));
        State {
            psi_s: vector(&self.psi_s),
            psi_r: vector(&self.psi_r),
            omega_m: f(&self.omega_m),
            theta_m: f(&self.theta_m),
            load: LoadLaw { constant_nm: f(&self.load.constant_nm), fan_nm_s2: f(&self.load.fan_nm_s2) },
            extra: self.extra.map(f),
        }
    }
}

impl<T: Scalar> Extra<T> {
    /// Changes every space vector; the function is given the vector that stands in its place in `beside`, too.
    pub(crate) fn each_vector(&mut self, beside: &Self, f: impl Fn(Complex<T>, Complex<T>) -> Complex<T>) {
        for &id in EffectId::ALL {
            let mut from = 0;
            for info in id.states() {
                let range = from..from + info.width();
                from = range.end;
                if let ([re, im], [re_2, im_2]) = (&mut self.of_mut(id)[range.clone()], &beside.of(id)[range]) {
                    let v = f(Complex::new(*re, *im), Complex::new(*re_2, *im_2));
                    (*re, *im) = (v.re, v.im);
                }
            }
        }
    }
}
