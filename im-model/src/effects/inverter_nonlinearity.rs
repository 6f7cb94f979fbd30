//! Inverter nonlinearity: dead time and device drop take a voltage in the direction of each phase current.
//!
//! u_x = u_x* − U_d f(i_x/I_0),  f(x) = x/√(1 + x²),  x = a, b, c.  The zero sequence drops out (floating star point).

use num_complex::Complex;

use super::{About, Card, Place, SteadyState, effect};
use crate::error::Bound;
use crate::space_vector::{from_phases, to_phases};

effect! {
    /// Dead time and forward voltage of an inverter whose commanded voltage is what was recorded.
    InverterNonlinearity, "inverter_nonlinearity",
    about: About { steady_state: SteadyState::Ripples, ..About::at(Place::Voltage) },
    card: Card {
        title: "Inverter nonlinearity (dead time and device drop)",
        what: "Each phase loses U_d in the direction of its current, less near zero current: U_d = U_dc·t_dead/T_sw plus the devices' drop.",
        shows: "Current error around the zero crossings of the phase currents, sixth harmonic in the rotating frame (5th and 7th in the phases), worst at low speed; the fitted stator resistance is too large.",
        rivals: &[
            ("stator_heating", "drifts slowly; dead time is there at once"),
            ("voltage_gain", "in proportion to the voltage; dead time independent of it"),
            ("current_sensor_offset", "turns with supply frequency in the rotating frame, dead time with six times that"),
        ],
        test: "Low speed at several currents, with slow current zero crossings; or direct current steps at standstill.",
        place: "applied voltage, by the sign of phase currents",
        source: "averaged dead-time model; cf. Kwon et al. Sec. VII, Jadot et al. Sec. VI (PWM drives)",
    },
    parameters: {
        /// Voltage lost per phase at large current.
        voltage_v: Strength, default 0.0, "V", Voltage, typical 0.003 to 0.05, Bound::NotNegative;
        /// Phase current at which 71 % of it is lost.
        zero_crossing_current_a: Shape, default 0.03, "A", Current, typical 0.003 to 0.15, Bound::Positive;
    },
    hooks: {
        #[inline(always)]
        fn applied_voltage(&self, u: Complex<T>, i_s: Complex<T>) -> Complex<T> {
            let w2 = self.zero_crossing_current_a * self.zero_crossing_current_a;
            let lost = to_phases(i_s).map(|i| i / (i * i + w2).sqrt());
            u - from_phases(lost) * self.voltage_v
        }

        fn added_resistance(&self, _cold_r_r: f64) -> f64 {
            self.voltage_v.value() / self.zero_crossing_current_a.value()
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for InverterNonlinearity<f64> {
    fn frame(&self, on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "phase current, A",
            "voltage lost, V",
            (-on.current_a, on.current_a),
            "Dead-time curve: voltage lost per phase over its current.",
        )
    }

    fn law(&self, _on: &super::Rated, x: f64) -> f64 {
        self.voltage_v * x / x.hypot(self.zero_crossing_current_a)
    }
}
