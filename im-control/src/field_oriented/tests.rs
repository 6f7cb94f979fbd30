use super::*;
use crate::tests::scenario;
use im_model::machines::{self, NamedMachine};
use im_model::simulation::{Profile, Simulation, Source, Start};
use im_model::{Effects, Machine};

fn data(m: &NamedMachine, overload: f64) -> (Machine<f64>, MachineData<f64>) {
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let current = overload * m.rating.current_peak_a(&m.parameters(), m.pole_pairs);
    (machine, MachineData::of(&machine, current))
}

type C = Complex<f64>;
const M: NamedMachine = machines::JADOT_TABLE_I;

#[test]
fn speed_and_flux_are_followed_from_zero_flux_through_a_load_step() {
    for direct in [false, true] {
        let (machine, known) = data(&M, 1.5);
        let gains = FieldOrientedGains::typical(&known, 0.9, 1e-4);
        let gains = if direct { gains.direct() } else { gains };
        let mut drive = FieldOriented::try_new(&known, &gains).unwrap();
        let speed = Profile::points([[0.0, 0.0], [0.3, 0.0], [0.3, 120.0]]).unwrap();
        let load = Profile::points([[0.0, 0.0], [1.0, 0.0], [1.0, 20.0]]).unwrap();
        let s = scenario(speed, 0.9, load, 1.6, Some(560.0));
        let run = Simulation::new(&machine, &s).controlled_by(&mut drive).with_internals().run().unwrap();
        let w = &run.recording.omega_m;
        let psi: Vec<f64> = run.internals.unwrap().states.iter().map(|x| x.psi_r.norm()).collect();
        assert!(w[..2900].iter().all(|w| w.abs() < 0.01), "still while it is magnetized");
        assert!((w[9900] - 120.0).abs() < 0.05, "{}", w[9900]);
        let dip = w[10_000..].iter().fold(0.0f64, |d, w| d.max((w - 120.0).abs()));
        // T/(J a e) for a step T: 20/(0.045·40·e) = 4.1 rad/s.
        assert!((3.0..5.0).contains(&dip), "{dip}");
        assert!((w[15_900] - 120.0).abs() < 0.05, "{}", w[15_900]);
        assert!(psi[3000..].iter().all(|p| (p / 0.9 - 1.0).abs() < 0.02), "flux apart from torque");
        assert!(run.recording.i_s.iter().all(|i| i.norm() < 1.05 * known.current_max_a));
        assert!((drive.torque_nm() - 20.0).abs() < 0.3);
        assert_eq!(drive.status(), DriveStatus::OK);
        // The field turns ahead of the rotor by the slip of the load, ω_s = R_r τ/(1.5 n_p λ²).
        let slip = M.parameters().rotor_resistance_ohm * 20.0 / (1.5 * 2.0 * 0.9 * 0.9);
        assert!((drive.state.omega_s - 240.0 - slip).abs() < 0.05 * slip, "{} {slip}", drive.state.omega_s - 240.0);
        // With the right parameters the integral is aL_σ i alone, what active damping takes; a wrong R_σ would leave ΔR i there.
        let i = *run.recording.i_s.last().unwrap() * drive.state.direction.conj();
        let law = drive.state.circuit.current;
        let left = drive.state.current_integral - i * (law.bandwidth_rad_s * law.leakage_inductance_h);
        assert!(left.norm() < 0.02 * law.resistance_ohm * i.norm() + 0.5, "{left}");
    }
}

#[test]
fn the_flux_gives_way_above_rated_speed() {
    let (machine, known) = data(&M, 1.5);
    let mut drive = FieldOriented::try_new(&known, &FieldOrientedGains::typical(&known, 0.95, 1e-4)).unwrap();
    let speed = Profile::points([[0.0, 0.0], [0.4, 0.0], [0.4, 320.0]]).unwrap();
    let s = scenario(speed, 0.95, Profile::points([[0.5, 0.0], [0.5, 5.0]]).unwrap(), 3.0, Some(540.0));
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).with_internals().run().unwrap();
    assert!((run.state.omega_m - 320.0).abs() < 0.5, "{}", run.state.omega_m);
    let psi = run.state.psi_r.norm();
    // About u_max/ω_s = 0.92·540/√3/640.
    assert!((0.35..0.5).contains(&psi), "{psi}");
    assert!(drive.status().has(DriveStatus::FIELD_WEAKENING));
}

#[test]
fn a_turning_machine_is_caught_without_a_jolt() {
    let (machine, known) = data(&M, 1.5);
    let mut drive = FieldOriented::try_new(&known, &FieldOrientedGains::typical(&known, 0.9, 1e-4)).unwrap();
    let mut s = scenario(100.0.into(), 0.9, 0.0.into(), 1.0, Some(560.0));
    s.start = Start::State(im_model::State::turning(100.0));
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).run().unwrap();
    assert!(run.recording.omega_m.iter().all(|w| (w - 100.0).abs() < 0.5));
    assert!(run.recording.i_s.iter().all(|i| i.norm() < 1.05 * known.current_max_a));
}

#[test]
fn single_precision_gives_the_same_drive() {
    let (machine, known) = data(&M, 1.5);
    let gains = FieldOrientedGains::typical(&known, 0.9, 1e-4);
    let small = known.cast::<f32>();
    let mut wide = FieldOriented::try_new(&known, &gains).unwrap();
    let narrow = FieldOriented::try_new(&small, &FieldOrientedGains::typical(&small, 0.9, 1e-4)).unwrap();
    let mut narrow = im_model::simulation::SinglePrecision(narrow);
    let speed = Profile::points([[0.0, 0.0], [0.3, 0.0], [0.3, 120.0]]).unwrap();
    let s = scenario(speed, 0.9, Profile::points([[0.6, 0.0], [0.6, 10.0]]).unwrap(), 1.0, Some(560.0));
    let a = Simulation::new(&machine, &s).controlled_by(&mut wide).run().unwrap();
    let b = Simulation::new(&machine, &s).controlled_by(&mut narrow).run().unwrap();
    // Rounding of the flux model over ten thousand samples.
    let worst = a.recording.omega_m.iter().zip(&b.recording.omega_m).fold(0.0f64, |w, (a, b)| w.max((a - b).abs()));
    assert!(worst < 0.02, "{worst}");
}

#[test]
fn effects_unknown_to_the_controller_leave_the_speed_right() {
    let m = M;
    let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    e.main_flux_saturation.excess = 0.6;
    e.inverter_nonlinearity.voltage_v = 8.0;
    e.voltage_delay.delay_s = 1e-4;
    let machine = Machine::try_new(m.parameters(), m.pole_pairs, e).unwrap();
    let known = data(&m, 1.5).1.delayed(1e-4);
    let mut drive = FieldOriented::try_new(&known, &FieldOrientedGains::typical(&known, 0.9, 1e-4)).unwrap();
    let speed = Profile::points([[0.0, 0.0], [0.4, 0.0], [0.4, 120.0]]).unwrap();
    let s = scenario(speed, 0.9, Profile::points([[0.8, 0.0], [0.8, 15.0]]).unwrap(), 2.0, Some(560.0));
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).run().unwrap();
    assert!((run.state.omega_m - 120.0).abs() < 0.1, "{}", run.state.omega_m);
}

/// One sample at a speed and a current.
fn sample(omega_m: f64, i_s: C) -> Measured<f64> {
    Measured { i_s, omega_m, u_s: C::new(0.0, 0.0), dc_voltage_v: 560.0, sample_time_s: 1e-4 }
}

/// Where there is no flux the frame turns with the rotor, and keeps its length.
#[test]
fn without_flux_the_frame_turns_with_the_rotor() {
    let (_, known) = data(&M, 1.5);
    let mut drive = FieldOriented::try_new(&known, &FieldOrientedGains::typical(&known, 0.9, 1e-4)).unwrap();
    let none = Reference { omega_m: 0.0, rotor_flux_vs: 0.0, torque_nm: 0.0 };
    // What rounding would add is taken away again.
    drive.state.direction *= 1.05;
    for k in 1..=2000 {
        drive.step(&sample(100.0, C::new(0.0, 0.0)), &none);
        let expected = im_model::space_vector::unit(200.0 * 1e-4 * f64::from(k));
        assert!((drive.state.direction - expected).norm() < if k < 5 { 0.05 } else { 1e-6 }, "{k}: {}", drive.state.direction);
        assert!(drive.status() == DriveStatus::MAGNETIZING && drive.torque_nm() == 0.0);
    }
}

/// Torque begins with 0.8 of the flux wanted, and ends below a quarter of it.
#[test]
fn torque_once_there_stays_until_a_quarter_of_the_flux() {
    let (_, known) = data(&M, 1.5);
    let caught = |share: f64| Caught {
        rotor_flux_vs: C::new(0.9 * share, 0.0),
        i_s: C::new(0.9 * share / known.windings.mutual_inductance_h, 0.0),
        u_s: C::new(0.0, 0.0),
        omega_m: 0.0,
        sample_time_s: 1e-4,
    };
    let magnetizing = |before: f64, then: f64| {
        let mut drive = FieldOriented::try_new(&known, &FieldOrientedGains::typical(&known, 0.9, 1e-4)).unwrap();
        for share in [before, then] {
            drive.begin_at(&caught(share));
            // The voltage sets no limit yet.
            drive.state.flux_limit = 0.9 * drive.state.circuit.k_r;
            drive.step(&sample(0.0, caught(share).i_s), &Reference { omega_m: 0.0, rotor_flux_vs: 0.9, torque_nm: 0.0 });
        }
        drive.status().has(DriveStatus::MAGNETIZING)
    };
    let found = [[0.0, 0.75], [0.0, 0.85], [1.0, 0.75], [1.0, 0.27], [1.0, 0.22]].map(|[before, then]| magnetizing(before, then));
    assert_eq!(found, [true, false, false, false, true]);
}

/// An identifier may tell the rotor resistance; nonsense is not heard.
#[test]
fn a_rotor_resistance_is_taken_if_it_is_one() {
    let (_, known) = data(&M, 1.5);
    let mut drive = FieldOriented::try_new(&known, &FieldOrientedGains::typical(&known, 0.9, 1e-4)).unwrap();
    drive.set_rotor_resistance_ohm(2.5);
    for nonsense in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        drive.set_rotor_resistance_ohm(nonsense);
        assert_eq!(drive.law.rotor_resistance_ohm, 2.5);
    }
}

/// A drive that follows torque gives it, up to what the current allows beside the flux.
#[test]
fn a_torque_reference_is_followed_up_to_the_current() {
    let (machine, known) = data(&M, 1.5);
    let gains = FieldOrientedGains { follows_torque: true, ..FieldOrientedGains::typical(&known, 0.9, 1e-4) };
    for (asked, limited) in [(12.0, false), (-12.0, false), (200.0, true), (-200.0, true)] {
        let mut drive = FieldOriented::try_new(&known, &gains).unwrap();
        let mut s = scenario(0.0.into(), 0.9, 0.0.into(), 0.6, Some(560.0));
        s.imposed_speed = Some(30.0.into());
        let Source::Controller { references, .. } = &mut s.source else { unreachable!() };
        references.torque_nm = asked.into();
        let run = Simulation::new(&machine, &s).controlled_by(&mut drive).with_internals().run().unwrap();
        let torque = *run.internals.unwrap().torque_nm.last().unwrap();
        let (w, i_max) = (known.windings, known.current_max_a);
        let i_d = 0.9 / w.mutual_inductance_h;
        let most = 1.5 * 2.0 * w.mutual_inductance_h / w.rotor_inductance_h * 0.9 * (i_max * i_max - i_d * i_d).sqrt();
        let expected = if limited { most.copysign(asked) } else { asked };
        assert!((torque - expected).abs() < 0.02 * most, "{asked}: {torque} {expected}");
        assert_eq!(drive.status(), if limited { DriveStatus::CURRENT_LIMITED } else { DriveStatus::OK });
    }
}

/// Beyond i_q = ψ_s/L_σ more current means less torque: with current to spare, torque stops a tenth before the pull-out.
#[test]
fn torque_stops_before_the_pull_out() {
    let (machine, known) = data(&M, 1.5);
    let known = MachineData { current_max_a: 300.0, ..known };
    let gains = FieldOrientedGains { follows_torque: true, ..FieldOrientedGains::typical(&known, 0.9, 1e-4) };
    let mut drive = FieldOriented::try_new(&known, &gains).unwrap();
    let mut s = scenario(0.0.into(), 0.9, 0.0.into(), 0.8, Some(900.0));
    s.imposed_speed = Some(30.0.into());
    let Source::Controller { references, .. } = &mut s.source else { unreachable!() };
    references.torque_nm = 2000.0.into();
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).with_internals().run().unwrap();
    let w = known.windings;
    let (psi, l) = (0.9 * w.mutual_inductance_h / w.rotor_inductance_h, drive.state.circuit.current.leakage_inductance_h);
    let expected = 1.5 * 2.0 * psi * 0.9 * (psi / l + 0.9 / w.mutual_inductance_h);
    let torque = *run.internals.unwrap().torque_nm.last().unwrap();
    assert!((torque / expected - 1.0).abs() < 0.03, "{torque} {expected}");
}
