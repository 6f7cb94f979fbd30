//! What a controller computes with: a sample that no machine can have shown is left out, a reference that is no number is not followed.
//!
//! The bounds keep arithmetic in `f32` within its range. What is plausible for one drive is for [`Drive`](crate::Drive) to know.

use im_model::simulation::{Command, Measured, Reference};
use im_model::space_vector::norm2;
use im_model::{Bound, Complex, ModelError, Scalar};

use crate::status::DriveStatus;
use crate::vector::is_finite;

/// Gains, rates and limits: beyond, arithmetic in `f32` has no room.
pub(crate) const SIZE: Bound = Bound::OfMachines(Bound::SMALLEST, Bound::LARGEST);
/// Those that may be none.
pub(crate) const SIZE_OR_ZERO: Bound = Bound::Within(0.0, 1e12);
/// Those of either sign.
const NUMBER: Bound = Bound::Within(-1e12, 1e12);
/// Sampling times of drives, s.
const SAMPLE_TIMES_S: [f64; 2] = [1e-7, 0.1];
/// Mechanical speeds beyond any machine's, rad/s, and voltages, V.
const SPEED_RAD_S: f64 = 1e5;
const VOLTAGE_V: f64 = 1e6;
/// Times the largest current of the machine.
const CURRENT: f64 = 100.0;

/// Checks a sampling time, or another period of a drive, by its name.
///
/// # Errors
/// It is outside the bounds.
pub(crate) fn check_sample_time<T: Scalar>(quantity: &'static str, t: T) -> Result<(), ModelError> {
    let [shortest, longest] = SAMPLE_TIMES_S;
    Bound::OfMachines(shortest, longest).check(quantity, t.value())
}

/// Checks both parts of a vector, by its name.
///
/// # Errors
/// One that is no number.
pub(crate) fn check_number<T: Scalar>(quantity: &'static str, z: Complex<T>) -> Result<(), ModelError> {
    [z.re, z.im].iter().try_for_each(|x| NUMBER.check(quantity, x.value()))
}

/// Whether a sampling time is one.
pub(crate) fn is_sample_time<T: Scalar>(t: T) -> bool {
    let [low, high] = SAMPLE_TIMES_S.map(T::from_f64);
    t >= low && t <= high
}

/// Whether a voltage is one that machines have. What is not a number fails every comparison.
pub(crate) fn is_voltage<T: Scalar>(u: Complex<T>) -> bool {
    norm2(u) <= T::from_f64(VOLTAGE_V * VOLTAGE_V)
}

/// Whether a sample can be computed with: numbers, of sizes that machines have. What is not a number fails every comparison.
pub(crate) fn is_usable<T: Scalar>(m: &Measured<T>, current_max_a: T) -> bool {
    is_sample_time(m.sample_time_s) && is_of_machines(m, current_weight(current_max_a))
}

/// 1/A²: what squared currents count in [`is_of_machines`], for the largest current of a machine.
fn current_weight<T: Scalar>(current_max_a: T) -> T {
    let most = current_max_a * T::from_f64(CURRENT);
    T::one() / (most * most)
}

/// Whether the squares of all that was measured, each over that of its bound, are one together at most; and the dc voltage is none below zero.
#[inline]
fn is_of_machines<T: Scalar>(m: &Measured<T>, current_weight: T) -> bool {
    let per_square = |most: f64| T::from_f64(1.0 / (most * most));
    let size = norm2(m.i_s) * current_weight
        + (norm2(m.u_s) + m.dc_voltage_v * m.dc_voltage_v) * per_square(VOLTAGE_V)
        + m.omega_m * m.omega_m * per_square(SPEED_RAD_S);
    size <= T::one() && m.dc_voltage_v >= T::zero()
}

/// What in a sample is no number, or of no size that machines have, is NaN.
pub(crate) fn plausible<T: Scalar>(m: &Measured<T>, current_max_a: T) -> Measured<T> {
    let nan = T::from_f64(f64::NAN);
    let vector = |z: Complex<T>, most: T| if norm2(z) <= most * most { z } else { Complex::new(nan, nan) };
    let voltage = T::from_f64(VOLTAGE_V);
    let dc = m.dc_voltage_v;
    Measured {
        i_s: vector(m.i_s, current_max_a * T::from_f64(CURRENT)),
        u_s: vector(m.u_s, voltage),
        omega_m: if m.omega_m.abs() <= T::from_f64(SPEED_RAD_S) { m.omega_m } else { nan },
        dc_voltage_v: if dc >= T::zero() && dc <= voltage { dc } else { nan },
        sample_time_s: m.sample_time_s,
    }
}

/// The sample without the voltages, for a controller that does not use them.
pub(crate) fn without_voltages<T: Scalar>(m: &Measured<T>) -> Measured<T> {
    Measured { u_s: Complex::new(T::zero(), T::zero()), dc_voltage_v: T::zero(), ..*m }
}

/// The reference before the first.
pub(crate) fn no_reference<T: Scalar>() -> Reference<T> {
    Reference { omega_m: T::zero(), rotor_flux_vs: T::zero(), torque_nm: T::zero() }
}

/// What stands between two samples, whatever the law.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standing<T> {
    /// The last reference in numbers, the last command, and what was said of it.
    pub reference: Reference<T>,
    pub command: Complex<T>,
    pub status: DriveStatus,
    /// [`current_weight`].
    current_weight: T,
    /// The last sampling time that was one.
    sample_time_s: T,
}

impl<T: Scalar> Standing<T> {
    /// Before the first sample, for a machine with a largest current.
    pub fn new(current_max_a: T) -> Self {
        let o = T::zero();
        Self {
            reference: no_reference(),
            command: Complex::new(o, o),
            status: DriveStatus::OK,
            current_weight: current_weight(current_max_a),
            sample_time_s: T::zero(),
        }
    }

    /// Whether a sampling time is one; mostly it is that of the sample before.
    #[inline]
    fn has_time(&mut self, sample_time_s: T) -> bool {
        sample_time_s == self.sample_time_s || self.takes_time(sample_time_s)
    }

    #[cold]
    fn takes_time(&mut self, sample_time_s: T) -> bool {
        let is = is_sample_time(sample_time_s);
        if is {
            self.sample_time_s = sample_time_s;
        }
        is
    }

    /// Takes a reference; what is no number in it stays as it was.
    #[inline]
    fn take(&mut self, r: &Reference<T>) {
        if (r.omega_m + r.rotor_flux_vs + r.torque_nm).is_finite() {
            self.reference = *r;
        } else {
            self.take_numbers(r);
        }
    }

    #[cold]
    fn take_numbers(&mut self, r: &Reference<T>) {
        let last = &mut self.reference;
        for (last, new) in
            [(&mut last.omega_m, r.omega_m), (&mut last.rotor_flux_vs, r.rotor_flux_vs), (&mut last.torque_nm, r.torque_nm)]
        {
            if new.is_finite() {
                *last = new;
            }
        }
    }
}

/// A law that is computed in sampled time.
pub(crate) trait Sampled<T: Scalar> {
    /// What stands of the sample before.
    fn standing(&mut self) -> &mut Standing<T>;
    /// The law for a sample that is one, with the reference that stands.
    fn follow(&mut self, m: &Measured<T>) -> Complex<T>;
    /// A sum of the state: no number where a part of it is none.
    fn sum(&self) -> T;
    /// Back to the state before the first sample.
    fn begin_anew(&mut self);
}

/// A sample that cannot be computed with leaves the last command standing, and the state as it is; should the state leave the finite range all the same, it begins anew.
/// One sample later everything is as before.
#[inline]
pub(crate) fn step<T: Scalar>(law: &mut impl Sampled<T>, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
    let standing = law.standing();
    standing.take(reference);
    if !(is_of_machines(m, standing.current_weight) && standing.has_time(m.sample_time_s)) {
        standing.status = DriveStatus::OK.and(DriveStatus::CURRENT_LOST);
        return Command::Voltage(held(standing.command));
    }
    let u = law.follow(m);
    if (u.re + u.im + law.sum()).is_finite() {
        law.standing().command = u;
        return Command::Voltage(u);
    }
    let reference = law.standing().reference;
    law.begin_anew();
    let standing = law.standing();
    (standing.reference, standing.status) = (reference, DriveStatus::OK.and(DriveStatus::RESTARTED));
    Command::Voltage(standing.command)
}

/// The last command, when it is one.
fn held<T: Scalar>(u: Complex<T>) -> Complex<T> {
    if is_finite(u) { u } else { Complex::new(T::zero(), T::zero()) }
}
