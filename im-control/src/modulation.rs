//! Duty cycles and dwell times of a two-level bridge, and what its dead time takes.
//!
//! Carrier: d_x = ½ + (u_x + u_0)/U_dc. The zero sequence u_0 is free, as the star point floats: none gives sinusoidal modulation up to
//! U_dc/2; −(max + min)/2 centres the pulses, which is space-vector modulation and reaches U_dc/√3; pushing a phase to a rail leaves it
//! unswitched for a third of the time.

use im_model::simulation::Bridge;
use im_model::space_vector::{from_phases, to_phases};
use im_model::{Bound, Complex, ModelError, Scalar};

use crate::guard::{SIZE_OR_ZERO, check_sample_time};

/// How the zero sequence is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZeroSequence {
    /// None: sinusoidal modulation.
    None,
    /// Between the largest and the smallest phase: space-vector modulation.
    Centred,
    /// The smallest phase stays on the negative rail.
    Low,
    /// The largest phase stays on the positive rail.
    High,
}

/// Duty cycles, each from 0 to 1, the voltage that they make, and whether the one asked for was beyond reach and has been shortened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Duty<T> {
    /// The mean voltage that the bridge makes, V: what goes into the next sample ([`Measured::u_s`](im_model::simulation::Measured)). Zero without a link.
    pub u_s: Complex<T>,
    /// Share of the period on the positive rail, for a, b, c.
    pub duty: [T; 3],
    /// The voltage was shortened to what can be made.
    pub limited: bool,
}

/// Dc voltages that a bridge may have, V: what lies outside is no measurement.
const DC_VOLTAGES_V: [f64; 2] = [1e-3, 1e6];

/// A voltage that can be computed with, shortened to some times the dc voltage where it is absurd; `None` where it is no number, or the
/// dc voltage is none.
fn usable<T: Scalar>(u: Complex<T>, dc_voltage_v: T) -> Option<Complex<T>> {
    let [low, high] = DC_VOLTAGES_V.map(T::from_f64);
    // What is not a number fails every comparison.
    if !(dc_voltage_v >= low && dc_voltage_v <= high && u.re.is_finite() && u.im.is_finite()) {
        return None;
    }
    let (size, most) = (u.re.abs().max(u.im.abs()), dc_voltage_v * T::from_f64(100.0));
    Some(if size > most { Complex::new(u.re / size * most, u.im / size * most) } else { u })
}

/// Duty cycles for an average voltage, V. A voltage out of reach keeps its direction. Where the voltage is no number, or the dc voltage
/// not between 1 mV and 1 MV, all are ½ (`limited`): never does a timer get a NaN.
pub fn duty_cycles<T: Scalar>(u: Complex<T>, dc_voltage_v: T, zero_sequence: ZeroSequence) -> Duty<T> {
    let half = T::from_f64(0.5);
    let Some(u) = usable(u, dc_voltage_v) else {
        return Duty { u_s: Complex::new(T::zero(), T::zero()), duty: [half; 3], limited: true };
    };
    let phases = to_phases(u);
    let (most, least) = extremes(phases);
    let reach = match zero_sequence {
        // The largest phase alone meets the rail.
        ZeroSequence::None => most.max(-least) * T::from_f64(2.0),
        _ => most - least,
    };
    let limited = reach > dc_voltage_v;
    let shorter = if limited { dc_voltage_v / reach } else { T::one() };
    let [a, b, c] = phases.map(|x| x * shorter);
    let (most, least) = extremes([a, b, c]);
    let u_0 = match zero_sequence {
        ZeroSequence::None => T::zero(),
        ZeroSequence::Centred => -(most + least) * half,
        ZeroSequence::Low => -least - dc_voltage_v * half,
        ZeroSequence::High => dc_voltage_v * half - most,
    };
    // Rounding must not leave the range.
    let duty = [a, b, c].map(|x| ((x + u_0) / dc_voltage_v + half).max(T::zero()).min(T::one()));
    Duty { u_s: u * shorter, duty, limited }
}

fn extremes<T: Scalar>([a, b, c]: [T; 3]) -> (T, T) {
    (a.max(b).max(c), a.min(b).min(c))
}

/// The two active vectors beside a voltage, and for which share of the period each is on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dwell<T> {
    /// Sector 0 to 5: between the active vectors at 60°·k and 60°·(k + 1).
    pub sector: u8,
    /// Share of the vector at 60°·k.
    pub first: T,
    /// Share of the vector at 60°·(k + 1).
    pub second: T,
    /// Share of the two zero vectors together.
    pub zero: T,
}

/// Space-vector modulation as dwell times, for timers that are loaded with vectors. A voltage beyond the hexagon is shortened to it; where
/// [`duty_cycles`] gives ½ everywhere, the zero vectors have the whole period.
pub fn dwell_times<T: Scalar>(u: Complex<T>, dc_voltage_v: T) -> Dwell<T> {
    let Some(u) = usable(u, dc_voltage_v) else {
        return Dwell { sector: 0, first: T::zero(), second: T::zero(), zero: T::one() };
    };
    let [a, b, c] = to_phases(Bridge::ideal(dc_voltage_v).limited(u)).map(|x| x / dc_voltage_v);
    // The order of the phases is the sector; the steps between them are the shares.
    let (sector, [high, middle, low]) = match (a >= b, b >= c, c >= a) {
        (true, true, _) => (0, [a, b, c]),
        (false, true, false) => (1, [b, a, c]),
        (false, true, true) => (2, [b, c, a]),
        (false, false, _) => (3, [c, b, a]),
        (true, false, true) => (4, [c, a, b]),
        (true, false, false) => (5, [a, c, b]),
    };
    let (one, two) = (high - middle, middle - low);
    // In odd sectors the vector with two phases high comes first.
    let (first, second) = if sector % 2 == 0 { (one, two) } else { (two, one) };
    // Rounding must not fill more than the period.
    let first = first.max(T::zero()).min(T::one());
    let second = second.max(T::zero()).min(T::one() - first);
    Dwell { sector, first, second, zero: (T::one() - first - second).max(T::zero()) }
}

/// Adds what dead time and device drop will take: per phase (U_dc t_d/T_sw + V_f) f(i_x) + r i_x, f(x) = x/√(I₀² + x²).
///
/// The rounding near zero current keeps noise from switching the whole amount back and forth, and is the averaged effect of ripple.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadTimeCompensation<T> {
    /// t_d, s.
    pub dead_time_s: T,
    /// T_sw: time of one edge up and one down, s.
    pub switching_period_s: T,
    /// V_f: forward voltage of the devices, V.
    pub drop_v: T,
    /// r: their differential resistance, Ω.
    pub on_resistance_ohm: T,
    /// I₀: current at which 71 % is compensated, A.
    pub soft_current_a: T,
}

impl<T: Scalar> DeadTimeCompensation<T> {
    /// For a bridge that switches with `switching_period_s`.
    pub fn of(bridge: &Bridge<T>, switching_period_s: T, soft_current_a: T) -> Self {
        Self {
            dead_time_s: bridge.dead_time_s,
            switching_period_s,
            drop_v: bridge.drop_v,
            on_resistance_ohm: bridge.on_resistance_ohm,
            soft_current_a,
        }
    }

    /// Checks the values.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        check_sample_time("switching_period_s", self.switching_period_s)?;
        Bound::Within(0.0, 0.5 * self.switching_period_s.value()).check("dead_time_s", self.dead_time_s.value())?;
        SIZE_OR_ZERO.check("drop_v", self.drop_v.value())?;
        SIZE_OR_ZERO.check("on_resistance_ohm", self.on_resistance_ohm.value())?;
        Bound::OfMachines(1e-6, 1e6).check("soft_current_a", self.soft_current_a.value())
    }

    /// The voltage to add to a command at the current `i_s`, V.
    #[inline]
    pub fn voltage(&self, i_s: Complex<T>, dc_voltage_v: T) -> Complex<T> {
        let lost = dc_voltage_v * self.dead_time_s / self.switching_period_s + self.drop_v;
        let soft = self.soft_current_a * self.soft_current_a;
        from_phases(to_phases(i_s).map(|i| lost * i / (i * i + soft).sqrt())) + i_s * self.on_resistance_ohm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::simulation::CarrierPwm;
    use im_model::space_vector::unit;
    use proptest::prelude::*;

    /// The mean voltage of duty cycles.
    fn mean(duty: [f64; 3], u_dc: f64) -> Complex<f64> {
        from_phases(duty) * u_dc
    }

    /// Numbers as a fault leaves them, and some good ones.
    fn anything() -> impl Strategy<Value = f64> {
        prop_oneof![
            prop::num::f64::ANY,
            prop::sample::select(vec![0.0, -0.0, 5e-324, 1e-310, 1e38, 1e300, f64::MAX, f64::NAN, f64::INFINITY, 600.0, 5e-39]),
            -1e3..1e3f64,
        ]
    }

    fn timers<T: Scalar>(u: [f64; 2], dc: f64) -> Vec<f64> {
        let (u, dc) = (Complex::new(T::from_f64(u[0]), T::from_f64(u[1])), T::from_f64(dc));
        let w = dwell_times(u, dc);
        let zeros = [ZeroSequence::None, ZeroSequence::Centred, ZeroSequence::Low, ZeroSequence::High];
        let duties = zeros.into_iter().flat_map(|z| duty_cycles(u, dc, z).duty);
        duties.chain([w.first, w.second, w.zero]).map(|x| x.value()).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

        /// Whatever comes in, a timer gets a share of its period.
        #[test]
        fn no_timer_ever_gets_a_nan(a in anything(), b in anything(), dc in anything()) {
            for x in timers::<f64>([a, b], dc).into_iter().chain(timers::<f32>([a, b], dc)) {
                prop_assert!((0.0..=1.0).contains(&x), "{x} of {a} {b} at {dc}");
            }
        }
    }

    proptest! {
        #[test]
        fn every_zero_sequence_gives_the_voltage_within_its_reach(size in 0.0..0.5f64, angle in -7.0..7.0f64) {
            let u = unit(angle) * size * 600.0;
            for z in [ZeroSequence::None, ZeroSequence::Centred, ZeroSequence::Low, ZeroSequence::High] {
                let d = duty_cycles(u, 600.0, z);
                prop_assert!(!d.limited && (mean(d.duty, 600.0) - u).norm() < 1e-9 && d.u_s == u, "{z:?} {d:?}");
            }
            prop_assert!(duty_cycles(u, 600.0, ZeroSequence::Low).duty.into_iter().any(|d| d == 0.0 || d.abs() < 1e-12));
        }

        #[test]
        fn out_of_reach_the_direction_stays(size in 0.7..5.0f64, angle in -7.0..7.0f64) {
            let u = unit(angle) * size * 600.0;
            for z in [ZeroSequence::None, ZeroSequence::Centred, ZeroSequence::Low, ZeroSequence::High] {
                let d = duty_cycles(u, 600.0, z);
                let made = mean(d.duty, 600.0);
                prop_assert!(d.limited && (made / made.norm() - u / u.norm()).norm() < 1e-9 && (made - d.u_s).norm() < 1e-9, "{z:?}");
                prop_assert!(made.norm() >= 299.999 && d.duty.into_iter().all(|d| (0.0..=1.0).contains(&d)));
            }
        }

        /// The two ways to space-vector modulation, and the model's own, are one.
        #[test]
        fn dwell_times_are_the_centred_duty_cycles(size in 0.0..0.9f64, angle in -7.0..7.0f64) {
            let u = unit(angle) * size * 600.0;
            let w = dwell_times(u, 600.0);
            let vector = |k: u8| unit(f64::from(k) * std::f64::consts::FRAC_PI_3) * (2.0 / 3.0 * 600.0);
            let made = vector(w.sector) * w.first + vector(w.sector + 1) * w.second;
            let limited = Bridge::ideal(600.0).limited(u);
            prop_assert!((made - limited).norm() < 1e-9, "{w:?}: {made} {limited}");
            prop_assert!((w.first + w.second + w.zero - 1.0).abs() < 1e-12 && w.first >= 0.0 && w.second >= 0.0);
            let (a, b) = (duty_cycles(u, 600.0, ZeroSequence::Centred).duty, CarrierPwm::duty_cycles(&Bridge::ideal(600.0), u));
            prop_assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12));
        }
    }

    #[test]
    fn no_link_gives_half_of_it() {
        assert_eq!(duty_cycles(Complex::new(1.0, 0.0), f64::NAN, ZeroSequence::Centred).duty, [0.5; 3]);
        assert_eq!(dwell_times(Complex::new(1.0, 0.0), 0.0).zero, 1.0);
    }
}
