//! The recording against the motor file: order and sign of the phases, pole pairs, the speed's scale, another machine altogether.

use std::f64::consts::{FRAC_PI_3, PI};
use std::ops::RangeInclusive;

use im_model::{Complex, MotorFile};

use super::steady::{ImpedanceFit, Impedances, Steady};
use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity};
use crate::intake::unit::SPEEDS_MISREAD;

/// Beyond this |ln(Z/Z_model)| the impedance does not fit: half or one and a half times, or thirty degrees.
const MISFIT: f64 = 0.5;
/// Beyond this it is no guess of the machine that is off, but a column or a unit: five times, or a fifth.
const BEYOND_GUESSES: f64 = 1.6;
/// A turn of the current explains a misfit when it leaves no more of it than this share.
const EXPLAINED: f64 = 0.4;

/// So much faster than its field no machine turns: the speed is in another unit, or of something else.
const ANOTHER_UNIT: f64 = 3.0;

/// Magnetizing inductance over the sum of the leakages, of any machine.
const MAIN_OVER_LEAKAGE: RangeInclusive<f64> = 0.5..=500.0;

/// A speed below this share of the supply's is that of a machine that stands.
const STANDS: f64 = 1e-3;

/// What steady operation says against the motor file; `locked` where the rotor is said to be.
pub fn check(steady: &[Steady], motor: &MotorFile, columns: &str, locked: bool) -> Vec<Finding> {
    let mut out: Vec<Finding> = inductances(motor).into_iter().collect();
    let size = |s: &Steady| s.i.norm().max(s.against[1].norm());
    let largest = steady.iter().map(size).fold(0.0, f64::max);
    let loud: Vec<&Steady> = steady.iter().filter(|s| size(s) > 0.1 * largest && s.u.norm() > 0.0).collect();
    // The longest story first: the stretch with the largest voltage.
    let Some(main) = loud.iter().copied().max_by(|a, b| a.u.norm().total_cmp(&b.u.norm())) else { return out };
    if main.against[1].norm() > main.i.norm() {
        out.push(
            Finding::new(
                FindingKind::SwappedPhases,
                Severity::Serious,
                format!("The currents ({columns}) turn against the voltages: two phases are exchanged in one of them"),
                "Exchange two phases of the voltage or of the current in the mapping.",
            )
            .at(vec![main.rows.clone()]),
        );
        return out;
    }
    let models: Vec<Impedances> = loud.iter().map(|s| Impedances::of(&motor.machine, s.u.norm(), s)).collect();
    let turned = |(s, model): (&Steady, &Impedances), by: f64| {
        // In the negative sequence everything is mirrored.
        let z = s.u / s.i * Complex::from_polar(1.0, by);
        model.fit(if s.omega < 0.0 { z.conj() } else { z })
    };
    let all = || loud.iter().copied().zip(&models);
    let mean_off = |by: f64| all().map(|one| turned(one, by).off).sum::<f64>() / loud.len() as f64;
    let off = mean_off(0.0);
    let mut fits = true;
    if off > MISFIT {
        fits = false;
        let turns =
            [(PI, "point the other way"), (2.0 * FRAC_PI_3, "are one phase off"), (-2.0 * FRAC_PI_3, "are one phase off")];
        let best = turns.iter().map(|(by, what)| (mean_off(*by), what)).min_by(|a, b| a.0.total_cmp(&b.0));
        match best {
            Some((left, what)) if left < EXPLAINED * off && left < MISFIT => out.push(
                Finding::new(
                    FindingKind::SwappedPhases,
                    Severity::Serious,
                    format!("The currents ({columns}) {what} against the voltages: turned back they would fit the motor"),
                    if left == mean_off(PI) {
                        "Turn their sign: gain = -1 in [current]."
                    } else {
                        "Name the phases of the current in the order of those of the voltage."
                    },
                )
                .at(vec![main.rows.clone()]),
            ),
            _ => {
                let fit = turned((main, &Impedances::of(&motor.machine, main.u.norm(), main)), 0.0);
                let per_unit = per_unit(main, fit.ratio, motor);
                let far = fit.off > BEYOND_GUESSES;
                let severity = if far || per_unit.is_some() { Severity::Serious } else { Severity::Warning };
                let also =
                    if far { " Are voltages and currents exchanged? Is an inductance of the motor file in mH?" } else { "" };
                let advice = format!(
                    "Check that motor file and recording are of the same machine, star or delta, and the units and gains of voltage \
                     and current.{also}"
                );
                out.push(
                    Finding::new(
                        FindingKind::DifferentMachine,
                        severity,
                        format!(
                            "In steady operation at {} Hz the machine takes {} A at {} V: {} times the impedance of the motor file at \
                             the slip that fits best ({} off in all)",
                            number(main.omega.abs() / (2.0 * PI), 3),
                            number(main.i.norm(), 3),
                            number(main.u.norm(), 3),
                            number(fit.ratio, 2),
                            number(fit.off, 2)
                        ),
                        per_unit.unwrap_or(advice),
                    )
                    .at(vec![main.rows.clone()]),
                );
            }
        }
    }
    if fits {
        let fits: Vec<ImpedanceFit> = all().map(|one| turned(one, 0.0)).collect();
        out.extend(speed(&loud, motor, &fits, locked));
    }
    let unbalance = main.against[1].norm() / main.i.norm();
    let supply = main.against[0].norm() / main.u.norm().max(1e-12);
    if unbalance > 0.1 && unbalance > 8.0 * supply {
        let text = format!(
            "The currents are unbalanced by {} %, the voltages by {} %",
            number(100.0 * unbalance, 2),
            number(100.0 * supply, 2)
        );
        let advice = "Check the gains of the current sensors, and the machine for an open or shorted winding.";
        out.push(Finding::new(FindingKind::Unbalance, Severity::Warning, text, advice).at(vec![main.rows.clone()]));
    }
    out
}

/// An inductance of the motor file that is a thousand times another is in another unit: no steady state would tell, as the slip is free.
fn inductances(motor: &MotorFile) -> Option<Finding> {
    let p = motor.machine.parameters();
    let leakage = p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h;
    let ratio = p.magnetizing_inductance_h / leakage;
    (!MAIN_OVER_LEAKAGE.contains(&ratio)).then(|| {
        let text = format!(
            "In the motor file the magnetizing inductance, {} H, is {} times both leakages, {} H; 5 to 60 times is usual",
            number(p.magnetizing_inductance_h, 3),
            number(ratio, 2),
            number(leakage, 3)
        );
        let advice = "Is one of them in mH? All are in H.";
        Finding::new(FindingKind::DifferentMachine, Severity::Serious, text, advice)
    })
}

/// What to write where currents are multiples of the rated one: the impedance is as many times too large as the rated current has amperes, as
/// well as a nameplate tells that.
fn per_unit(main: &Steady, ratio: f64, motor: &MotorFile) -> Option<String> {
    let amperes = motor.rating.current_peak_a(motor.machine.parameters(), motor.machine.pole_pairs());
    let are = ratio > 4.0 && (0.4..1.8).contains(&(ratio / amperes)) && main.i.norm() < 10.0;
    are.then(|| {
        format!(
            "These are the sizes of currents in per unit. Write what one of them is, about gain = {} in [current] by the rating in the \
             motor file. If they are no such numbers, check that motor file and recording are of the same machine.",
            number(amperes, 2)
        )
    })
}

/// Sign, scale and pole pairs of the speed.
fn speed(loud: &[&Steady], motor: &MotorFile, fits: &[ImpedanceFit], locked: bool) -> Option<Finding> {
    let n_p = f64::from(motor.machine.pole_pairs());
    // (shown, expected) electrical speeds over the supply's, where the machine is on the steep part of its curve.
    let seen: Vec<(f64, f64, &Steady)> = loud
        .iter()
        .zip(fits)
        .filter_map(|(s, fit)| Some((n_p * s.omega_m? / s.omega, 1.0 - fit.slip, *s)))
        .filter(|(_, expected, _)| (0.8..1.1).contains(expected))
        .collect();
    let (shown, expected, at) = *seen.iter().max_by(|a, b| a.2.u.norm().total_cmp(&b.2.u.norm()))?;
    let factor = shown / expected;
    if (factor - 1.0).abs() < 0.08 || shown == 0.0 && at.omega_m == Some(0.0) && expected < 0.82 {
        return None;
    }
    let rows = vec![at.rows.clone()];
    let shows = number(at.omega_m.unwrap_or(0.0), 3);
    let should = number(expected * at.omega / n_p, 3);
    if seen.iter().all(|(shown, ..)| shown.abs() < STANDS) {
        let (what, advice) = if locked {
            (
                "The rotor is said to be locked",
                "Name the column of its speed in [speed], or leave [speed] out: the impedance is that of a rotor that turns.",
            )
        } else {
            ("The speed stays at 0 rad/s", "Its sensor is dead or the wrong column is named: leave [speed] out, or name another.")
        };
        let text = format!("{what} where supply frequency and current ask for {should} rad/s");
        return Some(Finding::new(FindingKind::DeadChannel, Severity::Serious, text, advice).at(rows));
    }
    if seen.iter().all(|(f, ..)| *f < 0.0) && (factor.abs() - 1.0).abs() < 0.08 {
        let text = format!(
            "The speed is {shows} rad/s while the phases turn the other way: two phases are exchanged, or the speed's sign"
        );
        let advice = "Turn the speed's sign (gain = -1 in [speed]), or exchange two phases of voltage and current alike.";
        return Some(Finding::new(FindingKind::SwappedPhases, Severity::Serious, text, advice).at(rows));
    }
    let by_current = format!("the speed shows {shows} rad/s where supply frequency and current ask for {should} rad/s");
    let size = factor.abs();
    let close = |x: f64| (size / x - 1.0).abs() < 0.06;
    let pairs = (n_p / size).round();
    if let Some((_, is, read)) = SPEEDS_MISREAD.iter().find(|(f, ..)| close(*f)) {
        let advice = format!("It is in {is} and read as {read}: unit = \"{is}\" in [speed].");
        let text = format!("The speed has another unit: {by_current}");
        return Some(Finding::new(FindingKind::SpeedScale, Severity::Serious, text, advice).at(rows));
    }
    if (1.0..=12.0).contains(&pairs) && pairs != n_p && close(n_p / pairs) {
        let text = format!("The pole pairs do not fit: {by_current}, with the motor file's {n_p} pole pairs");
        let electrical = if close(n_p) { ", or the speed is electrical (electrical = true in [speed])" } else { "" };
        let advice = format!("The machine has {pairs} pole pairs{electrical}.");
        return Some(Finding::new(FindingKind::WrongPolePairs, Severity::Serious, text, advice).at(rows));
    }
    let text = format!("The speed's gain is off: {by_current}");
    let advice = format!(
        "Multiply its gain by {}, or calibrate it by a stretch of known speed. If the speed is right, the voltage is not what it is taken for: is it \
         line to line, and read as that of the phases?",
        number(1.0 / factor, 4)
    );
    let severity = if size > ANOTHER_UNIT { Severity::Serious } else { Severity::Warning };
    Some(Finding::new(FindingKind::SpeedScale, severity, text, advice).at(rows))
}
