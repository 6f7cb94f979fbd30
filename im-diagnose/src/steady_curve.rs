//! The static torque-speed curve of a machine: its steady states on a sinusoidal supply.

use im_model::{Held, Machine, MotorFile, Plant, steady_state};
use serde_json::{Map, Value, json};

/// Points of a curve in a file.
const POINTS: usize = 56;

/// Speed, rad/s, and electromagnetic torque, Nm, from standstill to a tenth above synchronous speed; speeds without a steady state are left
/// out. Effects that ripple (asymmetries, dead time, sensors) are left out of each state, as in [`steady_state`].
pub fn torque_speed(machine: &Machine<f64>, phase_voltage_peak_v: f64, frequency_hz: f64, points: usize) -> Vec<[f64; 2]> {
    let synchronous = std::f64::consts::TAU * frequency_hz / f64::from(machine.pole_pairs());
    let plant = Plant::new(machine);
    let at = |k: usize| {
        let omega_m = 1.1 * synchronous * k as f64 / (points.max(2) - 1) as f64;
        let state = steady_state(machine, phase_voltage_peak_v, frequency_hz, Held::Speed(omega_m)).ok()?;
        Some([omega_m, plant.torque(&state)])
    };
    (0..points.max(2)).filter_map(at).collect()
}

/// The curves of motors at their rated supply, each under a name, as pairs of speed and torque.
pub fn to_json(motors: &[(&str, &MotorFile)]) -> Value {
    let curve = |m: &MotorFile| torque_speed(&m.machine, m.rating.phase_voltage_peak_v, m.rating.electrical_frequency_hz, POINTS);
    let curves: Map<_, _> = motors.iter().map(|(name, m)| ((*name).to_owned(), json!(curve(m)))).collect();
    json!({"columns": ["omega_m_rad_s", "torque_Nm"], "curves": curves})
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kloss: without stator resistance T/T_max = 2/(s/s_max + s_max/s) with s_max = R_R/(ω L_ℓ), in Γ parameters.
    #[test]
    fn the_curve_of_the_linear_machine_is_that_of_kloss() {
        let named = im_model::machines::ALL[0];
        let p = im_model::TParameters { stator_resistance_ohm: 1e-7, ..named.parameters() };
        let machine = Machine::base(p, named.pole_pairs).unwrap();
        let (u, f) = (300.0, 50.0);
        let omega = std::f64::consts::TAU * f;
        // Seen from the stator's terminals the branches of the Γ circuit are parallel: the rotor's alone makes torque.
        let gamma = p.gamma();
        let breakdown = gamma.rotor_resistance_ohm / (omega * gamma.leakage_inductance_h);
        let most = 1.5 * f64::from(named.pole_pairs) * u * u / (2.0 * omega * omega * gamma.leakage_inductance_h);
        for [w, torque] in torque_speed(&machine, u, f, 40) {
            let slip = 1.0 - w * f64::from(named.pole_pairs) / omega;
            if slip.abs() > 1e-9 {
                let kloss = 2.0 * most / (slip / breakdown + breakdown / slip);
                assert!((torque - kloss).abs() < 1e-4 * most, "{w}: {torque} instead of {kloss}");
            }
        }
    }
}
