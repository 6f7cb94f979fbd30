//! Physics of whole runs.

use num_complex::Complex;

use super::*;
use crate::machines::{JADOT_TABLE_I, MODELICA_IMC_DOL, NamedMachine};
use crate::space_vector::{from_phases, to_phases, unit};
use crate::{Effects, Held, Machine, State, steady_state};

const RATED: VoltsPerHertz<f64> =
    VoltsPerHertz { voltage_peak_v: 320.0, frequency_hz: 50.0, boost_v: 15.0, ramp_hz_per_s: 100.0 };
const U_DC: f64 = 600.0;

fn machine(named: &NamedMachine, set: impl Fn(&mut Effects<f64>)) -> Machine<f64> {
    let mut e = Effects::scaled(&named.rating, &named.parameters(), named.pole_pairs);
    set(&mut e);
    Machine::try_new(named.parameters(), named.pole_pairs, e).unwrap()
}

fn jadot() -> Machine<f64> {
    machine(&JADOT_TABLE_I, |_| ())
}

fn drive(frequency_hz: impl Into<Profile>, duration_s: f64) -> Scenario {
    Scenario { source: Source::VoltsPerHertz(RATED, frequency_hz.into()), ..Scenario::direct_on_line(1.0, 50.0, duration_s) }
}

fn pwm(half_period_s: f64, bridge: Bridge<f64>) -> Inverter {
    Inverter::CarrierPwm(CarrierPwm { half_period_s }, bridge)
}

fn run(m: &Machine<f64>, s: &Scenario) -> Run {
    Simulation::new(m, s).with_internals().run().unwrap()
}

fn angle(k: usize, f: f64, t: f64) -> Complex<f64> {
    unit(2.0 * core::f64::consts::PI * f * t * k as f64)
}

#[test]
fn the_recording_run_again_gives_the_same_numbers() {
    let m = machine(&JADOT_TABLE_I, |e| {
        e.main_flux_saturation.excess = 0.5;
        e.voltage_delay.delay_s = 1.3e-4;
        e.speed_sensor_lag.time_constant_s = 2e-3;
        e.inverter_nonlinearity.voltage_v = 4.0;
    });
    let load = Load { torque_nm: Profile::points([[0.0, 0.0], [0.3, 5.0]]).unwrap(), quadratic_nm_s2: 2e-4 };
    let first = run(&m, &Scenario { load, ..drive(40.0, 0.4) }).recording;
    let again = Scenario { source: Source::Recording(first.clone()), ..drive(0.0, 1.0) };
    assert_eq!(run(&m, &again).recording, first);
}

#[test]
fn volts_per_hertz_reaches_the_speed_of_the_steady_state() {
    let m = jadot();
    let s = Scenario { load: Load { torque_nm: 10.0.into(), quadratic_nm_s2: 0.0 }, ..drive(40.0, 3.0) };
    let out = run(&m, &s);
    let expected = steady_state(&m, RATED.amplitude_v(40.0), 40.0, Held::Load(10.0)).unwrap();
    let found = out.state.omega_m;
    // Holding the voltage over 0.1 ms takes (ωT/2)²/6 = 3e-5 of it.
    assert!((found / expected.omega_m - 1.0).abs() < 1e-5, "{found} {}", expected.omega_m);
    assert!((out.state.psi_s.norm() / expected.psi_s.norm() - 1.0).abs() < 1e-4);
    let torque = *out.internals.unwrap().torque_nm.last().unwrap();
    assert!((torque - 10.0).abs() < 1e-3, "{torque}");
}

#[test]
fn direct_on_line_ends_at_the_modelica_library_s_speed() {
    let m = machine(&MODELICA_IMC_DOL, |_| ());
    let omega_n = 1440.45 / 60.0 * 2.0 * core::f64::consts::PI;
    let load = Load { torque_nm: 0.0.into(), quadratic_nm_s2: 161.4 / (omega_n * omega_n) };
    let mut s = Scenario { load, ..Scenario::direct_on_line(core::f64::consts::SQRT_2 * 100.0, 50.0, 1.5) };
    if let Source::Mains(mains) = &mut s.source {
        mains.closing_s = 0.1;
    }
    let out = run(&m, &s);
    assert!(out.recording.i_s[..1000].iter().all(|i| i.norm() == 0.0));
    assert!((out.state.omega_m / 150.8438 - 1.0).abs() < 1e-5, "{}", out.state.omega_m);
    // 100 A RMS in each winding.
    let i = out.recording.i_s.last().unwrap().norm() / core::f64::consts::SQRT_2;
    assert!((i / 100.0 - 1.0).abs() < 1e-3, "{i}");
}

#[test]
fn a_steady_start_stays_on_the_mains_and_on_volts_per_hertz() {
    let m = machine(&JADOT_TABLE_I, |e| e.iron_loss.conductance_s = 1e-3);
    let load = Load { torque_nm: 15.0.into(), quadratic_nm_s2: 0.0 };
    let start = Start::SteadyState(Held::Load(15.0));
    let mains = Mains { voltage_peak_v: 320.0, frequency_hz: 50.0, phase_rad: 0.7, closing_s: 0.0 };
    for (source, tolerance) in [(Source::Mains(mains), 1e-6), (Source::VoltsPerHertz(RATED, 45.0.into()), 1e-4)] {
        let s = Scenario { source, load: load.clone(), start: start.clone(), ..drive(0.0, 0.3) };
        let out = run(&m, &s);
        let r = &out.recording;
        let wander = |x: &dyn Fn(usize) -> f64| (0..r.len()).map(|k| (x(k) / x(0) - 1.0).abs()).fold(0.0, f64::max);
        assert!(wander(&|k| r.omega_m[k]) < tolerance, "{}", wander(&|k| r.omega_m[k]));
        // An error of the flux is L_s/L_σ = 20 times as large in the current.
        assert!(wander(&|k| r.i_s[k].norm()) < 20.0 * tolerance, "{}", wander(&|k| r.i_s[k].norm()));
    }
}

#[test]
fn carrier_modulation_does_what_the_averaged_inverter_does() {
    let m = jadot();
    let averaged = drive(Profile::points([[0.0, 0.0], [0.4, 40.0]]).unwrap(), 0.8);
    let a = run(&m, &averaged).recording;
    for half_period_s in [1e-4, 5e-5, 2.5e-5] {
        let switched = Scenario { inverter: pwm(half_period_s, Bridge::ideal(U_DC)), ..averaged.clone() };
        let b = run(&m, &switched).recording;
        // The command is recorded, not the pulses.
        assert_eq!(a.u_s, b.u_s);
        let n = a.len();
        let speed = (0..n).map(|k| (a.omega_m[k] - b.omega_m[k]).abs()).fold(0.0, f64::max);
        assert!(speed < 0.05, "{speed}");
        // At the samples the ripple of the current passes through zero.
        let current = ((n / 2..n).map(|k| (a.i_s[k] - b.i_s[k]).norm_sqr()).sum::<f64>() * 2.0 / n as f64).sqrt();
        assert!(current < 0.15, "{half_period_s}: {current}");
    }
}

/// A machine at standstill with direct voltage: i = (u − lost)/R_s shows the voltage that the dead time takes.
#[test]
fn the_dead_time_shows_in_the_direct_current() {
    let m = jadot();
    let r_s = m.parameters().stator_resistance_ohm;
    let (t_d, half) = (2e-6, 5e-5);
    let u = unit(0.2) * 40.0;
    let command = Recorded { u, n: 30_000 }.recording();
    let bridge = Bridge { dead_time_s: t_d, drop_v: 0.8, ..Bridge::ideal(U_DC) };
    let s = Scenario {
        source: Source::Recording(command),
        imposed_speed: Some(0.0.into()),
        inverter: pwm(half, bridge),
        ..drive(0.0, 3.0)
    };
    let r = run(&m, &s).recording;
    let tail = &r.i_s[29_000..];
    let i = tail.iter().sum::<Complex<f64>>() / tail.len() as f64;
    let lost = from_phases(to_phases(i).map(|i: f64| (U_DC * t_d / (2.0 * half) + 0.8) * i.signum()));
    assert!((i * r_s - (u - lost)).norm() < 0.02 * lost.norm(), "{} {}", i * r_s, u - lost);
}

/// The averaged effect is the same physics: U_dc·t_d/T_sw per phase.
#[test]
fn the_inverter_effect_stands_for_the_dead_time() {
    let (t_d, half) = (2e-6, 5e-5);
    let plain = jadot();
    let with_effect = machine(&JADOT_TABLE_I, |e| {
        e.inverter_nonlinearity.voltage_v = U_DC * t_d / (2.0 * half);
        e.inverter_nonlinearity.zero_crossing_current_a = 0.1;
    });
    let base = drive(Profile::points([[0.0, 0.0], [0.2, 5.0]]).unwrap(), 1.0);
    let bridge = Bridge { dead_time_s: t_d, ..Bridge::ideal(U_DC) };
    let switched = run(&plain, &Scenario { inverter: pwm(half, bridge), ..base.clone() }).recording;
    let averaged = run(&with_effect, &base).recording;
    let ideal = run(&plain, &base).recording;
    let rms = |a: &crate::Recording, b: &crate::Recording| {
        let n = a.len();
        ((n / 2..n).map(|k| (a.i_s[k] - b.i_s[k]).norm_sqr()).sum::<f64>() * 2.0 / n as f64).sqrt()
    };
    let (near, far) = (rms(&switched, &averaged), rms(&switched, &ideal));
    assert!(near < 0.2 * far, "{near} {far}");
}

#[test]
fn delta_modulation_makes_the_current() {
    let m = jadot();
    let bridge = Bridge { dead_time_s: 2e-6, ..Bridge::ideal(U_DC) };
    let s = Scenario {
        source: Source::RotatingCurrent { amplitude_a: 10.0.into(), frequency_hz: 10.0.into() },
        inverter: Inverter::DeltaModulation(DeltaModulator { period_s: 1e-4 }, bridge),
        imposed_speed: Some((9.0 * core::f64::consts::PI).into()),
        ..drive(0.0, 1.0)
    };
    let r = run(&m, &s).recording;
    let leakage = m.parameters().inverse_gamma().leakage_inductance_h;
    let ripple = 2.0 / 3.0 * U_DC * 1e-4 / leakage;
    let worst = (2000..r.len()).map(|k| (r.i_s[k] - angle(k, 10.0, 1e-4) * 10.0).norm()).fold(0.0, f64::max);
    assert!(worst < 2.0 * ripple, "{worst} {ripple}");
    // On average over whole turns the current is there.
    let mean = (2000..r.len()).map(|k| r.i_s[k] / angle(k, 10.0, 1e-4)).sum::<Complex<f64>>() / (r.len() - 2000) as f64;
    assert!((mean - 10.0).norm() < 0.1 * 10.0, "{mean}");
    // What is recorded as commanded is what the bridge was given: the stator equation closes but for dead time.
    assert!(r.u_s.iter().all(|u| u.norm() <= 2.0 / 3.0 * U_DC + 1e-9));
}

#[test]
fn a_thinned_recording_carries_mean_voltages() {
    let m = jadot();
    let full = run(&m, &drive(30.0, 0.1)).recording;
    let thin = run(&m, &Scenario { record_every: 4, ..drive(30.0, 0.1) }).recording;
    assert_eq!((thin.len(), thin.sample_time_s), (250, 4e-4));
    for k in 0..250 {
        assert_eq!(thin.i_s[k], full.i_s[4 * k]);
        let mean = full.u_s[4 * k..4 * k + 4].iter().sum::<Complex<f64>>() / 4.0;
        assert!((thin.u_s[k] - mean).norm() < 1e-12);
    }
}

#[test]
fn sensors_do_not_touch_the_machine() {
    let m = jadot();
    let sensors = Sensors { current_noise_a: 0.1, speed_step_rad_s: 0.5, torque_noise_nm: 0.2, ..Sensors::default() };
    let clean = run(&m, &drive(30.0, 0.1));
    let noisy = run(&m, &Scenario { sensors, ..drive(30.0, 0.1) });
    assert_eq!(clean.state, noisy.state);
    assert_ne!(clean.recording.i_s, noisy.recording.i_s);
    assert_eq!(clean.recording.u_s, noisy.recording.u_s);
}

#[test]
fn an_imposed_speed_is_kept_and_a_two_mass_load_is_braked_at_its_own_speed() {
    let m = machine(&JADOT_TABLE_I, |e| e.shaft_compliance.load_inertia_fraction = 0.5);
    let speed = Profile::points([[0.0, 0.0], [0.1, 50.0]]).unwrap();
    let r = run(&m, &Scenario { imposed_speed: Some(speed.clone()), ..drive(30.0, 0.1) }).recording;
    assert!(r.tau_load.is_none());
    for k in 0..r.len() {
        assert!((r.omega_m[k] - speed.at(r.time_s(k))).abs() < 1e-6);
    }
    let out = run(&m, &Scenario { load: Load { torque_nm: 0.0.into(), quadratic_nm_s2: 1e-3 }, ..drive(30.0, 0.3) });
    let (states, tau) = (out.internals.unwrap().states, out.recording.tau_load.unwrap());
    let load = |x: &crate::State<f64>| x.extra.of(crate::EffectId::ShaftCompliance)[0];
    for (x, tau) in states.iter().zip(tau) {
        assert!((tau - 1e-3 * load(x) * load(x).abs()).abs() < 1e-12);
    }
}

/// A proportional-integral current controller at standstill, as firmware would write it.
struct DirectCurrent {
    wanted: f32,
    integral: f32,
}
impl Controller<f32> for DirectCurrent {
    fn step(&mut self, m: &Measured<f32>, _: &Reference<f32>) -> Command<f32> {
        let e = self.wanted - m.i_s.re;
        self.integral += 1000.0 * e * m.sample_time_s;
        Command::Voltage(Complex::new(10.0 * e + self.integral, 0.0))
    }
}

#[test]
fn a_controller_in_single_precision_closes_the_loop() {
    let m = jadot();
    let references = References { speed_rad_s: 0.0.into(), rotor_flux_vs: 0.0.into(), torque_nm: 0.0.into() };
    let s = Scenario {
        source: Source::Controller { name: "direct current".into(), observer: None, references },
        inverter: pwm(5e-5, Bridge { dead_time_s: 2e-6, ..Bridge::ideal(U_DC) }),
        ..drive(0.0, 0.5)
    };
    assert!(matches!(Simulation::new(&m, &s).run(), Err(SimulationError::NoController(name)) if name == "direct current"));
    let mut controller = SinglePrecision(DirectCurrent { wanted: 5.0, integral: 0.0 });
    let mut reported = Vec::new();
    let mut report = |done, all| reported.push((done, all));
    let r = Simulation::new(&m, &s).controlled_by(&mut controller).with_progress(&mut report).run().unwrap().recording;
    let i = r.i_s.last().unwrap();
    assert!((i.re - 5.0).abs() < 0.1 && i.im.abs() < 0.1, "{i}");
    // In the steady state the integral holds R·i and what the dead time takes.
    let expected = 1.5 * 5.0 + U_DC * 2e-6 / 1e-4 * 4.0 / 3.0;
    assert!((controller.0.integral / expected as f32 - 1.0).abs() < 0.02, "{} {expected}", controller.0.integral);
    assert_eq!(reported, [(2048, 5000), (4096, 5000), (5000, 5000)]);
}

#[test]
fn what_does_not_fit_is_refused() {
    let m = jadot();
    let error = |s: Scenario| Simulation::new(&m, &s).run().unwrap_err().to_string();
    let odd = error(Scenario { inverter: pwm(3e-5, Bridge::ideal(U_DC)), ..drive(30.0, 0.1) });
    assert!(odd.contains("holds 3.33"), "{odd}");
    let delta = Inverter::DeltaModulation(DeltaModulator { period_s: 1e-4 }, Bridge::ideal(U_DC));
    assert!(error(Scenario { inverter: delta, ..drive(30.0, 0.1) }).contains("follows a current"));
    let current = Source::RotatingCurrent { amplitude_a: 1.0.into(), frequency_hz: 1.0.into() };
    assert!(error(Scenario { source: current, ..drive(30.0, 0.1) }).contains("needs delta modulation"));
    assert!(error(Scenario { duration_s: f64::NAN, ..drive(30.0, 0.1) }).starts_with("duration_s = NaN must be"));
    let start = Start::SteadyState(Held::Load(1e4));
    assert!(error(Scenario { start, ..drive(30.0, 0.1) }).contains("no steady state"));
    let mains = Scenario { inverter: delta, ..Scenario::direct_on_line(320.0, 50.0, 0.1) };
    assert!(error(mains).contains("no inverter to describe"));
    let nothing = Recorded { u: Complex::new(f64::NAN, 0.0), n: 10 }.recording();
    let bridge = pwm(5e-5, Bridge::ideal(U_DC));
    assert!(error(Scenario { source: Source::Recording(nothing), inverter: bridge, ..drive(0.0, 0.1) }).contains("finite range"));
    let gone = Start::State(State { omega_m: f64::NAN, ..State::default() });
    assert!(error(Scenario { start: gone, ..drive(30.0, 0.1) }).contains("finite range at t = 0 s"));
}

/// A constant voltage.
struct Recorded {
    u: Complex<f64>,
    n: usize,
}
impl Recorded {
    fn recording(&self) -> crate::Recording {
        crate::Recording {
            name: "constant".into(),
            start_s: 0.0,
            sample_time_s: 1e-4,
            u_s: vec![self.u; self.n],
            i_s: vec![Complex::default(); self.n],
            omega_m: vec![0.0; self.n],
            tau_load: None,
        }
    }
}
