//! Losses against those of a machine whose steady states are solved, where every part is known.

use im_model::machines::MOTULATOR_2_2_KW as M;
use im_model::{BaseParameter, Complex, EffectId, Effects, Held, Machine, MotorFile, ParameterId, Plant, steady_state};

use super::*;
use crate::intake::steady_table::{SteadyRow, TableKind};

const FREQUENCY: f64 = 50.0;

fn machine() -> Machine<f64> {
    let mut effects = Effects::scaled(&M.rating, &M.parameters(), M.pole_pairs);
    effects.iron_loss.conductance_s = 6e-4;
    effects.windage.coefficient_nm_s2 = 2e-5;
    effects.coulomb_friction.torque_nm = 0.15;
    // It is there without load, too, with the square of the current: the standard counts that part as iron loss.
    effects.stray_load_torque.torque_nm = 0.06;
    let machine = Machine::try_new(M.parameters(), M.pole_pairs, effects).unwrap();
    let p = M.parameters();
    let leakage = p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h;
    let set = [
        // Friction of its own is windage and Coulomb friction here.
        (BaseParameter::ViscousFriction, 0.0),
        // The standard takes the iron's voltage behind the resistance: nearly all of the leakage is the rotor's.
        (BaseParameter::StatorLeakageInductance, 0.02 * leakage),
        (BaseParameter::RotorLeakageInductance, 0.98 * leakage),
    ];
    machine.with(&set.map(|(p, x)| (ParameterId::Base(p), x))).unwrap()
}

fn motor() -> MotorFile {
    let text = include_str!("../../../examples/motor.toml");
    let mut motor = MotorFile::parse(text, "motor.toml").unwrap();
    (motor.machine, motor.rating) = (machine(), M.rating);
    motor
}

/// Readings at a phase voltage, peak, under a torque; and stator copper, rotor, iron and the torque that friction takes.
fn row(u: f64, torque: f64) -> (SteadyRow, [f64; 4]) {
    let machine = machine();
    let plant = Plant::new(&machine);
    let x = steady_state(&machine, u, FREQUENCY, Held::Load(torque)).unwrap();
    let i = plant.currents(&x);
    let s = Complex::new(u, 0.0) * i.i_s.conj() * 1.5;
    let p = machine.parameters();
    let (copper, rotor) = (1.5 * p.stator_resistance_ohm * i.i_s.norm_sqr(), 1.5 * p.rotor_resistance_ohm * i.i_r.norm_sqr());
    let synchronous = std::f64::consts::TAU * FREQUENCY / f64::from(M.pole_pairs);
    // What crosses the gap: τ_e ω_s; the rest of the input is copper and iron.
    let gap = plant.torque(&x) * synchronous;
    let iron = s.re - copper - gap;
    let row = SteadyRow {
        phase_voltage_rms_v: u / 2f64.sqrt(),
        current_rms_a: i.i_s.norm() / 2f64.sqrt(),
        active_power_w: s.re,
        reactive_power_var: None,
        omega_m_rad_s: Some(x.omega_m),
        torque_nm: Some(torque),
        winding_c: None,
        rotor_c: None,
    };
    (row, [copper, rotor, iron, (plant.torque(&x) - torque) * x.omega_m])
}

fn table(kind: TableKind, rows: Vec<SteadyRow>) -> SteadyTable {
    SteadyTable { name: "test".into(), kind, class_percent: 0.2, rows }
}

fn no_load(voltages: &[f64]) -> SteadyTable {
    let rated = M.rating.phase_voltage_peak_v;
    table(TableKind::NoLoad, voltages.iter().map(|v| SteadyRow { torque_nm: None, ..row(v * rated, 0.0).0 }).collect())
}

const LOADS: [f64; 6] = [1.25, 1.15, 1.0, 0.75, 0.5, 0.25];
const VOLTAGES: [f64; 8] = [1.1, 1.0, 0.95, 0.9, 0.6, 0.5, 0.4, 0.3];

fn loads() -> SteadyTable {
    let rated = M.rating.phase_voltage_peak_v;
    table(TableKind::Load, LOADS.iter().map(|t| row(rated, t * M.rating.torque_nm).0).collect())
}

fn measured() -> Option<Resistance> {
    Some(Resistance { terminal_ohm: 2.0 * M.parameters().stator_resistance_ohm, at_c: 25.0, warm_c: 25.0, class_percent: 0.2 })
}

#[test]
fn every_loss_is_that_of_the_machine() {
    let l = segregate(&motor(), &[no_load(&VOLTAGES), loads()], measured()).unwrap();
    assert_eq!((l.constant_by, l.stray_by, l.left_out), (ConstantBy::Voltages, StrayBy::Regression, None));
    assert!(l.correlation.unwrap() > 0.99, "{:?}", l.correlation);
    let rated = row(M.rating.phase_voltage_peak_v, M.rating.torque_nm).0.active_power_w;
    for (p, t) in l.points.iter().zip(LOADS) {
        let (r, [copper, rotor, iron, braking]) = row(M.rating.phase_voltage_peak_v, t * M.rating.torque_nm);
        let near =
            |e: Estimate, true_: f64, of_rated: f64| assert!((e.value - true_).abs() < of_rated * rated, "{t}: {e:?}, {true_} W");
        near(p.stator_w, copper, 1e-9);
        near(p.rotor_w, rotor, 5e-4);
        near(p.iron_w, iron, 3e-3);
        // What brakes the shaft, stray load included.
        near((p.friction_windage_w.value + p.stray_w.value).into(), braking, 4e-3);
        near(p.total_w, r.active_power_w - r.torque_nm.unwrap() * r.omega_m_rad_s.unwrap(), 4e-3);
        assert!(p.total_w.half_95 > 0.0 && p.total_w.half_95 < 0.1 * p.total_w.value, "{p:?}");
    }
}

#[test]
fn one_voltage_leaves_iron_and_friction_one_sum() {
    let l = segregate(&motor(), &[no_load(&[1.0]), loads()], measured()).unwrap();
    let (_, [_, _, iron, friction]) = row(M.rating.phase_voltage_peak_v, 0.0);
    assert_eq!(l.constant_by, ConstantBy::OneVoltage);
    assert!((l.constant_w.value / (iron + friction) - 1.0).abs() < 0.02, "{:?} {iron} {friction}", l.constant_w);
    // Either may be all of it.
    let open = |e: Estimate| e.value - e.half_95 < 0.0 && e.value + e.half_95 > l.constant_w.value;
    assert!(open(l.iron_w) && open(l.friction_windage_w), "{l:?}");
    assert!(l.constant_w.half_95 < 0.2 * l.constant_w.value && l.remarks.iter().any(|r| r.contains("half")), "{l:?}");
}

#[test]
fn without_a_no_load_test_the_load_points_leave_the_sum() {
    let l = segregate(&motor(), &[loads()], measured()).unwrap();
    let (_, [_, _, iron, friction]) = row(M.rating.phase_voltage_peak_v, 0.0);
    assert_eq!(l.constant_by, ConstantBy::LoadPoints);
    assert!((l.constant_w.value / (iron + friction) - 1.0).abs() < 0.1, "{:?} {iron} {friction}", l.constant_w);
    assert!(l.constant_w.half_95 > 0.0);
}

/// A torque meter whose scale is 3 % too large: the more torque, the less is left.
#[test]
fn what_falls_with_the_torque_is_no_loss_of_it() {
    for no_load in [Some(no_load(&VOLTAGES)), None] {
        let mut loads = loads();
        loads.rows.iter_mut().flat_map(|r| &mut r.torque_nm).for_each(|t| *t *= 1.03);
        let tables: Vec<SteadyTable> = no_load.into_iter().chain([loads]).collect();
        let l = segregate(&motor(), &tables, measured()).unwrap();
        assert!(l.correlation.unwrap() < 0.0, "{:?}", l.correlation);
        assert_eq!(l.stray_by, StrayBy::Allowance);
        assert!(l.points.iter().all(|p| p.stray_w.value > 0.0), "{:?}", l.points);
        assert!(l.remarks.iter().any(|r| r.contains("does not rise with the torque")), "{:?}", l.remarks);
    }
}

#[test]
fn a_winding_takes_no_more_than_the_input() {
    let milliohm = measured().map(|r| Resistance { terminal_ohm: 1e3 * r.terminal_ohm, ..r });
    for tables in [vec![no_load(&VOLTAGES), loads()], vec![loads()]] {
        let e = segregate(&motor(), &tables, milliohm).unwrap_err().to_string();
        assert!(e.contains("is it in mΩ?"), "{e}");
    }
}

#[test]
fn a_winding_that_is_warm_has_more_resistance() {
    let warm = Resistance { warm_c: 95.0, ..measured().unwrap() };
    let [cold, warm] = [measured().unwrap(), warm].map(|r| segregate(&motor(), &[no_load(&VOLTAGES), loads()], Some(r)).unwrap());
    let ratio = warm.points[0].stator_w.value / cold.points[0].stator_w.value;
    assert!((ratio - (235.0 + 95.0) / (235.0 + 25.0)).abs() < 1e-9, "{ratio}");
}

#[test]
fn the_order_of_rows_is_nothing() {
    let turned = |t: SteadyTable| SteadyTable { rows: t.rows.into_iter().rev().collect(), ..t };
    let a = segregate(&motor(), &[no_load(&VOLTAGES), loads()], measured()).unwrap();
    let b = segregate(&motor(), &[turned(loads()), turned(no_load(&VOLTAGES))], measured()).unwrap();
    assert!(
        (a.stray_w_per_nm2.value - b.stray_w_per_nm2.value).abs() < 1e-12
            && a.friction_windage_w.value == b.friction_windage_w.value
    );
}

#[test]
fn torques_that_are_not_there_leave_the_allowance() {
    let blind = SteadyTable { rows: loads().rows.into_iter().map(|r| SteadyRow { torque_nm: None, ..r }).collect(), ..loads() };
    let l = segregate(&motor(), &[no_load(&VOLTAGES), blind], measured()).unwrap();
    assert_eq!((l.stray_by, l.correlation), (StrayBy::Allowance, None));
    let p = &l.points[2];
    let part = p.stray_w.value / p.input_w;
    assert!((0.022..0.025).contains(&part), "2.2 kW: 2.3 % of the input, {part}");
    assert!(segregate(&motor(), &[table(TableKind::Locked, loads().rows)], measured()).is_err());
}

/// A loss of the model that ends at zero, and does not show its own exponent, takes no interval from the others.
#[test]
fn a_stray_loss_of_nothing_leaves_the_other_intervals() {
    let mut motor = motor();
    let none = [(ParameterId::Effect(EffectId::StrayLoadTorque, 0), 0.0)];
    motor.machine = motor.machine.with(&none).unwrap();
    let rated = M.rating.phase_voltage_peak_v;
    let on = |torque: f64| {
        let x = steady_state(&motor.machine, rated, FREQUENCY, Held::Load(torque)).unwrap();
        let i = Plant::new(&motor.machine).currents(&x).i_s;
        let power = 1.5 * (Complex::new(rated, 0.0) * i.conj()).re;
        SteadyRow {
            phase_voltage_rms_v: rated / 2f64.sqrt(),
            current_rms_a: i.norm() / 2f64.sqrt(),
            // Less than any stray load would leave.
            active_power_w: power * (1.0 - 1e-4 * torque),
            omega_m_rad_s: Some(x.omega_m),
            torque_nm: Some(torque),
            ..row(rated, 0.0).0
        }
    };
    let loads = table(TableKind::Load, LOADS.iter().map(|t| on(t * M.rating.torque_nm)).collect());
    let model = ByModel::of(&motor, &[no_load(&VOLTAGES), loads], measured()).unwrap();
    for p in &model.points {
        for e in [p.stator_w, p.rotor_w, p.iron_w, p.friction_windage_w, p.total_w] {
            assert!(e.half_95 > 1e-4 * e.value, "{p:?}");
        }
    }
}

/// A resistance is known as far as the motor file says; at a temperature that the tests do not have, less.
#[test]
fn a_resistance_is_known_as_far_as_the_file_says() {
    let id = ParameterId::Base(BaseParameter::StatorResistance);
    let with = |tolerance, winding_c| {
        let mut motor = motor();
        motor.known.insert(id, im_model::Known { value: M.parameters().stator_resistance_ohm, tolerance });
        motor.winding_c = winding_c;
        segregate(&motor, &[no_load(&VOLTAGES), loads()], None).unwrap()
    };
    let half = |l: &Losses| l.points[0].stator_w.half_95 / l.points[0].stator_w.value;
    let [sure, unsure, cold] = [with(0.01, None), with(0.5, None), with(0.01, Some(25.0))];
    assert!(half(&unsure) > 0.4 && half(&sure) < 0.03, "{} {}", half(&unsure), half(&sure));
    assert!(half(&cold) > 0.2 && cold.remarks.iter().any(|r| r.contains("25 °C")), "{} {:?}", half(&cold), cold.remarks);
}
