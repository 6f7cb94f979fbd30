//! The laboratory's recordings, where they are at hand.

use std::path::{Path, PathBuf};

use im_diagnose::intake::{FindingKind, Intake, mapping::Begin, read};
use im_identify::offline::ChannelKind;
use im_model::MotorFile;

use crate::simulated::of;

const FIXTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/recordings/direct_on_line_4kw");

fn measured(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings/measured/direct_on_line_4kw").join(name)
}

fn taken(name: &str) -> Intake {
    let path = measured(&format!("{name}.csv"));
    let motor = MotorFile::read(format!("{FIXTURES}/motor.toml")).unwrap();
    let mapping = format!("{FIXTURES}/{name}.recording.toml");
    let taken = read(&path, Some(Path::new(&mapping)), &motor).unwrap().remove(0);
    for f in &taken.findings {
        println!("{:?} {}", f.kind, f.line());
        println!("   {:?}", f.rows);
    }
    taken
}

/// The saturated sensors are found by the sum, and the second sensor of phase 3 takes its place.
#[test]
#[ignore = "needs the recordings in ../shared, which cannot be copied"]
fn the_start_is_compared_by_what_the_sensors_show_truly() {
    let t = taken("Test_4_IM_Direct_Start");
    let e = &t.experiment;
    assert_eq!(t.begin, Begin::AtRest);
    let names: Vec<&str> = e.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["i_a_A", "i_b_A", "i_c_A", "omega_m_rad_s"]);
    // The peak of phase c is seen by the second sensor alone.
    let peak = e.channels[2].values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    assert!(peak > 90.0, "{peak}");
    assert_eq!(of(&t.findings, FindingKind::RedundantSensor).len(), 1);
    let masked: Vec<usize> = e.channels.iter().map(|c| e.len() - c.count()).collect();
    println!("rows left out: {masked:?}");
    assert!(masked[0] > 50 && masked[1] > 50 && masked[2] < 20 && masked[3] == 0, "{masked:?}");
    // What is left sums to zero, within the noise, the gains and half a sample between the sensors.
    let i: Vec<&Vec<f64>> = e.channels[..3].iter().map(|c| &c.values).collect();
    let mut off: Vec<f64> = Vec::new();
    for k in (0..e.len()).filter(|&k| e.channels[..3].iter().all(|c| c.is_valid(k))) {
        let size = i.iter().fold(0.0, |m: f64, x| m.max(x[k].abs()));
        off.push((i[0][k] + i[1][k] + i[2][k]).abs() / (1.5 + 0.03 * size));
    }
    assert!(off.iter().all(|x| *x < 1.3), "{:?}", off.iter().fold(0.0, |m: f64, x| m.max(*x)));
    // Only the start saturates them; the load step does not.
    let after = (0.2 / e.sample_time_s) as usize;
    assert!(e.channels.iter().all(|c| (after..e.len()).all(|k| c.is_valid(k))));
    let load = &e.tau_load[(1.2 / e.sample_time_s) as usize..(1.5 / e.sample_time_s) as usize];
    let mean = load.iter().sum::<f64>() / load.len() as f64;
    assert!((24.0..30.0).contains(&mean), "{mean}");
}

#[test]
#[ignore = "needs the recordings in ../shared, which cannot be copied"]
fn locked_rotor_and_no_load_need_no_mercy() {
    let locked = taken("Test_2_IM_Locked_Rotor");
    assert!(locked.experiment.imposed_speed.as_ref().is_some_and(|w| w.iter().all(|x| *x == 0.0)));
    assert!(locked.experiment.channels.iter().all(|c| matches!(c.kind, ChannelKind::Current { .. }) && c.valid.is_none()));
    let free = taken("Test_3_IM_No_Load");
    assert_eq!(free.begin, Begin::InMotion);
    assert!(free.experiment.channels.iter().all(|c| c.valid.is_none()));
    for f in locked.findings.iter().chain(&free.findings) {
        assert!(
            !matches!(f.kind, FindingKind::DifferentMachine | FindingKind::WrongPolePairs | FindingKind::SwappedPhases),
            "{f:?}"
        );
    }
}
