use super::*;
use im_identify::online::{Fixed, SchemeSettings, TimeScale};
use im_model::{Machine, Plant, PlantInput, State as MachineState, machines};

const H: f64 = 1e-4;
const DC: f64 = 565.0;

fn paper() -> (Machine<f64>, MachineData<f64>, RegulationParameters<f64>) {
    let m = machines::JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let data = MachineData::of(&machine, 20.0);
    (machine, data, machine.parameters().inverse_gamma().into())
}

fn fixed() -> Jadot<f64, Fixed<f64>> {
    let (_, data, p) = paper();
    Jadot::try_new(&data, &JadotGains::of_the_paper(), Fixed::try_new(p).unwrap()).unwrap()
}

/// Runs a controller on the machine of Table I and returns its last state; `see` gets every sample and may spoil the measurement.
fn run<A: Adaptation<f64>>(
    c: &mut Jadot<f64, A>,
    seconds: f64,
    wanted: impl Fn(f64) -> [f64; 2],
    mut see: impl FnMut(f64, &mut Measured<f64>, &MachineState<f64>, &Jadot<f64, A>),
) -> MachineState<f64> {
    let plant = Plant::new(&paper().0);
    let mut x = MachineState::default();
    let mut u_s = Complex::new(0.0, 0.0);
    for k in 0..(seconds / H) as usize {
        let t = H * k as f64;
        let mut m = Measured { i_s: plant.currents(&x).i_s, omega_m: x.omega_m, u_s, dc_voltage_v: DC, sample_time_s: H };
        see(t, &mut m, &x, c);
        let [omega_m, load] = wanted(t);
        let Command::Voltage(u) = c.step(&m, &Reference { omega_m, rotor_flux_vs: 0.95, torque_nm: 0.0 }) else { panic!() };
        assert!(u.re.is_finite() && u.im.is_finite() && u.norm() <= DC * 2.0 / 3.0 + 1e-9, "{t}: {u}");
        u_s = u;
        x = plant.step(&x, &PlantInput::new(u, load), H);
    }
    x
}

#[test]
fn speed_flux_and_current_settle_on_their_references_with_known_parameters() {
    let mut c = fixed();
    let x = run(&mut c, 2.0, |t| [(300.0 * (t - 0.4)).clamp(0.0, 100.0), if t > 1.0 { 20.0 } else { 0.0 }], |_, _, _, _| ());
    assert!((x.omega_m - 100.0).abs() < 0.05, "{}", x.omega_m);
    assert!((x.psi_r.norm() - 0.95).abs() < 0.003, "{}", x.psi_r.norm());
    // (11): without friction the torque asked for in the steady state is the load's.
    assert!((c.load_torque_nm() - 20.0).abs() < 0.1, "{}", c.load_torque_nm());
    // What time in samples leaves of K_Pη, which is zero in continuous time.
    assert!(c.state.eta.norm() < 0.02, "{}", c.state.eta);
    assert!((c.references().0 - x.psi_r * c.k_r * c.direction().conj()).norm() < 0.003);
    assert_eq!(c.status(), DriveStatus::OK);
    // The flux lies along the first axis of the frame, not against it.
    assert!((c.references().0.re - 0.95 * c.k_r).abs() < 0.003, "{}", c.references().0);
}

#[test]
fn currents_and_voltages_keep_their_limits_and_nothing_winds_up() {
    let mut c = fixed();
    let (mut most, mut asked) = (0.0f64, 0.0f64);
    let mut limited = [false; 2];
    let mut overshoot = 0.0f64;
    // A speed step far beyond what the limits allow.
    run(
        &mut c,
        3.0,
        |t| [if t > 0.5 { 200.0 } else { 0.0 }, 2.0],
        |t, m, x, c| {
            most = most.max(m.i_s.norm());
            asked = asked.max(c.state.i_cons.norm());
            limited[0] |= c.status().has(DriveStatus::CURRENT_LIMITED);
            limited[1] |= c.status().has(DriveStatus::VOLTAGE_LIMITED);
            if t > 0.5 {
                overshoot = overshoot.max(x.omega_m - 200.0);
            }
        },
    );
    assert!(limited[0] && limited[1], "the study reaches both limits: {limited:?}");
    // The reference keeps the limit; the machine follows it with the current error of a limited voltage.
    assert!(most < 1.1 * 20.0, "{most} A");
    assert!((asked - 20.0).abs() < 1e-9, "all of the current is used, and no more: {asked} A");
    assert!(overshoot < 0.02 * 200.0, "{overshoot} rad/s");
    assert!(c.status().has(DriveStatus::FIELD_WEAKENING));
}

#[test]
fn the_reference_follows_a_limited_voltage_so_that_the_error_equations_hold() {
    let mut c = fixed();
    let (mut worst, mut binds) = (0.0f64, 0);
    run(
        &mut c,
        1.2,
        |t| [if t > 0.5 { 200.0 } else { 0.0 }, 2.0],
        |_, m, _, c| {
            if c.status().has(DriveStatus::VOLTAGE_LIMITED) {
                // The reference of this sample, after what was missing in the last one.
                worst = worst.max(m.i_s.norm() - c.i_ref_after(m).norm());
                binds += 1;
            }
        },
    );
    assert!(binds > 100, "{binds}");
    assert!(worst < 0.6, "A machine without its voltage stays by its reference: {worst} A");
}

#[test]
fn lost_samples_and_references_are_bridged_and_flagged() {
    let (_, data, p) = paper();
    let settings = SchemeSettings::full(p.scaled([1.2, 0.9, 1.1, 1.0]), H);
    let mut c = Jadot::try_new(&data, &JadotGains::of_the_paper(), TimeScale::try_new(&settings, 0.6).unwrap()).unwrap();
    let mut seen = DriveStatus::OK;
    let x = run(
        &mut c,
        2.0,
        |t| [if t < 1.5 { 60.0 } else { f64::NAN }, 5.0],
        |t, m, _, c| {
            seen = seen.and(c.status());
            if (t * 1e4).round() as usize % 97 == 3 {
                m.i_s = Complex::new(f64::NAN, 0.0);
            }
            if (t * 1e4).round() as usize % 89 == 5 {
                (m.omega_m, m.u_s) = (f64::INFINITY, Complex::new(0.0, f64::NAN));
            }
        },
    );
    assert!(seen.has(DriveStatus::CURRENT_LOST.and(DriveStatus::SPEED_LOST).and(DriveStatus::REFERENCE_LOST)), "{seen}");
    assert!(c.parameters().values().iter().all(|v| v.is_finite()));
    assert!(c.estimate().is_some_and(|e| e.values == c.parameters().values()), "what the adaptation says is what is used");
    // The last slip goes on when the reference is lost: the load is still carried, roughly.
    assert!(x.omega_m.is_finite() && x.psi_r.norm() > 0.8, "{x:?}");
}

#[test]
fn single_precision_does_the_same() {
    let (_, data, p) = paper();
    let p32 = RegulationParameters::from_values(p.values().map(|x| x as f32));
    let mut narrow = Jadot::try_new(&data.cast::<f32>(), &JadotGains::of_the_paper(), Fixed::try_new(p32).unwrap()).unwrap();
    let mut c = fixed();
    let mut worst = 0.0f64;
    run(
        &mut c,
        1.0,
        |t| [(300.0 * (t - 0.4)).clamp(0.0, 50.0), 10.0 * f64::from(t > 0.5)],
        |t, m, _, wide| {
            let single = |z: Complex<f64>| Complex::new(z.re as f32, z.im as f32);
            let m32 = Measured {
                i_s: single(m.i_s),
                omega_m: m.omega_m as f32,
                u_s: single(m.u_s),
                dc_voltage_v: DC as f32,
                sample_time_s: H as f32,
            };
            let omega_m = (300.0 * (t - 0.4)).clamp(0.0, 50.0) as f32;
            let Command::Voltage(u) = narrow.step(&m32, &Reference { omega_m, rotor_flux_vs: 0.95, torque_nm: 0.0 }) else {
                panic!()
            };
            let mut twin = *wide;
            let r = Reference { omega_m: f64::from(omega_m), rotor_flux_vs: 0.95, torque_nm: 0.0 };
            let Command::Voltage(w) = twin.step(m, &r) else { panic!() };
            worst = worst.max((w.re - f64::from(u.re)).hypot(w.im - f64::from(u.im)));
        },
    );
    // Two open integrators (frame angle, ξ) in 24 bits over 10,000 samples.
    assert!(worst < 1.0, "{worst} V");
}

#[test]
fn impossible_gains_are_named() {
    let (_, data, p) = paper();
    let fixed = Fixed::try_new(p).unwrap();
    let bad = JadotGains { current_proportional_ohm: -1.0, ..JadotGains::of_the_paper() };
    assert!(Jadot::try_new(&data, &bad, fixed).unwrap_err().to_string().starts_with("current_proportional_ohm"));
    assert!(Fixed::try_new(p.scaled([1.0, f64::NAN, 1.0, 1.0])).unwrap_err().to_string().starts_with("magnetizing_inductance_h"));
}

/// (25): η' = K_IΔi, and what is asked for falls by K_P(Δi + η).
#[test]
fn the_integral_gathers_the_current_error() {
    let mut c = fixed();
    let wanted = Reference { omega_m: 0.0, rotor_flux_vs: 0.95, torque_nm: 0.0 };
    let delta = Complex::new(0.3, -0.2);
    let gains = JadotGains::<f64>::of_the_paper();
    for k in 1..=20 {
        let u_s = c.state.asked.map_or(Complex::new(0.0, 0.0), |[_, u]| u);
        let m = Measured {
            i_s: (c.state.i_ref + delta) * c.state.direction,
            omega_m: 20.0,
            u_s,
            dc_voltage_v: 0.0,
            sample_time_s: H,
        };
        let mut twin = c;
        c.step(&m, &wanted);
        let expected = delta * (gains.current_integral_per_s * H * f64::from(k));
        assert!((c.state.eta - expected).norm() < 1e-9, "{k}: {} {expected}", c.state.eta);
        // The same sample without an error of its own asks for K_P(Δi + K_IΔi h) more.
        let straight = Measured { i_s: twin.state.i_ref * twin.state.direction, ..m };
        twin.step(&straight, &wanted);
        let [with, without] = [c, twin].map(|x| x.state.asked.unwrap()[0]);
        // The correction v_r of φ_ref enters at half a sample: R_req h |jω + 1/T_r| of it.
        let less = delta * (gains.current_proportional_ohm * (1.0 + gains.current_integral_per_s * H));
        assert!((with - without + less).norm() < 0.02 * less.norm(), "{k}: {} {less}", with - without);
    }
}

/// The frame lies on the flux at the next sample, when both have turned with the rotor; the references are what is there.
#[test]
fn it_begins_with_flux_and_current_of_a_machine_that_was_caught() {
    let mut c = fixed();
    let flux = im_model::space_vector::unit(0.7) * 0.6;
    let i_s = Complex::new(1.5, -0.4);
    c.begin_at(&Caught { rotor_flux_vs: flux, i_s, u_s: Complex::new(0.0, 0.0), omega_m: 120.0, sample_time_s: H });
    let (phi, i_ref) = c.references();
    assert!((c.direction() - im_model::space_vector::unit(0.7 + 240.0 * H)).norm() < 1e-6);
    assert!((phi - Complex::new(0.6 * c.k_r, 0.0)).norm() < 1e-12);
    assert!((i_ref - i_s * im_model::space_vector::unit(-0.7)).norm() < 1e-6, "{i_ref}");
    assert_eq!(c.frequencies(), (240.0, 0.0));
    // Without flux there is no direction to take.
    let mut c = fixed();
    c.begin_at(&Caught { rotor_flux_vs: flux * 0.0, i_s, u_s: i_s, omega_m: 120.0, sample_time_s: H });
    assert_eq!((c.direction(), c.references().0), (Complex::new(1.0, 0.0), Complex::new(0.0, 0.0)));
}

/// What is lost is said, and nothing else is.
#[test]
fn each_loss_has_its_own_word() {
    let (m, r) = (
        Measured { i_s: Complex::new(0.0, 0.0), omega_m: 0.0, u_s: Complex::new(0.0, 0.0), dc_voltage_v: DC, sample_time_s: H },
        Reference { omega_m: 0.0, rotor_flux_vs: 0.95, torque_nm: 0.0 },
    );
    let nan = f64::NAN;
    let status = |m: &Measured<f64>, r: &Reference<f64>| {
        let mut c = fixed();
        c.step(m, r);
        c.status().bits() & DriveStatus::CURRENT_LOST.and(DriveStatus::SPEED_LOST).and(DriveStatus::REFERENCE_LOST).bits()
    };
    for (m, r, word) in [
        (m, r, DriveStatus::OK),
        (Measured { i_s: Complex::new(0.0, nan), ..m }, r, DriveStatus::CURRENT_LOST),
        (Measured { omega_m: nan, ..m }, r, DriveStatus::SPEED_LOST),
        (m, Reference { omega_m: nan, ..r }, DriveStatus::REFERENCE_LOST),
        (m, Reference { rotor_flux_vs: nan, ..r }, DriveStatus::REFERENCE_LOST),
    ] {
        assert_eq!(status(&m, &r), word.bits(), "{m:?} {r:?}");
    }
}

/// (20), (17) and (19), sample by sample, with the machine on its reference: Δi = 0, so that v_s and v_r vanish.
#[test]
fn the_references_move_as_20_and_17_and_the_voltage_is_that_of_19() {
    let (_, _, p) = paper();
    let (r, l_f) = (p.rotor_resistance_ohm, p.leakage_inductance_h);
    let (total, a) = (p.stator_resistance_ohm + r, p.inverse_rotor_time_constant());
    let mut c = fixed();
    for k in 0..3000 {
        let before = c.state;
        let u_s = before.asked.map_or(Complex::new(0.0, 0.0), |[_, u]| u);
        let m = Measured { i_s: before.i_ref * before.direction, omega_m: 40.0, u_s, dc_voltage_v: 0.0, sample_time_s: H };
        c.step(&m, &Reference { omega_m: 45.0, rotor_flux_vs: 0.95, torque_nm: 0.0 });
        let x = c.state;
        let rate = (x.i_ref - before.i_ref) / H;
        assert!((rate * l_f - (x.i_cons - x.i_ref) * total).norm() < 1e-6, "(20), {k}");
        let (i, phi) = ((x.i_ref + before.i_ref) / 2.0, (x.phi_ref + before.phi_ref) / 2.0);
        let slope = i * r - Complex::new(a, x.omega_g) * x.phi_ref;
        assert!(((x.phi_ref - before.phi_ref) / H - slope).norm() < 1e-6, "(17), {k}");
        assert_eq!(x.omega_s, 80.0 + x.omega_g);
        let u = i * Complex::new(total, l_f * x.omega_s) - phi * Complex::new(a, -80.0) + rate * l_f;
        let [asked, at_stator] = x.asked.unwrap();
        assert!((asked - u).norm() < 1e-6, "(19), {k}: {asked} {u}");
        let ahead = before.direction * im_model::space_vector::unit(x.omega_s * H / 2.0);
        assert!((at_stator - u * ahead).norm() < 1e-6 * (1.0 + u.norm()), "{k}");
    }
}

/// (18): a voltage that was not given is missing in i_ref by (Δu/R)(1 − e^{−Rh/L_f}), in the frame of the middle of its sample.
#[test]
fn what_the_inverter_did_not_give_is_missing_in_the_reference() {
    let (_, _, p) = paper();
    let (r, l_f) = (p.stator_resistance_ohm + p.rotor_resistance_ohm, p.leakage_inductance_h);
    for delay_s in [0.0, 1e-4] {
        let mut c = fixed();
        c.voltage_delay_s = delay_s;
        let m = |u_s| Measured { i_s: Complex::new(0.0, 0.0), omega_m: 120.0, u_s, dc_voltage_v: 0.0, sample_time_s: H };
        c.step(&m(Complex::new(0.0, 0.0)), &Reference { omega_m: 120.0, rotor_flux_vs: 0.95, torque_nm: 0.0 });
        let [_, asked] = c.state.asked.unwrap();
        let missing = Complex::new(-60.0, 35.0);
        let middle = c.state.direction * im_model::space_vector::unit(c.state.omega_s * (delay_s - H / 2.0));
        let expected = missing * middle.conj() / r * (1.0 - (-r * H / l_f).exp());
        let got = c.i_ref_after(&m(asked + missing)) - c.state.i_ref;
        // The middle of an interval is its mean to (Rh/L)²/12.
        assert!((got - expected).norm() < 1e-3 * expected.norm(), "{got} {expected}");
        // Where what was given is not measured, it takes what it knows of the limit: all was given.
        assert_eq!(c.i_ref_after(&m(Complex::new(f64::NAN, 0.0))), c.state.i_ref);
    }
}

/// Rounding neither lengthens nor shortens the frame.
#[test]
fn a_frame_that_is_too_long_finds_its_length() {
    let mut c = fixed();
    c.state.direction *= 1.05;
    run(&mut c, 5.0 * H, |_| [0.0, 0.0], |_, _, _, _| ());
    assert!((c.direction().norm() - 1.0).abs() < 1e-9, "{}", c.direction().norm());
}
