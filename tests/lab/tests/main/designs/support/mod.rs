//! Random machines, and how many of them.

#![allow(dead_code, unused_imports)] // each of its users takes a part

mod every;
mod region;

pub use every::every;
pub use region::region;

use im_design::LinearMachine;
use im_design::matrix::Matrix;
use im_model::TParameters;
use proptest::prelude::*;

/// Few by default, to keep the tests quick; `PROPTEST_CASES=2000` for the long run. A test fails when it had to reject
/// more than one machine or point in twenty (one, where there are fewer than twenty).
pub fn cases(few: u32) -> ProptestConfig {
    let standard = ProptestConfig::default();
    let cases = if std::env::var_os("PROPTEST_CASES").is_some() { standard.cases } else { few };
    ProptestConfig { cases, max_global_rejects: (cases / 20).max(1), ..standard }
}

/// Per-unit parameters of standard induction machines, scaled to a power at 400 V, 50 Hz.
pub fn machine() -> impl Strategy<Value = LinearMachine> {
    let power = (400f64.ln()..75e3f64.ln()).prop_map(f64::exp);
    (power, 1u32..=4, 0.0..1.0f64, 0.0..1.0f64, 0.0..1.0f64, 0.06..0.14f64, 1.5..4.0f64, 0.3..3.0f64).prop_map(
        |(power, pole_pairs, a, b, friction, leakage, magnetizing, inertia)| {
            // Base impedance by apparent power; resistances fall with size.
            let z = 400.0 * 400.0 / (power / 0.7);
            let l = z / (2.0 * std::f64::consts::PI * 50.0);
            let small = (power / 1000.0).powf(-0.35).min(1.3);
            let (l_m, l_leak) = (magnetizing * l, leakage * l);
            let speed = 2.0 * std::f64::consts::PI * 50.0 / f64::from(pole_pairs);
            let inertia_kg_m2 = inertia * 0.2 * power / (speed * speed);
            LinearMachine {
                stator_resistance_ohm: z * small * (0.02 + 0.06 * a),
                rotor_resistance_ohm: z * small * (0.02 + 0.05 * b),
                stator_inductance_h: l_m + l_leak,
                rotor_inductance_h: l_m + 1.1 * l_leak,
                mutual_inductance_h: l_m,
                pole_pairs,
                inertia_kg_m2,
                viscous_friction_n_m_s: inertia_kg_m2 * (0.01 + friction),
            }
        },
    )
}

/// The same machine as parameters of the T circuit.
pub fn t_parameters(m: &LinearMachine) -> TParameters<f64> {
    TParameters {
        stator_resistance_ohm: m.stator_resistance_ohm,
        rotor_resistance_ohm: m.rotor_resistance_ohm,
        stator_leakage_inductance_h: m.stator_inductance_h - m.mutual_inductance_h,
        rotor_leakage_inductance_h: m.rotor_inductance_h - m.mutual_inductance_h,
        magnetizing_inductance_h: m.mutual_inductance_h,
        inertia_kg_m2: m.inertia_kg_m2,
        viscous_friction_nm_s_per_rad: m.viscous_friction_n_m_s,
    }
}

/// The same machine as a model.
pub fn modelled(m: &LinearMachine) -> im_model::Machine<f64> {
    im_model::Machine::base(t_parameters(m), m.pole_pairs).unwrap()
}

/// The machine of `examples/motor.toml`, with friction that Thau's observer can rely on.
pub fn four_kilowatts() -> LinearMachine {
    LinearMachine {
        stator_resistance_ohm: 1.5,
        rotor_resistance_ohm: 0.9,
        stator_inductance_h: 0.16,
        rotor_inductance_h: 0.16,
        mutual_inductance_h: 0.156,
        pole_pairs: 2,
        inertia_kg_m2: 0.045,
        viscous_friction_n_m_s: 0.002,
    }
}

pub fn top_speed(machine: &LinearMachine) -> f64 {
    1.1 * 2.0 * std::f64::consts::PI * 50.0 / f64::from(machine.pole_pairs)
}

/// e(t) by the exponential of each constant stretch, e' = A e; returns √(eᵀPe) before and after.
pub fn decay(a: &Matrix<f64>, p: &Matrix<f64>, e: &mut Matrix<f64>, time: f64) -> (f64, f64) {
    let size = |e: &Matrix<f64>| (&(&e.t() * p) * e)[(0, 0)].sqrt();
    let before = size(e);
    let steps = (a.norm() * time * 4.0).ceil().clamp(1.0, 2e5) as usize;
    let h = time / steps as f64;
    for _ in 0..steps {
        // Taylor to fourth order: the step is a quarter of the inverse norm.
        let mut term = e.clone();
        for k in 1..=4 {
            term = (a * &term).scaled(&(h / f64::from(k)));
            *e = &*e + &term;
        }
    }
    (before, size(e))
}
