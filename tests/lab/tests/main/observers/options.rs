//! What practice adds, and the step limits: each holds on one side and fails on the other.

use im_lab::observation::{C, Truth, basis, held, machine, rms, volts_per_hertz};
use im_model::effects::InverterNonlinearity;
use im_model::machines::{JADOT_TABLE_I, MOTULATOR_2_2_KW};
use im_model::{Complex, Effects, Machine};
use im_observers::*;

const H: f64 = 1e-4;

/// 100 µs is too long for forward Euler with the gain of (3) in SI units and short enough for the rule here; the limit is where e⁺ = (1 + hM)e
/// turns from decay to growth.
#[test]
fn forward_euler_holds_up_to_its_limit_and_fails_beyond() {
    let m = JADOT_TABLE_I;
    let machine = machine(&m);
    let c = machine.parameters().windings().derived(2);
    let k = c.beta;
    let l1 = c.eta_l_m + k * c.eta;
    let o = [0.0; 2];
    let gains = KubotaGains {
        gain: [[l1, 0.0], [0.0, l1], o, o],
        gain_per_speed: [[0.0, -k * c.n_p], [k * c.n_p, 0.0], o, o],
        ..KubotaGains::without_feedback(0.01, 1.0)
    };
    let limit = gains.euler_step_limit_s(&machine, 157.0);
    assert!(limit > 0.0 && limit < H, "{limit}");
    let size_after = |h: f64| {
        // The worst speed is the highest; l₂ = 0.
        let a = C::new(-c.eta, c.n_p * 157.0);
        let l = C::new(l1, k * c.n_p * 157.0);
        let mut e = [C::new(1e-3, 0.0), C::new(0.0, 1e-3)];
        for _ in 0..400_000 {
            let d = [a * e[0] + (c.eta_l_m - l) * e[1], -a * c.beta * e[0] - e[1] * c.gamma];
            e = [e[0] + d[0] * h, e[1] + d[1] * h];
            if !e[1].norm().is_finite() {
                return f64::INFINITY;
            }
        }
        e[0].norm() + e[1].norm()
    };
    let (within, beyond) = (size_after(0.8 * limit), size_after(1.2 * limit));
    assert!(within < 5e-4 && beyond > 1e-2, "{within} {beyond} at {limit} s");
    let refused = Kubota::discretized(basis(&m, H), gains, Discretization::ForwardEuler).unwrap_err();
    assert!(refused.to_string().contains("may be at most"), "{refused}");
    let truth = Truth::of(&machine, &held(&m, 100.0, 4.0, 1.0));
    let e = truth.observe(&Kubota::try_new(basis(&m, H), gains).unwrap());
    assert!(e.iter().all(|e| e.rotor_flux_vs.norm() < 2.0), "the rule here is stable with the same gain and step");
}

#[test]
fn the_proportional_path_is_refused_where_it_would_oscillate() {
    let m = JADOT_TABLE_I;
    let machine = machine(&m);
    let truth = Truth::of(&machine, &held(&m, 100.0, 4.0, 0.6));
    let last = |bandwidth: f64| {
        let (p, _) = KubotaGains::speed_law(&machine, &m.rating, bandwidth);
        // Flux held to what it is: the limit is then that of rated flux.
        let limits = Limits { flux_max_vs: 1.02 * m.rating.rotor_flux_vs, ..Limits::of(&machine, &m.rating) };
        let observer = Kubota::try_new(basis(&m, H).with_limits(limits).unwrap(), KubotaGains::without_feedback(p, 1e-6));
        observer.map(|o| {
            let mut state = truth.state(&o, 0);
            let e: Vec<f64> = (1..truth.len()).map(|k| o.step(&mut state, &truth.input(k)).omega_m).collect();
            rms(e[5000..].iter().map(|w| w - 100.0))
        })
    };
    assert!(last(1.5 / H).unwrap() < 1.0);
    assert!(matches!(last(2.0 / H), Err(ObserverError::StepTooLong { .. })));
}

/// The torque loop of Thau's observer turns a current error into speed and back at √(μn_pβ)|λ|, a box gain at √(|L_ω|n_pβ|λ|): a sample must be
/// shorter than the inverse at the largest flux.
#[test]
fn thaus_torque_loop_bounds_the_sampling_time() {
    let m = JADOT_TABLE_I;
    let machine = machine(&m);
    let c = machine.parameters().windings().derived(2);
    let with_flux =
        |flux_max_vs: f64| basis(&m, H).with_limits(Limits { flux_max_vs, ..Limits::of(&machine, &m.rating) }).unwrap();
    let limit = |e: ObserverError| match e {
        ObserverError::StepTooLong { limit_s, .. } => limit_s,
        other => panic!("{other}"),
    };
    let most = 1.0 / (H * (c.mu * c.n_p * c.beta).sqrt());
    let thau = |flux: f64| Thau::try_new(with_flux(flux), ThauGains::published(), LoadTorqueModel::EqualToTorque);
    assert!(thau(0.999 * most).is_ok());
    assert!((limit(thau(1.25 * most).unwrap_err()) / (0.8 * H) - 1.0).abs() < 1e-9);
    // |L_ω| = 5 at 50 rad/s, 13 at 100: the larger end counts.
    let o = [0.0; 2];
    let gains = ThauBoxGains {
        frame_rad_s: [50.0, 100.0],
        gain: [[1.0, 4.0], o, o, o, o],
        gain_per_frame_speed: [[0.04, 0.08], o, o, o, o],
    };
    let scale = |k: f64| ThauBoxGains {
        gain: gains.gain.map(|r| r.map(|x| k * x)),
        gain_per_frame_speed: gains.gain_per_frame_speed.map(|r| r.map(|x| k * x)),
        ..gains
    };
    let boxed = |k: f64| Thau::in_box(with_flux(2.0), scale(k), LoadTorqueModel::EqualToTorque);
    let most = 1.0 / (H * H * 13.0 * c.n_p * c.beta * 2.0);
    assert!(boxed(0.999 * most).is_ok());
    assert!((limit(boxed(4.0 * most).unwrap_err()) / (0.5 * H) - 1.0).abs() < 1e-9);
}

#[test]
fn implicit_sliding_does_not_chatter_and_the_sign_does_within_its_band() {
    let m = MOTULATOR_2_2_KW;
    let machine = machine(&m);
    let beta = machine.parameters().windings().derived(2).beta;
    let truth = Truth::of(&machine, &held(&m, 100.0, 4.0, 0.5));
    let gains = DerdiyokGains::published(&machine, 1.1, 160.0);
    let residual = |o: Derdiyok<f64>| {
        let e = truth.observe_from(&o, 1, truth.state(&o, 0));
        rms(e[2000..].iter().map(|e| e.residual_a.norm()))
    };
    let band = 2.0 * H * beta * gains.nu0;
    let sign = residual(Derdiyok::discretized(basis(&m, H), gains, Discretization::ForwardEuler).unwrap());
    let implicit = residual(Derdiyok::try_new(basis(&m, H), gains).unwrap());
    assert!(sign > 0.05 * band && sign < 1.5 * band, "{sign} {band}");
    assert!(implicit < 1e-9, "{implicit}");
    let layer = |share: f64| DerdiyokGains { boundary_layer_a: share * H * beta * gains.nu0, ..gains };
    assert!(Derdiyok::discretized(basis(&m, H), layer(0.9), Discretization::ForwardEuler).is_err());
    let wide = residual(Derdiyok::discretized(basis(&m, H), layer(1.1), Discretization::ForwardEuler).unwrap());
    assert!(wide < band, "{wide} {band}");
}

/// Two ways through a sample, one observer: at 24 rad/s and 100 µs forward Euler is off by ωh/2 = 0.1 % in flux and γh/2 = 1 to 3 % in current.
#[test]
fn forward_euler_sees_the_same_machine_as_the_trapezoid() {
    let m = JADOT_TABLE_I;
    let machine = machine(&m);
    let c = machine.parameters().windings().derived(2);
    let truth = Truth::of(&machine, &held(&m, 10.0, 4.0, 0.6));
    let b = basis(&m, H);
    let (p, i) = KubotaGains::speed_law(&machine, &m.rating, 100.0);
    let o = [0.0; 2];
    let gains = KubotaGains { gain: [o, o, [30.0, -5.0], [5.0, 30.0]], ..KubotaGains::without_feedback(p, i) };
    let thau = ThauGains { gain: [o, o, o, [30.0, -5.0], [5.0, 30.0]] };
    let derdiyok = DerdiyokGains { anchor_per_s: 10.0, ..DerdiyokGains::published(&machine, 1.5, 60.0) };
    let derdiyok = DerdiyokGains { boundary_layer_a: 3.0 * H * c.beta * derdiyok.nu0, filter_rad_s: 100.0, ..derdiyok };
    let utkin = UtkinGains { omega0_rad_s: 60.0, boundary_layer_avs: 3.0, filter_rad_s: 100.0 };
    fn run<O: Observer<f64>>(truth: &Truth, o: &O) -> Vec<Estimate<f64>> {
        truth.observe_from(o, 1, truth.state(o, 0))
    }
    let runs = [Discretization::Implicit, Discretization::ForwardEuler].map(|d| {
        [
            run(&truth, &Kubota::discretized(b, gains, d).unwrap()),
            run(&truth, &Thau::discretized(b, thau, LoadTorqueModel::Balanced, d).unwrap()),
            run(&truth, &Derdiyok::discretized(b, derdiyok, d).unwrap()),
            run(&truth, &Utkin::discretized(b, utkin, d).unwrap()),
        ]
    });
    for (k, (a, b)) in runs[0].iter().zip(&runs[1]).enumerate() {
        let flux = rms(a.iter().zip(b).map(|(x, y)| (x.rotor_flux_vs - y.rotor_flux_vs).norm())) / m.rating.rotor_flux_vs;
        let speed = rms(a.iter().zip(b).map(|(x, y)| x.omega_m - y.omega_m));
        // Utkin's layer holds an error in proportion to ω̂ by Euler, and to its change by the other.
        let allowed = if k == 3 { 0.06 } else { 0.02 };
        assert!(flux < allowed && speed < 0.5, "{k}: {flux} {speed}");
    }
}

/// Inside the layer the switching is a line through zero: ν = −ν₀e/φ. In steady state ν is the equivalent control (η − jn_pω)λ, so that
/// the current error is φ/ν₀ of it, by both discretizations.
#[test]
fn in_the_boundary_layer_the_current_error_is_in_proportion_to_the_equivalent_control() {
    let m = MOTULATOR_2_2_KW;
    let machine = machine(&m);
    let c = machine.parameters().windings().derived(2);
    let truth = Truth::of(&machine, &held(&m, 100.0, 4.0, 0.5));
    let published = DerdiyokGains::published(&machine, 1.5 * m.rating.rotor_flux_vs, 160.0);
    let gains = DerdiyokGains { boundary_layer_a: 2.0 * H * c.beta * published.nu0, ..published };
    for discretization in [Discretization::Implicit, Discretization::ForwardEuler] {
        let o = Derdiyok::discretized(basis(&m, H), gains, discretization).unwrap();
        let e = truth.observe_from(&o, 1, truth.state(&o, 0));
        let wanted = C::new(c.eta, -200.0) * m.rating.rotor_flux_vs * (gains.boundary_layer_a / gains.nu0);
        let share = rms(e[2000..].iter().map(|e| e.residual_a.norm())) / wanted.norm();
        // A sample of 100 µs at 204 rad/s turns the control by 2 %; Euler sees the error one sample late, a layer of two samples wide.
        assert!((share - 1.0).abs() < 0.1, "{discretization:?}: {share}");
    }
}

#[test]
fn knowing_the_saturation_takes_the_flux_error_away() {
    let m = MOTULATOR_2_2_KW;
    let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    e.main_flux_saturation.excess = 0.5;
    let saturated = Machine::try_new(m.parameters(), m.pole_pairs, e).unwrap();
    let truth = Truth::of(&saturated, &volts_per_hertz(&m, 45.0, 6.0, 2.0));
    let gains = KubotaGains::for_machine(&saturated, &m.rating).unwrap();
    let plain = Basis::try_new(&saturated, &m.rating, H).unwrap();
    let error = |b: Basis<f64>| {
        let currents = truth.observe(&CurrentModel::new(b));
        let e = truth.observe(&Kubota::try_new(b, gains).unwrap());
        (truth.flux_rms(&currents, 1.5), truth.speed_rms(&e, 1.5))
    };
    let (without, aware) = (error(plain), error(plain.with_saturation(&saturated)));
    assert!(aware.0 < 0.1 * without.0, "flux of the current model: {without:?} {aware:?}");
    assert!(aware.1 < 0.1, "speed: {without:?} {aware:?}");
}

#[test]
fn dead_time_compensation_mends_low_speed() {
    let m = JADOT_TABLE_I;
    let inverter = InverterNonlinearity { voltage_v: 4.0, zero_crossing_current_a: 0.1, ..Default::default() };
    let mut effects = Effects::none();
    effects.inverter_nonlinearity = inverter;
    let machine = Machine::try_new(m.parameters(), m.pole_pairs, effects).unwrap();
    let scenario = held(&m, 8.0, 3.0, 2.5);
    let truth = Truth::of(&machine, &scenario);
    let gains = KubotaGains::for_machine(&machine, &m.rating).unwrap();
    let error = |b: Basis<f64>| {
        let o = Kubota::try_new(b, gains).unwrap();
        truth.speed_rms(&truth.observe_from(&o, 1, truth.state(&o, 0)), 1.5)
    };
    let (without, with) = (error(basis(&m, H)), error(basis(&m, H).with_inverter(inverter).unwrap()));
    assert!(with < 0.2 * without && without > 0.2, "{without} {with}");
}

/// Single precision follows double within what rounding leaves: 24 bits of a speed of 100 rad/s, seen through β ≈ 50 1/H.
#[test]
fn single_precision_agrees_with_double() {
    let m = JADOT_TABLE_I;
    let machine = machine(&m);
    let truth = Truth::of(&machine, &volts_per_hertz(&m, 40.0, 8.0, 2.0));
    let single = Basis::<f32>::try_new(&machine, &m.rating, H).unwrap();
    let gains = KubotaGains::for_machine(&machine, &m.rating).unwrap();
    fn run<T: im_model::Scalar, O: Observer<T>>(truth: &Truth, o: &O) -> Vec<f64> {
        let z = |z: C| Complex::new(T::from_f64(z.re), T::from_f64(z.im));
        let mut state = O::State::default();
        (0..truth.len())
            .map(|k| {
                let x = truth.input(k);
                let e = o.step(&mut state, &Input::new(z(x.u_s), z(x.i_s)).with_speed(T::from_f64(truth.omega[k])));
                e.omega_m.value()
            })
            .collect()
    }
    let pairs = [
        (run(&truth, &Kubota::try_new(single, gains).unwrap()), run(&truth, &Kubota::try_new(basis(&m, H), gains).unwrap())),
        (
            run(&truth, &Derdiyok::try_new(single, DerdiyokGains::for_machine(&machine, &m.rating)).unwrap()),
            run(&truth, &Derdiyok::try_new(basis(&m, H), DerdiyokGains::for_machine(&machine, &m.rating)).unwrap()),
        ),
        (
            run(&truth, &Utkin::try_new(single, UtkinGains::for_machine(&machine, &m.rating)).unwrap()),
            run(&truth, &Utkin::try_new(basis(&m, H), UtkinGains::for_machine(&machine, &m.rating)).unwrap()),
        ),
    ];
    for (k, (a, b)) in pairs.iter().enumerate() {
        // From the run-up on: what happens within the first magnetization is decided by rounding.
        let off = rms(a[12_000..].iter().zip(&b[12_000..]).map(|(x, y)| x - y));
        assert!(off < 0.05, "{k}: {off}");
    }
}

#[test]
fn gains_and_limits_out_of_range_are_named() {
    let m = JADOT_TABLE_I;
    let machine = machine(&m);
    let b = basis(&m, H);
    let says = |e: ObserverError, what: &str| assert!(e.to_string().contains(what), "{e}");
    let good = KubotaGains::for_machine(&machine, &m.rating).unwrap();
    says(Kubota::try_new(b, KubotaGains { integral: 0.0, ..good }).unwrap_err(), "integral = 0");
    says(Kubota::try_new(b, KubotaGains { proportional: f64::NAN, ..good }).unwrap_err(), "proportional = NaN");
    says(KubotaGains::stabilized(&machine, 0.0, 0.1, 1.0).unwrap_err(), "rho = 0");
    let mut skewed = good;
    skewed.gain[0][1] = 3.0;
    says(Kubota::try_new(b, skewed).unwrap_err(), "form [x, -y; y, x]");
    let mut infinite = ThauGains::published();
    infinite.gain[2][1] = f64::INFINITY;
    says(Thau::try_new(b, infinite, LoadTorqueModel::Balanced).unwrap_err(), "gain = inf");
    says(Basis::<f64>::try_new(&machine, &m.rating, 0.1).unwrap_err(), "sample_time_s = 0.1");
    let limits = Limits { flux_min_vs: 3.0, ..Limits::of(&machine, &m.rating) };
    says(b.with_limits(limits).unwrap_err(), "flux_min_vs");
    says(
        b.with_inverter(InverterNonlinearity { voltage_v: -1.0, zero_crossing_current_a: 0.1, ..Default::default() })
            .unwrap_err(),
        "voltage_v = -1",
    );
}
