//! Voltage offset: a constant voltage reaches the terminals that was not recorded, or one was recorded that does not. u = u* + u_0.
//!
//! In a steady state it drives i = u_0/R_s: a thousandth of the rated voltage is some per cent of the rated current.

use num_complex::Complex;

use super::{About, Card, Place, SteadyState, effect};
use crate::error::Bound;

effect! {
    /// Constant error of the voltage sensors, or of an inverter's pulses.
    VoltageOffset, "voltage_offset",
    about: About { steady_state: SteadyState::Hides, ..About::at(Place::Voltage) },
    card: Card {
        title: "Voltage offset",
        what: "A constant voltage reaches the terminals that was not recorded (or the other way round): the zero of a voltage sensor, or pulses of an inverter that differ between its phases.",
        shows: "The model carries a direct current that the machine does not, or the other way round: u_0/R_s, which builds up with the time constant of the winding and swings the torque at supply frequency. A thousandth of the rated voltage is enough.",
        rivals: &[
            ("current_sensor_offset", "is there at once, without voltage too; the current of a voltage offset builds up"),
            ("inverter_nonlinearity", "changes sign with the phase current"),
        ],
        test: "A second with the voltage sensors short-circuited; of an inverter, a second at standstill with no voltage commanded.",
        place: "applied voltage",
        source: "linear sensor model",
    },
    parameters: {
        /// Offset, α.
        alpha_v: Strength, default 0.0, "V", Voltage, typical 0.0003 to 0.02, Bound::Within(-1e4, 1e4);
        /// Offset, β.
        beta_v: Strength, default 0.0, "V", Voltage, typical 0.0003 to 0.02, Bound::Within(-1e4, 1e4);
    },
    hooks: {
        #[inline(always)]
        fn applied_voltage(&self, u: Complex<T>, _i_s: Complex<T>) -> Complex<T> {
            u + Complex::new(self.alpha_v, self.beta_v)
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for VoltageOffset<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "direction, °",
            "offset in that direction, V",
            (0.0, 360.0),
            "Applied less recorded voltage where none is recorded, by direction (0° is phase a).",
        )
    }

    fn law(&self, _on: &super::Rated, x: f64) -> f64 {
        let (sin, cos) = x.to_radians().sin_cos();
        self.alpha_v * cos + self.beta_v * sin
    }
}

#[cfg(test)]
mod tests {
    use super::super::trying::*;
    use crate::EffectId::{CurrentSensorOffset, InverterNonlinearity, VoltageOffset};
    use crate::{Bench, EffectId, Machine, PlantInput, State};
    use num_complex::Complex;

    /// What the sensors show of the current after so long at standstill, without voltage.
    fn shown(m: &Machine<f64>, after_s: f64) -> Complex<f64> {
        let mut bench = Bench::new(m, State::turning(0.0), T);
        for _ in 0..(after_s / T) as usize {
            bench.advance(&PlantInput { imposed_speed: Some([0.0; 2]), ..PlantInput::new(Complex::new(0.0, 0.0), 0.0) });
        }
        bench.output().i_s
    }

    #[test]
    fn drives_the_current_that_the_resistance_allows() {
        let m = with(VoltageOffset);
        let e = m.effects().voltage_offset;
        let i = Complex::new(e.alpha_v, e.beta_v) / m.parameters().stator_resistance_ohm;
        assert!((shown(&m, 2.0) - i).norm() < 1e-3 * i.norm());
        // The same beside a turning field.
        assert!((current(&running_for(&m, RATED_V, SYNCHRONOUS, 200), 0.0) - i).norm() < 0.02 * i.norm());
    }

    #[test]
    fn differs_from_current_sensor_offset() {
        let at_once = |id: EffectId| shown(&with(id), 0.0).norm() / shown(&with(id), 2.0).norm();
        assert!(at_once(VoltageOffset) < 1e-9 && (at_once(CurrentSensorOffset) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn differs_from_inverter_nonlinearity() {
        let constant = |id: EffectId| current(&running(&with(id), RATED_V, SYNCHRONOUS), 0.0).norm();
        assert!(constant(VoltageOffset) > 0.05 && constant(InverterNonlinearity) < 0.1 * constant(VoltageOffset));
    }
}
