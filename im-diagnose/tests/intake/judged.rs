//! A comparison and a validation count errors alike, and as a diagnosis does.

use im_diagnose::report::Comparison;
use im_diagnose::validation::Validation;
use im_model::{BaseParameter, ParameterId};

use crate::simulated::{MAPPING, columns, motor, taken};

/// Without the load the measured speed drives the model, whose noise counts for nothing.
#[test]
fn a_comparison_and_a_validation_count_alike_where_the_load_is_unknown() {
    let mapping = MAPPING.split("[load]").next().unwrap();
    let run = || taken("judged", &columns(), mapping);
    let right = motor();
    let wrong = {
        let r_r = (ParameterId::Base(BaseParameter::RotorResistance), 1.3);
        im_model::MotorFile { machine: right.machine.with(&[r_r]).unwrap(), ..right.clone() }
    };
    let (compared, _) = Comparison::of_intake(&right, "right", vec![run()], false).unwrap();
    let found = Validation::new((&wrong, "wrong"), (&right, "right"), run(), false).unwrap();
    let [before, after] = &found.not_nudged;
    assert!(
        (compared.total.rms_in_sigma() - after.rms_in_sigma()).abs() < 1e-9,
        "{} {}",
        compared.total.rms_in_sigma(),
        after.rms_in_sigma()
    );
    assert_eq!(compared.total.rmse, after.rmse);
    // 1.15: what a diagnosis says of this run and motor as given, whose start is faster than its smooth speed follows.
    assert!((after.rms_in_sigma() - 1.15).abs() < 0.02 && before.rms_in_sigma() > 3.0, "{before:?} {after:?}");
    // No speed is compared that could be drawn to another.
    assert_eq!(found.not_nudged, found.speed_nudged);
}
