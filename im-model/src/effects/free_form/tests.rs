use core::f64::consts::PI;

use num_complex::Complex;

use super::{Acts, COEFFICIENTS, FreeForm, Over};
use crate::dual::SingleDual;
use crate::effects::EffectId;
use crate::effects::trying::{RATED_V, SYNCHRONOUS, T, machine};
use crate::machines::MOTULATOR_2_2_KW as M;
use crate::motor_file::MotorFile;
use crate::{Bench, Machine, ParameterId, Plant, PlantInput, State};

/// Every free-form effect, on a range that a run at rated frequency passes through, with uneven coefficients of its usual size.
fn every() -> Vec<(EffectId, Machine<f64>)> {
    FreeForm::all()
        .map(|(acts, over)| {
            let range = match over {
                Over::Speed if acts == Acts::Torque => (-20.0, 1.1 * SYNCHRONOUS),
                Over::Speed => (0.0, 1.1 * SYNCHRONOUS),
                Over::Time => (0.0, 0.1),
                Over::Current => (0.0, 20.0),
                Over::Slip => (0.0, 350.0),
                Over::Flux => (0.0, 1.4),
                Over::Lag => (-4.0, -2.0),
                Over::ShaftAngle | Over::FluxDirection => (0.0, 1.0),
            };
            let id = EffectId::Custom(FreeForm::define(acts, over, range, 2.0));
            let unit = M.rating.unit_of(id.parameters()[0].scale, &M.parameters(), M.pole_pairs);
            let size = 0.3 * id.parameters()[0].typical.1 * unit;
            let with = machine(|e| {
                for k in 0..COEFFICIENTS {
                    e.set(id, k, size * (1.0 + 0.4 * (k as f64 * 1.7).sin()));
                }
            });
            (id, with)
        })
        .collect()
}

/// Speed and currents over the first tenth of a second on rated voltage, from a speed.
fn run(m: &Machine<f64>) -> Vec<[f64; 3]> {
    let mut bench = Bench::new(m, State::turning(0.6 * SYNCHRONOUS), T);
    (0..1000)
        .map(|k| {
            let y = bench.output();
            let u = Complex::from_polar(RATED_V, 100.0 * PI * T * (f64::from(k) + 0.5));
            bench.advance(&PlantInput::new(u, 5.0));
            [y.i_s.re, y.i_s.im, y.omega_m]
        })
        .collect()
}

fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().zip(b).flat_map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).powi(2))).sum::<f64>().sqrt()
}

#[test]
fn every_place_changes_what_is_measured_and_none_at_zero() {
    let base = run(&machine(|_| ()));
    for (id, with) in every() {
        assert!(distance(&run(&with), &base) > 0.1, "{id} does nothing");
        let mut off = *with.effects();
        off.switch_off(id);
        assert_eq!(run(&with.with_effects(off).unwrap()), base, "{id} leaves something behind");
    }
}

/// Axes of the stator that magnetize unequally store energy: the current is its gradient, whose cross derivatives are equal.
#[test]
fn an_anisotropy_makes_no_energy() {
    let id = EffectId::Custom(FreeForm::define(Acts::MagnetizingCurrent, Over::FluxDirection, (0.0, 1.0), 2.0));
    let with = machine(|e| {
        for k in 0..COEFFICIENTS {
            e.set(id, k, 0.1 * (1.0 + k as f64 * 1.7).sin());
        }
    });
    let plant = Plant::new(&with);
    let current = |x: f64, y: f64| plant.currents(&State { psi_s: Complex::new(x, y), ..State::default() }).i_s;
    let h = 1e-5;
    for (x, y) in [(0.7, 0.2), (-0.3, 0.9), (0.1, -1.1)] {
        let by_x = (current(x + h, y) - current(x - h, y)) / (2.0 * h);
        let by_y = (current(x, y + h) - current(x, y - h)) / (2.0 * h);
        assert!((by_y.re - by_x.im).abs() < 1e-6 * by_x.norm(), "{by_x} {by_y}");
        assert!(by_x.im.abs() > 1e-3 * by_x.norm(), "{by_x}: no anisotropy");
    }
}

/// The current of an inductance that changes with the angle is the gradient of its energy by the flux, its torque that by the angle.
#[test]
fn an_inductance_over_the_angle_makes_no_energy() {
    for acts in [Acts::MagnetizingCurrent, Acts::LeakageCurrent] {
        let id = EffectId::Custom(FreeForm::define(acts, Over::ShaftAngle, (0.0, 1.0), 7.0));
        let with = machine(|e| {
            for k in 0..COEFFICIENTS {
                e.set(id, k, 0.05 * (1.0 + k as f64 * 1.7).sin());
            }
        });
        let plant = Plant::new(&with);
        let at = |theta_m: f64| State { psi_s: Complex::new(0.7, 0.3), theta_m, ..State::default() };
        // Current times change of flux, in proportion to the flux on the way: half of the product at its end.
        let energy = |theta_m: f64| {
            let x = at(theta_m);
            0.75 * (x.psi_s.conj() * plant.currents(&x).i_s).re
        };
        for theta in [0.1, 0.5, 1.3] {
            let h = 1e-5;
            let by_angle = (energy(theta + h) - energy(theta - h)) / (2.0 * h);
            let e = plant.evaluate(&at(theta), &PlantInput::new(Complex::new(0.0, 0.0), 0.0));
            let braking = e.torque - e.rates.omega_m * M.parameters().inertia_kg_m2;
            assert!((braking - by_angle).abs() < 1e-6 * by_angle.abs() && by_angle.abs() > 0.1, "{acts:?}: {braking} {by_angle}");
        }
    }
}

/// Seen in a mirror a machine turns the other way, and is the same.
#[test]
fn a_machine_is_the_same_in_a_mirror() {
    let run = |m: &Machine<f64>, sense: f64| {
        let mut bench = Bench::new(m, State::turning(sense * 0.6 * SYNCHRONOUS), T);
        (0..600)
            .map(|k| {
                let y = bench.output();
                let u = Complex::from_polar(RATED_V, sense * 100.0 * PI * T * (f64::from(k) + 0.5));
                bench.advance(&PlantInput::new(u, sense * 5.0));
                [y.i_s.re, sense * y.i_s.im, sense * y.omega_m]
            })
            .collect::<Vec<_>>()
    };
    for (id, with) in every() {
        let EffectId::Custom(c) = id else { continue };
        let form = c.0.free_form().unwrap();
        if form.acts() != Acts::Torque && !form.over().is_angle() {
            let [a, b] = [1.0, -1.0].map(|sense| run(&with, sense));
            assert!(distance(&a, &b) < 1e-9, "{id}: {}", distance(&a, &b));
        }
    }
}

/// At speed the windings are short circuits to a flux that turns past them: its current is Δψ/L_σ.
#[test]
fn a_flux_carried_past_the_windings_drives_a_current_through_the_leakage() {
    let (part, order) = (0.01, 28.0);
    let id = EffectId::Custom(FreeForm::define(Acts::ShaftFlux, Over::ShaftAngle, (0.0, 1.0), order));
    let (plain, with) = (run(&machine(|_| ())), run(&machine(|e| e.set(id, 0, part))));
    let off = |(a, b): (&[f64; 3], &[f64; 3])| (a[0] - b[0]).hypot(a[1] - b[1]);
    let late = || plain.iter().zip(&with).skip(600).map(off);
    let mean = late().sum::<f64>() / late().count() as f64;
    let flux = RATED_V / (100.0 * PI);
    let p = M.parameters();
    let expected = part * flux / (p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h);
    assert!((mean / expected - 1.0).abs() < 0.1, "{mean} A, expected {expected} A");
}

#[test]
fn derivatives_by_the_coefficients_are_exact() {
    for (id, with) in every() {
        for k in [0, 3, 6] {
            let at = ParameterId::Effect(id, k);
            let seeded = with.map(|p, x| if p == at { SingleDual::<4>::seeded(x, 0, 1.0) } else { SingleDual::constant(x) });
            let end = |m: &Machine<f64>| {
                let mut bench = Bench::new(m, State::turning(100.0), T);
                (0..300).for_each(|_| bench.advance(&PlantInput::new(Complex::new(200.0, 30.0), 2.0)));
                bench.output()
            };
            let mut bench = Bench::new(&seeded, State::turning(SingleDual::constant(100.0)), SingleDual::constant(T));
            let c = SingleDual::constant;
            (0..300).for_each(|_| bench.advance(&PlantInput::new(Complex::new(c(200.0), c(30.0)), c(2.0))));
            let h = 1e-5 * id.parameters()[0].typical.1;
            let shifted = |s: f64| end(&with.with(&[(at, with.get(at) + s * h)]).unwrap());
            let (up, down) = (shifted(1.0), shifted(-1.0));
            let exact = bench.output();
            for (exact, up, down) in [(exact.i_s.re, up.i_s.re, down.i_s.re), (exact.omega_m, up.omega_m, down.omega_m)] {
                let differences = (up - down) / (2.0 * h);
                // Differences lose a third of the digits; the step of 1e-5 of the usual size leaves 1e-5 of the slope.
                let slope = f64::from(exact.eps[0]);
                assert!((slope - differences).abs() < 1e-4 * differences.abs() + 1e-5, "{id} {k}: {slope} {differences}");
            }
        }
    }
}

/// A sensor through one lag τ, as a curve that is one everywhere makes it of eight: sines are turned and shrunk as (Σ w/(1 + jωτ)) says, from the first
/// sample on, where the machine already turns; and longer samples show the same.
#[test]
fn lags_are_solved_exactly_and_begin_where_they_settle() {
    let id = EffectId::Custom(FreeForm::define(Acts::CurrentSensor, Over::Lag, (-3.5, -2.0), 1.0));
    let with = machine(|e| (0..COEFFICIENTS).for_each(|k| e.set(id, k, 0.1)));
    let tau = |k: i32| 10_f64.powf(-3.5 + 1.5 * f64::from(k) / 7.0);
    let omega = 100.0 * PI;
    let expected = (0..8).fold(Complex::new(1.0, 0.0), |sum, k| sum + (Complex::new(1.0, omega * tau(k)).inv() - 1.0) * 0.1);
    // A machine that is already in its steady state: its currents turn from the first sample on.
    let steady = |t: f64| {
        let mut bench = Bench::new(&machine(|_| ()), State::turning(SYNCHRONOUS), t);
        let u = |k: f64| Complex::from_polar(RATED_V, omega * t * (k + 0.5));
        let settling = (2.0 / t) as u32;
        (0..settling).for_each(|k| {
            let imposed = Some([SYNCHRONOUS; 2]);
            bench.advance(&PlantInput { imposed_speed: imposed, ..PlantInput::new(u(f64::from(k)), 0.0) });
        });
        let mut slow = Bench::new(&with, *bench.state(), t);
        (0..200).fold(0.0_f64, |worst, k| {
            let input = PlantInput { imposed_speed: Some([SYNCHRONOUS; 2]), ..PlantInput::new(u(f64::from(settling + k)), 0.0) };
            slow.advance(&input);
            bench.advance(&input);
            worst.max((slow.output().i_s / bench.output().i_s - expected).norm())
        })
    };
    for t in [T, 3.0 * T] {
        assert!(steady(t) < 2e-3 * (t / T).powi(2), "{}", steady(t));
    }
}

/// A voltage that steps reaches the terminals as each lag lets it: the mean over a sample of 1 − e^{−t/τ}.
#[test]
fn a_voltage_passes_through_its_lags() {
    let id = EffectId::Custom(FreeForm::define(Acts::Voltage, Over::Lag, (-3.0, -2.9), 1.0));
    let with = machine(|e| (0..COEFFICIENTS).for_each(|k| e.set(id, k, 0.125)));
    let flux = |m: &Machine<f64>| {
        let mut bench = Bench::new(m, State::default(), T);
        (0..20).for_each(|_| {
            bench.advance(&PlantInput { imposed_speed: Some([0.0; 2]), ..PlantInput::new(Complex::new(1.0, 0.0), 0.0) })
        });
        bench.state().psi_s.re
    };
    // Before much current flows, ψ_s is the integral of what arrives: t − τ(1 − e^{−t/τ}) of a step.
    let (tau, t) = (10_f64.powf(-2.95), 20.0 * T);
    let expected = 1.0 - tau / t * (1.0 - (-t / tau).exp());
    let part = flux(&with) / flux(&machine(|_| ()));
    assert!((part - expected).abs() < 0.03, "{part} {expected}");
}

#[test]
fn a_learned_curve_reads_back_from_a_motor_file() {
    for (id, with) in every() {
        let file = MotorFile::new("m", with, M.rating);
        let back = MotorFile::parse(&file.to_toml(), "motor.toml").unwrap();
        assert_eq!(run(&back.machine), run(&with), "{id}");
        assert_eq!(back.to_toml(), file.to_toml());
    }
}

#[test]
fn a_file_must_say_where_the_curve_lies() {
    let (id, with) = every().remove(0);
    let text = MotorFile::new("m", with, M.rating).to_toml();
    let without = text.lines().filter(|l| !l.starts_with("to_rad_s")).collect::<Vec<_>>().join("\n");
    let error = MotorFile::parse(&without, "motor.toml").unwrap_err().to_string();
    assert!(error.contains("to_rad_s is missing") && error.contains(id.name()), "{error}");
}

/// A time constant that no filter has would be an infinite number in it.
#[test]
fn a_lag_lies_within_the_times_of_filters() {
    let id = EffectId::Custom(FreeForm::define(Acts::CurrentSensor, Over::Lag, (-4.0, -2.0), 1.0));
    let text = MotorFile::new("m", machine(|e| e.set(id, 0, 0.1)), M.rating).to_toml();
    let error = MotorFile::parse(&text.replace("to_log10_s = -2", "to_log10_s = 400"), "motor.toml").unwrap_err().to_string();
    assert!(error.contains("to_log10_s = 400 must be from -9 to 3"), "{error}");
}

/// The value is the sum of coefficients and weights: what bands are made of.
#[test]
fn values_are_linear_in_the_coefficients() {
    for (id, with) in every() {
        let EffectId::Custom(c) = id else { continue };
        let form = c.0.free_form().unwrap();
        let values: Vec<f64> = (0..id.parameters().len()).map(|k| with.get(ParameterId::Effect(id, k))).collect();
        for x in [0.0, 0.3, 1.0, 7.0, 120.0] {
            let sum: f64 = form.weights(&values, x).iter().zip(&values).map(|(w, c)| w * c).sum();
            assert!((sum - form.value(&values, x)).abs() < 1e-12 * (1.0 + sum.abs()), "{id} at {x}");
        }
    }
}
