//! What `im learn --rust` writes is Rust that compiles, and does what the curve does.
//!
//! The files in `src/learned` are compiled with this crate. `BLESS=1 cargo test -p im-tests --test learned_rust` writes them anew.

use std::path::PathBuf;

use im_diagnose::learn::{Curve, own_effect};
use im_model::effects::{Acts, CustomId, Over};
use im_model::{Bench, Complex, EffectId, Machine, ParameterId, PlantInput, State, machines};

/// A curve of each kind of place, nearest to a formula of the dictionary.
fn curves() -> Vec<(&'static str, Curve)> {
    let of = |pair, range, order, f: fn(f64) -> f64| Curve::of_function(pair, range, order, 0.01, f);
    let brake = |w: f64| 4.0 * (w / 40.0) / (1.0 + (w / 40.0).powi(2));
    vec![
        ("own_torque_over_speed", of((Acts::Torque, Over::Speed), (-20.0, 160.0), 1.0, brake)),
        ("own_torque_over_shaft_angle", of((Acts::Torque, Over::ShaftAngle), (0.0, 1.0), 3.0, |x| 2.0 * (3.0 * x).cos())),
        (
            "own_stator_resistance_over_time",
            of((Acts::StatorResistance, Over::Time), (0.0, 0.1), 1.0, |t| 0.4 * (-t / 0.04).exp()),
        ),
        ("own_magnetizing_current_over_flux", of((Acts::MagnetizingCurrent, Over::Flux), (0.0, 1.3), 1.0, |x| 0.3 * x * x)),
        (
            "own_magnetizing_current_over_shaft_angle",
            of((Acts::MagnetizingCurrent, Over::ShaftAngle), (0.0, 1.0), 28.0, |x| 0.03 * (28.0 * x).cos()),
        ),
        ("own_current_sensor_over_current", of((Acts::CurrentSensor, Over::Current), (0.0, 90.0), 1.0, |i| -0.003 * i)),
        ("own_speed_sensor_over_shaft_angle", of((Acts::SpeedSensor, Over::ShaftAngle), (0.0, 1.0), 1.0, |x| 0.02 * x.sin())),
        ("own_voltage_over_current", of((Acts::Voltage, Over::Current), (0.0, 90.0), 1.0, |i| -0.001 * i)),
        ("own_leakage_current_over_current", of((Acts::LeakageCurrent, Over::Current), (0.0, 90.0), 1.0, |i| 0.01 * i)),
    ]
}

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("src/learned/{name}.rs"))
}

#[test]
fn the_files_are_what_is_written() {
    for (name, curve) in curves() {
        let written = own_effect(&curve, name).expect("each has a formula");
        if std::env::var("BLESS").is_ok() {
            std::fs::write(file(name), &written).unwrap();
        }
        assert_eq!(std::fs::read_to_string(file(name)).unwrap(), written, "{name}");
    }
}

/// Speed and currents over the first tenth of a second on rated voltage, from a speed.
fn run(m: &Machine<f64>) -> Vec<[f64; 3]> {
    let mut bench = Bench::new(m, State::turning(90.0), 1e-4);
    (0..1000)
        .map(|k| {
            let y = bench.output();
            let u = Complex::from_polar(326.6, 314.16 * 1e-4 * (f64::from(k) + 0.5));
            bench.advance(&PlantInput::new(u, 5.0));
            [y.i_s.re, y.i_s.im, y.omega_m]
        })
        .collect()
}

fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().zip(b).flat_map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).powi(2))).sum::<f64>().sqrt()
}

/// The curves are the formulas to within what five intervals of a spline can do: a twentieth of what the effect changes.
#[test]
fn an_effect_written_does_what_its_curve_does() {
    use im_tests::learned as l;
    let effects: [CustomId; 9] = [
        CustomId(&l::own_torque_over_speed::OwnTorqueOverSpeedEffect),
        CustomId(&l::own_torque_over_shaft_angle::OwnTorqueOverShaftAngleEffect),
        CustomId(&l::own_stator_resistance_over_time::OwnStatorResistanceOverTimeEffect),
        CustomId(&l::own_magnetizing_current_over_flux::OwnMagnetizingCurrentOverFluxEffect),
        CustomId(&l::own_magnetizing_current_over_shaft_angle::OwnMagnetizingCurrentOverShaftAngleEffect),
        CustomId(&l::own_current_sensor_over_current::OwnCurrentSensorOverCurrentEffect),
        CustomId(&l::own_speed_sensor_over_shaft_angle::OwnSpeedSensorOverShaftAngleEffect),
        CustomId(&l::own_voltage_over_current::OwnVoltageOverCurrentEffect),
        CustomId(&l::own_leakage_current_over_current::OwnLeakageCurrentOverCurrentEffect),
    ];
    let motor = machines::MOTULATOR_2_2_KW;
    let base = Machine::base(motor.parameters(), motor.pole_pairs).unwrap();
    let alone = run(&base);
    for ((name, curve), own) in curves().into_iter().zip(effects) {
        assert_eq!(own.name(), name);
        let set = |e: EffectId, values: &[f64]| {
            let all: Vec<_> = values.iter().enumerate().map(|(k, x)| (ParameterId::Effect(e, k), *x)).collect();
            run(&base.with(&all).unwrap())
        };
        let learned = set(curve.effect, &curve.values);
        let formula = &curve.formulas[0];
        let values: Vec<f64> = formula.factors.iter().chain(&formula.shape).copied().collect();
        let written = set(EffectId::Custom(own), &values);
        let (changed, apart) = (distance(&learned, &alone), distance(&learned, &written));
        assert!(changed > 0.1 && apart < 0.05 * changed, "{name}: {apart} of {changed}; {formula:?}");
    }
}
