//! What a controller sees and gives, sample by sample.

use num_complex::Complex;

use crate::scalar::Scalar;

/// What is measured at the beginning of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured<T> {
    /// Stator current as the sensors show it, A.
    pub i_s: Complex<T>,
    /// Mechanical speed as the sensor shows it, rad/s.
    pub omega_m: T,
    /// Average voltage commanded over the sample that ends here, after the limit of the inverter, V. Behind a voltage delay the machine had an earlier one.
    pub u_s: Complex<T>,
    /// Voltage of the dc link, V; zero if the inverter has no limit.
    pub dc_voltage_v: T,
    /// Sampling time, s.
    pub sample_time_s: T,
}

/// What is asked of a controller. Each takes what it knows how to follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference<T> {
    /// Mechanical speed, rad/s.
    pub omega_m: T,
    /// Magnitude of the rotor flux linkage, Vs.
    pub rotor_flux_vs: T,
    /// Torque, Nm.
    pub torque_nm: T,
}

/// What a controller asks of the inverter over the sample that begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command<T> {
    /// Average stator voltage, V.
    Voltage(Complex<T>),
    /// Stator current, A, for an inverter that tracks currents (delta modulation).
    Current(Complex<T>),
}

/// A controller in sampled time. Steps cannot fail.
pub trait Controller<T: Scalar> {
    /// The command for the sample that begins.
    fn step(&mut self, measured: &Measured<T>, reference: &Reference<T>) -> Command<T>;
}

impl<T: Scalar, C: Controller<T> + ?Sized> Controller<T> for &mut C {
    fn step(&mut self, measured: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        (**self).step(measured, reference)
    }
}

/// Runs a controller written for `f32`, as in firmware, where `f64` is asked for.
#[derive(Clone, Copy, Debug)]
pub struct SinglePrecision<C>(pub C);

impl<C: Controller<f32>> Controller<f64> for SinglePrecision<C> {
    fn step(&mut self, m: &Measured<f64>, r: &Reference<f64>) -> Command<f64> {
        let narrow = |z: Complex<f64>| Complex::new(z.re as f32, z.im as f32);
        let wide = |z: Complex<f32>| Complex::new(f64::from(z.re), f64::from(z.im));
        let measured = Measured {
            i_s: narrow(m.i_s),
            omega_m: m.omega_m as f32,
            u_s: narrow(m.u_s),
            dc_voltage_v: m.dc_voltage_v as f32,
            sample_time_s: m.sample_time_s as f32,
        };
        let reference =
            Reference { omega_m: r.omega_m as f32, rotor_flux_vs: r.rotor_flux_vs as f32, torque_nm: r.torque_nm as f32 };
        match self.0.step(&measured, &reference) {
            Command::Voltage(u) => Command::Voltage(wide(u)),
            Command::Current(i) => Command::Current(wide(i)),
        }
    }
}
