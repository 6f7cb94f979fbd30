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

/// Whether a sampling time is one.
pub(crate) fn is_sample_time<T: Scalar>(t: T) -> bool {
    let [low, high] = SAMPLE_TIMES_S.map(T::from_f64);
    t >= low && t <= high
}

/// Whether a sample can be computed with: numbers, of sizes that machines have. What is not a number fails every comparison.
pub(crate) fn is_usable<T: Scalar>(m: &Measured<T>, current_max_a: T) -> bool {
    let within = |z: Complex<T>, most: T| norm2(z) <= most * most;
    let voltage = T::from_f64(VOLTAGE_V);
    is_sample_time(m.sample_time_s)
        && within(m.i_s, current_max_a * T::from_f64(CURRENT))
        && within(m.u_s, voltage)
        && m.omega_m.abs() <= T::from_f64(SPEED_RAD_S)
        && m.dc_voltage_v >= T::zero()
        && m.dc_voltage_v <= voltage
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

/// A reference with what is no number in it taken from the one before.
pub(crate) fn numbers<T: Scalar>(r: &Reference<T>, before: &Reference<T>) -> Reference<T> {
    if (r.omega_m + r.rotor_flux_vs + r.torque_nm).is_finite() {
        return *r;
    }
    let one = |x: T, before: T| if x.is_finite() { x } else { before };
    Reference {
        omega_m: one(r.omega_m, before.omega_m),
        rotor_flux_vs: one(r.rotor_flux_vs, before.rotor_flux_vs),
        torque_nm: one(r.torque_nm, before.torque_nm),
    }
}

/// The reference before the first.
pub(crate) fn no_reference<T: Scalar>() -> Reference<T> {
    Reference { omega_m: T::zero(), rotor_flux_vs: T::zero(), torque_nm: T::zero() }
}

/// A law that is computed in sampled time, and what stands between two samples.
pub(crate) trait Sampled<T: Scalar> {
    /// Currents far beyond this are not computed with, A.
    fn current_max_a(&self) -> T;
    /// The last reference in numbers, the last command and the status.
    fn last(&mut self) -> (&mut Reference<T>, &mut Complex<T>, &mut DriveStatus);
    /// The law for a sample that is one.
    fn follow(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Complex<T>;
    /// Whether the state is.
    fn is_finite(&self) -> bool;
    /// Back to the state before the first sample.
    fn begin_anew(&mut self);
}

/// A sample that cannot be computed with leaves the last command standing, and the state as it is; should the state leave the finite range all the same, it begins anew.
/// One sample later everything is as before.
#[inline]
pub(crate) fn step<T: Scalar>(law: &mut impl Sampled<T>, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
    let usable = is_usable(m, law.current_max_a());
    let (last, command, status) = law.last();
    *last = numbers(reference, last);
    let reference = *last;
    if !usable {
        *status = DriveStatus::OK.and(DriveStatus::CURRENT_LOST);
        return Command::Voltage(held(*command));
    }
    let u = law.follow(m, &reference);
    if is_finite(u) && law.is_finite() {
        *law.last().1 = u;
        return Command::Voltage(u);
    }
    law.begin_anew();
    let (last, command, status) = law.last();
    (*last, *status) = (reference, DriveStatus::OK.and(DriveStatus::RESTARTED));
    Command::Voltage(*command)
}

/// The last command, when it is one.
fn held<T: Scalar>(u: Complex<T>) -> Complex<T> {
    if is_finite(u) { u } else { Complex::new(T::zero(), T::zero()) }
}
