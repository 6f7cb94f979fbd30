use super::*;
use crate::tests::scenario;
use im_model::machines;
use im_model::simulation::{Profile, Simulation, Source};
use im_model::{Effects, Machine};

#[test]
fn speed_and_flux_are_followed_from_zero_flux_through_a_load_step() {
    let m = machines::JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let known = MachineData::of(&machine, 1.5 * m.rating.current_peak_a(&m.parameters(), m.pole_pairs));
    let mut drive = Kenne::try_new(&known, &KenneGains::typical(&known, 0.9, 560.0, 1e-4)).unwrap();
    let speed = Profile::points([[0.0, 0.0], [0.3, 0.0], [0.3, 120.0]]).unwrap();
    let load = Profile::points([[0.0, 0.0], [1.0, 0.0], [1.0, 20.0]]).unwrap();
    let s = scenario(speed, 0.9, load, 1.6, Some(560.0));
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).with_internals().run().unwrap();
    let w = &run.recording.omega_m;
    let psi: Vec<f64> = run.internals.unwrap().states.iter().map(|x| x.psi_r.norm()).collect();
    let peak = run.recording.i_s.iter().fold(0.0f64, |p, i| p.max(i.norm()));
    assert!(w[..2900].iter().all(|w| w.abs() < 0.01), "still while it is magnetized");
    assert!((w[9900] - 120.0).abs() < 0.05, "{}", w[9900]);
    assert!((w[15_900] - 120.0).abs() < 0.1, "{}", w[15_900]);
    assert!(psi[4000..].iter().all(|p| (p / 0.9 - 1.0).abs() < 0.03), "flux apart from torque");
    assert!(peak < 1.1 * known.current_max_a);
    assert!((drive.load_torque_nm() - 20.0).abs() < 0.3);
    // The field turns ahead of the rotor by the slip of the load, ω_s = R_r τ/(1.5 n_p λ²).
    let slip = m.parameters().rotor_resistance_ohm * 20.0 / (1.5 * 2.0 * 0.9 * 0.9);
    assert_eq!(drive.status(), DriveStatus::OK);
    assert!((drive.state.omega_s - 240.0 - slip).abs() < 0.1 * slip, "{} {slip}", drive.state.omega_s - 240.0);
}

/// (25) and (26): a gain at the bound makes |s| fall at η whatever f and b are within their bounds.
#[test]
fn the_switching_gain_of_25_and_26_reaches_the_surface() {
    let (f_error, reach, b, v_hat) = (30.0, 5.0, [2.0, 3.5], 12.0);
    let k: f64 = switching_gain(f_error, reach, b, v_hat);
    for b_true in [2.0, 2.7, 3.5] {
        for b_law in [2.0, 2.9, 3.5] {
            for (df, v) in [(f_error, v_hat), (-f_error, v_hat), (f_error, -v_hat), (-f_error, -v_hat)] {
                // ṡ = f + b v, v = v̂ − k sign s, v̂ = −f̂/b̂.
                let s_rate = |sign: f64| -v * b_law + df + b_true * (v - k * sign);
                assert!(s_rate(1.0) <= -reach + 1e-9 && s_rate(-1.0) >= reach - 1e-9, "{b_true} {b_law} {df} {v}");
            }
        }
    }
}

#[test]
fn unknown_effects_and_noise_leave_the_speed_right() {
    let m = machines::JADOT_TABLE_I;
    let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    e.main_flux_saturation.excess = 0.5;
    e.inverter_nonlinearity.voltage_v = 5.0;
    e.voltage_delay.delay_s = 1e-4;
    let machine = Machine::try_new(m.parameters(), m.pole_pairs, e).unwrap();
    let known = MachineData::of(&machine, 1.5 * m.rating.current_peak_a(&m.parameters(), m.pole_pairs)).delayed(1e-4);
    let mut drive = Kenne::try_new(&known, &KenneGains::typical(&known, 0.9, 560.0, 1e-4)).unwrap();
    let speed = Profile::points([[0.0, 0.0], [0.4, 0.0], [0.4, 120.0]]).unwrap();
    let load = Profile::points([[0.0, 0.0], [1.0, 0.0], [1.0, 20.0]]).unwrap();
    let mut s = scenario(speed, 0.9, load, 2.0, Some(560.0));
    s.sensors.current_noise_a = 0.1;
    s.sensors.speed_noise_rad_s = 0.1;
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).run().unwrap();
    assert!((run.state.omega_m - 120.0).abs() < 0.5, "{}", run.state.omega_m);
}

fn known() -> MachineData<f64> {
    let m = machines::JADOT_TABLE_I;
    MachineData::of(&Machine::base(m.parameters(), m.pole_pairs).unwrap(), 20.0)
}

fn drive() -> Kenne<f64> {
    Kenne::try_new(&known(), &KenneGains::typical(&known(), 0.9, 560.0, 1e-4)).unwrap()
}

fn sample(omega_m: f64, i_s: Complex<f64>) -> Measured<f64> {
    Measured { i_s, omega_m, u_s: Complex::new(0.0, 0.0), dc_voltage_v: 560.0, sample_time_s: 1e-4 }
}

/// Where there is no flux the frame turns with the rotor, and keeps its length.
#[test]
fn without_flux_the_frame_turns_with_the_rotor() {
    let mut drive = drive();
    // What rounding would add is taken away again.
    drive.state.direction *= 1.05;
    for k in 1..=2000 {
        drive.step(&sample(100.0, Complex::new(0.0, 0.0)), &Reference { omega_m: 0.0, rotor_flux_vs: 0.0, torque_nm: 0.0 });
        let expected = im_model::space_vector::unit(200.0 * 1e-4 * f64::from(k));
        assert!((drive.state.direction - expected).norm() < if k < 5 { 0.05 } else { 1e-6 }, "{k}: {}", drive.state.direction);
        assert_eq!(drive.status(), DriveStatus::MAGNETIZING);
    }
}

/// The law begins with 0.6 of the flux wanted, and ends below a quarter of it.
#[test]
fn the_law_once_begun_stays_until_a_quarter_of_the_flux() {
    let caught = |share: f64| Caught {
        rotor_flux_vs: Complex::new(0.9 * share, 0.0),
        i_s: Complex::new(0.9 * share / known().windings.mutual_inductance_h, 0.0),
        u_s: Complex::new(0.0, 0.0),
        omega_m: 0.0,
        sample_time_s: 1e-4,
    };
    let magnetizing = |before: f64, then: f64| {
        let mut drive = drive();
        for share in [before, then] {
            drive.begin_at(&caught(share));
            // The voltage sets no limit yet.
            drive.state.flux_limit = 0.9;
            drive.step(&sample(0.0, caught(share).i_s), &Reference { omega_m: 0.0, rotor_flux_vs: 0.9, torque_nm: 0.0 });
        }
        drive.status().has(DriveStatus::MAGNETIZING)
    };
    let found = [[0.0, 0.55], [0.0, 0.65], [1.0, 0.55], [1.0, 0.27], [1.0, 0.22]].map(|[before, then]| magnetizing(before, then));
    assert_eq!(found, [true, false, false, false, true]);
}

/// A load torque is taken where it is given, and estimated otherwise; nonsense is not heard.
#[test]
fn what_is_given_is_taken_if_it_is_a_number() {
    let mut drive = drive();
    drive.set_load_torque(5.0, 1.0);
    drive.set_rotor_resistance_ohm(2.5);
    assert_eq!(drive.load_torque_nm(), 0.0);
    drive.gains.load_torque = LoadTorqueSource::Given;
    drive.set_load_torque(5.0, -3.0);
    for nonsense in [f64::NAN, f64::INFINITY] {
        drive.set_load_torque(nonsense, 0.0);
        drive.set_load_torque(0.0, nonsense);
        drive.set_rotor_resistance_ohm(nonsense);
    }
    for nonsense in [0.0, -1.0] {
        drive.set_rotor_resistance_ohm(nonsense);
    }
    assert_eq!((drive.load_torque_nm(), drive.state.load.rate_nm_per_s, drive.rotor_resistance_ohm()), (5.0, -3.0, 2.5));
    drive.step(&sample(0.0, Complex::new(0.0, 0.0)), &Reference { omega_m: 0.0, rotor_flux_vs: 0.9, torque_nm: 0.0 });
    assert_eq!(drive.load_torque_nm(), 5.0);
}

/// On a machine that turns the flux is built up by a current that knows the emf (jω_e − 1/T_r)ψ_R: the integral is aL_σ i, what active
/// damping takes, and no more.
#[test]
fn the_current_that_builds_up_the_flux_knows_the_emf() {
    let m = machines::JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let mut drive = drive();
    let mut s = scenario(0.0.into(), 0.9, 0.0.into(), 0.06, Some(560.0));
    s.imposed_speed = Some(80.0.into());
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).run().unwrap();
    let size = drive.rotor_flux_vs().norm();
    assert!(drive.status() == DriveStatus::MAGNETIZING && size > 0.25, "{} {size}", drive.status());
    let i = *run.recording.i_s.last().unwrap() * drive.state.direction.conj();
    let (a, l) = (drive.magnetizing.bandwidth_rad_s, drive.magnetizing.leakage_inductance_h);
    // Twice the current of the wanted flux, along the flux.
    assert!((i - 2.0 * 0.9 / known().windings.mutual_inductance_h).norm() < 0.03 * i.norm(), "{i}");
    let left = drive.state.current_integral - i * (a * l);
    // ψ_R/T_r alone is 2 V, ω_eψ_R 60 V.
    assert!(left.norm() < 0.7, "{left}");
}

/// Under twice what the current can do, it is at its limit with the flux where it should be: i_q² = i_max² − i_d².
#[test]
fn overload_is_carried_with_all_of_the_current() {
    let m = machines::JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let known = MachineData { current_max_a: 12.0, ..known() };
    let mut drive = Kenne::try_new(&known, &KenneGains::typical(&known, 0.9, 560.0, 1e-4)).unwrap();
    let load = Profile::points([[0.0, 0.0], [0.8, 0.0], [0.8, 60.0]]).unwrap();
    let speed = Profile::points([[0.0, 0.0], [0.3, 0.0], [0.3, 100.0]]).unwrap();
    let s = scenario(speed, 0.9, load, 0.9, Some(560.0));
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).with_internals().run().unwrap();
    assert!(drive.status().has(DriveStatus::CURRENT_LIMITED), "{}", drive.status());
    let (i, psi) = (run.recording.i_s.last().unwrap().norm(), run.state.psi_r.norm());
    assert!((i / 12.0 - 1.0).abs() < 0.03 && (psi / 0.9 - 1.0).abs() < 0.03, "{i} A {psi} Vs");
}

/// Remark 4: a flux reference that changes is followed without a lag; without Ḟ_ref in s_λ it would be Ḟ_ref/c_λ = 0.05 Vs² behind.
#[test]
fn a_flux_reference_that_changes_is_followed_without_a_lag() {
    let m = machines::JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let mut drive = drive();
    let mut s = scenario(30.0.into(), 0.9, 5.0.into(), 0.8, Some(560.0));
    let flux = Profile::points([[0.0, 0.9], [0.6, 0.9], [0.9, 0.6]]).unwrap();
    let Source::Controller { references, .. } = &mut s.source else { unreachable!() };
    references.rotor_flux_vs = flux;
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).with_internals().run().unwrap();
    let psi: Vec<f64> = run.internals.unwrap().states.iter().map(|x| x.psi_r.norm()).collect();
    for (k, psi) in psi.iter().enumerate().skip(6500).take(1400) {
        let wanted = 0.9 - (k as f64 * 1e-4 - 0.6);
        assert!((psi - wanted).abs() < 0.01, "{k}: {psi} {wanted}");
    }
}

/// What builds up the flux is nine tenths of the largest current at most.
#[test]
fn the_current_that_builds_up_the_flux_keeps_the_limit() {
    let m = machines::JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let known = MachineData { current_max_a: 8.0, ..known() };
    let mut drive = Kenne::try_new(&known, &KenneGains::typical(&known, 0.9, 560.0, 1e-4)).unwrap();
    let s = scenario(0.0.into(), 0.9, 0.0.into(), 0.05, Some(560.0));
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).run().unwrap();
    let i = run.recording.i_s.last().unwrap().norm();
    assert!((i / 7.2 - 1.0).abs() < 0.02, "{i}");
}
