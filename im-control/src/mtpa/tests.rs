use super::*;
use im_model::space_vector::unit;
use im_model::{Machine, machines};

type C = Complex<f64>;
const T: f64 = 1e-4;

fn data() -> MachineData<f64> {
    let m = machines::KWON_TABLE_IV;
    MachineData::of(&Machine::base(m.parameters(), m.pole_pairs).unwrap(), 1e3)
}

fn drive(gains: &MtpaGains<f64>) -> Mtpa<f64> {
    Mtpa::try_new(&data(), &MtpaLaw::kwon_printed(), gains).unwrap()
}

/// The command, at 40 rad/s.
fn step(drive: &mut Mtpa<f64>, i_s: C, torque_nm: f64) -> C {
    let m = Measured { i_s, omega_m: 40.0, u_s: C::new(0.0, 0.0), dc_voltage_v: 540.0, sample_time_s: T };
    let Command::Current(i) = drive.step(&m, &Reference { omega_m: 0.0, rotor_flux_vs: 0.0, torque_nm }) else {
        panic!("currents")
    };
    i
}

/// Current of the law, peak, and its slip; the frame turns by n_pω + ω_s and keeps its length.
#[test]
fn an_inverter_that_gives_what_is_commanded_carries_the_current_of_the_law() {
    let law = MtpaLaw::<f64>::kwon_printed();
    let n_p = f64::from(data().pole_pairs);
    for (torque, slip_factor) in [(100.0, 1.0), (-100.0, 1.0), (60.0, 0.8)] {
        let mut drive = drive(&MtpaGains { slip_factor, ..MtpaGains::typical(&data()) });
        let (rms, slip) = law.at(torque);
        for k in 0..20_000 {
            let expected = unit((n_p * 40.0 + slip_factor * slip) * T * f64::from(k)) * (2f64.sqrt() * rms);
            // Commanded and given at once: the integral has nothing to do.
            let given = drive.direction * (2f64.sqrt() * rms);
            let commanded = step(&mut drive, given, torque);
            assert!(
                (commanded - expected).norm() < 1e-6 * expected.norm() * (1.0 + f64::from(k) * 0.01),
                "{k}: {commanded} {expected}"
            );
        }
    }
}

/// τ_scr dx/dt = i* − i, |x| ≤ i_fcl in each axis: an inverter that loses a tenth is made to give it, one that gives nothing is not.
#[test]
fn the_integral_makes_up_for_what_the_inverter_loses_up_to_its_limit() {
    let gains = MtpaGains { integral_limit_a: 12.0, tau_scr_s: 0.01, ..MtpaGains::typical(&data()) };
    let wanted = 2f64.sqrt() * MtpaLaw::<f64>::kwon_printed().at(60.0).0;
    let mut drive = drive(&gains);
    let mut given = 0.0;
    for k in 1..=2000 {
        let i = drive.direction * given;
        let before = drive.integral;
        let commanded = step(&mut drive, i, 60.0);
        assert!((drive.integral - before - C::new((wanted - given) * T / 0.01, 0.0)).norm() < 1e-9, "{k}");
        given = 0.9 * commanded.norm();
    }
    assert!((given - wanted).abs() < 1e-3 * wanted, "{given} {wanted}");
    for _ in 0..2000 {
        let i = drive.direction * C::new(0.0, 50.0);
        step(&mut drive, i, 60.0);
    }
    assert_eq!(drive.integral, C::new(12.0, -12.0));
}

/// On a machine that carries flux the current begins where it stands to the flux in the steady state: i/ψ_r ∝ 1 + jω_s T_r.
#[test]
fn it_begins_at_the_angle_that_the_slip_belongs_to() {
    let w = data().windings;
    for (connection, turned) in [(Connection::Star, 0.0), (Connection::Delta, -std::f64::consts::FRAC_PI_6)] {
        let gains = MtpaGains { connection, ..MtpaGains::typical(&data()) };
        let mut drive = drive(&gains);
        let caught =
            |flux| Caught { rotor_flux_vs: flux, i_s: C::new(0.0, 0.0), u_s: C::new(0.0, 0.0), omega_m: 40.0, sample_time_s: T };
        drive.begin_at(&caught(unit(1.1) * 0.3));
        let (_, slip) = MtpaLaw::<f64>::kwon_printed().at(60.0);
        let lead = (slip * w.rotor_inductance_h / w.rotor_resistance_ohm).atan();
        let angle = 1.1 + f64::from(data().pole_pairs) * 40.0 * T + lead;
        // The delta's windings carry a current turned by 30° to the line's.
        let i = step(&mut drive, C::new(0.0, 0.0), 60.0) - drive.integral * unit(angle - turned);
        assert!((i / i.norm() - unit(angle)).norm() < 1e-6, "{connection:?}: {i}");
        assert!((drive.direction.norm() - 1.0).abs() < 1e-12);
        // Once: from then on the frame goes its own way. Without flux there is no angle.
        assert!(drive.caught.is_none());
        drive.begin_at(&caught(C::new(0.0, 0.0)));
        assert!(drive.caught.is_none());
    }
}

/// Rounding neither lengthens nor shortens the frame: what is off is halved at least in a sample.
#[test]
fn a_frame_that_is_too_long_finds_its_length() {
    for length in [1.05, 0.95] {
        let mut drive = drive(&MtpaGains::typical(&data()));
        drive.direction *= length;
        for _ in 0..5 {
            step(&mut drive, C::new(0.0, 0.0), 60.0);
        }
        assert!((drive.direction.norm() - 1.0).abs() < 1e-9, "{}", drive.direction.norm());
    }
}
