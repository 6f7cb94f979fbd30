//! Delta modulation: each leg is switched towards its current reference, at clocked instants.
//!
//! Every T_sw, e_x = i_x* − i_x; the leg goes high if e_x > 0, low if e_x < 0. The instants of the three phases are staggered by
//! T_sw/3 (Kwon et al., Sec. VII, (16), (17); T_sw = 100 µs there).

use num_complex::Complex;

use crate::scalar::Scalar;
use crate::simulation::bridge::{Bridge, Fed, Legs};
use crate::space_vector::to_phases;

/// A delta modulator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeltaModulator<T> {
    /// Time between two decisions of a phase, s.
    pub period_s: T,
}

impl<T: Scalar> DeltaModulator<T> {
    /// Runs one period towards the reference, A. `shown` is what the current sensors make of the load's current.
    pub fn period<L: Fed<T>>(
        &self,
        bridge: &Bridge<T>,
        legs: &mut Legs<T>,
        reference: Complex<T>,
        load: &mut L,
        shown: impl Fn(Complex<T>) -> Complex<T>,
    ) {
        let third = self.period_s * T::from_f64(1.0 / 3.0);
        let wanted = to_phases(reference);
        for (x, wanted) in wanted.into_iter().enumerate() {
            let e = wanted - to_phases(shown(load.i_s()))[x];
            if !e.is_zero() {
                bridge.switch(legs, x, e > T::zero());
            }
            bridge.hold(legs, third, load);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space_vector::unit;
    use num_traits::Zero;

    /// An inductance with a back-voltage.
    struct Coil {
        i_s: Complex<f64>,
        inductance_h: f64,
        back_v: Complex<f64>,
    }
    impl Fed<f64> for Coil {
        fn i_s(&self) -> Complex<f64> {
            self.i_s
        }
        fn hold(&mut self, u_s: Complex<f64>, duration: f64) {
            self.i_s += (u_s - self.back_v) * (duration / self.inductance_h);
        }
    }

    #[test]
    fn the_current_follows_its_reference_within_the_ripple() {
        let (u_dc, l, t_sw) = (600.0, 0.01, 100e-6);
        let modulator = DeltaModulator { period_s: t_sw };
        for dead_time_s in [0.0, 3e-6] {
            let bridge = Bridge { dead_time_s, ..Bridge::ideal(u_dc) };
            let mut load = Coil { i_s: Complex::zero(), inductance_h: l, back_v: Complex::zero() };
            let mut legs = Legs::default();
            let omega = 2.0 * core::f64::consts::PI * 50.0;
            let mut mean = Complex::<f64>::zero();
            for k in 0..2000 {
                let turn = unit(omega * t_sw * f64::from(k));
                load.back_v = turn * Complex::new(0.0, 100.0);
                modulator.period(&bridge, &mut legs, turn * 10.0, &mut load, |i| i);
                if k >= 200 {
                    let e = (load.i_s - turn * 10.0) / turn;
                    // A wrong decision lasts T_sw, during which the worst vector, 2/3 U_dc, and the back-voltage act.
                    let ripple = (2.0 / 3.0 * u_dc + 100.0) * (t_sw + dead_time_s) / l;
                    assert!(e.norm() < 1.2 * ripple, "{k}: {e}");
                    mean += e / 1800.0;
                }
            }
            // The mean lies off by a part of the ripple, against the voltage that is needed: why Kwon et al. put an integrating regulator
            // in front.
            assert!(mean.norm() < 0.25 * 5.0 && mean.im < 0.0, "{mean}");
        }
    }
}
