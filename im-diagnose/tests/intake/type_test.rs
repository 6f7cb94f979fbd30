//! A type test with every loss known: the T circuit in closed form, its windings as warm as they get, read by instruments of class 0.2.

use im_diagnose::diagnosis::diagnose;
use im_diagnose::losses::{ByModel, Estimate, segregate};
use im_diagnose::sources::Sources;
use im_model::{BaseParameter, Complex, EffectId, MotorFile, ParameterId};

use crate::simulated::Folder;

const RS_25: f64 = 4.8;
const RR_25: f64 = 3.4;
const X_LS: f64 = 4.5;
const X_LR: f64 = 6.5;
const X_M: f64 = 130.0;
/// Of the iron, across the magnetizing branch, S.
const G: f64 = 1.2e-3;
const FRICTION_W: f64 = 14.0;
/// Additional load loss over the square of the rotor's current, W/A².
const STRAY: f64 = 7.0;
const OMEGA: f64 = std::f64::consts::TAU * 50.0;
const POLE_PAIRS: f64 = 2.0;
const RATED_V: f64 = 230.0;

/// What the instruments would show without an error: U, I, P, rpm, Nm; and stator, rotor, iron, friction, stray.
#[derive(Debug)]
struct Point {
    shown: [f64; 5],
    losses: [f64; 5],
}

/// At a slip; the winding at `c` °C, the rotor as warm.
fn at(u: f64, slip: f64, c: f64) -> Point {
    let (rs, rr) = (RS_25 * (235.0 + c) / 260.0, RR_25 * (225.0 + c) / 250.0);
    let rotor = slip / Complex::new(rr, slip * X_LR);
    let gap = 1.0 / (rotor + Complex::new(G, -1.0 / X_M));
    let i = u / (Complex::new(rs, X_LS) + gap);
    let e = i * gap;
    let i_r = e * rotor;
    let (copper, cage, iron) = (3.0 * rs * i.norm_sqr(), 3.0 * rr * i_r.norm_sqr(), 3.0 * G * e.norm_sqr());
    let omega_m = OMEGA / POLE_PAIRS * (1.0 - slip);
    let through = if slip == 0.0 { 0.0 } else { cage / slip * (1.0 - slip) };
    let friction = FRICTION_W * (1.0 - slip).powi(2);
    let stray = STRAY * i_r.norm_sqr();
    let torque = (through - friction - stray) / omega_m.max(1e-9);
    let shown = [u, i.norm(), 3.0 * u * i.re, omega_m * 30.0 / std::f64::consts::PI, torque];
    Point { shown, losses: [copper, cage, iron, friction, stray] }
}

/// Running under a torque.
fn under(u: f64, torque: f64, c: f64) -> Point {
    let (mut low, mut high) = (0.0, 0.2);
    for _ in 0..80 {
        let slip = 0.5 * (low + high);
        if at(u, slip, c).shown[4] < torque { low = slip } else { high = slip }
    }
    at(u, 0.5 * (low + high), c)
}

/// Errors of instruments, the same at every run: even over ± 0.2 % of the largest reading.
struct Errors(u64);

impl Errors {
    fn next(&mut self, largest: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        0.002 * largest * (2.0 * ((self.0 >> 11) as f64 / (1u64 << 53) as f64) - 1.0)
    }
}

/// Rows as a table; each with its temperature, or without.
fn csv(rows: &[(Point, f64)], columns: &str, errors: &mut Errors, temperatures: bool) -> String {
    let largest = |k: usize| rows.iter().map(|r| r.0.shown[k].abs()).fold(0.0, f64::max);
    let mut text = format!("V_ph_V,I_A,P_3ph_W{columns}{}\n", if temperatures { ",winding_C" } else { "" });
    for (p, c) in rows {
        let [u, i, w, n, t] = std::array::from_fn(|k| p.shown[k] + if k == 3 { 0.0 } else { errors.next(largest(k)) });
        let mut cells = vec![u, i, w];
        cells.extend(columns.contains("n_rpm").then_some(n));
        cells.extend(columns.contains("T_Nm").then_some(t));
        cells.extend(temperatures.then_some(*c));
        text += &(cells.iter().map(|x| format!("{x:.5}")).collect::<Vec<_>>().join(",") + "\n");
    }
    text
}

const LOADS: [(f64, f64); 6] = [(8.8, 96.0), (8.1, 95.0), (7.0, 92.0), (5.2, 87.0), (3.5, 82.0), (1.7, 77.0)];

fn loads() -> Vec<(Point, f64)> {
    LOADS.map(|(t, c)| (under(RATED_V, t, c), c)).into()
}

fn sources(folder: &Folder, temperatures: bool) -> Sources {
    let free = [253.0, 230.0, 218.0, 200.0, 138.0, 115.0, 92.0, 69.0];
    let free: Vec<(Point, f64)> =
        free.iter().enumerate().map(|(k, u)| (under(*u, 0.0, 52.0 - k as f64), 52.0 - k as f64)).collect();
    let held: Vec<(Point, f64)> = [30.0, 45.0, 60.0].map(|u| (at(u, 1.0, 28.0), 28.0)).into();
    let mut errors = Errors(7);
    let known = if temperatures { "winding_c = 25" } else { "" };
    let motor = format!(
        "[machine]\npole_pairs = 2\n{known}\n[machine.parameters]\nstator_resistance_ohm = {{ value = {}, tolerance = 0.01 }}\nrotor_resistance_ohm = 4.2\n\
         stator_leakage_inductance_h = 0.0173\nrotor_leakage_inductance_h = 0.025\nmagnetizing_inductance_h = 0.37\ninertia_kg_m2 = 0.003\n\
         viscous_friction_nm_s_per_rad = 0.001\n[machine.rating]\ntorque_nm = 7\nelectrical_frequency_hz = 50\nphase_voltage_peak_v = {}\n\
         rotor_flux_vs = 0.95\n",
        1.003 * RS_25,
        RATED_V * 2f64.sqrt()
    );
    let mut tables = Vec::new();
    for (name, columns, rows) in [("no_load", ",n_rpm", &free), ("locked", "", &held), ("load", ",n_rpm,T_Nm", &loads())] {
        let kind = if name == "locked" { "kind = \"locked\"\n" } else { "" };
        let winding = if temperatures { "winding = \"winding_C\"\n" } else { "" };
        let names = "phase_voltage = \"V_ph_V\"\ncurrent = \"I_A\"\npower = \"P_3ph_W\"\nspeed = \"n_rpm\"\ntorque = \"T_Nm\"\n";
        folder.put(&format!("{name}.table.toml"), format!("[table]\n{kind}class = 0.2\n{names}{winding}"));
        tables.push((folder.put(&format!("{name}.csv"), csv(rows, columns, &mut errors, temperatures)), None));
    }
    Sources { tables, ..Sources::new(MotorFile::parse(&motor, "motor.toml").unwrap(), "motor.toml".into()) }
}

#[test]
fn a_warm_type_test_agrees_with_a_cold_resistance() {
    let folder = Folder::new("type-test");
    let answer = |temperatures: bool| {
        let sources = sources(&folder, temperatures);
        let (case, findings) = sources.case().unwrap();
        (diagnose(case, sources.options()).unwrap(), findings)
    };
    let (d, findings) = answer(true);
    assert!(findings.iter().all(|f| f.kind != im_diagnose::intake::FindingKind::WindingTemperature), "{findings:?}");
    let allowed = [EffectId::IronLoss, EffectId::StrayLoadTorque];
    assert!(
        d.named().iter().all(|e| allowed.contains(e)) && d.named().contains(&EffectId::IronLoss),
        "{:?} {:?}",
        d.verdict,
        d.effects
    );
    let resistance = |m: &MotorFile| m.machine.get(ParameterId::Base(BaseParameter::StatorResistance));
    assert!((resistance(&d.refined) / RS_25 - 1.0).abs() < 0.015, "{}", resistance(&d.refined));
    assert_eq!(d.refined.winding_c, Some(25.0));
    // Without temperatures the cold resistance is kept: what the warm winding loses beyond it is counted as additional loss.
    let (blind, _) = answer(false);
    let (found, truth) = (blind.losses.iter().find(|p| p.table == "load").unwrap(), loads()[0].0.losses);
    assert!(found.stator_w.value < 0.85 * truth[0] && found.stray_w.value > 1.5 * truth[4], "{found:?}, true {truth:?}");
    // The losses of the refined model, by the rows of the load test.
    let model: Vec<_> = d.losses.iter().filter(|p| p.table == "load").collect();
    assert_eq!(model.len(), LOADS.len());
    for (p, (truth, _)) in model.iter().zip(loads()) {
        near(&[p.stator_w, p.rotor_w, p.iron_w, p.friction_windage_w, p.stray_w], p.total_w, &truth, "refined");
    }
}

/// The whole test in one file, the rotor held in some rows, with a torque of zero in all that carry no load.
#[test]
fn a_type_test_in_one_table_is_read_row_by_row() {
    let folder = Folder::new("type-test-in-one");
    let mut rows: Vec<(Point, f64)> = [253.0, 230.0, 200.0, 138.0, 92.0, 69.0].map(|u| (under(u, 0.0, 50.0), 50.0)).into();
    for u in [30.0, 45.0, 60.0] {
        let mut held = at(u, 1.0, 28.0);
        (held.shown[3], held.shown[4]) = (0.0, 0.0);
        rows.push((held, 28.0));
    }
    rows.extend(loads());
    let apart = sources(&folder, true);
    let names = "phase_voltage = \"V_ph_V\"\ncurrent = \"I_A\"\npower = \"P_3ph_W\"\nspeed = \"n_rpm\"\ntorque = \"T_Nm\"\n";
    folder.put("all.table.toml", format!("[table]\nclass = 0.2\n{names}winding = \"winding_C\"\n"));
    let one = folder.put("all.csv", csv(&rows, ",n_rpm,T_Nm", &mut Errors(7), true));
    let sources = Sources { tables: vec![(one, None)], ..apart };
    let (case, findings) = sources.case().unwrap();
    assert!(findings.iter().all(|f| !f.stops()), "{findings:?}");
    let d = diagnose(case, sources.options()).unwrap();
    let of = |p| d.refined.machine.get(ParameterId::Base(p));
    for (p, truth) in [
        (BaseParameter::StatorResistance, RS_25),
        (BaseParameter::RotorResistance, RR_25),
        (BaseParameter::MagnetizingInductance, X_M / OMEGA),
    ] {
        assert!((of(p) / truth - 1.0).abs() < 0.03, "{p:?}: {}, true {truth}", of(p));
    }
    assert!(d.named().contains(&EffectId::IronLoss), "{:?} {:?}", d.verdict, d.effects);
}

/// Every loss within its interval, half again as wide: thirty of them at 95 %. The additional loss is one of the rotor's current here, and of the
/// stator's in the model: what that has without load is iron loss here.
fn near([stator, rotor, iron, friction, stray]: &[Estimate; 5], total: Estimate, truth: &Point, what: &str) {
    let [copper, cage, core, bearings, additional] = truth.losses;
    let moved = Estimate { value: iron.value + stray.value, half_95: total.half_95 };
    let pairs = [
        ("stator", *stator, copper),
        ("rotor", *rotor, cage),
        ("friction", *friction, bearings),
        ("iron and stray", moved, core + additional),
        ("all", total, truth.losses.iter().sum()),
    ];
    for (name, e, x) in pairs {
        assert!(e.half_95 > 0.0 && (e.value - x).abs() < 1.5 * e.half_95, "{what}, {name}: {e:?}, true {x:.2} W");
        assert!(e.half_95 < 0.01 * truth.shown[2], "{what}, {name} is not determined: {e:?}");
    }
    assert!(
        (iron.value - core).abs() < 0.1 * core && (stray.value - additional).abs() < 0.1 * core,
        "{what}: {iron:?} {stray:?} {truth:?}"
    );
}

#[test]
fn the_standards_regression_and_the_fitted_model_segregate_alike() {
    let folder = Folder::new("type-test-losses");
    let sources = sources(&folder, true);
    let read = |(path, _): &(std::path::PathBuf, _)| im_diagnose::intake::SteadyTable::read(path, None).unwrap();
    let tables: Vec<_> = sources.tables.iter().map(read).collect();
    let by_model = ByModel::of(&sources.motor, &tables, None).unwrap();
    assert!(by_model.error < 1.5, "{}", by_model.error);
    // The resistance and its temperature are those of the motor file.
    let by_lines = segregate(&sources.motor, &tables, None).unwrap();
    assert!(by_lines.remarks.iter().all(|r| !r.contains("resistance")), "{:?}", by_lines.remarks);
    for ((m, l), (truth, c)) in by_model.points.iter().zip(&by_lines.points).zip(loads()) {
        near(&[m.stator_w, m.rotor_w, m.iron_w, m.friction_windage_w, m.stray_w], m.total_w, &truth, "model");
        assert_eq!(l.winding_c, c);
        let (a, b) = (m.total_w, l.total_w);
        // Straight over the square of the torque, the additional loss of the standard is not quite that of the rotor's current.
        assert!((a.value - b.value).abs() < 2.0 * a.half_95.hypot(b.half_95), "{a:?} {b:?}");
        assert!((l.stator_w.value - truth.losses[0]).abs() < l.stator_w.half_95, "{:?} {}", l.stator_w, truth.losses[0]);
    }
}
