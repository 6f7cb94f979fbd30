//! What a drive believes, what it passes on and what it lets out, seen by a controller that only looks.

use im_control::modulation::DeadTimeCompensation;
use im_control::{Drive, DriveLimits, DriveStatus, Reports};
use im_model::Complex;
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::unit;

type C = Complex<f64>;
const T: f64 = 1e-4;
const N_P: f64 = 2.0;
const ANSWER: C = C::new(80.0, -60.0);

/// Keeps what it is shown, and gives the answer that was set.
#[derive(Clone)]
struct Looks {
    answer: Command<f64>,
    shown: Option<(Measured<f64>, Reference<f64>)>,
    steps: usize,
}

impl Controller<f64> for Looks {
    fn step(&mut self, m: &Measured<f64>, r: &Reference<f64>) -> Command<f64> {
        self.shown = Some((*m, *r));
        self.steps += 1;
        self.answer
    }
}
impl Reports for Looks {
    fn status(&self) -> DriveStatus {
        DriveStatus::FIELD_WEAKENING
    }
}

/// What the controller says of itself goes through.
const WELL: DriveStatus = DriveStatus::FIELD_WEAKENING;

const LIMITS: DriveLimits<f64> = DriveLimits {
    pole_pairs: 2,
    current_range_a: 40.0,
    overcurrent_a: 15.0,
    speed_range_rad_s: 450.0,
    speed_max_rad_s: 300.0,
    rotor_flux_max_vs: 1.25,
    torque_max_nm: 30.0,
    speed_slew_rad_s2: 1000.0,
    torque_slew_nm_per_s: 200.0,
    voltage_max_v: 500.0,
    lost_samples_max: 3,
    fade_s: 0.01,
};

const GOOD: Measured<f64> =
    Measured { i_s: C::new(5.0, 2.0), omega_m: 100.0, u_s: C::new(30.0, 7.0), dc_voltage_v: 540.0, sample_time_s: T };
const ASKED: Reference<f64> = Reference { omega_m: 100.0, rotor_flux_vs: 0.9, torque_nm: 0.0 };

fn drive_with(answer: Command<f64>) -> Drive<f64, Looks> {
    Drive::try_new(Looks { answer, shown: None, steps: 0 }, &LIMITS).unwrap()
}

fn drive() -> Drive<f64, Looks> {
    drive_with(Command::Voltage(ANSWER))
}

/// What the controller is shown in a sample, and what the drive says of it.
fn shown(drive: &mut Drive<f64, Looks>, m: Measured<f64>, r: Reference<f64>) -> (Measured<f64>, Reference<f64>, DriveStatus) {
    drive.step(&m, &r);
    let (m, r) = drive.controller().shown.unwrap();
    (m, r, drive.status())
}

fn out(drive: &mut Drive<f64, Looks>, m: Measured<f64>) -> C {
    let (Command::Voltage(x) | Command::Current(x)) = drive.step(&m, &ASKED);
    x
}

fn near(a: C, b: C) -> bool {
    (a - b).norm() < 1e-9
}

#[test]
fn what_is_good_passes_as_it_is() {
    let mut d = drive();
    assert_eq!(shown(&mut d, GOOD, ASKED), (GOOD, ASKED, WELL));
    assert_eq!(out(&mut d, GOOD), ANSWER);
    // Up to the very end of a sensor's range, and with an empty link.
    let edge = Measured { i_s: C::new(0.0, -14.0), omega_m: -450.0, dc_voltage_v: 0.0, ..GOOD };
    assert_eq!(shown(&mut d, edge, ASKED).0, edge);
    assert_eq!(d.status(), WELL);
}

/// ψ and i of a machine without voltage stand still in the frame of the rotor, which turns by n_p ω T in a sample.
#[test]
fn a_lost_current_turns_on_with_the_rotor() {
    for lost in [C::new(f64::NAN, 0.0), C::new(0.0, f64::INFINITY), C::new(40.01, 0.0), C::new(-30.0, 30.0)] {
        let mut d = drive();
        shown(&mut d, GOOD, ASKED);
        for k in 1..=3 {
            let (m, _, status) = shown(&mut d, Measured { i_s: lost, ..GOOD }, ASKED);
            assert!(near(m.i_s, GOOD.i_s * unit(N_P * 100.0 * T * f64::from(k))), "{k}: {m:?}");
            assert_eq!(status, WELL.and(DriveStatus::CURRENT_LOST));
        }
    }
    // The range itself is believed, though it is an overcurrent.
    let (m, _, status) = shown(&mut drive(), Measured { i_s: C::new(40.0, 0.0), ..GOOD }, ASKED);
    assert_eq!((m.i_s, status), (C::new(40.0, 0.0), WELL.and(DriveStatus::OVERCURRENT)));
}

#[test]
fn other_quantities_that_are_lost_stay_as_they_were() {
    let mut d = drive();
    shown(&mut d, GOOD, ASKED);
    for omega_m in [f64::NAN, 450.1, -451.0] {
        let (m, _, status) = shown(&mut d, Measured { omega_m, ..GOOD }, ASKED);
        assert_eq!((m.omega_m, status), (100.0, WELL.and(DriveStatus::SPEED_LOST)));
    }
    for dc_voltage_v in [f64::NAN, -1.0, f64::INFINITY] {
        let (m, _, status) = shown(&mut d, Measured { dc_voltage_v, ..GOOD }, ASKED);
        assert_eq!((m.dc_voltage_v, status), (540.0, WELL.and(DriveStatus::DC_VOLTAGE_LOST)));
    }
    let (m, _, status) = shown(&mut d, Measured { u_s: C::new(0.0, f64::NAN), ..GOOD }, ASKED);
    assert_eq!((m.u_s, status), (GOOD.u_s, WELL));
    // Without a time since the last sample nothing is known of the current either.
    for sample_time_s in [0.0, -1e-4, f64::NAN, f64::INFINITY] {
        let mut d = drive();
        shown(&mut d, GOOD, ASKED);
        let (m, _, status) = shown(&mut d, Measured { sample_time_s, ..GOOD }, ASKED);
        assert_eq!((m.sample_time_s, status), (T, WELL.and(DriveStatus::CURRENT_LOST)));
        assert!(near(m.i_s, GOOD.i_s * unit(N_P * 100.0 * T)));
    }
}

#[test]
fn an_overcurrent_begins_above_its_limit() {
    let of = |a: f64| shown(&mut drive(), Measured { i_s: C::new(0.0, a), ..GOOD }, ASKED).2;
    assert_eq!((of(15.0), of(-15.01)), (WELL, WELL.and(DriveStatus::OVERCURRENT)));
}

#[test]
fn references_are_kept_within_their_limits_and_said_so_only_beyond_them() {
    let status = |r: Reference<f64>| shown(&mut drive(), GOOD, r).2;
    for edge in [
        Reference { omega_m: 300.0, ..ASKED },
        Reference { omega_m: -300.0, ..ASKED },
        Reference { rotor_flux_vs: 0.0, ..ASKED },
        Reference { rotor_flux_vs: 1.25, ..ASKED },
        Reference { torque_nm: 30.0, ..ASKED },
        Reference { torque_nm: -30.0, ..ASKED },
    ] {
        assert_eq!(status(edge), WELL, "{edge:?}");
    }
    for beyond in [
        Reference { omega_m: 300.1, ..ASKED },
        Reference { omega_m: -300.1, ..ASKED },
        Reference { rotor_flux_vs: -0.01, ..ASKED },
        Reference { rotor_flux_vs: 1.26, ..ASKED },
        Reference { torque_nm: 30.1, ..ASKED },
        Reference { torque_nm: -30.1, ..ASKED },
    ] {
        assert_eq!(status(beyond), WELL.and(DriveStatus::REFERENCE_LIMITED), "{beyond:?}");
    }
    let flux = |rotor_flux_vs: f64| shown(&mut drive(), GOOD, Reference { rotor_flux_vs, ..ASKED }).1.rotor_flux_vs;
    assert_eq!((flux(9.0), flux(-1.0)), (1.25, 0.0));

    // A reference that is no number is the last one.
    let mut d = drive();
    shown(&mut d, GOOD, ASKED);
    let lost = Reference { omega_m: f64::NAN, rotor_flux_vs: f64::INFINITY, torque_nm: f64::NAN };
    let (_, r, status) = shown(&mut d, GOOD, lost);
    assert_eq!((r, status), (ASKED, WELL.and(DriveStatus::REFERENCE_LOST)));
}

/// From the speed that the machine has, by 1000 rad/s² and 200 Nm/s, to the limit and no further.
#[test]
fn references_change_at_their_slew_rates() {
    for sign in [1.0, -1.0] {
        let mut d = drive();
        let wanted = Reference { omega_m: sign * 1e6, torque_nm: sign * 1e6, ..ASKED };
        for k in 1..=5000 {
            let (_, r, _) = shown(&mut d, GOOD, wanted);
            let t = f64::from(k) * T;
            let expected = [(100.0 + sign * 1000.0 * t).clamp(-300.0, 300.0), (sign * 200.0 * t).clamp(-30.0, 30.0)];
            assert!(
                (r.omega_m - expected[0]).abs() < 1e-6 && (r.torque_nm - expected[1]).abs() < 1e-6,
                "{k}: {r:?} {expected:?}"
            );
        }
    }
}

/// Three lost samples are bridged. With the fourth the command turns with the rotor and fades out in 10 ms; after more than three good ones
/// in a row the controller begins anew, from the speed that the machine has then.
#[test]
fn a_drive_that_lost_its_sensors_fades_out_and_begins_anew() {
    for answer in [Command::Voltage(ANSWER), Command::Current(C::new(8.0, -6.0))] {
        let (Command::Voltage(first) | Command::Current(first)) = answer;
        let mut d = drive_with(answer);
        let (good, lost) = (Measured { omega_m: 50.0, ..GOOD }, Measured { i_s: C::new(f64::NAN, 0.0), omega_m: 50.0, ..GOOD });
        for m in [good, lost, lost, lost] {
            assert_eq!(out(&mut d, m), first);
            assert!(!d.status().has(DriveStatus::BLOCKED));
        }
        assert_eq!(d.controller().steps, 4);
        let mut expected = first;
        for _ in 0..5 {
            expected = expected * unit(N_P * 50.0 * T) * (1.0 - T / 0.01);
            assert!(near(out(&mut d, lost), expected));
            assert_eq!(d.status(), DriveStatus::CURRENT_LOST.and(DriveStatus::BLOCKED));
        }
        // Two good ones, one bad: the count begins again. Meanwhile the machine was turned.
        let turned = Measured { omega_m: -200.0, ..GOOD };
        for m in [good, good, lost, turned, turned, turned] {
            out(&mut d, m);
            assert!(d.status().has(DriveStatus::BLOCKED) && d.controller().steps == 4);
        }
        let (_, r, status) = shown(&mut d, turned, Reference { omega_m: -200.0, torque_nm: 30.0, ..ASKED });
        assert_eq!(d.controller().steps, 1, "a controller in its first state");
        assert_eq!(status, WELL.and(DriveStatus::RESTARTED));
        assert!((r.omega_m + 200.0).abs() < 1e-9 && (r.torque_nm - 200.0 * T).abs() < 1e-9, "{r:?}");
        // A sample as long as all the fading.
        for _ in 0..4 {
            out(&mut d, lost);
        }
        assert_eq!(out(&mut d, Measured { sample_time_s: 0.02, ..lost }), C::new(0.0, 0.0));
    }
}

#[test]
fn a_command_that_is_no_number_starts_the_controller_anew() {
    let mut d = drive();
    out(&mut d, GOOD);
    d.controller_mut().answer = Command::Voltage(C::new(1.0, f64::NAN));
    let made = out(&mut d, GOOD);
    assert!(near(made, ANSWER * unit(N_P * 100.0 * T) * (1.0 - T / 0.01)), "{made}");
    assert_eq!(d.status(), WELL.and(DriveStatus::RESTARTED));
    assert_eq!((out(&mut d, GOOD), d.status()), (ANSWER, WELL));
}

#[test]
fn what_leaves_is_within_link_and_limits_in_its_direction() {
    let direction = unit(0.2);
    let made = |u: C, dc_voltage_v: f64| out(&mut drive_with(Command::Voltage(u)), Measured { dc_voltage_v, ..GOOD });
    // Without a link the limit of the drive alone; a hexagon reaches from U/√3 to 2U/3.
    assert!(near(made(direction * 900.0, 0.0), direction * 500.0));
    let within = made(direction * 450.0, 540.0);
    assert!((within / direction).im.abs() < 1e-9 && (540.0 / 3f64.sqrt()..=360.0).contains(&within.norm()), "{within}");
    let current = |i: C| out(&mut drive_with(Command::Current(i)), GOOD);
    assert!(near(current(direction * 99.0), direction * 15.0) && near(current(direction * 14.9), direction * 14.9));
}

/// The inverter gets u + what it will take; the controller is shown what it asked for.
#[test]
fn compensation_is_between_drive_and_inverter_alone() {
    let law = DeadTimeCompensation {
        dead_time_s: 2e-6,
        switching_period_s: 1e-4,
        drop_v: 1.2,
        on_resistance_ohm: 0.05,
        soft_current_a: 0.5,
    };
    let mut d = drive().compensating(&law).unwrap();
    let added = law.voltage(GOOD.i_s, GOOD.dc_voltage_v);
    let made = out(&mut d, GOOD);
    assert!(added.norm() > 5.0 && near(made, ANSWER + added), "{made} {added}");
    let (m, ..) = shown(&mut d, Measured { u_s: made, ..GOOD }, ASKED);
    assert!(near(m.u_s, ANSWER), "{}", m.u_s);
    // Currents need none.
    let mut d = drive_with(Command::Current(C::new(3.0, 4.0))).compensating(&law).unwrap();
    assert_eq!(out(&mut d, GOOD), C::new(3.0, 4.0));
}

/// Per phase (U t_d/T_sw + V_f) x/√(I₀² + x²) + r x, less what the floating star point takes.
#[test]
fn compensation_is_what_dead_time_and_devices_take() {
    let law = DeadTimeCompensation {
        dead_time_s: 3e-6,
        switching_period_s: 1e-4,
        drop_v: 1.5,
        on_resistance_ohm: 0.1,
        soft_current_a: 0.4,
    };
    let lost = 600.0 * 3e-6 / 1e-4 + 1.5;
    // i_a = I₀, the others −I₀/2: 71 % and 45 % of it; the space vector is two thirds of a − (b + c)/2.
    let (half, quarter) = (0.5f64.sqrt(), 0.2f64.sqrt());
    let at = law.voltage(C::new(0.4, 0.0), 600.0);
    assert!(near(at, C::new(2.0 / 3.0 * lost * (half + quarter) + 0.1 * 0.4, 0.0)), "{at}");
    // Far above I₀ it is the square wave of dead time: 4/3 of what a phase loses.
    let far = law.voltage(C::new(-1000.0, 0.0), 600.0);
    assert!((far.re + 4.0 / 3.0 * lost + 100.0).abs() < 1e-4 && far.im.abs() < 1e-9, "{far}");
}
