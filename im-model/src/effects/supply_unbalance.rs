//! Supply unbalance: the phase voltages differ, and only a balanced system was recorded or commanded.
//!
//! u = u* + (v_α + j v_β) ū*
//!
//! Phase voltages (1 + d_a)u_a*, (1 + d_b)u_b*, (1 + d_c)u_c* with Σd = 0 give v_α + j v_β = (d_a + a² d_b + a d_c)/3, a = e^{j2π/3}: the
//! mirror image turns backwards with the supply. |v| is the voltage unbalance factor, negative over positive sequence.

use num_complex::Complex;

use super::{About, Card, Place, SteadyState, effect};
use crate::error::Bound;

effect! {
    /// A negative sequence in the applied voltage, in proportion to it.
    SupplyUnbalance, "supply_unbalance",
    about: About { steady_state: SteadyState::Ripples, ..About::at(Place::Voltage) },
    card: Card {
        title: "Supply unbalance",
        what: "The phase voltages differ: (v_α + jv_β) times the mirrored voltage is applied in addition. |v| is the unbalance factor.",
        shows: "Negative-sequence current that depends on the voltage and not on the load, many times the voltage's unbalance in per cent; torque ripple at twice the supply frequency.",
        rivals: &[
            ("current_sensor_gain", "unbalances what is shown in proportion to the current; the supply unbalances the real current, alike at every load"),
            ("stator_asymmetry", "drops voltage in proportion to the current: more under load"),
        ],
        test: "No load and load at one voltage: the backward current of the supply stays; or measure all three voltages.",
        place: "applied voltage",
        source: "symmetrical components; voltage unbalance factor as in IEC 61000-2-2 and IEC 60034-26",
    },
    parameters: {
        /// Negative over positive sequence, α part.
        negative_alpha: Strength, default 0.0, "", One, typical 0.002 to 0.05, Bound::Within(-0.5, 0.5);
        /// Negative over positive sequence, β part.
        negative_beta: Strength, default 0.0, "", One, typical 0.002 to 0.05, Bound::Within(-0.5, 0.5);
    },
    hooks: {
        #[inline(always)]
        fn applied_voltage(&self, u: Complex<T>, _i_s: Complex<T>) -> Complex<T> {
            u + Complex::new(self.negative_alpha, self.negative_beta) * u.conj()
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for SupplyUnbalance<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        let caption = "Applied less recorded magnitude of the voltage over its direction (0° is phase a).";
        super::Frame::new("direction of the voltage, °", "applied minus recorded, %", (0.0, 360.0), caption)
    }

    fn law(&self, _on: &super::Rated, x: f64) -> f64 {
        let image = Complex::from_polar(1.0, -2.0 * x.to_radians()) * Complex::new(self.negative_alpha, self.negative_beta);
        100.0 * ((image + 1.0).norm() - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::trying::*;
    use super::*;
    use crate::EffectId::{self, CurrentSensorGain, StatorAsymmetry, SupplyUnbalance};
    use crate::effects::Hooks;

    #[test]
    fn three_unequal_phases_are_what_the_card_says() {
        let a = Complex::from_polar(1.0, core::f64::consts::TAU / 3.0);
        let d = [0.03, -0.01, -0.02];
        let v = (a * a * d[1] + a * d[2] + d[0]) / 3.0;
        let effect = super::SupplyUnbalance { negative_alpha: v.re, negative_beta: v.im };
        for u in [Complex::new(300.0, 20.0), Complex::new(-50.0, 200.0)] {
            let phases: [f64; 3] = core::array::from_fn(|k| (1.0 + d[k]) * crate::space_vector::to_phases(u)[k]);
            assert!(
                (effect.applied_voltage(u, Complex::new(0.0, 0.0)) - crate::space_vector::from_phases(phases)).norm() < 1e-10
            );
        }
    }

    /// Backward current at 4 % slip over that without load.
    fn under_load(id: EffectId) -> f64 {
        let m = match id {
            // Its unbalance, not its common part, is what is confused.
            CurrentSensorGain => machine(|e| e.current_sensor_gain.unbalance_alpha = 0.02),
            _ => with(id),
        };
        let backward = |speed| current(&running(&m, RATED_V, speed), -50.0).norm();
        backward(0.96 * SYNCHRONOUS) / backward(SYNCHRONOUS)
    }

    #[test]
    fn differs_from_current_sensor_gain() {
        assert!((under_load(SupplyUnbalance) - 1.0).abs() < 0.05 && under_load(CurrentSensorGain) > 1.5);
    }

    #[test]
    fn differs_from_stator_asymmetry() {
        assert!((under_load(SupplyUnbalance) - 1.0).abs() < 0.05 && under_load(StatorAsymmetry) > 1.5);
    }
}
