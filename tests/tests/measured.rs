//! The main job on real laboratory recordings, where they are at hand: locked rotor, no load, and a direct-on-line start.

use std::path::{Path, PathBuf};

use im_diagnose::case::Case;
use im_diagnose::diagnosis::{Verdict, diagnose};
use im_diagnose::intake::{Intake, SteadyTable, read};
use im_diagnose::search::{Options, Refinement};
use im_diagnose::tables;
use im_diagnose::uncertainty::MachineQuantity;
use im_identify::offline::{ChannelKind, Experiment, predict, start_on};
use im_model::{BaseParameter, Complex, EffectId, Known, Machine, MotorFile, ParameterId, Rating, State};

const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/recordings/measured");
const FIXTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../im-diagnose/tests/recordings/direct_on_line_4kw");

fn folder(name: &str) -> PathBuf {
    Path::new(SHARED).join(name)
}

/// A 4-kW machine with its rotor locked, without load, and in a direct-on-line start.
fn laboratory() -> (MotorFile, [Intake; 3]) {
    let dir = folder("direct_on_line_4kw");
    let motor = MotorFile::read(format!("{FIXTURES}/motor.toml")).unwrap();
    let tests = ["Test_2_IM_Locked_Rotor", "Test_3_IM_No_Load", "Test_4_IM_Direct_Start"];
    let taken = tests.map(|n| mapped(&dir, FIXTURES, n, &motor));
    (motor, taken)
}

fn mapped(folder: &Path, fixtures: &str, name: &str, motor: &MotorFile) -> Intake {
    let mapping = format!("{fixtures}/{name}.recording.toml");
    read(&folder.join(format!("{name}.csv")), Some(Path::new(&mapping)), motor).unwrap().remove(0)
}

/// Root mean square of the current error over the rows that count, of the channels together, A.
fn current_rms(machine: &Machine<f64>, e: &Experiment, start: &State<f64>, from_s: f64, to_s: f64) -> f64 {
    let y = predict(machine, e, start);
    let rows = (from_s / e.sample_time_s) as usize..((to_s / e.sample_time_s) as usize).min(e.len());
    let (mut sum, mut n) = (0.0, 0.0);
    for (c, y) in e.channels.iter().zip(&y).filter(|(c, _)| c.kind != ChannelKind::Speed) {
        for k in rows.clone().filter(|&k| c.is_valid(k)) {
            sum += (c.values[k] - y[k]).powi(2);
            n += 1.0;
        }
    }
    (sum / f64::max(n, 1.0)).sqrt()
}

/// The amplitude of the 50-Hz component of a row of space vectors.
fn fundamental(x: &[Complex<f64>], sample_time_s: f64) -> Complex<f64> {
    let w = std::f64::consts::TAU * 50.0 * sample_time_s;
    // Whole periods only.
    let n = ((x.len() as f64 * sample_time_s * 50.0).floor() / (50.0 * sample_time_s)).round() as usize;
    x[..n].iter().enumerate().map(|(k, x)| x * Complex::from_polar(1.0, -w * k as f64)).sum::<Complex<f64>>() / n as f64
}

/// From locked-rotor and no-load parameters, the start is missed by tens of amperes; the loop names leakage saturation, and the error falls.
#[test]
#[ignore = "needs the recordings in ../shared, which cannot be copied"]
fn leakage_saturation_is_missing_from_the_direct_start() {
    let (motor, [locked, free, start]) = laboratory();

    // What an engineer has before: parameters from the two steady tests.
    let (_, before) =
        Refinement::new(Case::from_intake(motor.clone(), vec![locked.clone(), free.clone()], None), Options::default()).unwrap();
    let on = |m: &Machine<f64>, e: &Experiment, a: f64, b: f64| current_rms(m, e, &start_on(m, e, &motor.rating), a, b);
    let missed = on(&before.fit.machine, &start.experiment, 0.036, 0.2);

    let d = diagnose(Case::from_intake(motor.clone(), vec![locked, free, start], None), Options::default()).unwrap();
    let m = &d.refined.machine;
    let [locked, free, start] = [0, 1, 2].map(|k| &d.case.train[k]);
    let (start_rms, free_rms) = (on(m, start, 0.036, 0.2), on(m, free, 0.0, 1.0));

    // As the sensors show them: what is found of their gains is part of the model.
    let shown = |of: &[Vec<f64>]| {
        let i: Vec<Complex<f64>> = (0..locked.len()).filter_map(|k| locked.current_vector(k, |c| of[c][k])).collect();
        fundamental(&i, locked.sample_time_s)
    };
    let u = fundamental(&locked.u_s, locked.sample_time_s);
    // The voltage is the mean over the sample that begins at the row: half a sample later than the current.
    let late = Complex::from_polar(1.0, -std::f64::consts::PI * 50.0 * locked.sample_time_s);
    let measured: Vec<Vec<f64>> = locked.channels.iter().map(|c| c.values.clone()).collect();
    let predicted = predict(m, locked, &start_on(m, locked, &motor.rating));
    let [z, model] = [measured, predicted].map(|of| u * late / shown(&of));
    let off = (model - z).norm() / z.norm();
    println!(
        "start {missed:.1} A rms before, {start_rms:.2} after; no load {free_rms:.2} A; locked rotor {z:.3} Ω against {model:.3}"
    );
    println!("{:?} {:?}, rivals {:?}", d.verdict, d.effects, d.alternatives);

    // It explains the start, and is there whatever the slots and harmonics are that the library does not hold. One current channel reads a few per
    // cent too much: it may be found beside it.
    assert_eq!(d.named(), [EffectId::LeakageFluxSaturation]);
    assert!(
        d.effects.iter().all(|e| [EffectId::LeakageFluxSaturation, EffectId::CurrentSensorGain].contains(e)),
        "{:?}",
        d.effects
    );
    assert!(missed > 15.0, "{missed}");
    assert!(start_rms < 2.5, "{start_rms}");
    assert!(free_rms < 0.6, "{free_rms}");
    assert!(off < 0.02, "{off}");
}

/// Locked rotor and no load tell little of a start, or of one another: a refit on some misses the others by 184 to 389 σ, where the motor as given is
/// 9 to 72 σ off. What takes part of that back has explained nothing, and what takes nothing neither.
#[test]
#[ignore = "needs the recordings in ../shared, which cannot be copied"]
fn what_a_refit_lost_is_not_explained_by_bringing_it_back() {
    let (motor, [locked, free, start]) = laboratory();
    for (train, holdout) in [(vec![&locked], &free), (vec![&locked, &free], &start), (vec![&start], &locked)] {
        let train: Vec<Intake> = train.into_iter().cloned().collect();
        let d = diagnose(Case::from_intake(motor.clone(), train, Some(holdout.clone())), Options::default()).unwrap();
        println!("{:?}: {:?}", d.verdict, d.effects);
        assert_eq!((d.verdict, d.named()), (Verdict::Unexplained, &[][..]));
    }
}

/// No-load, locked-rotor and load tables of a 1-kW machine: saturation, iron loss, and a speed sensor that shows too little.
#[test]
#[ignore = "needs the recordings in ../shared, which cannot be copied"]
fn steady_tables_go_through_the_same_loop() {
    let dir = folder("steady_state_1kw");
    let mut motor = MotorFile::read(format!("{FIXTURES}/motor.toml")).unwrap();
    let mut p = *motor.machine.parameters();
    p.stator_resistance_ohm = 5.7;
    p.rotor_resistance_ohm = 6.0;
    p.stator_leakage_inductance_h = 0.02;
    p.rotor_leakage_inductance_h = 0.02;
    p.magnetizing_inductance_h = 0.43;
    p.viscous_friction_nm_s_per_rad = 0.001;
    motor.machine = Machine::base(p, 2).unwrap();
    motor.rating = Rating { torque_nm: 8.0, electrical_frequency_hz: 50.0, phase_voltage_peak_v: 339.0, rotor_flux_vs: 1.0 };

    let tables = ["no_load", "locked_rotor", "load"].map(|n| SteadyTable::read(&dir.join(format!("{n}.csv")), None).unwrap());
    let (case, findings) = tables::case(motor, &tables).unwrap();
    // 1473.6 rpm without load on 50 Hz: 1.7 to 2 % too little.
    assert!(findings.len() == 1 && findings[0].sentence.contains("lower than a machine on 50 Hz can run"), "{findings:?}");
    let d = diagnose(case, Options { candidates: tables::candidates(), ..Options::default() }).unwrap();
    assert_eq!(d.verdict, Verdict::MissingEffects);
    let mut found = d.effects.clone();
    found.sort();
    // The locked rotor shows a larger rotor resistance than the load: by skin effect, or by another temperature.
    let mut expected = [EffectId::MainFluxSaturation, EffectId::RotorSkinEffect, EffectId::IronLoss];
    expected.sort();
    assert_eq!(found, expected);
    let power = |s: &im_diagnose::diagnosis::Step| s.train.rmse["p_W"];
    let (before, after) = (power(&d.steps[0]), power(&d.steps[d.steps.len() - 1]));
    assert!(after < 0.65 * before, "{before} W, {after} W");
}

const DRIVE_LOG: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../im-diagnose/tests/recordings/foc_inverter_28v");

/// A drive's own log in motion: commanded voltage, no torque. Its speed is filtered (24 ms by hand), its currents have offsets (1.4 A) and gains (3 %).
#[test]
#[ignore = "needs the recordings in ../shared, which cannot be copied"]
fn the_sensors_of_a_drive_are_found_in_its_own_log() {
    let dir = folder("foc_inverter_28v");
    let mut motor = MotorFile::read(format!("{DRIVE_LOG}/motor.toml")).unwrap();
    // The base of the voltage is free, and with it the size of the flux.
    let held = ParameterId::Base(BaseParameter::MagnetizingInductance);
    motor.known.insert(held, Known { value: motor.machine.get(held), tolerance: 0.0 });
    let runs = ["load_step", "speed_step"].map(|n| mapped(&dir, DRIVE_LOG, n, &motor));
    let d = diagnose(Case::from_intake(motor, runs.to_vec(), None), Options::default()).unwrap();
    println!("{:?}: {:?}, {:?}", d.verdict, d.effects, d.alternatives);
    // They are there whatever the slots and harmonics are that the library does not hold.
    for e in [EffectId::SpeedSensorLag, EffectId::CurrentSensorOffset, EffectId::CurrentSensorGain] {
        assert!(d.named().contains(&e), "{e:?}: {:?}", d.named());
    }
    let machine = &d.refined.machine;
    let lag = machine.effects().speed_sensor_lag.time_constant_s;
    assert!((lag / 0.024 - 1.0).abs() < 0.2, "{lag} s");
    let error = |s: &im_diagnose::diagnosis::Step| s.train.rmse["i_alpha_A"].hypot(s.train.rmse["i_beta_A"]);
    let (before, after) = (error(&d.steps[0]), error(&d.steps[d.steps.len() - 1]));
    assert!(after < 1.3 && before > 3.0, "{before} A, {after} A");
    // No parameter runs away.
    for p in d.parameters.iter().filter(|p| !matches!(p.quantity, MachineQuantity::Parameter(ParameterId::Effect(..)))) {
        assert!(p.before == 0.0 || (0.05..20.0).contains(&(p.after / p.before).abs()), "{p:?}");
    }
}
