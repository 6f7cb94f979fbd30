//! Carrier pulse-width modulation: three duty cycles compared with a triangle.
//!
//! d_x = 1/2 + (u_x + u_0)/U_dc with u_0 = −(max + min)/2, which centres the pulses and reaches U_dc/√3 in every direction. A duty
//! cycle holds for half a carrier period: on the rising half the leg is high for the first d·T_sw/2, on the falling half for the last.

use num_complex::Complex;

use crate::scalar::Scalar;
use crate::simulation::bridge::{Bridge, Fed, Legs};
use crate::space_vector::to_phases;

/// A carrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarrierPwm<T> {
    /// Half the carrier period, s.
    pub half_period_s: T,
}

impl<T: Scalar> CarrierPwm<T> {
    /// Duty cycles for an average voltage, each from 0 to 1; a voltage outside the bridge's hexagon is limited to it.
    pub fn duty_cycles(bridge: &Bridge<T>, u: Complex<T>) -> [T; 3] {
        let [a, b, c] = to_phases(bridge.limited(u));
        let half = T::from_f64(0.5);
        let middle = (a.max(b).max(c) + a.min(b).min(c)) * half;
        // Rounding must not leave the range.
        [a, b, c].map(|x| ((x - middle) / bridge.dc_voltage_v + half).max(T::zero()).min(T::one()))
    }

    /// Runs one half of the carrier period.
    pub fn half_period(&self, bridge: &Bridge<T>, legs: &mut Legs<T>, duty: [T; 3], rising: bool, load: &mut impl Fed<T>) {
        let mut order = [0, 1, 2];
        let edge = duty.map(|d| self.half_period_s * if rising { d } else { T::one() - d });
        for (a, b) in [(0, 1), (1, 2), (0, 1)] {
            if edge[order[b]] < edge[order[a]] {
                order.swap(a, b);
            }
        }
        for (x, d) in duty.into_iter().enumerate() {
            let first = if rising { d > T::zero() } else { d >= T::one() };
            bridge.switch(legs, x, first);
        }
        let mut now = T::zero();
        for x in order {
            bridge.hold(legs, edge[x] - now, load);
            now = edge[x];
            if duty[x] > T::zero() && duty[x] < T::one() {
                bridge.switch(legs, x, !rising);
            }
        }
        bridge.hold(legs, self.half_period_s - now, load);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::bridge::tests::Constant;
    use crate::space_vector::{from_phases, unit};
    use proptest::prelude::*;

    fn run(bridge: &Bridge<f64>, u: Complex<f64>, load: &mut Constant, periods: usize) {
        let pwm = CarrierPwm { half_period_s: 50e-6 };
        let mut legs = Legs::default();
        let duty = CarrierPwm::duty_cycles(bridge, u);
        // One period to leave the initial state behind.
        for k in 0..=2 * periods + 1 {
            if k == 2 {
                *load = Constant::new(load.i_s.re, load.i_s.im);
            }
            pwm.half_period(bridge, &mut legs, duty, k % 2 == 0, load);
        }
    }

    proptest! {
        #[test]
        fn the_average_is_the_command_inside_the_hexagon(size in 0.0..0.999f64, angle in 0.0..6.3f64) {
            let bridge = Bridge::ideal(600.0);
            let u = unit(angle) * size * 600.0 / 3f64.sqrt();
            let mut load = Constant::new(1.0, 0.3);
            run(&bridge, u, &mut load, 1);
            prop_assert!((load.volt_seconds / load.time_s - u).norm() < 1e-9);
        }

        /// U_dc·t_d/T_sw in the direction of each phase current, as long as no pulse is narrower than the dead time.
        #[test]
        fn the_dead_time_takes_its_share_by_the_sign_of_the_current(size in 0.0..0.8f64, angle in 0.0..6.3f64, turn in 0.0..6.3f64) {
            let (u_dc, t_d, t_sw) = (600.0, 2e-6, 100e-6);
            let bridge = Bridge { dead_time_s: t_d, ..Bridge::ideal(u_dc) };
            let u = unit(angle) * size * u_dc / 3f64.sqrt();
            let i = unit(turn) * 7.0;
            let mut load = Constant::new(i.re, i.im);
            run(&bridge, u, &mut load, 3);
            let lost = from_phases(to_phases(i).map(|x: f64| u_dc * t_d / t_sw * x.signum()));
            prop_assert!((u - load.volt_seconds / load.time_s - lost).norm() < 1e-9, "{} {lost}", u - load.volt_seconds / load.time_s);
        }
    }

    /// Firmware's numbers: the mean is met to single precision.
    #[test]
    fn single_precision_suffices() {
        struct Sum(Complex<f32>);
        impl Fed<f32> for Sum {
            fn i_s(&self) -> Complex<f32> {
                Complex::new(1.0, 0.0)
            }
            fn hold(&mut self, u_s: Complex<f32>, duration: f32) {
                self.0 += u_s * duration;
            }
        }
        let (bridge, pwm) = (Bridge::ideal(600.0f32), CarrierPwm { half_period_s: 50e-6f32 });
        let (mut legs, mut sum) = (Legs::default(), Sum(Complex::new(0.0, 0.0)));
        let u = Complex::new(123.0, -45.0);
        let duty = CarrierPwm::duty_cycles(&bridge, u);
        pwm.half_period(&bridge, &mut legs, duty, true, &mut sum);
        pwm.half_period(&bridge, &mut legs, duty, false, &mut sum);
        assert!((sum.0 / 100e-6 - u).norm() < 1e-3, "{}", sum.0 / 100e-6);
    }

    #[test]
    fn full_and_empty_duty_cycles_do_not_switch() {
        let bridge = Bridge { dead_time_s: 5e-6, ..Bridge::ideal(600.0) };
        let mut load = Constant::new(3.0, 0.0);
        // The corner of the hexagon: leg a always high, the others always low. Nothing is lost.
        run(&bridge, Complex::new(400.0, 0.0), &mut load, 2);
        assert!((load.volt_seconds / load.time_s - Complex::new(400.0, 0.0)).norm() < 1e-9);
    }
}
