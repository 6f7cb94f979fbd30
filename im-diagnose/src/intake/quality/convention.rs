//! Whether voltage and current are given in the convention that is read: per phase, peak, amplitude-invariant.
//!
//! A steady state on the rated supply says how large the voltage should be, and the motor file how large the current: at the slip that
//! fits the angle best, |U/I| of the T circuit. A factor of √3, √2 or √(3/2) in either, where nothing else is off, is a convention.

use std::f64::consts::{PI, SQRT_2};

use im_model::{Complex, MotorFile};

use super::steady::{Steady, fit_slip};
use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity};

/// How near to a factor a ratio must come, relative: a supply is its rating to some percent.
const NEAR: f64 = 0.05;
/// The same of the impedance, which a first guess of the parameters gives.
const ROUGHLY: f64 = 0.1;
/// A voltage this near its rating is the rated one, relative.
const RATED: f64 = 0.08;

/// What steady operation at the rated frequency says.
pub fn check(steady: &[Steady], motor: &MotorFile) -> Vec<Finding> {
    let rated = 2.0 * PI * motor.rating.electrical_frequency_hz;
    let at_rated = |s: &&Steady| (s.omega.abs() / rated - 1.0).abs() < 0.03 && s.i.norm() > s.against[1].norm();
    let Some(main) = steady.iter().filter(at_rated).max_by(|a, b| a.u.norm().total_cmp(&b.u.norm())) else { return Vec::new() };
    let z = main.u / main.i;
    let z = if main.omega < 0.0 { z.conj() } else { z };
    let fit = fit_slip(motor.machine.parameters(), z, rated);
    let voltage = main.u.norm() / motor.rating.phase_voltage_peak_v;
    let is = |x: f64, factor: f64, near: f64| (x / factor - 1.0).abs() < near;
    let root3 = 3f64.sqrt();
    let root32 = 1.5f64.sqrt();
    // With the phase of U/I known the slip follows, and with it the size.
    let size = ratio_at_angle(motor, z, rated).unwrap_or(fit.ratio);
    let shown = format!(
        "In steady operation at {} Hz the voltage is {} V, {} times the rated {} V, and |U/I| is {} times the motor file's",
        number(main.omega.abs() / (2.0 * PI), 3),
        number(main.u.norm(), 3),
        number(voltage, 3),
        number(motor.rating.phase_voltage_peak_v, 3),
        number(size, 3)
    );
    let causes = [
        (root3, root3, "Are the voltages line to line, and read as those of the phases? Then name them ab, bc in [voltage]."),
        (1.0 / SQRT_2, 1.0 / SQRT_2, "Is the voltage rms, and read as instantaneous? Then say gain = 1.4142 of its columns."),
        (1.0, SQRT_2, "Is the current rms, and read as instantaneous? Then say gain = 1.4142 of its columns."),
        (root32, 1.0, "Are voltage and current power-invariant? Then say gain = 0.8165 of their columns."),
        (
            SQRT_2 * root3,
            SQRT_2 * root3,
            "Are the voltages line to line, and scaled to their peak? Then name them ab, bc in [voltage].",
        ),
    ];
    let near = |x: f64| if x == 1.0 { RATED } else { NEAR };
    let found = causes.iter().find(|(u, z, _)| is(voltage, *u, near(*u)) && is(size, *z, ROUGHLY));
    let found = found
        .map(|(.., advice)| Finding::new(FindingKind::Convention, Severity::Warning, shown, *advice).at(vec![main.rows.clone()]));
    found.into_iter().collect()
}

/// |Z|/|Z_model| at the motoring slip where the model has the angle of `z`; `None` where it has it nowhere.
fn ratio_at_angle(motor: &MotorFile, z: Complex<f64>, omega: f64) -> Option<f64> {
    let p = motor.machine.parameters();
    let j = Complex::<f64>::i();
    let model = |s: f64| {
        let rotor = p.rotor_resistance_ohm / s + j * omega * p.rotor_leakage_inductance_h;
        let main = j * omega * p.magnetizing_inductance_h;
        p.stator_resistance_ohm + j * omega * p.stator_leakage_inductance_h + main * rotor / (main + rotor)
    };
    // From no load to the best power factor the angle falls with the slip; beyond, no machine runs for long.
    let slips = (0..160).map(|k| 10f64.powf(-5.0 + 3.7 * f64::from(k) / 159.0));
    let off = |s: f64| (model(s).arg() - z.arg()).abs();
    let slip = slips.min_by(|a, b| off(*a).total_cmp(&off(*b)))?;
    (off(slip) < 0.05).then(|| z.norm() / model(slip).norm())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example's motor on its rated supply at a slip of 3 %, with voltage and current scaled.
    fn found(u: f64, i: f64) -> Vec<Finding> {
        let motor = MotorFile::parse(include_str!("../../../../examples/motor.toml"), "motor.toml").unwrap();
        let (p, omega) = (*motor.machine.parameters(), 2.0 * PI * motor.rating.electrical_frequency_hz);
        let j = Complex::<f64>::i();
        let rotor = p.rotor_resistance_ohm / 0.03 + j * omega * p.rotor_leakage_inductance_h;
        let main = j * omega * p.magnetizing_inductance_h;
        let z = p.stator_resistance_ohm + j * omega * p.stator_leakage_inductance_h + main * rotor / (main + rotor);
        let supply = Complex::from(motor.rating.phase_voltage_peak_v);
        let zero = Complex::from(0.0);
        let steady = Steady { rows: 0..400, omega, u: supply * u, i: supply / z * i, against: [zero; 2], omega_m: None };
        check(&[steady], &motor)
    }

    #[test]
    fn conventions_are_asked_for_and_what_is_right_is_not() {
        let (root2, root3) = (SQRT_2, 3f64.sqrt());
        for (u, i, said) in [
            (root3, 1.0, "line to line"),
            (1.0 / root2, 1.0, "Is the voltage rms"),
            (1.0, 1.0 / root2, "Is the current rms"),
            (1.5f64.sqrt(), 1.5f64.sqrt(), "power-invariant"),
        ] {
            let all = found(u, i);
            assert!(all.len() == 1 && all[0].advice.contains(said), "{u} {i}: {all:?}");
            assert!(all[0].kind == FindingKind::Convention && !all[0].stops());
        }
        for (u, i) in [(1.0, 1.0), (0.95, 0.9), (1.05, 1.1), (0.5, 0.5)] {
            assert!(found(u, i).is_empty(), "{u} {i}");
        }
    }
}
