//! Open-loop voltages: the mains, and an inverter that keeps volts per hertz.

use num_complex::Complex;
use num_traits::Zero;

use crate::error::{Bound, ModelError};
use crate::scalar::Scalar;
use crate::space_vector::{j, unit};

const TWO_PI: f64 = 2.0 * core::f64::consts::PI;

/// A sinusoidal three-phase supply, closed onto the machine at an instant.
///
/// Before that the voltage is zero, which equals open terminals as long as the machine carries no flux.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mains<T> {
    /// Phase voltage, peak, V.
    pub voltage_peak_v: T,
    /// Frequency, Hz; negative turns the field backwards.
    pub frequency_hz: T,
    /// Angle of the voltage at t = 0, rad.
    pub phase_rad: T,
    /// When the contactor closes, s.
    pub closing_s: T,
}

impl<T: Scalar> Mains<T> {
    /// Checks the values: voltage not negative, frequency not zero, all finite.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        Bound::NotNegative.check("voltage_peak_v", self.voltage_peak_v.value())?;
        let size = self.frequency_hz.abs().value();
        Bound::Positive.check("frequency_hz", size)?;
        Bound::Within(-1e3, 1e3).check("phase_rad", self.phase_rad.value())?;
        Bound::Within(-1e9, 1e9).check("closing_s", self.closing_s.value())
    }

    /// The mean voltage between two times, V: the integral of the rotating vector is exact.
    pub fn mean(&self, from_s: T, to_s: T) -> Complex<T> {
        let begin = from_s.max(self.closing_s);
        if begin >= to_s {
            return Complex::zero();
        }
        let omega = self.frequency_hz.scale(TWO_PI);
        let at = |t: T| unit(omega * t + self.phase_rad);
        -j(at(to_s) - at(begin)) * (self.voltage_peak_v / (omega * (to_s - from_s)))
    }
}

/// Voltage in proportion to frequency, with a boost at low frequency and a limit at the rated voltage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoltsPerHertz<T> {
    /// Phase voltage, peak, at the rated frequency and above, V.
    pub voltage_peak_v: T,
    /// Rated frequency, Hz.
    pub frequency_hz: T,
    /// Phase voltage, peak, at standstill, V.
    pub boost_v: T,
    /// Fastest change of frequency, Hz/s.
    pub ramp_hz_per_s: T,
}

impl<T: Scalar> VoltsPerHertz<T> {
    /// Checks the values: voltage, frequency and ramp positive, boost from zero to the rated voltage.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        Bound::Positive.check("voltage_peak_v", self.voltage_peak_v.value())?;
        Bound::Positive.check("frequency_hz", self.frequency_hz.value())?;
        Bound::Within(0.0, self.voltage_peak_v.value()).check("boost_v", self.boost_v.value())?;
        Bound::Positive.check("ramp_hz_per_s", self.ramp_hz_per_s.value())
    }

    /// The amplitude at a frequency, V.
    pub fn amplitude_v(&self, frequency_hz: T) -> T {
        let share = (frequency_hz.abs() / self.frequency_hz).min(T::one());
        self.boost_v + (self.voltage_peak_v - self.boost_v) * share
    }

    /// One sample: `state` is frequency (Hz) and angle (rad); returns the voltage to hold, at the angle of the sample's middle.
    pub fn step(&self, state: &mut [T; 2], wanted_hz: T, sample_time_s: T) -> Complex<T> {
        let [frequency, angle] = state;
        let reach = self.ramp_hz_per_s * sample_time_s;
        *frequency = wanted_hz.max(*frequency - reach).min(*frequency + reach);
        turn(angle, *frequency, sample_time_s) * self.amplitude_v(*frequency)
    }
}

/// Advances an angle over a sample; the direction at its middle.
pub(crate) fn turn<T: Scalar>(angle: &mut T, frequency_hz: T, sample_time_s: T) -> Complex<T> {
    let half = frequency_hz.scale(0.5 * TWO_PI) * sample_time_s;
    let middle = *angle + half;
    *angle = middle + half;
    let whole = T::from_f64(TWO_PI);
    while *angle > whole {
        *angle -= whole;
    }
    while *angle < -whole {
        *angle += whole;
    }
    unit(middle)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAINS: Mains<f64> = Mains { voltage_peak_v: 325.0, frequency_hz: 50.0, phase_rad: 0.4, closing_s: 0.01 };

    #[test]
    fn means_add_up_to_the_mean_and_vanish_before_closing() {
        assert_eq!(MAINS.mean(0.0, 0.01), Complex::zero());
        let whole = MAINS.mean(0.009, 0.013);
        let parts: Complex<f64> = (0..40).map(|k| MAINS.mean(0.009 + 1e-4 * f64::from(k), 0.009 + 1e-4 * f64::from(k + 1))).sum();
        assert!((whole - parts / 40.0).norm() < 1e-9);
        let short = MAINS.mean(0.02, 0.02 + 1e-7);
        assert!((short - unit(TWO_PI * 50.0 * 0.02 + 0.4) * 325.0).norm() < 0.01);
    }

    #[test]
    fn volts_per_hertz_ramps_boosts_and_limits() {
        let v = VoltsPerHertz { voltage_peak_v: 320.0, frequency_hz: 50.0, boost_v: 20.0, ramp_hz_per_s: 100.0 };
        assert_eq!(v.amplitude_v(0.0), 20.0);
        assert_eq!(v.amplitude_v(-25.0), 170.0);
        assert_eq!(v.amplitude_v(80.0), 320.0);
        let mut state = [0.0, 0.0];
        for _ in 0..2500 {
            v.step(&mut state, 50.0, 1e-4);
        }
        assert!((state[0] - 25.0).abs() < 1e-9, "a quarter of a second at 100 Hz/s: {}", state[0]);
        for _ in 0..10_000 {
            v.step(&mut state, -10.0, 1e-4);
        }
        assert_eq!(state[0], -10.0);
        assert!(state[1].abs() <= TWO_PI);
    }
}
