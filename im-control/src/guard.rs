//! What a controller computes with: a sample that no machine can have shown is left out, a reference that is no number is not followed.
//!
//! The bounds keep arithmetic in `f32` within its range. What is plausible for one drive is for [`Drive`](crate::Drive) to know.

use im_model::simulation::{Measured, Reference};
use im_model::{Complex, Scalar};

use crate::vector::is_finite;

/// Sampling times of drives, s.
pub(crate) const SAMPLE_TIMES_S: [f64; 2] = [1e-7, 0.1];
/// Mechanical speeds beyond any machine's, rad/s, and voltages, V.
const SPEED_RAD_S: f64 = 1e5;
const VOLTAGE_V: f64 = 1e6;
/// Times the largest current of the machine.
const CURRENT: f64 = 100.0;

/// Whether a sampling time is one.
pub(crate) fn is_sample_time<T: Scalar>(t: T) -> bool {
    let [low, high] = SAMPLE_TIMES_S.map(T::from_f64);
    t >= low && t <= high
}

/// Whether a sample can be computed with: numbers, of sizes that machines have. What is not a number fails every comparison.
pub(crate) fn is_usable<T: Scalar>(m: &Measured<T>, current_max_a: T) -> bool {
    let within = |z: Complex<T>, most: T| z.re.abs() <= most && z.im.abs() <= most;
    let voltage = T::from_f64(VOLTAGE_V);
    is_sample_time(m.sample_time_s)
        && within(m.i_s, current_max_a * T::from_f64(CURRENT))
        && within(m.u_s, voltage)
        && m.omega_m.abs() <= T::from_f64(SPEED_RAD_S)
        && m.dc_voltage_v >= T::zero()
        && m.dc_voltage_v <= voltage
}

/// A reference with what is no number in it taken from the one before.
pub(crate) fn numbers<T: Scalar>(r: &Reference<T>, before: &Reference<T>) -> Reference<T> {
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

/// The last command, when it is one.
pub(crate) fn held<T: Scalar>(u: Complex<T>) -> Complex<T> {
    if is_finite(u) { u } else { Complex::new(T::zero(), T::zero()) }
}
