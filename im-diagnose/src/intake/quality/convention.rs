//! Whether voltage and current are given in the convention that is read: per phase, peak, amplitude-invariant.
//!
//! A steady state on the rated supply says how large the voltage should be, and the motor file how large the current: at the slip that
//! fits the angle best, |U/I| of the T circuit. Where the voltage is √3, √2 or √(3/2) of the rated one, or the current √2 of what it
//! should be, that is a convention. So it is where a fit leaves the motor file by the same factor in all impedances at once, or by that of the
//! power in the inertia alone, on a supply that is off by as much.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_6, PI, SQRT_2};

use im_model::{Complex, Machine, MotorFile, TParameters};

use super::steady::{Impedances, Steady};
use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity};
use crate::intake::mapping::VoltageForm;

/// A reading in another convention, by what it makes of things.
struct Cause {
    /// Voltage as read over the true one.
    voltage: f64,
    /// By which angle it leads the true one, rad.
    leads: f64,
    /// The same of U/I.
    impedance: f64,
    /// The same of the product of both, and with it of torque and inertia.
    power: f64,
    advice: &'static str,
}

const ROOT_3: f64 = 1.732_050_807_568_877_2;

const CAUSES: [Cause; 11] = [
    Cause {
        voltage: ROOT_3,
        leads: FRAC_PI_6,
        impedance: ROOT_3,
        power: ROOT_3,
        advice: "Are the voltages line to line, and read as those of the phases? Then name them ab, bc in [voltage].",
    },
    Cause {
        voltage: ROOT_3,
        leads: 0.0,
        impedance: ROOT_3,
        power: ROOT_3,
        advice: "Are the voltages as large as those from line to line? Then say gain = 0.5774 of their columns.",
    },
    Cause {
        voltage: ROOT_3,
        leads: 0.0,
        impedance: 3.0,
        power: 1.0,
        advice: "Is the machine connected in star, and the motor file for delta? Then multiply its resistances and inductances by 3, \
                 and its voltages and fluxes by 1.732.",
    },
    Cause {
        voltage: 1.0 / ROOT_3,
        leads: -FRAC_PI_6,
        impedance: 1.0 / ROOT_3,
        power: 1.0 / ROOT_3,
        advice: "Are the voltages those of the phases, and read as line to line? Then name them a, b, c in [voltage].",
    },
    Cause {
        voltage: 1.0 / ROOT_3,
        leads: 0.0,
        impedance: 1.0 / ROOT_3,
        power: 1.0 / ROOT_3,
        advice: "Are the voltages divided by the root of three once too often? Then say gain = 1.732 of their columns.",
    },
    Cause {
        voltage: 1.0 / ROOT_3,
        leads: 0.0,
        impedance: 1.0 / 3.0,
        power: 1.0,
        advice: "Is the machine connected in delta, and the motor file for star? Then divide its resistances and inductances by 3, and \
                 its voltages and fluxes by 1.732.",
    },
    Cause {
        voltage: FRAC_1_SQRT_2,
        leads: 0.0,
        impedance: FRAC_1_SQRT_2,
        power: FRAC_1_SQRT_2,
        advice: "Is the voltage rms, and read as instantaneous? Then say gain = 1.4142 of its columns.",
    },
    Cause {
        voltage: 1.0,
        leads: 0.0,
        impedance: SQRT_2,
        power: FRAC_1_SQRT_2,
        advice: "Is the current rms, and read as instantaneous? Then say gain = 1.4142 of its columns.",
    },
    Cause {
        voltage: 1.224_744_871_391_589,
        leads: 0.0,
        impedance: 1.0,
        power: 1.5,
        advice: "Are voltage and current power-invariant? Then say gain = 0.8165 of their columns.",
    },
    Cause {
        voltage: SQRT_2 * ROOT_3,
        leads: FRAC_PI_6,
        impedance: SQRT_2 * ROOT_3,
        power: SQRT_2 * ROOT_3,
        advice: "Are the voltages line to line, and scaled to their peak? Then name them ab, bc in [voltage], with gain = 0.7071.",
    },
    Cause {
        voltage: SQRT_2 * ROOT_3,
        leads: 0.0,
        impedance: SQRT_2 * ROOT_3,
        power: SQRT_2 * ROOT_3,
        advice: "Are the voltages line to line, and scaled to their peak? Then say gain = 0.4082 of their columns.",
    },
];

/// How near to a factor a ratio must come, relative: a supply is its rating to some percent.
const NEAR: f64 = 0.05;
/// A voltage this near its rating is the rated one, relative.
const RATED: f64 = 0.08;
/// How near the impedance must come where it alone tells, and where it must not contradict: the motor file is a first guess.
const IMPEDANCE: [f64; 2] = [0.1, 0.25];
/// A common factor of fitted parameters: how near their mean must come, and how far apart they may lie, as logarithms.
const COMMON: [f64; 2] = [0.15, 0.25];

fn off(x: f64, factor: f64) -> f64 {
    (x / factor).ln().abs()
}

/// What steady operation says, from half the rated frequency on, where the supply gives the rated voltage per frequency.
pub fn check(steady: &[Steady], form: &VoltageForm, motor: &MotorFile) -> Vec<Finding> {
    let rated = 2.0 * PI * motor.rating.electrical_frequency_hz;
    let usual = |s: &&Steady| (0.5..1.03).contains(&(s.omega.abs() / rated)) && s.i.norm() > s.against[1].norm();
    let Some(main) = steady.iter().filter(usual).max_by(|a, b| a.u.norm().total_cmp(&b.u.norm())) else { return Vec::new() };
    let z = main.u / main.i;
    let (z, omega) = (if main.omega < 0.0 { z.conj() } else { z }, main.omega.abs());
    let expected = motor.rating.phase_voltage_peak_v * (omega / rated).min(1.0);
    let voltage = main.u.norm() / expected;
    // With the phase of U/I known the slip follows, and with it the size.
    let size = |leads: f64| {
        let z = z * Complex::from_polar(1.0, -leads);
        ratio_at_angle(motor, z, omega).unwrap_or_else(|| Impedances::of(&motor.machine, expected, main).fit(z).ratio)
    };
    // Voltages turn where what was read as phases is line to line, or the other way.
    let may_turn = |c: &Cause| match form {
        VoltageForm::Lines(..) | VoltageForm::ThreeLines(_) => c.leads <= 0.0,
        _ => c.leads >= 0.0,
    };
    // A voltage that leads by what the slip may make of it fits both ways: the less far-fetched counts.
    let misfit = |c: &Cause| {
        let [voltage_within, impedance_within] = if c.voltage == 1.0 { [RATED, IMPEDANCE[0]] } else { [NEAR, IMPEDANCE[1]] };
        // A size costs as many steady states as there are slips: it is asked where the voltage fits.
        let impedance = (off(voltage, c.voltage) < voltage_within).then(|| off(size(c.leads), c.impedance))?;
        (impedance < impedance_within).then_some(impedance)
    };
    let shown = |c: &Cause| {
        format!(
            "In steady operation at {} Hz the voltage is {} V, {} times the {} V of the rating there, and |U/I| is {} times the motor file's{}",
            number(omega / (2.0 * PI), 3),
            number(main.u.norm(), 3),
            number(voltage, 3),
            number(expected, 3),
            number(size(c.leads), 3),
            if c.leads == 0.0 {
                String::new()
            } else {
                format!(" once the voltage is turned by {}°", number(-c.leads.to_degrees(), 2))
            }
        )
    };
    let best = CAUSES.iter().filter(|c| may_turn(c)).filter_map(|c| Some((misfit(c)?, c))).min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, c)| finding(shown(c), c).at(vec![main.rows.clone()])).into_iter().collect()
}

fn finding(shown: String, cause: &Cause) -> Finding {
    // Size and phase of the voltage, and |U/I|: three that agree.
    let severity = if cause.leads == 0.0 { Severity::Warning } else { Severity::Serious };
    Finding::new(FindingKind::Convention, severity, shown, cause.advice)
}

/// R_s, R_R, L_σ and L_M of one machine over those of another.
pub(crate) fn impedance_ratios(given: &TParameters<f64>, fitted: &TParameters<f64>) -> [f64; 4] {
    let (a, b) = (given.inverse_gamma(), fitted.inverse_gamma());
    [
        b.stator_resistance_ohm / a.stator_resistance_ohm,
        b.rotor_resistance_ohm / a.rotor_resistance_ohm,
        b.leakage_inductance_h / a.leakage_inductance_h,
        b.magnetizing_inductance_h / a.magnetizing_inductance_h,
    ]
}

/// What a fit says: all impedances of the machine are off by one factor, and the inertia by that of the power. Inertia alone is too often
/// guessed wrong: it takes a `supply` that is off as well, as a part of the rated one.
pub fn of_fit(given: &MotorFile, fitted: &Machine<f64>, supply: Option<f64>) -> Option<Finding> {
    let (before, after) = (given.machine.parameters(), fitted.parameters());
    let ratios = impedance_ratios(before, after);
    let impedance = (ratios.iter().map(|r| r.ln()).sum::<f64>() / 4.0).exp();
    let inertia = after.inertia_kg_m2 / before.inertia_kg_m2;
    // A voltage that is turned leaves no common factor.
    let fits = |c: &&Cause| {
        c.leads == 0.0
            && (c.impedance != 1.0 || supply.is_some_and(|u| off(u, c.voltage) < NEAR))
            && off(impedance, c.impedance) < COMMON[0]
            && off(inertia, c.power) < COMMON[1]
            && ratios.iter().all(|r| off(*r, c.impedance) < COMMON[1])
    };
    let cause = CAUSES.iter().find(fits)?;
    let [r_s, r_r, l_s, l_m] = ratios.map(|r| number(r, 3));
    let on = supply.filter(|_| cause.impedance == 1.0).map(|u| format!(", on {} times the rated voltage", number(u, 3)));
    let text = format!(
        "Against the motor file the fit has {r_s} times R_s, {r_r} times R_R, {l_s} times L_σ, {l_m} times L_M and {} times J{}: as one \
         factor in voltage or current would make of them",
        number(inertia, 3),
        on.unwrap_or_default()
    );
    Some(finding(text, cause))
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
    let turned = |s: f64| (model(s).arg() - z.arg()).abs();
    let slip = slips.min_by(|a, b| turned(*a).total_cmp(&turned(*b)))?;
    (turned(slip) < 0.05).then(|| z.norm() / model(slip).norm())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intake::mapping::Signal;

    /// The example's motor on its rated supply at a slip of 3 %, with voltage and current scaled, and the voltage turned.
    fn found(u: f64, i: f64, leads: f64) -> Vec<Finding> {
        let motor = MotorFile::parse(include_str!("../../../../examples/motor.toml"), "motor.toml").unwrap();
        let (p, omega) = (*motor.machine.parameters(), 2.0 * PI * motor.rating.electrical_frequency_hz);
        let j = Complex::<f64>::i();
        let rotor = p.rotor_resistance_ohm / 0.03 + j * omega * p.rotor_leakage_inductance_h;
        let main = j * omega * p.magnetizing_inductance_h;
        let z = p.stator_resistance_ohm + j * omega * p.stator_leakage_inductance_h + main * rotor / (main + rotor);
        let supply = Complex::from(motor.rating.phase_voltage_peak_v);
        let zero = Complex::from(0.0);
        let steady = Steady {
            rows: 0..400,
            omega,
            growth: 0.0,
            u: Complex::from_polar(supply.re * u, leads),
            i: supply / z * i,
            against: [zero; 2],
            omega_m: None,
        };
        let [a, b, c] = ["a", "b", "c"].map(Signal::plain);
        let read_as = if leads < 0.0 { VoltageForm::ThreeLines([a, b, c]) } else { VoltageForm::Phases([a, b, c]) };
        check(&[steady], &read_as, &motor)
    }

    #[test]
    fn conventions_are_asked_for_and_what_is_right_is_not() {
        let (root2, root3) = (SQRT_2, ROOT_3);
        for (u, i, leads, said) in [
            (root3, 1.0, FRAC_PI_6, "line to line, and read as those of the phases"),
            (root3, 1.0, 0.0, "gain = 0.5774"),
            (1.0 / root3, 1.0, -FRAC_PI_6, "those of the phases, and read as line to line"),
            (1.0 / root3, 1.0, 0.0, "gain = 1.732"),
            (root3, 1.0 / root3, 0.0, "connected in star"),
            (1.0 / root3, root3, 0.0, "connected in delta"),
            (1.0 / root2, 1.0, 0.0, "Is the voltage rms"),
            (1.0, 1.0 / root2, 0.0, "Is the current rms"),
            (1.5f64.sqrt(), 1.5f64.sqrt(), 0.0, "power-invariant"),
        ] {
            let all = found(u, i, leads);
            assert!(all.len() == 1 && all[0].advice.contains(said), "{u} {i} {leads}: {all:?}");
            assert!(all[0].kind == FindingKind::Convention && all[0].stops() == (leads != 0.0));
        }
        for (u, i) in [(1.0, 1.0), (0.95, 0.9), (1.05, 1.1), (0.5, 0.5), (1.0 / root2, 1.0 / root2)] {
            assert!(found(u, i, 0.0).is_empty(), "{u} {i}");
        }
    }

    #[test]
    fn one_factor_in_all_that_is_fitted_is_a_convention() {
        let given = MotorFile::parse(include_str!("../../../../examples/motor.toml"), "motor.toml").unwrap();
        let p = *given.machine.parameters();
        let scaled_on = |z: f64, j: f64, r_r: f64, supply: Option<f64>| {
            let fitted = given.machine.with_parameters(im_model::TParameters {
                stator_resistance_ohm: p.stator_resistance_ohm * z,
                rotor_resistance_ohm: p.rotor_resistance_ohm * z * r_r,
                stator_leakage_inductance_h: p.stator_leakage_inductance_h * z,
                rotor_leakage_inductance_h: p.rotor_leakage_inductance_h * z,
                magnetizing_inductance_h: p.magnetizing_inductance_h * z,
                inertia_kg_m2: p.inertia_kg_m2 * j,
                ..p
            });
            of_fit(&given, &fitted.unwrap(), supply).map(|f| f.advice)
        };
        let scaled = |z, j, r_r| scaled_on(z, j, r_r, Some(1.0));
        for (z, j, said) in [
            (ROOT_3, ROOT_3, "line to line"),
            (FRAC_1_SQRT_2, FRAC_1_SQRT_2, "Is the voltage rms"),
            (SQRT_2, FRAC_1_SQRT_2, "Is the current rms"),
        ] {
            assert!(scaled(z, j, 1.1).is_some_and(|advice| advice.contains(said)), "{z} {j}");
        }
        // A warm rotor, another inertia, a guess that was off in each parameter by something else.
        for (z, j, r_r) in
            [(1.0, 1.0, 1.0), (1.0, 1.5, 1.0), (1.0, 1.0, 1.5), (1.3, 1.0, 1.0), (1.0, 2.5, 1.0), (ROOT_3, ROOT_3, 0.6)]
        {
            assert_eq!(scaled(z, j, r_r), None, "{z} {j} {r_r}");
        }
        // Power-invariant: nothing but the inertia is off, and the supply.
        let root = 1.5f64.sqrt();
        assert!(scaled_on(1.0, 1.6, 1.1, Some(root)).is_some_and(|advice| advice.contains("power-invariant")));
        assert_eq!(scaled_on(1.0, 1.5, 1.0, None), None);
        assert_eq!(scaled_on(1.0, 1.0, 1.0, Some(root)), None);
    }
}
