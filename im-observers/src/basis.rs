//! What every observer is built on: the machine as its constants, the sampling time, limits, and what is known of inverter and iron.

use im_model::effects::{Hooks, InverterNonlinearity};
use im_model::space_vector::{cross, norm2};
use im_model::{Bound, Complex, Machine, Rating, Scalar};
use num_traits::Zero;

use crate::error::ObserverError;
use crate::interface::{Estimate, Input, ObserverStatus};
use crate::saturation::{Electrical, Saturation};

/// What is plausible. Beyond it inputs are refused, states are held, and the estimate is not valid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits<T> {
    /// Largest phase voltage the inverter can make, V peak.
    pub voltage_max_v: T,
    /// Largest stator current the sensors can show, A peak.
    pub current_max_a: T,
    /// Largest rotor flux linkage, Vs.
    pub flux_max_vs: T,
    /// Rotor flux linkage below which it does not show the speed, Vs.
    pub flux_min_vs: T,
    /// Largest mechanical speed, rad/s.
    pub speed_max_rad_s: T,
    /// Largest current residual of a valid estimate, A.
    pub residual_max_a: T,
    /// Time without fault after which an estimate is valid, s.
    pub settling_s: T,
}

impl Limits<f64> {
    /// From the rating: 1.5 times the voltage, 2.5 times the current of a locked rotor, 2 times the flux and the speed; flux from a
    /// tenth of the rated on, residual up to a tenth of the locked-rotor current, settled after 50 ms.
    pub fn of(machine: &Machine<f64>, rating: &Rating) -> Self {
        let c = machine.parameters().windings().derived(machine.pole_pairs());
        let omega_e = 2.0 * core::f64::consts::PI * rating.electrical_frequency_hz;
        let locked = rating.phase_voltage_peak_v / (omega_e * c.sigma_l_s);
        Self {
            voltage_max_v: 1.5 * rating.phase_voltage_peak_v,
            current_max_a: 2.5 * locked,
            flux_max_vs: 2.0 * rating.rotor_flux_vs,
            flux_min_vs: 0.1 * rating.rotor_flux_vs,
            speed_max_rad_s: 2.0 * omega_e / c.n_p,
            residual_max_a: 0.1 * locked,
            settling_s: 0.05,
        }
    }

    fn validate(&self) -> Result<(), ObserverError> {
        Bound::Positive.check("voltage_max_v", self.voltage_max_v)?;
        Bound::Positive.check("current_max_a", self.current_max_a)?;
        Bound::Positive.check("flux_max_vs", self.flux_max_vs)?;
        Bound::Positive.check("flux_min_vs", self.flux_min_vs)?;
        Bound::Within(0.0, self.flux_max_vs).check("flux_min_vs (below flux_max_vs)", self.flux_min_vs)?;
        Bound::Positive.check("speed_max_rad_s", self.speed_max_rad_s)?;
        Bound::Positive.check("residual_max_a", self.residual_max_a)?;
        Ok(Bound::NotNegative.check("settling_s", self.settling_s)?)
    }
}

/// How an observer's equations are taken through a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Discretization {
    /// Forward Euler: the equations as published, at the sampling time. Only with gains slow enough for it; construction checks.
    ForwardEuler,
    /// The trapezoidal rule, warped at the rotor's frequency, for what is linear; implicit where something switches: stable at every step.
    #[default]
    Implicit,
}

/// The machine as the observers see it, checked once. Made in f64, kept in the firmware's number type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basis<T> {
    pub(crate) nominal: Electrical<T>,
    pub(crate) n_p: T,
    pub(crate) inverse_inertia: T,
    pub(crate) friction_rate: T,
    pub(crate) sample_time_s: T,
    pub(crate) limits: Limits<T>,
    pub(crate) squares: Squares<T>,
    settle_samples: u32,
    saturation: Option<Saturation<T>>,
    inverter: Option<InverterNonlinearity<T>>,
}

impl<T: Scalar> Basis<T> {
    /// The base machine at a sampling time, with [`Limits::of`] its rating. Effects of the machine are left out until asked for.
    ///
    /// # Errors
    /// A sampling time outside 1 µs to 10 ms, or a rating that is not positive and finite.
    pub fn try_new(machine: &Machine<f64>, rating: &Rating, sample_time_s: f64) -> Result<Self, ObserverError> {
        Bound::Within(1e-6, 1e-2).check("sample_time_s", sample_time_s)?;
        rating.validate()?;
        let p = machine.parameters();
        let f = T::from_f64;
        let limits = Limits::of(machine, rating);
        let basis = Self {
            nominal: Electrical::new(p, machine.pole_pairs()),
            n_p: f(f64::from(machine.pole_pairs())),
            inverse_inertia: f(1.0 / p.inertia_kg_m2),
            friction_rate: f(p.viscous_friction_nm_s_per_rad / p.inertia_kg_m2),
            sample_time_s: f(sample_time_s),
            limits: limits.cast(),
            squares: Squares::of(&limits),
            settle_samples: 0,
            saturation: None,
            inverter: None,
        };
        basis.with_limits(limits)
    }

    /// With other limits.
    ///
    /// # Errors
    /// A limit that is not positive and finite.
    pub fn with_limits(mut self, limits: Limits<f64>) -> Result<Self, ObserverError> {
        limits.validate()?;
        self.limits = limits.cast();
        self.squares = Squares::of(&limits);
        self.settle_samples = (limits.settling_s / self.sample_time_s.value()) as u32;
        Ok(self)
    }

    /// With constants that follow the machine's `main_flux_saturation`; nothing changes where that is off.
    #[must_use]
    pub fn with_saturation(mut self, machine: &Machine<f64>) -> Self {
        let law = &machine.effects().main_flux_saturation;
        self.saturation = (law.excess > 0.0).then(|| Saturation::new(machine.parameters(), machine.pole_pairs(), law));
        self
    }

    /// With the voltage that dead time and devices take, subtracted from the command by the sign of the measured phase currents.
    ///
    /// # Errors
    /// A voltage that is negative or a current that is not positive.
    pub fn with_inverter(mut self, inverter: InverterNonlinearity<f64>) -> Result<Self, ObserverError> {
        Bound::NotNegative.check("voltage_v", inverter.voltage_v)?;
        Bound::Positive.check("zero_crossing_current_a", inverter.zero_crossing_current_a)?;
        let f = T::from_f64;
        self.inverter = (inverter.voltage_v > 0.0).then_some(InverterNonlinearity {
            voltage_v: f(inverter.voltage_v),
            zero_crossing_current_a: f(inverter.zero_crossing_current_a),
            ripple_a_per_v: f(inverter.ripple_a_per_v),
            dc_voltage_v: f(inverter.dc_voltage_v),
        });
        Ok(self)
    }

    /// Sampling time, s.
    pub fn sample_time_s(&self) -> T {
        self.sample_time_s
    }

    /// The limits.
    pub fn limits(&self) -> &Limits<T> {
        &self.limits
    }

    /// The constants of this sample.
    #[inline(always)]
    pub(crate) fn electrical(&self, lambda: Complex<T>, i_s: Complex<T>) -> Electrical<T> {
        match &self.saturation {
            None => self.nominal,
            Some(s) => s.at(lambda, i_s),
        }
    }

    /// Looks at an input: what is unusable is replaced by what is best known, and named.
    #[inline(always)]
    pub(crate) fn admit(&self, watch: &Watch<T>, input: &Input<T>, i_hat: Complex<T>) -> Sample<T> {
        let (mut i_s, mut i_before, mut u_s) = (input.i_s, watch.i_s, input.u_s);
        let (mut measured, mut status) = (true, ObserverStatus::VALID);
        // A NaN fails the comparisons, too.
        if !(norm2(i_s) <= self.squares.current && norm2(u_s) <= self.squares.voltage) {
            measured = norm2(i_s) <= self.squares.current;
            if !measured {
                (i_s, i_before) = (i_hat, i_hat);
                status = ObserverStatus::CURRENT_LOST;
            }
            let reason;
            (u_s, reason) = self.usable(u_s, watch.u_s);
            status = status.and(reason);
        }
        let i_mean = (i_before + i_s).scale(T::from_f64(0.5));
        let u_machine = match &self.inverter {
            None => u_s,
            Some(inverter) => inverter.applied_voltage(u_s, i_mean),
        };
        Sample { u_s: u_machine, u_commanded: u_s, i_s, i_before, i_mean, measured, status }
    }

    /// A voltage beyond its limit, cut; one that is not finite, replaced by the one before.
    #[cold]
    fn usable(&self, u_s: Complex<T>, before: Complex<T>) -> (Complex<T>, ObserverStatus) {
        let square = norm2(u_s);
        if !square.is_finite() {
            (before, ObserverStatus::VOLTAGE_LOST)
        } else if square > self.squares.voltage {
            (shortened(u_s, self.limits.voltage_max_v), ObserverStatus::VOLTAGE_LIMITED)
        } else {
            (u_s, ObserverStatus::VALID)
        }
    }

    /// Holds states within their limits and makes the estimate. `false` when a state is not finite: the caller starts again.
    #[inline(always)]
    pub(crate) fn conclude(
        &self,
        watch: &mut Watch<T>,
        sample: &Sample<T>,
        constants: &Electrical<T>,
        lambda: &mut Complex<T>,
        i_hat: &mut Complex<T>,
        omega_m: &mut T,
    ) -> (Estimate<T>, bool) {
        let mut status = sample.status;
        let squares = &self.squares;
        let within =
            (norm2(*lambda) <= squares.flux) & (norm2(*i_hat) <= squares.current) & (omega_m.abs() < self.limits.speed_max_rad_s);
        if !within {
            let restrained = self.restrained(*lambda, *i_hat, *omega_m);
            (*lambda, *i_hat, *omega_m) = restrained.0;
            status = status.and(restrained.1);
            if status.contains(ObserverStatus::RESTARTED) {
                *watch = Watch::default();
                let zero = Complex::zero();
                let status = status.and(ObserverStatus::SETTLING);
                return (
                    Estimate { rotor_flux_vs: zero, omega_m: T::zero(), torque_nm: T::zero(), residual_a: zero, status },
                    false,
                );
            }
        }
        status.add_if(norm2(*lambda) < squares.flux_min, ObserverStatus::FLUX_LOW);
        // A current that was lost is what the observer predicts.
        let i_s = if sample.measured { sample.i_s } else { *i_hat };
        let residual_a = i_s - *i_hat;
        status.add_if(norm2(residual_a) > squares.residual, ObserverStatus::RESIDUAL);
        if status.is_fault() {
            watch.good_samples = 0;
        } else if watch.good_samples < self.settle_samples {
            watch.good_samples += 1;
        }
        status.add_if(watch.good_samples < self.settle_samples, ObserverStatus::SETTLING);
        (watch.i_s, watch.u_s) = (i_s, sample.u_commanded);
        let torque_nm = constants.torque * cross(*lambda, i_s);
        (Estimate { rotor_flux_vs: *lambda, omega_m: *omega_m, torque_nm, residual_a, status }, true)
    }

    /// A speed within the limits.
    #[inline(always)]
    pub(crate) fn within_speeds(&self, omega_m: T) -> T {
        let top = self.limits.speed_max_rad_s;
        if omega_m.abs() > top { if omega_m > T::zero() { top } else { -top } } else { omega_m }
    }

    /// λ̂, î and ω̂, cut where they are beyond their limits; or the demand for a new start where something is not finite.
    #[cold]
    fn restrained(&self, lambda: Complex<T>, i_hat: Complex<T>, omega_m: T) -> ((Complex<T>, Complex<T>, T), ObserverStatus) {
        if !(norm2(lambda) + norm2(i_hat) + omega_m).is_finite() {
            return ((lambda, i_hat, omega_m), ObserverStatus::RESTARTED);
        }
        let lambda = shortened(lambda, self.limits.flux_max_vs);
        let i_hat = shortened(i_hat, self.limits.current_max_a);
        ((lambda, i_hat, self.within_speeds(omega_m)), ObserverStatus::LIMITED)
    }
}

/// Cuts a vector to a length.
#[cold]
fn shortened<T: Scalar>(z: Complex<T>, longest: T) -> Complex<T> {
    let size = norm2(z).sqrt();
    if size > longest { z.scale(longest / size) } else { z }
}

impl Limits<f64> {
    fn cast<U: Scalar>(&self) -> Limits<U> {
        let f = U::from_f64;
        Limits {
            voltage_max_v: f(self.voltage_max_v),
            current_max_a: f(self.current_max_a),
            flux_max_vs: f(self.flux_max_vs),
            flux_min_vs: f(self.flux_min_vs),
            speed_max_rad_s: f(self.speed_max_rad_s),
            residual_max_a: f(self.residual_max_a),
            settling_s: f(self.settling_s),
        }
    }
}

/// The limits that are compared with squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Squares<T> {
    voltage: T,
    current: T,
    flux: T,
    pub flux_min: T,
    residual: T,
}

impl<T: Scalar> Squares<T> {
    fn of(limits: &Limits<f64>) -> Self {
        let square = |x: f64| T::from_f64(x * x);
        Self {
            voltage: square(limits.voltage_max_v),
            current: square(limits.current_max_a),
            flux: square(limits.flux_max_vs),
            flux_min: square(limits.flux_min_vs),
            residual: square(limits.residual_max_a),
        }
    }
}

/// What is remembered of the sample before, in every observer's state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Watch<T> {
    pub i_s: Complex<T>,
    pub u_s: Complex<T>,
    good_samples: u32,
}

impl<T: Scalar> Default for Watch<T> {
    fn default() -> Self {
        Self::from_current(Complex::zero())
    }
}

impl<T: Scalar> Watch<T> {
    /// With the current before the first sample.
    pub fn from_current(i_s: Complex<T>) -> Self {
        Self { i_s, u_s: Complex::zero(), good_samples: 0 }
    }
}

/// An input after [`Basis::admit`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample<T> {
    /// Voltage at the machine over the sample that ended.
    pub u_s: Complex<T>,
    pub u_commanded: Complex<T>,
    /// Current now, before, and their mean.
    pub i_s: Complex<T>,
    pub i_before: Complex<T>,
    pub i_mean: Complex<T>,
    /// Whether the current is a measured one.
    pub measured: bool,
    status: ObserverStatus,
}

impl<T> Sample<T> {
    /// Whether current and voltage are both as they came.
    #[inline(always)]
    pub fn trusted(&self) -> bool {
        self.status.is_valid()
    }

    pub fn note(&mut self, condition: bool, reason: ObserverStatus) {
        self.status.add_if(condition, reason);
    }
}
