//! Recordings of a machine that nobody here has simulated, with a stator that heats up.

use std::path::PathBuf;

use im_identify::online::{ReplayScheme, replay};
use im_model::{BaseParameter, MotorFile, ParameterId, Recording};

/// Case open07 with its true parameters (`truth.json` beside it) and the thermal model it names: K/W, J/K.
const TRUE_BASE: [(BaseParameter, f64); 5] = [
    (BaseParameter::StatorResistance, 3.578_146),
    (BaseParameter::RotorResistance, 1.977_933),
    (BaseParameter::StatorLeakageInductance, 0.011_266_47),
    (BaseParameter::RotorLeakageInductance, 0.009_723_617),
    (BaseParameter::MagnetizingInductance, 0.236_406_98),
];
const THERMAL: [f64; 2] = [0.311_157, 44.310_36];
/// Copper, 1/K.
const COEFFICIENT: f64 = 3.93e-3;

#[test]
#[ignore = "needs the recordings in ../shared, which cannot be copied"]
fn winding_resistance_is_followed_as_it_heats_up_on_foreign_data() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings/open/open07");
    let motor = MotorFile::read(folder.join("motor.toml")).unwrap();
    let changes = TRUE_BASE.map(|(p, x)| (ParameterId::Base(p), x));
    let motor = MotorFile { machine: motor.machine.with(&changes).unwrap(), ..motor };
    let recording = Recording::read_csv(folder.join("train2.csv")).unwrap();
    let (h, [r_th, c], cold) = (recording.sample_time_s, THERMAL, TRUE_BASE[0].1);
    let mut rise = 0.0;
    let truth: Vec<f64> = (0..recording.len())
        .map(|k| {
            let r_s = cold * (1.0 + COEFFICIENT * rise);
            rise += h * (1.5 * r_s * recording.i_s[k].norm_sqr() - rise / r_th) / c;
            r_s
        })
        .collect();
    let rows = replay(&motor, &recording, ReplayScheme::TimeScale, |k| k % 200 == 0).unwrap();
    let (mut sum, mut cold_sum, mut n) = (0.0, 0.0, 0.0);
    for row in rows.iter().filter(|r| r.time_s > 2.0 && r.both.adapting[1]) {
        let k = ((row.time_s - recording.start_s) / h).round() as usize;
        sum += (row.both.values[1] / truth[k] - 1.0).abs();
        cold_sum += (cold / truth[k] - 1.0).abs();
        n += 1.0;
        assert!((row.rotor.values[0] / TRUE_BASE[1].1 - 1.0).abs() < 0.25, "{row:?}");
    }
    let (followed, not) = (sum / n, cold_sum / n);
    assert!(n > 100.0 && followed < 0.04 && not > 0.1, "{followed} against {not} of the cold value, {n} rows");
}
