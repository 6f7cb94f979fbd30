//! How well the T circuit is known, of which terminals show the inverse-Γ circuit alone: the ratio of the leakages is held as given.

use im_model::{BaseParameter, InverseGammaParameters, MotorFile, ParameterId};

use crate::uncertainty::{Estimates, MachineQuantity};

/// Parameters of the T circuit that depend on the ratio of the leakages.
pub const HELD: [BaseParameter; 4] = [
    BaseParameter::RotorResistance,
    BaseParameter::StatorLeakageInductance,
    BaseParameter::RotorLeakageInductance,
    BaseParameter::MagnetizingInductance,
];

/// Whether a parameter depends on the ratio of the leakages.
pub fn is_held(id: ParameterId) -> bool {
    matches!(id, ParameterId::Base(p) if HELD.contains(&p))
}

/// Standard deviations of the parameters of [`HELD`]: by those of the inverse-Γ circuit, and by the ratio of the leakages, which is known as
/// well as the design of the rotor is ([`MotorFile::leakage_ratio_std`]). NaN where the recordings determine no such circuit.
pub fn held_std(estimates: &Estimates, motor: &MotorFile) -> [f64; 4] {
    let of = |q: MachineQuantity| estimates.list.iter().position(|e| e.quantity == q);
    let circuit =
        [MachineQuantity::RotorResistance, MachineQuantity::LeakageInductance, MachineQuantity::MagnetizingInductance].map(of);
    let [Some(r), Some(l), Some(m)] = circuit else { return [f64::NAN; 4] };
    let given = motor.machine.parameters();
    let at = [r, l, m].map(|k| estimates.list[k].after);
    let t = |x: [f64; 4]| {
        let circuit = InverseGammaParameters {
            stator_resistance_ohm: given.stator_resistance_ohm,
            rotor_resistance_ohm: x[0],
            leakage_inductance_h: x[1],
            magnetizing_inductance_h: x[2],
        };
        let t = circuit.to_t(x[3], given.inertia_kg_m2, given.viscous_friction_nm_s_per_rad);
        HELD.map(|p| t.values()[p as usize])
    };
    let x = [at[0], at[1], at[2], given.leakage_ratio()];
    let slopes: [[f64; 4]; 4] = std::array::from_fn(|k| {
        let step = 1e-4 * x[k];
        let moved = |by: f64| t(std::array::from_fn(|j| if j == k { x[j] + by } else { x[j] }));
        let (low, high) = (moved(-step), moved(step));
        std::array::from_fn(|p| (high[p] - low[p]) / (2.0 * step))
    });
    let covariance = |a: usize, b: usize| match (a, b) {
        (3, 3) => (motor.leakage_ratio_std() * x[3]).powi(2),
        (3, _) | (_, 3) => 0.0,
        _ => estimates.covariance[([r, l, m][a], [r, l, m][b])],
    };
    std::array::from_fn(|p| {
        let mut variance = 0.0;
        for a in 0..4 {
            for b in 0..4 {
                variance += slopes[a][p] * covariance(a, b) * slopes[b][p];
            }
        }
        variance.max(0.0).sqrt()
    })
}
