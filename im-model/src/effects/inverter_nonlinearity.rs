//! Inverter nonlinearity: dead time and device drop take a voltage in the direction of each phase current.
//!
//! u_x = u_x* − U_d f(i_x/I_0),  f(x) = x/√(1 + x²),  x = a, b, c.  The zero sequence drops out (floating star point).
//!
//! What decides is the current at the edges of the leg. It is off its mean i_x by the ripple, δ_x at the edge down and −δ_x at the edge up:
//!
//! u_x = u_x* − (U_d/2) (f((i_x + δ_x)/I_0) + f((i_x − δ_x)/I_0)),   δ_x = r (U_dc (d_x − Σ_y min(d_x, d_y)/3) − d_x u_x*),   r = T_sw/(2L_σ)
//!
//! with the duty cycles d_x = ½ + (u_x* − (max u* + min u*)/2)/U_dc of centred pulses: from the middle of its pulse to its edge the leg is high for d_x T_sw/2, the others for
//! min(d_x, d_y) T_sw/2, and the emf is the mean voltage. Between −|δ_x| and |δ_x| both edges are without loss, and nothing is taken: the knee is as wide as the ripple.

use num_complex::Complex;

use super::{About, Card, Place, SteadyState, effect};
use crate::error::Bound;
use crate::scalar::Scalar;
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
        /// Half a switching period over the leakage inductance: what the ripple is in proportion to; zero where it is not known.
        ripple_a_per_v: Fixed, default 0.0, "A/V", Conductance, typical 0.0 to 1.0, Bound::NotNegative;
        /// Voltage of the dc link, which the ripple depends on.
        dc_voltage_v: Fixed, default 1.8, "V", Voltage, typical 1.7 to 2.5, Bound::Positive;
    },
    hooks: {
        #[inline(always)]
        fn applied_voltage(&self, u: Complex<T>, i_s: Complex<T>) -> Complex<T> {
            u - self.taken_v(u, i_s)
        }

        fn added_resistance(&self, _cold_r_r: f64) -> f64 {
            self.voltage_v.value() / self.zero_crossing_current_a.value()
        }
    }
}

impl<T: Scalar> InverterNonlinearity<T> {
    /// What it takes of a commanded voltage at a current, V.
    #[inline(always)]
    pub fn taken_v(&self, u: Complex<T>, i_s: Complex<T>) -> Complex<T> {
        from_phases(self.shares(u, to_phases(i_s))) * self.voltage_v
    }

    /// What each phase loses, over U_d, at a commanded voltage and phase currents.
    #[inline(always)]
    pub fn shares(&self, u: Complex<T>, i: [T; 3]) -> [T; 3] {
        let w2 = self.zero_crossing_current_a * self.zero_crossing_current_a;
        let f = |i: T| i / (i * i + w2).sqrt();
        if self.ripple_a_per_v > T::zero() {
            let delta = self.ripple(to_phases(u));
            core::array::from_fn(|x| (f(i[x] + delta[x]) + f(i[x] - delta[x])).scale(0.5))
        } else {
            i.map(f)
        }
    }

    /// δ of each phase, A, at phase voltages.
    fn ripple(&self, u: [T; 3]) -> [T; 3] {
        let [a, b, c] = u;
        let middle = (a.max(b).max(c) + a.min(b).min(c)).scale(0.5);
        // d_x U_dc, between the rails.
        let high = u.map(|x| (x - middle + self.dc_voltage_v.scale(0.5)).max(T::zero()).min(self.dc_voltage_v));
        let third = 1.0 / 3.0;
        core::array::from_fn(|x| {
            let together = high.iter().fold(T::zero(), |sum, y| sum + high[x].min(*y));
            self.ripple_a_per_v * (high[x] - together.scale(third) - high[x] * u[x] / self.dc_voltage_v)
        })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::{Bridge, CarrierPwm, Fed, Legs};
    use crate::space_vector::unit;
    use proptest::prelude::*;

    const INDUCTANCE_H: f64 = 8e-3;

    /// An inductance against the mean voltage.
    struct Winding {
        i_s: Complex<f64>,
        emf: Complex<f64>,
        volt_seconds: Complex<f64>,
    }

    impl Fed<f64> for Winding {
        fn i_s(&self) -> Complex<f64> {
            self.i_s
        }
        fn hold(&mut self, u_s: Complex<f64>, duration: f64) {
            self.i_s += (u_s - self.emf) * (duration / INDUCTANCE_H);
            self.volt_seconds += u_s * duration;
        }
    }

    proptest! {
        /// What a bridge loses over a period at any voltage and currents of the size of the ripple, but where an edge meets zero current within a twentieth of an ampere: there
        /// the current changes sign within the dead time.
        #[test]
        fn the_ripple_decides_what_a_bridge_takes(size in 0.05..0.9f64, angle in 0.0..6.3f64, current in 0.0..1.0f64, turn in 0.0..6.3f64) {
            let (u_dc, t_d, t_sw) = (600.0, 2e-7, 100e-6);
            let bridge = Bridge { dead_time_s: t_d, ..Bridge::ideal(u_dc) };
            let u = unit(angle) * size * u_dc / 3f64.sqrt();
            let law = InverterNonlinearity {
                voltage_v: u_dc * t_d / t_sw,
                zero_crossing_current_a: 1e-6,
                ripple_a_per_v: t_sw / (2.0 * INDUCTANCE_H),
                dc_voltage_v: u_dc,
            };
            let i_s = unit(turn) * current;
            let (i, delta) = (to_phases(i_s), law.ripple(to_phases(u)));
            for x in 0..3 {
                prop_assume!((i[x] + delta[x]).abs() > 0.05 && (i[x] - delta[x]).abs() > 0.05);
            }
            // From the middle of the pulses of all legs.
            let pwm = CarrierPwm { half_period_s: 0.5 * t_sw };
            let duty = CarrierPwm::duty_cycles(&bridge, u);
            let mut legs = Legs::default();
            (0..3).for_each(|x| bridge.switch(&mut legs, x, true));
            bridge.hold(&mut legs, t_d, &mut Winding { i_s, emf: u, volt_seconds: u });
            let mut load = Winding { i_s, emf: u, volt_seconds: Complex::new(0.0, 0.0) };
            pwm.half_period(&bridge, &mut legs, duty, true, &mut load);
            pwm.half_period(&bridge, &mut legs, duty, false, &mut load);
            let taken = u - load.volt_seconds / t_sw;
            prop_assert!((taken - law.taken_v(u, i_s)).norm() < 0.02 * law.voltage_v, "{taken} {}", law.taken_v(u, i_s));
        }
    }
}
