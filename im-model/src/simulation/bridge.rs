//! A two-level three-phase bridge: three legs, their dead time and the drop of their devices.
//!
//! A leg that is to change opens its closed transistor at once and closes the other after the dead time. In between, and through
//! the diodes, the current decides: a current out of the leg pulls it to the negative rail, a current into it lifts it to the
//! positive. Over a period with one edge each way the leg so loses U_dc·t_d in the direction of its current. The drop of whatever
//! device conducts is V_f·sign(i) + r·i. A current that reaches zero within the dead time is not held there.

use num_complex::Complex;
use num_traits::Zero;

use crate::error::{Bound, ModelError};
use crate::scalar::Scalar;
use crate::space_vector::{from_phases, to_phases};

/// What hangs on the bridge: it has a current, and is carried on by a constant voltage.
pub trait Fed<T> {
    /// The current out of the bridge, A.
    fn i_s(&self) -> Complex<T>;
    /// Time passes by `duration`, s, at the voltage `u_s`, V.
    fn hold(&mut self, u_s: Complex<T>, duration: T);
}

/// The bridge's data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bridge<T> {
    /// Voltage of the dc link, V.
    pub dc_voltage_v: T,
    /// Time between the opening of one transistor of a leg and the closing of the other, s.
    pub dead_time_s: T,
    /// Forward voltage of the conducting device, V.
    pub drop_v: T,
    /// Its differential resistance, Ω.
    pub on_resistance_ohm: T,
}

/// The legs of a bridge: how they are commanded, and how much of their dead time is left. `default` is all on the negative rail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Legs<T> {
    high: [bool; 3],
    blank_s: [T; 3],
    commanded_vs: Complex<T>,
}

impl<T: Scalar> Default for Legs<T> {
    fn default() -> Self {
        Self { high: [false; 3], blank_s: [T::zero(); 3], commanded_vs: Complex::zero() }
    }
}

impl<T: Scalar> Legs<T> {
    /// Whether each leg is commanded to the positive rail.
    pub fn high(&self) -> [bool; 3] {
        self.high
    }

    /// The integral of the commanded voltage since the last call, Vs: what an ideal bridge would have applied.
    pub fn take_commanded_vs(&mut self) -> Complex<T> {
        core::mem::replace(&mut self.commanded_vs, Complex::zero())
    }
}

impl<T: Scalar> Bridge<T> {
    /// An ideal bridge.
    pub fn ideal(dc_voltage_v: T) -> Self {
        Self { dc_voltage_v, dead_time_s: T::zero(), drop_v: T::zero(), on_resistance_ohm: T::zero() }
    }

    /// Checks the values: dc voltage positive, the others not negative.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        Bound::Positive.check("dc_voltage_v", self.dc_voltage_v.value())?;
        Bound::NotNegative.check("dead_time_s", self.dead_time_s.value())?;
        Bound::NotNegative.check("drop_v", self.drop_v.value())?;
        Bound::NotNegative.check("on_resistance_ohm", self.on_resistance_ohm.value())
    }

    /// The voltage nearest to `u`, in its direction, that the bridge can make: inside the hexagon |u_x − u_y| ≤ U_dc.
    pub fn limited(&self, u: Complex<T>) -> Complex<T> {
        let [a, b, c] = to_phases(u);
        let span = a.max(b).max(c) - a.min(b).min(c);
        if span > self.dc_voltage_v { u * (self.dc_voltage_v / span) } else { u }
    }

    /// Tells a leg (0, 1, 2) to go to the positive rail, or to the negative.
    pub fn switch(&self, legs: &mut Legs<T>, leg: usize, high: bool) {
        if legs.high[leg] != high {
            legs.high[leg] = high;
            legs.blank_s[leg] = self.dead_time_s;
        }
    }

    /// The voltage at the terminals at the current `i_s`.
    pub fn voltage(&self, legs: &Legs<T>, i_s: Complex<T>) -> Complex<T> {
        let i = to_phases(i_s);
        let half = T::from_f64(0.5);
        from_phases(core::array::from_fn(|x| {
            let sign = if i[x] > T::zero() {
                T::one()
            } else if i[x] < T::zero() {
                -T::one()
            } else {
                T::zero()
            };
            let level =
                if legs.blank_s[x] > T::zero() { half - half * sign } else { T::from_f64(f64::from(u8::from(legs.high[x]))) };
            self.dc_voltage_v * level - self.drop_v * sign - self.on_resistance_ohm * i[x]
        }))
    }

    /// Keeps the commands for `duration`, s, while dead times run out.
    pub fn hold(&self, legs: &mut Legs<T>, duration: T, load: &mut impl Fed<T>) {
        let mut left = duration;
        while left > T::zero() {
            let blank = |b: &T| if *b > T::zero() { *b } else { left };
            let dt = legs.blank_s.iter().map(blank).fold(left, |a, b| a.min(b));
            load.hold(self.voltage(legs, load.i_s()), dt);
            let level = legs.high.map(|h| T::from_f64(f64::from(u8::from(h))));
            legs.commanded_vs += from_phases(level) * (self.dc_voltage_v * dt);
            for b in &mut legs.blank_s {
                // What is left after subtraction of itself is exactly zero.
                *b = if *b > dt { *b - dt } else { T::zero() };
            }
            left -= dt;
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A load with a constant current, which adds up the volt-seconds.
    pub struct Constant {
        pub i_s: Complex<f64>,
        pub volt_seconds: Complex<f64>,
        pub time_s: f64,
    }

    impl Constant {
        pub fn new(re: f64, im: f64) -> Self {
            Self { i_s: Complex::new(re, im), volt_seconds: Complex::zero(), time_s: 0.0 }
        }
    }

    impl Fed<f64> for Constant {
        fn i_s(&self) -> Complex<f64> {
            self.i_s
        }
        fn hold(&mut self, u_s: Complex<f64>, duration: f64) {
            self.volt_seconds += u_s * duration;
            self.time_s += duration;
        }
    }

    #[test]
    fn the_hexagon_limits() {
        let b = Bridge::ideal(600.0);
        let inside = Complex::new(300.0, 0.0);
        assert_eq!(b.limited(inside), inside);
        // Along a phase 2/3 U_dc, between two phases U_dc/√3.
        assert!((b.limited(Complex::new(900.0, 0.0)).re - 400.0).abs() < 1e-9);
        assert!((b.limited(Complex::new(0.0, 900.0)).im - 600.0 / 3f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn during_the_dead_time_the_current_decides() {
        let b = Bridge { dead_time_s: 2e-6, ..Bridge::ideal(600.0) };
        for (i, level) in [(5.0, 0.0), (-5.0, 600.0)] {
            let mut legs = Legs::default();
            b.switch(&mut legs, 0, true);
            let expected: f64 = if i > 0.0 { 0.0 } else { 400.0 };
            assert!((b.voltage(&legs, Complex::new(i, 0.0)).re - expected).abs() < 1e-9);
            let mut load = Constant::new(i, 0.0);
            b.hold(&mut legs, 10e-6, &mut load);
            let dead = 2e-6 * level * 2.0 / 3.0;
            assert!((load.volt_seconds.re - (8e-6 * 400.0 + dead)).abs() < 1e-12, "{}", load.volt_seconds);
            assert!((load.time_s - 10e-6).abs() < 1e-18);
            assert!((legs.take_commanded_vs().re - 10e-6 * 400.0).abs() < 1e-15);
        }
    }

    #[test]
    fn devices_take_their_drop_from_each_phase() {
        let b = Bridge { drop_v: 1.0, on_resistance_ohm: 0.1, ..Bridge::ideal(600.0) };
        // Currents 4, −2, −2 A: drops 1.4, −1.2, −1.2 V; the zero sequence falls out.
        let u = b.voltage(&Legs::default(), Complex::new(4.0, 0.0));
        assert!((u - Complex::new(-(2.0 * 1.4 + 2.0 * 1.2) / 3.0, 0.0)).norm() < 1e-12, "{u}");
    }
}
