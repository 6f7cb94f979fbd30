//! Closed-form steady state of the T circuit, to check the simulator against.

use super::machine::CatalogueMachine;
use super::plane::Vector;

/// Steady state at constant voltage, frequency and slip.
#[derive(Clone, Copy, Debug)]
pub struct SteadyState {
    /// Torque of the air gap, N m.
    pub torque_nm: f64,
    /// Stator current, peak, A; α along the voltage.
    pub current: Vector,
}

fn times(a: Vector, b: Vector) -> Vector {
    Vector::new(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x)
}

fn over(a: Vector, b: Vector) -> Vector {
    times(a, Vector::new(b.x, -b.y)) * (1.0 / b.dot(b))
}

/// Solves the T circuit with phasors: stator impedance, then magnetizing reactance beside R_r/s + jωL_lr.
pub fn steady_state(machine: &CatalogueMachine, voltage_v: f64, electrical_rad_s: f64, slip: f64) -> SteadyState {
    let w = electrical_rad_s;
    let stator = Vector::new(machine.stator_resistance_ohm, w * machine.stator_leakage_h);
    let rotor = Vector::new(machine.rotor_resistance_ohm / slip, w * machine.rotor_leakage_h);
    let main = Vector::new(0.0, w * machine.magnetizing_h);
    let parallel = over(times(rotor, main), rotor + main);
    let current = over(Vector::new(voltage_v, 0.0), stator + parallel);
    let rotor_current = over(times(current, main), rotor + main);
    let air_gap_power_w = 1.5 * rotor_current.dot(rotor_current) * machine.rotor_resistance_ohm / slip;
    SteadyState { torque_nm: air_gap_power_w * f64::from(machine.pole_pairs) / w, current }
}
