//! A simulated recording replayed: what each scheme says of a machine whose parameters it was given wrong.

use crate::bench::{Bench, Point};
use im_identify::online::{IdentifierStatus, ReplayScheme, replay};
use im_model::machines::JADOT_TABLE_I;
use im_model::{BaseParameter, Machine, MotorFile, ParameterId, Recording};

const H: f64 = 1e-4;
const BEGIN_S: f64 = 5.0;

/// Six seconds at one loaded point: row k shows what is measured then and the voltage that acts until the next.
fn recording() -> Recording {
    let m = JADOT_TABLE_I;
    let mut bench = Bench::new(m.parameters(), m.pole_pairs, H);
    let point = Point { omega_r: 250.0, omega_g: 7.0, flux_vs: 0.9 };
    bench.settle(&point);
    let mut samples = vec![bench.sample()];
    bench.hold(6.0, &point, |s, _| samples.push(*s));
    let held = samples.iter().skip(1).map(|s| s.u_s);
    Recording {
        name: "loaded".into(),
        start_s: BEGIN_S,
        sample_time_s: H,
        u_s: held.chain([samples[0].u_s]).collect(),
        i_s: samples.iter().map(|s| s.i_s).collect(),
        omega_m: samples.iter().map(|s| s.omega_m).collect(),
        tau_load: None,
    }
}

/// What the drive was given: R_r and R_s wrong, the inductances right.
fn motor(rotor: f64, stator: f64) -> MotorFile {
    let m = JADOT_TABLE_I;
    let p = m.parameters();
    let base = Machine::base(p, m.pole_pairs).unwrap();
    let of = |id, x: f64| (ParameterId::Base(id), x);
    let machine = base
        .with(&[
            of(BaseParameter::RotorResistance, rotor * p.rotor_resistance_ohm),
            of(BaseParameter::StatorResistance, stator * p.stator_resistance_ohm),
        ])
        .unwrap();
    MotorFile::new("given", machine, m.rating)
}

#[test]
fn every_identifier_finds_what_the_drive_was_given_wrongly() {
    let (r, p) = (recording(), JADOT_TABLE_I.parameters());
    let truth = p.inverse_gamma();
    for (scheme, stator) in [(ReplayScheme::TimeScale, 1.0), (ReplayScheme::TimeVarying, 1.0), (ReplayScheme::Reduced, 1.2)] {
        let rows = replay(&motor(1.25, stator), &r, scheme, |k| k % 10 == 0).unwrap();
        assert_eq!(rows.len(), (r.len() - 1) / 10);
        assert!(rows.iter().enumerate().all(|(k, row)| (row.time_s - BEGIN_S - 10.0 * H * (k + 1) as f64).abs() < 1e-9));
        let last = rows.last().unwrap();
        assert_eq!(
            (last.rotor.status, last.both.status, last.regulation.status),
            (IdentifierStatus::Adapting, IdentifierStatus::Adapting, IdentifierStatus::Adapting)
        );
        // R_r alone takes what R_s is wrong by for its own: 20 % of the small R_s, seen against the voltage.
        assert!(
            (last.rotor.values[0] / p.rotor_resistance_ohm - 1.0).abs() < if stator == 1.0 { 0.01 } else { 0.15 },
            "{last:?}"
        );
        assert!((last.both.values[0] / p.rotor_resistance_ohm - 1.0).abs() < 0.01, "{last:?}");
        assert!((last.both.values[1] / p.stator_resistance_ohm - 1.0).abs() < 0.03, "{last:?}");
        let four = last.regulation.values;
        assert!((four[0] / truth.rotor_resistance_ohm - 1.0).abs() < 0.05, "{scheme:?}: {last:?}");
        match scheme {
            ReplayScheme::Reduced => {
                assert_eq!(last.regulation.adapting, [true, true, false, false]);
                assert_eq!(four[2..], [1.2 * p.stator_resistance_ohm, truth.leakage_inductance_h]);
            }
            _ => assert_eq!(last.regulation.adapting, [true; 4]),
        }
    }
}

/// Both of Jadot's laws in full, not the same one: theirs is another speed.
#[test]
fn the_schemes_are_different_laws() {
    let r = recording();
    let at = |scheme| replay(&motor(1.25, 1.0), &r, scheme, |k| k == 2000).unwrap()[0].regulation.values[0];
    let all = [ReplayScheme::TimeScale, ReplayScheme::TimeVarying, ReplayScheme::Reduced].map(at);
    assert!(all[0] != all[1] && all[1] != all[2], "{all:?}");
}
