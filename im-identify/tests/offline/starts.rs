//! How recordings begin: at rest, in motion, with the shaft at an unknown angle.

use super::*;
use im_model::{EffectId, Held, steady_state};

/// A recording that begins in motion is seen as such, and its fluxes and speed are found from the first second.
#[test]
fn a_start_in_motion_is_noticed_and_found() {
    let r = recording(true);
    assert_eq!(guess_start(&experiment(&r)), Start::Rest);
    let from = 3000;
    let cut = |v: &[Complex<f64>]| v[from..].to_vec();
    let late = Recording {
        u_s: cut(&r.u_s),
        i_s: cut(&r.i_s),
        omega_m: r.omega_m[from..].to_vec(),
        tau_load: r.tau_load.as_ref().map(|t| t[from..].to_vec()),
        ..r.clone()
    };
    let mut e = experiment(&late);
    e.start = guess_start(&e);
    let Start::Estimated(first) = e.start else { panic!("{:?}", e.start) };
    assert!(
        (first.omega_m - r.omega_m[from]).abs() < 1.0
            && first == State { psi_s: first.psi_s, psi_r: first.psi_r, ..State::turning(first.omega_m) }
    );
    let found = start_on(&truth(), &e, &M.rating);
    let internals = Simulation::new(&truth(), &scenario(false)).with_internals().run().unwrap().internals.unwrap();
    let x = internals.states[from];
    assert!((found.psi_r - x.psi_r).norm() < 0.01 && (found.psi_s - x.psi_s).norm() < 0.01, "{found:?} {x:?}");
    assert!((found.omega_m - x.omega_m).abs() < 0.1, "{} {}", found.omega_m, x.omega_m);
    // Known starts are taken as they are; with the speed imposed only fluxes are unknown.
    assert_eq!(start_on(&truth(), &Experiment { start: Start::State(x), ..e.clone() }, &M.rating), x);
    assert_eq!(start_parameters(std::slice::from_ref(&e), &M.rating, false).len(), 5);
    let imposed = Experiment { imposed_speed: Some(late.omega_m.clone()), ..e };
    assert_eq!(start_parameters(&[experiment(&r), imposed], &M.rating, false).len(), 4);
}

/// Nobody measures the shaft's angle: a broken bar begins each recording elsewhere. The angles between recordings are found with its size.
#[test]
fn what_is_fixed_to_the_shaft_is_fitted_though_each_recording_begins_at_another_angle() {
    let [direct, quadrature] = [0, 1].map(|k| ParameterId::Effect(EffectId::RotorAsymmetry, k));
    let broken = truth().with(&[(direct, 0.08), (quadrature, 0.03)]).unwrap();
    let angles = [0.0, 2.0];
    let both = angles.map(|theta_m| {
        let mut e = experiment(&recording(true));
        let noise = residuals(&truth(), &e, &State::default());
        let clean = predict(&broken, &e, &State { theta_m, ..State::default() });
        for (c, (y, r)) in e.channels.iter_mut().zip(clean.iter().zip(noise)) {
            c.values = y.iter().zip(r).map(|(y, r)| y + c.sigma * r).collect();
        }
        e
    });
    let turned = |m: &Machine<f64>, e: &Experiment| State { theta_m: angle_on(m, e, &State::default()), ..State::default() };
    let from = truth().with(&[(direct, 0.05)]).unwrap();
    let starts = both.iter().map(|e| turned(&from, e)).collect();
    let mut free = effect_parameters(EffectId::RotorAsymmetry, &from, &M.rating);
    free.extend(start_parameters(&both, &M.rating, true));
    assert_eq!(
        free.iter().map(Free::name).collect::<Vec<_>>()[2..],
        ["rotor_asymmetry.leakage_share", "initial theta_m_rad of run 2"]
    );
    let found = fit_from(&from, starts, &both, &free, &FitOptions::near()).unwrap();
    // Its direction is counted from where the first recording begins; noise leaves 0.3 % of the unbalance.
    let size = found.machine.get(direct).hypot(found.machine.get(quadrature));
    assert!((size - 0.08f64.hypot(0.03)).abs() < 1e-3, "{size}");
    // The field of an unbalanced rotor looks the same after half a turn of the field.
    let period = std::f64::consts::PI / f64::from(M.pole_pairs);
    let between = (found.starts[1].theta_m - found.starts[0].theta_m - angles[1]).rem_euclid(period);
    assert!(between.min(period - between) < 0.01, "{between} of {period}");
    // A recording that no fit has seen: its angle is found on it.
    let alone = start_on(&broken, &both[1], &M.rating).theta_m - angles[1];
    assert!(alone.rem_euclid(period).min(period - alone.rem_euclid(period)) < 0.01, "{alone}");
}

/// Standing on a voltage without current, sensors show their offsets: that is rest. A current that the voltage drives is not.
#[test]
fn an_offset_is_no_motion_and_a_driven_current_is() {
    let (mut e, _) = odd();
    let n = e.len();
    for c in &mut e.channels {
        c.values = (0..n).map(|k| if k < n / 2 { 0.3 } else { 3.0 }).collect();
    }
    e.channels[2].values = vec![0.0; n];
    e.channels[2].sigma = 0.01;
    let volts = |first: f64| (0..n).map(|k| Complex::new(if k < n / 2 { first } else { 100.0 }, 0.0)).collect::<Vec<_>>();
    assert_eq!(guess_start(&Experiment { u_s: volts(0.0), ..e.clone() }), Start::Rest);
    assert!(matches!(guess_start(&Experiment { u_s: volts(10.0), ..e.clone() }), Start::Estimated(_)));
    let turned = Experiment { u_s: volts(0.0), imposed_speed: Some(vec![20.0; n]), ..e };
    assert!(matches!(guess_start(&turned), Start::Estimated(x) if x == State::turning(20.0)));
}

/// An experiment whose signals say nothing yet: `n` rows at rest.
fn silent(n: usize) -> Experiment {
    let r = Recording {
        name: "silent".into(),
        start_s: 0.0,
        sample_time_s: 2e-4,
        u_s: vec![Complex::new(0.0, 0.0); n],
        i_s: vec![Complex::new(0.0, 0.0); n],
        omega_m: vec![0.0; n],
        tau_load: None,
    };
    Experiment::from_recording(&r, [0.01; 2], 0.1)
}

/// A twentieth of the largest speed and 5σ of a mean over five rows; rows that do not count do not.
#[test]
fn a_speed_that_stands_out_of_noise_and_range_is_motion() {
    let n = 50;
    let with = |first: [f64; 5], largest: f64| {
        let mut e = silent(n);
        e.channels[2].values = [&first[..], &vec![largest; n - 5]].concat();
        e
    };
    let speed = |e: &Experiment| match guess_start(e) {
        Start::Estimated(x) => Some((x.omega_m, x.extra.of(EffectId::ShaftCompliance)[0])),
        _ => None,
    };
    assert_eq!(speed(&with([10.0, 11.0, 12.0, 13.0, 14.0], 100.0)), Some((12.0, 12.0)));
    assert_eq!(speed(&with([-7.0; 5], 100.0)), Some((-7.0, -7.0)));
    for (first, largest, moves) in [
        (4.5, 100.0, false),
        (5.5, 100.0, true),
        (4.5, -100.0, false),
        (5.5, -100.0, true),
        // 5σ/√5 = 0.224 rad/s.
        (0.2, 1.0, false),
        (0.25, 1.0, true),
    ] {
        assert_eq!(speed(&with([first; 5], largest)), moves.then_some((first, first)), "{first} of {largest}");
    }
    let mut e = with([70.0, 70.0, 0.0, 0.0, 0.0], 0.0);
    e.channels[2].valid = Some((0..n).map(|k| k > 1).collect());
    assert_eq!(speed(&e), None);
    e.channels[2].valid = Some((0..n).map(|k| k == 1).collect());
    assert_eq!(speed(&e), Some((70.0, 70.0)), "one row that counts is all there is");
    e.supply_frequency_hz = Some(50.0);
    assert_eq!(guess_start(&e), Start::Rest, "a table has no start");
}

/// A current needs a voltage, beyond a fiftieth of the largest, to be motion; the speed is then what is shown, imposed, or taken as none.
#[test]
fn a_current_under_voltage_is_motion_at_the_speed_that_is_known() {
    let n = 50;
    let with = |volts: f64, amperes: f64| {
        let mut e = silent(n);
        e.u_s = (0..n).map(|k| Complex::new(0.0, if k < 5 { volts } else { 100.0 })).collect();
        e.channels[1].values = vec![amperes; n];
        e
    };
    let speed = |e: &Experiment| match guess_start(e) {
        Start::Estimated(x) => Some(x.omega_m),
        _ => None,
    };
    for (volts, amperes, moves) in
        [(10.0, 3.0, true), (2.5, 3.0, true), (1.5, 3.0, false), (10.0, 0.02, false), (0.0, 0.0, false)]
    {
        assert_eq!(speed(&with(volts, amperes)), moves.then_some(0.0), "{volts} V, {amperes} A");
    }
    // A current that rises from none with the first row is no motion: it is what the voltage does to a machine at rest.
    let mut rising = with(10.0, 3.0);
    rising.channels[1].values = (0..n).map(|k| 0.3 * k.min(10) as f64).collect();
    assert_eq!(guess_start(&rising), Start::Rest);
    rising.channels[1].values.iter_mut().for_each(|i| *i += 0.5);
    assert_eq!(speed(&rising), Some(0.0));
    // A speed below what counts is none, not its noise.
    let mut e = with(10.0, 3.0);
    e.channels[2].values = vec![0.05; n];
    assert_eq!(speed(&e), Some(0.0));
    e.channels[2].values = vec![30.0; n];
    assert_eq!(speed(&e), Some(30.0));
    let imposed = |first: f64| Some((0..n).map(|k| first + k as f64).collect::<Vec<_>>());
    assert_eq!(speed(&Experiment { imposed_speed: imposed(20.0), ..e.clone() }), Some(20.0));
    e.channels.truncate(2);
    assert_eq!(speed(&e), Some(0.0), "no speed is shown");
    assert_eq!(speed(&Experiment { imposed_speed: imposed(20.0), ..e }), Some(20.0));
    let still = Experiment { imposed_speed: imposed(0.0), ..with(0.0, 0.0) };
    assert_eq!(guess_start(&still), Start::Rest, "what begins at standstill begins at rest");
}

/// Fluxes and, where nothing imposes it, the speed of what begins in motion; the angle from the second on. Units are errors to be expected.
#[test]
fn what_is_unknown_of_starts_is_free() {
    let motion = |imposed: bool| Experiment {
        start: Start::Estimated(State::default()),
        imposed_speed: imposed.then(|| vec![1.0; 9]),
        ..silent(9)
    };
    let known = Experiment { start: Start::State(State::default()), ..silent(9) };
    let table = Experiment { supply_frequency_hz: Some(50.0), ..silent(9) };
    let all = [motion(false), motion(true), silent(9), known, table];
    for (fixed_to_shaft, angles) in [(false, &[][..]), (true, &[1, 2, 3][..])] {
        let free = start_parameters(&all, &M.rating, fixed_to_shaft);
        let of = |wanted: usize| -> Vec<usize> {
            let components = free.iter().filter_map(|f| match f.target {
                Target::Initial { experiment, component } if experiment == wanted => Some(component),
                _ => None,
            });
            components.collect()
        };
        for (k, motion) in [5, 4, 0, 0, 0].into_iter().enumerate() {
            let wanted: Vec<usize> = (0..motion).chain(angles.contains(&k).then_some(5)).collect();
            assert_eq!(of(k), wanted, "experiment {k}, angles {fixed_to_shaft}");
        }
        let electrical = std::f64::consts::TAU * M.rating.electrical_frequency_hz;
        for f in &free {
            let (Target::Initial { component, .. }, Transform::Linear(unit)) = (&f.target, f.transform) else {
                panic!("{}", f.name())
            };
            let expected = match component {
                4 => 0.003 * electrical..0.03 * electrical,
                // An eighth of a turn of the field of eight poles is too far for a descent.
                5 => 0.02..std::f64::consts::TAU / 8.0 / 4.0,
                _ => 0.3 * M.rating.rotor_flux_vs..1.5 * M.rating.rotor_flux_vs,
            };
            assert!(expected.contains(&unit), "{}: {unit}", f.name());
            assert!(f.limits.0 < -1e6 && f.limits.1 > 1e6, "a start has no limits");
        }
    }
}

/// A loaded machine on the mains from its steady state, 0.4 ms a row, with noise; what comes after the first second is somebody else's.
#[test]
fn the_first_second_tells_how_a_recording_begins() {
    let n = 5000;
    let x = steady_state(&truth(), 326.6, 50.0, Held::Load(10.0)).unwrap();
    let mut e = silent(n);
    e.sample_time_s = 4e-4;
    e.tau_load = vec![10.0; n];
    e.u_s = (0..n).map(|k| Complex::from_polar(326.6, 314.159 * 4e-4 * (k as f64 + 0.5))).collect();
    let about = State::turning(0.97 * x.omega_m);
    let shown = predict(&truth(), &e, &x);
    for (c, (channel, y)) in e.channels.iter_mut().zip(shown).enumerate() {
        let noise = |k: usize| ((k * 7919 + c * 31) % 101) as f64 / 50.0 - 1.0;
        channel.values =
            y.iter().enumerate().map(|(k, y)| if k < 2500 { y + channel.sigma * noise(k) } else { -3.0 * y }).collect();
    }
    e.start = Start::Estimated(about);
    let found = start_on(&truth(), &e, &M.rating);
    assert!((found.psi_s - x.psi_s).norm() < 2e-3 && (found.psi_r - x.psi_r).norm() < 2e-3, "{found:?} {x:?}");
    assert!((found.omega_m - x.omega_m).abs() < 0.1 && found.extra == State::turning(found.omega_m).extra, "{found:?}");
    // A machine that cannot be simulated has no better start than the one given.
    e.u_s[100] = Complex::new(f64::NAN, 0.0);
    assert_eq!(start_on(&truth(), &e, &M.rating), about);
}

/// Wherever the shaft stands: the nearest of the angles tried, and the angle itself from there.
#[test]
fn the_angle_of_the_shaft_is_found_from_anywhere() {
    let direct = ParameterId::Effect(EffectId::RotorAsymmetry, 0);
    let broken = truth().with(&[(direct, 0.1)]).unwrap();
    let n = 1500;
    let settled = steady_state(&truth(), 326.6, 50.0, Held::Load(14.0)).unwrap();
    let mut e = silent(n);
    e.tau_load = vec![14.0; n];
    e.u_s = (0..n).map(|k| Complex::from_polar(326.6, 314.159 * 2e-4 * (k as f64 + 0.5))).collect();
    // Half a turn of the field is a turn of the unbalance.
    let period = std::f64::consts::PI / f64::from(M.pole_pairs);
    let apart = |a: f64, b: f64| (a - b).rem_euclid(period).min(period - (a - b).rem_euclid(period));
    for angle in [0.1, 0.55, 0.9, 1.4, 4.0] {
        let x = State { theta_m: angle, ..settled };
        for (c, y) in predict(&broken, &e, &x).into_iter().enumerate() {
            e.channels[c].values = y;
        }
        e.start = Start::State(State { theta_m: 0.0, ..x });
        let coarse = angle_on(&broken, &e, &e.start.state());
        assert!(apart(coarse, angle) <= std::f64::consts::TAU / 64.0 + 1e-9, "{angle}: {coarse}");
        let found = start_on(&broken, &e, &M.rating);
        assert!(apart(found.theta_m, angle) < 1e-3, "{angle}: {}", found.theta_m);
        assert_eq!(State { theta_m: 0.0, ..found }, State { theta_m: 0.0, ..settled }, "the rest is known");
        // Nothing is fixed to the shaft of a sound machine, and no angle to be found; nor on a table.
        assert_eq!(start_on(&truth(), &Experiment { start: Start::State(x), ..e.clone() }, &M.rating), x);
        let table = Experiment { supply_frequency_hz: Some(50.0), start: Start::State(x), ..e.clone() };
        assert_eq!(start_on(&broken, &table, &M.rating), x);
    }
    // Where no angle gives a number, the one that was given.
    e.u_s[3] = Complex::new(f64::NAN, 0.0);
    assert_eq!(angle_on(&broken, &e, &State { theta_m: 0.7, ..settled }), 0.7);
}
