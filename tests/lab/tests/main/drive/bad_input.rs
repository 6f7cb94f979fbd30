//! What comes in may be wrong: what goes out is bounded, says so, and the drive comes back by itself.

use im_control::DriveStatus;
use im_control::named::Supervised;
use im_model::simulation::{Command, Controller, Measured, Reference, Simulation};
use im_model::{Complex, Machine, machines};
use proptest::prelude::*;

use super::common::{DriveCase, points};

/// Spoils what passes between machine and drive.
struct Spoiled<'a, F> {
    drive: &'a mut dyn Supervised,
    spoil: F,
    sample: usize,
    seen: DriveStatus,
    largest: f64,
}

impl<F: FnMut(usize, &mut Measured<f64>, &mut Reference<f64>)> Controller<f64> for Spoiled<'_, F> {
    fn step(&mut self, m: &Measured<f64>, r: &Reference<f64>) -> Command<f64> {
        let (mut m, mut r) = (*m, *r);
        (self.spoil)(self.sample, &mut m, &mut r);
        self.sample += 1;
        let command = self.drive.step(&m, &r);
        self.seen = self.seen.and(self.drive.status());
        let (Command::Voltage(u) | Command::Current(u)) = command;
        assert!(u.re.is_finite() && u.im.is_finite(), "sample {}", self.sample);
        self.largest = self.largest.max(u.norm());
        command
    }
}

fn case() -> (Machine<f64>, DriveCase) {
    let m = machines::JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let case = DriveCase::new(&machine, &m.rating, 0.0);
    (machine, case)
}

/// Runs up to 100 rad/s with something spoiled between samples 8000 and `until`; the end must be as if nothing had been.
fn recovers(
    name: &str,
    drive: &mut dyn Supervised,
    until: usize,
    expected: DriveStatus,
    spoil: impl Fn(&mut Measured<f64>, &mut Reference<f64>),
) {
    let (machine, case) = case();
    let s = case.scenario(points(&[[0.0, 0.0], [0.3, 0.0], [0.3, 100.0]]), points(&[[0.6, 0.0], [0.6, 10.0]]), 2.5);
    let mut spoiled = Spoiled {
        drive,
        spoil: |k: usize, m: &mut Measured<f64>, r: &mut Reference<f64>| {
            if (8000..until).contains(&k) {
                spoil(m, r);
            }
        },
        sample: 0,
        seen: DriveStatus::OK,
        largest: 0.0,
    };
    let run = Simulation::new(&machine, &s).controlled_by(&mut spoiled).run().unwrap();
    assert!(spoiled.seen.has(expected), "{name}: {}, expected {expected}", spoiled.seen);
    assert!(spoiled.largest <= case.dc_voltage_v * 2.0 / 3.0 + 1e-9);
    let peak = run.recording.i_s.iter().fold(0.0f64, |p, i| p.max(i.norm()));
    assert!(peak < 2.0 * case.known.current_max_a, "{name}: {peak} A");
    assert!((run.state.omega_m - 100.0).abs() < 0.5, "{name}: {} rad/s", run.state.omega_m);
    assert!(drive.status() == DriveStatus::OK, "{name}: {}", drive.status());
}

#[test]
fn a_few_lost_samples_are_bridged() {
    for (name, mut drive) in case().1.drives() {
        recovers(name, drive.as_mut(), 8003, DriveStatus::CURRENT_LOST, |m, _| m.i_s = Complex::new(f64::NAN, 0.0));
    }
    for (name, mut drive) in case().1.drives() {
        recovers(name, drive.as_mut(), 8005, DriveStatus::SPEED_LOST, |m, _| m.omega_m = f64::INFINITY);
    }
    for (name, mut drive) in case().1.drives() {
        recovers(name, drive.as_mut(), 8001, DriveStatus::CURRENT_LOST, |m, _| m.i_s = Complex::new(1e6, 0.0));
    }
    for (name, mut drive) in case().1.drives() {
        recovers(name, drive.as_mut(), 8050, DriveStatus::DC_VOLTAGE_LOST, |m, _| m.dc_voltage_v = f64::NAN);
    }
}

#[test]
fn after_long_loss_the_drive_is_blocked_and_comes_back() {
    for (name, mut drive) in case().1.drives() {
        let expected = DriveStatus::CURRENT_LOST.and(DriveStatus::BLOCKED).and(DriveStatus::RESTARTED);
        recovers(name, drive.as_mut(), 8500, expected, |m, _| m.i_s = Complex::new(f64::NAN, f64::NAN));
    }
    for (name, mut drive) in case().1.drives() {
        recovers(name, drive.as_mut(), 8020, DriveStatus::SPEED_LOST.and(DriveStatus::BLOCKED), |m, _| m.omega_m = f64::NAN);
    }
}

#[test]
fn references_out_of_bounds_are_limited_and_said() {
    for (name, mut drive) in case().1.drives() {
        recovers(name, drive.as_mut(), 8200, DriveStatus::REFERENCE_LIMITED, |_, r| r.omega_m = 1e9);
    }
    for (name, mut drive) in case().1.drives() {
        recovers(name, drive.as_mut(), 8200, DriveStatus::REFERENCE_LOST, |_, r| {
            (r.omega_m, r.rotor_flux_vs, r.torque_nm) = (f64::NAN, f64::NAN, f64::NEG_INFINITY);
        });
    }
    for (name, mut drive) in case().1.drives() {
        recovers(name, drive.as_mut(), 8200, DriveStatus::REFERENCE_LIMITED, |_, r| r.rotor_flux_vs = 50.0);
    }
    for (name, mut drive) in case().1.drives() {
        recovers(name, drive.as_mut(), 8200, DriveStatus::MAGNETIZING, |_, r| r.rotor_flux_vs = 0.0);
    }
}

#[test]
fn at_zero_flux_the_drive_says_that_it_magnetizes() {
    let (_, case) = case();
    for (name, mut drive) in case.drives() {
        let m = Measured {
            i_s: Complex::new(0.0, 0.0),
            omega_m: 0.0,
            u_s: Complex::new(0.0, 0.0),
            dc_voltage_v: 560.0,
            sample_time_s: 1e-4,
        };
        drive.step(&m, &Reference { omega_m: 50.0, rotor_flux_vs: 0.9, torque_nm: 0.0 });
        assert!(drive.status().has(DriveStatus::MAGNETIZING), "{name}");
    }
}

/// What is spoiled, and what the status must say of it at least.
type Fault = (DriveStatus, fn(&mut Measured<f64>, &mut Reference<f64>));

const FAULTS: [Fault; 8] = [
    (DriveStatus::CURRENT_LOST, |m, _| m.i_s.re = f64::NAN),
    (DriveStatus::CURRENT_LOST, |m, _| m.i_s = Complex::new(f64::INFINITY, 1e9)),
    (DriveStatus::SPEED_LOST, |m, _| m.omega_m = f64::NAN),
    (DriveStatus::SPEED_LOST, |m, _| m.omega_m = -1e6),
    (DriveStatus::DC_VOLTAGE_LOST, |m, _| m.dc_voltage_v = f64::NEG_INFINITY),
    (DriveStatus::REFERENCE_LOST, |_, r| (r.omega_m, r.rotor_flux_vs) = (f64::NAN, f64::INFINITY)),
    (DriveStatus::REFERENCE_LIMITED, |_, r| (r.omega_m, r.rotor_flux_vs) = (-1e9, 1e9)),
    (DriveStatus::CURRENT_LOST, |m, r| {
        let nan = Complex::new(f64::NAN, f64::NAN);
        *m = Measured { i_s: nan, omega_m: f64::NAN, u_s: nan, dc_voltage_v: f64::NAN, sample_time_s: f64::NAN };
        *r = Reference { omega_m: f64::NAN, rotor_flux_vs: f64::NAN, torque_nm: f64::NAN };
    }),
];

fn anything() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(0.0),
        Just(f64::MAX),
        Just(1e-300),
        -1e3..1e3f64
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    /// Any fault, for any time up to fifty milliseconds: bounded, said, and afterwards as if nothing had been, without a restart from outside.
    #[test]
    fn every_drive_comes_back_from_any_fault(fault in 0..FAULTS.len(), samples in 1..500usize) {
        let (expected, spoil) = FAULTS[fault];
        for (name, mut drive) in case().1.drives() {
            recovers(name, drive.as_mut(), 8000 + samples, expected, spoil);
        }
    }
}

/// At 60 rad/s and 15 Nm, a fault of up to fifty milliseconds: current and torque are bounded, and the torque comes back.
#[test]
fn the_drive_of_least_current_comes_back_from_faults() {
    let (machine, (_, case)) = (super::mtpa::machine(), case());
    let law = super::mtpa::law(&machine);
    for (expected, spoil) in FAULTS {
        for samples in [3, 400] {
            let mut s = super::mtpa::scenario(15.0);
            s.duration_s = 3.5;
            let mut drive = case.drive("mtpa", Some(law));
            let mut spoiled = Spoiled {
                drive: drive.as_mut(),
                spoil: |k: usize, m: &mut Measured<f64>, r: &mut Reference<f64>| {
                    if (12_000..12_000 + samples).contains(&k) {
                        spoil(m, r);
                    }
                },
                sample: 0,
                seen: DriveStatus::OK,
                largest: 0.0,
            };
            let run = Simulation::new(&machine, &s).controlled_by(&mut spoiled).with_internals().run().unwrap();
            let seen = spoiled.seen;
            // Nothing in a drive that follows torque hears of these.
            let reference = expected == DriveStatus::REFERENCE_LIMITED || expected == DriveStatus::REFERENCE_LOST;
            assert!(reference || seen.has(expected), "{seen}, expected {expected}");
            let torque = run.internals.unwrap().torque_nm[32_000..].iter().sum::<f64>() / 3000.0;
            assert!((torque / 15.0 - 1.0).abs() < 0.02, "{expected} for {samples} samples: {torque} Nm");
            let peak = run.recording.i_s.iter().fold(0.0f64, |p, i| p.max(i.norm()));
            assert!(peak < 2.0 * case.known.current_max_a, "{expected}: {peak} A");
            assert_eq!(drive.status(), DriveStatus::OK);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Whatever comes in, in any order: what goes out is a voltage within the hexagon, or a current within its limit.
    #[test]
    fn no_input_makes_the_output_unbounded(rows in proptest::collection::vec([(); 9].map(|()| anything()), 1..200)) {
        let (_, case) = case();
        for (name, mut drive) in case.with_baselines() {
            let mut voltage = 0.0f64;
            for x in &rows {
                let m = Measured { i_s: Complex::new(x[0], x[1]), omega_m: x[2], u_s: Complex::new(x[3], x[4]), dc_voltage_v: x[5].abs().min(1e3), sample_time_s: 1e-4 };
                if m.dc_voltage_v.is_finite() && m.dc_voltage_v > 0.0 {
                    voltage = voltage.max(m.dc_voltage_v);
                }
                let command = drive.step(&m, &Reference { omega_m: x[6], rotor_flux_vs: x[7], torque_nm: x[8] });
                let Command::Voltage(u) = command else { panic!("{name} gives voltages") };
                prop_assert!(u.norm() <= case.limits().voltage_max_v.max(2.0 / 3.0 * voltage) * 1.000_001, "{name} {u}");
            }
        }
        let law = im_control::MtpaLaw { torque_nm: [0.5, 40.0], ..im_control::MtpaLaw::kwon_printed() };
        let mut drive = case.drive("mtpa", Some(law));
        for x in &rows {
            let m = Measured { i_s: Complex::new(x[0], x[1]), omega_m: x[2], u_s: Complex::new(x[3], x[4]), dc_voltage_v: x[5], sample_time_s: 1e-4 };
            let command = drive.step(&m, &Reference { omega_m: x[6], rotor_flux_vs: x[7], torque_nm: x[8] });
            let Command::Current(i) = command else { panic!("mtpa gives currents") };
            prop_assert!(i.norm() <= case.limits().overcurrent_a * 1.000_001, "mtpa {i}");
        }
    }
}
