//! What one starts from follows from the rating, and an estimate's status from its own numbers.

use im_lab::observation::{C, Truth, basis, every_observer, held, machine, rms, volts_per_hertz};
use im_model::machines::{ALL, JADOT_TABLE_I, KWON_TABLE_IV, NamedMachine};
use im_model::space_vector::cross;
use im_observers::*;

const H: f64 = 1e-4;

/// Equal but for rounding.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * a.abs().max(b.abs())
}

/// Current of the locked rotor: the leakage alone takes the rated voltage.
fn locked_rotor_a(m: &NamedMachine) -> f64 {
    let leakage_h = machine(m).parameters().windings().derived(m.pole_pairs).sigma_l_s;
    m.rating.phase_voltage_peak_v / (std::f64::consts::TAU * m.rating.electrical_frequency_hz * leakage_h)
}

#[test]
fn limits_are_multiples_of_rated_values_and_of_the_locked_rotor_current() {
    for m in ALL {
        let l = Limits::of(&machine(&m), &m.rating);
        let synchronous = std::f64::consts::TAU * m.rating.electrical_frequency_hz / f64::from(m.pole_pairs);
        for (got, wanted) in [
            (l.voltage_max_v, 1.5 * m.rating.phase_voltage_peak_v),
            (l.current_max_a, 2.5 * locked_rotor_a(&m)),
            (l.residual_max_a, 0.1 * locked_rotor_a(&m)),
            (l.flux_max_vs, 2.0 * m.rating.rotor_flux_vs),
            (l.flux_min_vs, 0.1 * m.rating.rotor_flux_vs),
            (l.speed_max_rad_s, 2.0 * synchronous),
        ] {
            assert!(same(got, wanted), "{}: {got} {wanted}", m.name);
        }
    }
}

/// The speed error obeys s² + K_P l²s + K_I l² = 0 with the lever l = n_pβλ: both poles at half the bandwidth.
#[test]
fn kubotas_speed_law_has_a_double_pole_at_half_its_bandwidth() {
    for m in ALL {
        let c = machine(&m).parameters().windings().derived(m.pole_pairs);
        let (proportional, integral) = KubotaGains::speed_law(&machine(&m), &m.rating, 100.0);
        let lever2 = (c.n_p * c.beta * m.rating.rotor_flux_vs).powi(2);
        assert!(same(proportional * lever2, 100.0) && same(integral * lever2, 50.0 * 50.0), "{}", m.name);
        let start = KubotaGains::for_machine(&machine(&m), &m.rating).unwrap();
        assert!(same(start.fade_a, 0.1 * locked_rotor_a(&m)), "{}", m.name);
        assert_eq!((start.proportional, start.integral), KubotaGains::speed_law(&machine(&m), &m.rating, 400.0));
    }
}

/// Without feedback the observer has the machine's own poles, p² + (γ + η − jω_e)p + (η − jω_e)R_s/σL_s = 0; forward Euler is stable up to
/// the least −2Re(p)/|p|².
#[test]
fn without_feedback_forward_euler_is_limited_by_the_machines_own_poles() {
    for m in ALL {
        let (p, c) = (m.parameters(), machine(&m).parameters().windings().derived(m.pole_pairs));
        let gains = KubotaGains::without_feedback(1.0, 1.0);
        for most in [0.0, 60.0, 300.0] {
            let mut limit = f64::INFINITY;
            for k in -20..=20 {
                let turning = C::new(c.eta, -c.n_p * most * f64::from(k) / 20.0);
                let (sum, product) = (turning + c.gamma, turning * (p.stator_resistance_ohm / c.sigma_l_s));
                let root = (sum * sum - product * 4.0).sqrt();
                for pole in [(-sum + root) / 2.0, (-sum - root) / 2.0] {
                    limit = limit.min(-2.0 * pole.re / pole.norm_sqr());
                }
            }
            let got = gains.euler_step_limit_s(&machine(&m), most);
            assert!((got / limit - 1.0).abs() < 1e-9, "{} to {most} rad/s: {got} {limit}", m.name);
        }
    }
}

/// Started right on a machine that runs, the first estimates are right, either way round: the filters of the equivalent control begin at
/// (η − jn_pω)λ.
#[test]
fn an_observer_that_starts_right_is_right_at_once() {
    let m = JADOT_TABLE_I;
    for speed in [100.0, -60.0] {
        let truth = Truth::of(&machine(&m), &held(&m, speed, 3.0, 0.05));
        let b = basis(&m, H);
        let derdiyok = Derdiyok::try_new(b, DerdiyokGains::for_machine(&machine(&m), &m.rating)).unwrap();
        let estimates = truth.observe_from(&derdiyok, 1, truth.state(&derdiyok, 0));
        for (k, e) in estimates.iter().take(20).enumerate() {
            // The switching passes the filter by 2 % a sample.
            assert!((e.omega_m - speed).abs() < 0.1 * speed.abs(), "{k}: {} {speed}", e.omega_m);
        }
    }
}

/// ν₀ and ω₀ dominate what they must, at 1.2 times rated flux and twice rated speed, and not by more than was said.
#[test]
fn switching_gains_to_start_from_cover_twice_the_rated_speed() {
    for m in ALL {
        let c = machine(&m).parameters().windings().derived(m.pole_pairs);
        let synchronous = std::f64::consts::TAU * m.rating.electrical_frequency_hz / c.n_p;
        let derdiyok = DerdiyokGains::for_machine(&machine(&m), &m.rating);
        let need = 1.2 * m.rating.rotor_flux_vs * C::new(c.eta, c.n_p * 2.0 * synchronous).norm();
        assert!(same(derdiyok.nu0, 1.05 * need), "{}: {} {need}", m.name, derdiyok.nu0);
        assert_eq!((derdiyok.filter_rad_s, derdiyok.anchor_per_s, derdiyok.boundary_layer_a), (200.0, 10.0, 0.0));
        assert!(same(UtkinGains::for_machine(&machine(&m), &m.rating).omega0_rad_s, 2.0 * synchronous), "{}", m.name);
    }
}

/// Whatever an estimate shows, its status fits: low flux, a large residual, the limits; and its torque is that of its flux.
#[test]
fn the_status_says_what_the_numbers_say() {
    let m = JADOT_TABLE_I;
    let truth = Truth::of(&machine(&m), &volts_per_hertz(&m, 40.0, 8.0, 1.5));
    let c = machine(&m).parameters().windings().derived(m.pole_pairs);
    // Narrow ones, so that every bound is passed from both sides: rated flux is reached at the end only, residuals are a few mA.
    let limits = Limits { flux_min_vs: 0.5, residual_max_a: 0.02, settling_s: 0.0123, ..Limits::of(&machine(&m), &m.rating) };
    for mut o in every_observer(&machine(&m), &m.rating, basis(&m, H).with_limits(limits).unwrap()) {
        let (mut low, mut large, mut good) = (0, 0, 0u32);
        for k in 0..truth.len() {
            let input = truth.input(k);
            let e = o.step(&input);
            let is = |s: ObserverStatus| e.status.contains(s);
            assert_eq!(is(ObserverStatus::FLUX_LOW), e.rotor_flux_vs.norm() < limits.flux_min_vs, "{} at row {k}", o.name);
            assert_eq!(is(ObserverStatus::RESIDUAL), e.residual_a.norm() > limits.residual_max_a, "{} at row {k}", o.name);
            low += usize::from(is(ObserverStatus::FLUX_LOW));
            large += usize::from(is(ObserverStatus::RESIDUAL));
            // 123 samples after the last that a limit spoiled; a residual alone does not make it start anew.
            good = if is(ObserverStatus::FLUX_LOW) || is(ObserverStatus::LIMITED) { 0 } else { good + 1 };
            assert_eq!(is(ObserverStatus::SETTLING), good < 123, "{} at row {k}", o.name);
            // L_m/L_r = βσL_s.
            let torque = 1.5 * c.n_p * c.beta * c.sigma_l_s * cross(e.rotor_flux_vs, input.i_s);
            assert!((e.torque_nm - torque).abs() <= 1e-9, "{} at row {k}: {} {torque}", o.name, e.torque_nm);
        }
        assert!((100..truth.len() - 100).contains(&low), "{}: low flux in {low} rows", o.name);
        assert!(large < truth.len(), "{}: {large} rows", o.name);
    }
}

/// The residual of the current model is what the machine does otherwise than the model: next to nothing with the right parameters.
#[test]
fn the_residual_of_the_current_model_shows_a_wrong_machine() {
    let m = KWON_TABLE_IV;
    let truth = Truth::of(&machine(&m), &held(&m, 120.0, 3.0, 0.4));
    let residual = |machine: &im_model::Machine<f64>| {
        let o = CurrentModel::new(Basis::try_new(machine, &m.rating, H).unwrap());
        rms(truth.observe_from(&o, 1, truth.state(&o, 0)).iter().map(|e| e.residual_a.norm()))
    };
    let hot = im_model::Machine::base(
        im_model::TParameters { stator_resistance_ohm: 1.3 * m.parameters().stator_resistance_ohm, ..m.parameters() },
        m.pole_pairs,
    );
    let (right, wrong) = (residual(&machine(&m)), residual(&hot.unwrap()));
    assert!(right < 0.1 * wrong, "{right} {wrong}");
}

/// Without voltage and current nothing moves, not even by a sign that takes zero for something.
#[test]
fn nothing_in_nothing_out() {
    let m = JADOT_TABLE_I;
    let b = basis(&m, H);
    let derdiyok = DerdiyokGains { boundary_layer_a: 0.0, ..DerdiyokGains::for_machine(&machine(&m), &m.rating) };
    let utkin = UtkinGains { boundary_layer_avs: 0.0, ..UtkinGains::for_machine(&machine(&m), &m.rating) };
    let euler = Discretization::ForwardEuler;
    let mut all = every_observer(&machine(&m), &m.rating, b);
    all.push(im_lab::observation::Running::from_rest("Derdiyok, Euler", Derdiyok::discretized(b, derdiyok, euler).unwrap()));
    all.push(im_lab::observation::Running::from_rest("Utkin, Euler", Utkin::discretized(b, utkin, euler).unwrap()));
    let zero = C::new(0.0, 0.0);
    for mut o in all {
        for _ in 0..10 {
            let e = o.step(&Input::new(zero, zero).with_speed(0.0));
            assert_eq!((e.rotor_flux_vs, e.omega_m, e.torque_nm, e.residual_a), (zero, 0.0, 0.0, zero), "{}", o.name);
        }
    }
}
