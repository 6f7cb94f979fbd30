//! The current model: the plain flux observer that the others are measured against. It needs the speed.
//!
//! ```text
//! λ̂' = (−η + jn_pω)λ̂ + ηL_m i
//! ```
//!
//! A copy of the rotor equation: errors decay at η = 1/T_r whatever the speed, the machine's own rate; R_s and voltage do not enter. The
//! current residual shown is the error of the stator equation's prediction over one sample.

use im_model::{Complex, Machine, Rating, Scalar};
use num_traits::Zero;

use crate::basis::{Basis, Watch};
use crate::interface::{Estimate, Input, Observer, ObserverStatus};
use crate::named::{Gains, Named};
use crate::tustin::{step1, warped};

/// The observer; nothing to tune, no step limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentModel<T> {
    basis: Basis<T>,
}

/// λ̂ and the speed before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentModelState<T> {
    lambda: Complex<T>,
    omega_m: T,
    watch: Watch<T>,
}

impl<T: Scalar> Default for CurrentModelState<T> {
    fn default() -> Self {
        Self { lambda: Complex::zero(), omega_m: T::zero(), watch: Watch::default() }
    }
}

impl<T: Scalar> CurrentModel<T> {
    /// The current model of a machine.
    pub fn new(basis: Basis<T>) -> Self {
        Self { basis }
    }
}

impl<T: Scalar> Observer<T> for CurrentModel<T> {
    type State = CurrentModelState<T>;

    fn state_at(&self, rotor_flux_vs: Complex<T>, i_s: Complex<T>, omega_m: T) -> CurrentModelState<T> {
        CurrentModelState { lambda: rotor_flux_vs, omega_m, watch: Watch::from_current(i_s) }
    }

    #[inline]
    fn step(&self, s: &mut CurrentModelState<T>, input: &Input<T>) -> Estimate<T> {
        let b = &self.basis;
        let mut sample = b.admit(&s.watch, input, s.watch.i_s);
        let c = b.electrical(s.lambda, sample.i_mean);
        let h = b.sample_time_s;
        // A NaN fails the comparison; without a speed the last one is kept, and the estimate says so.
        let shown = input.omega_m.filter(|w| w.abs() <= b.limits.speed_max_rad_s);
        let before = s.omega_m;
        s.omega_m = shown.unwrap_or(before);
        sample.note(shown.is_none(), ObserverStatus::LIMITED);
        let mean = (before + s.omega_m) * T::from_f64(0.5);
        let a = Complex::new(-c.eta, b.n_p * mean);
        let lambda_before = s.lambda;
        s.lambda = step1(a, s.lambda, sample.i_mean.scale(c.eta_l_m), warped(h, b.n_p * mean));
        let middle = (lambda_before + s.lambda).scale(T::from_f64(0.5));
        let drive = sample.u_s.scale(c.inverse_sigma_l_s) - a * middle.scale(c.beta);
        let mut predicted = step1(Complex::new(-c.gamma(), T::zero()), sample.i_before, drive, h);
        let (estimate, finite) = b.conclude(&mut s.watch, &sample, &c, &mut s.lambda, &mut predicted, &mut s.omega_m);
        if !finite {
            *s = CurrentModelState::default();
        }
        estimate
    }
}

impl<T: Scalar> Named<T> for CurrentModel<T> {
    const NAME: &'static str = "current-model";
    const TITLE: &'static str = "current model";
    const NEEDS_SPEED: bool = true;
    const TABLES: &'static [&'static str] = &[];

    fn made<G: Gains>(basis: Basis<T>, _: &Machine<f64>, _: &Rating, _: &G) -> Result<Self, G::Error> {
        Ok(Self::new(basis))
    }
}
