//! Off-line fitting: what is known of a made-up run is found again, with deviations that are true; slopes are derivatives.

use im_identify::offline::*;
use im_model::machines::{MOTULATOR_2_2_KW, NamedMachine};
use im_model::simulation::{Load, Profile, Scenario, Sensors, Simulation, Source, VoltsPerHertz};
use im_model::{BaseParameter, Complex, EffectId, Effects, Held, Machine, ParameterId, Recording, State, steady_state};

const M: NamedMachine = MOTULATOR_2_2_KW;
const NOISE: [f64; 2] = [0.05, 0.1];

fn truth() -> Machine<f64> {
    Machine::base(M.parameters(), M.pole_pairs).unwrap()
}

/// Up to 40 Hz, loaded, reversed: 1.6 s at 200 µs, with noise of 50 mA and 0.1 rad/s.
fn scenario(noisy: bool) -> Scenario {
    let supply = VoltsPerHertz { voltage_peak_v: 326.6, frequency_hz: 50.0, boost_v: 20.0, ramp_hz_per_s: 200.0 };
    let noise = if noisy { NOISE } else { [0.0; 2] };
    Scenario {
        source: Source::VoltsPerHertz(supply, Profile::points([[0.0, 40.0], [1.0, 40.0], [1.0, -20.0]]).unwrap()),
        load: Load { torque_nm: Profile::points([[0.6, 0.0], [0.6, 8.0]]).unwrap(), ..Load::none() },
        sensors: Sensors { current_noise_a: noise[0], speed_noise_rad_s: noise[1], ..Sensors::default() },
        sample_time_s: 2e-4,
        ..Scenario::direct_on_line(0.0, 50.0, 1.6)
    }
}

fn recording(noisy: bool) -> Recording {
    Simulation::new(&truth(), &scenario(noisy)).run().unwrap().recording
}

fn experiment(r: &Recording) -> Experiment {
    Experiment::from_recording(r, [NOISE[0]; 2], NOISE[1])
}

/// 30 to 40 % off.
fn guess() -> Machine<f64> {
    let p = M.parameters();
    truth()
        .with_parameters(im_model::TParameters {
            stator_resistance_ohm: 0.7 * p.stator_resistance_ohm,
            rotor_resistance_ohm: 1.4 * p.rotor_resistance_ohm,
            stator_leakage_inductance_h: 0.6 * p.stator_leakage_inductance_h,
            rotor_leakage_inductance_h: 0.6 * p.rotor_leakage_inductance_h,
            magnetizing_inductance_h: 1.3 * p.magnetizing_inductance_h,
            inertia_kg_m2: 0.7 * p.inertia_kg_m2,
            ..p
        })
        .unwrap()
}

fn id(p: BaseParameter) -> ParameterId {
    ParameterId::Base(p)
}

/// White noise of known size: nothing but it is left, and every parameter lies within four of its standard deviations.
#[test]
fn parameters_are_found_again_within_their_standard_deviations() {
    let e = [experiment(&recording(true))];
    let free = base_parameters(&guess());
    let found = fit(&guess(), &e, &free, &FitOptions::default()).unwrap();
    // χ² of 24 000 residuals: 1 ± 0.009.
    assert!(found.converged && (found.chi2_per_sample() - 1.0).abs() < 0.04, "{}", found.chi2_per_sample());
    assert_eq!(found.count, 3 * e[0].len());
    for ((f, value), deviation) in free.iter().zip(found.values()).zip(found.standard_deviations()) {
        let true_value = truth().get(f.id().unwrap());
        assert!((value - true_value).abs() < 4.0 * deviation, "{}: {value} ± {deviation}, true {true_value}", f.name());
        // 8000 rows of a 1 % noise leave less than a percent; friction is small against its scale.
        assert!(deviation < 0.01 * true_value.max(0.1 * M.parameters().inertia_kg_m2), "{}: {value} ± {deviation}", f.name());
    }
    assert!(found.undetermined(0.1).is_empty());
    // The deviation of a parameter is that of a fit in which it costs one more unit of χ² to be elsewhere, the others refitted.
    let k = 1;
    let held = found.machine.with(&[(free[k].id().unwrap(), found.values()[k] + found.standard_deviations()[k])]).unwrap();
    let others: Vec<Free> = free.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, f)| f.clone()).collect();
    let refitted = fit(&held, &e, &others, &FitOptions::near()).unwrap();
    let more = refitted.cost - found.cost;
    assert!((more - 1.0).abs() < 0.2, "{more}");
    // So is the cost a sum of squares over what is left.
    let left: f64 = found.residuals.iter().flatten().flatten().map(|r| r * r).sum();
    assert!((left / found.cost - 1.0).abs() < 1e-9 && (cost(&found.machine, &e, &found.starts) / left - 1.0).abs() < 1e-9);
    let c = found.correlation(0, 2);
    assert!((c - found.correlation(2, 0)).abs() < 1e-9 && c.abs() < 1.0, "{c}");
    assert!((found.correlation(3, 3) - 1.0).abs() < 1e-9);
}

/// What the recording does not show has no small deviation: at rest on direct voltage neither inertia nor friction act.
#[test]
fn what_a_recording_does_not_show_is_undetermined() {
    let r = recording(false);
    let n = 1000;
    let mut e = experiment(&r);
    e.u_s = (0..n).map(|k| Complex::new(if k < 500 { 20.0 } else { 5.0 }, 0.0)).collect();
    e.tau_load = vec![0.0; n];
    for c in &mut e.channels {
        c.values.truncate(n);
    }
    let shown = predict(&truth(), &e, &State::default());
    for (c, y) in e.channels.iter_mut().zip(shown) {
        c.values = y;
    }
    let free = base_parameters(&truth());
    let found = fit(&truth(), &[e], &free, &FitOptions::near()).unwrap();
    let undetermined: Vec<String> = found.undetermined(0.1).into_iter().map(|k| free[k].name()).collect();
    assert!(
        undetermined.iter().any(|n| n.contains("inertia")) && undetermined.iter().any(|n| n.contains("friction")),
        "{undetermined:?}"
    );
    assert!(!undetermined.iter().any(|n| n.contains("stator_resistance")), "{undetermined:?}");
}

/// A limit that the data would have a parameter cross is where it stays; the others do what they can.
#[test]
fn a_parameter_stays_at_its_limit_and_the_others_make_the_best_of_it() {
    let e = [experiment(&recording(true))];
    let r_s = M.parameters().stator_resistance_ohm;
    let mut free = base_parameters(&truth());
    free[0].limits = (1.2 * r_s, 2.0 * r_s);
    let start = truth().with(&[(id(BaseParameter::StatorResistance), 1.5 * r_s)]).unwrap();
    let found = fit(&start, &e, &free, &FitOptions::near()).unwrap();
    assert!((found.values()[0] / (1.2 * r_s) - 1.0).abs() < 1e-9, "{}", found.values()[0]);
    let held = truth().with(&[(id(BaseParameter::StatorResistance), 1.2 * r_s)]).unwrap();
    let others = fit(&held, &e, &free[1..], &FitOptions::near()).unwrap();
    assert!((found.cost / others.cost - 1.0).abs() < 1e-4, "{} {}", found.cost, others.cost);
}

/// A channel of each kind of use: phase b in place of β, rows that do not count, a speed that draws or is imposed, motion at the start.
fn odd() -> (Experiment, State<f64>) {
    let r = recording(false);
    let mut e = experiment(&r);
    let n = 400;
    e.u_s.truncate(n);
    e.tau_load = (0..n).map(|k| 0.01 * k as f64).collect();
    for c in &mut e.channels {
        c.values.truncate(n);
    }
    e.channels[1].kind = ChannelKind::Current { direction_rad: 2.0 * core::f64::consts::FRAC_PI_3 };
    e.channels[0].valid = Some((0..n).map(|k| k % 7 != 3).collect());
    let start = State {
        psi_s: Complex::new(0.5, -0.2),
        psi_r: Complex::new(0.45, -0.25),
        omega_m: 30.0,
        omega_load: 30.0,
        ..State::default()
    };
    e.start = Start::Estimated(start);
    (e, start)
}

/// d(predicted/σ)/dv against central differences, for machine parameters, an effect and the start, however many are free at once.
#[test]
fn slopes_are_the_derivatives_of_the_predictions() {
    let (e, start) = odd();
    let mut effects = Effects::scaled(&M.rating, &M.parameters(), M.pole_pairs);
    effects.iron_loss.conductance_s = 1e-3;
    let machine = truth().with_effects(effects).unwrap();
    let all = [
        base_parameters(&machine),
        effect_parameters(im_model::EffectId::IronLoss, &machine, &M.rating),
        effect_parameters(im_model::EffectId::MainFluxSaturation, &machine, &M.rating),
        start_parameters(std::slice::from_ref(&e), &M.rating, false),
    ]
    .concat();
    assert!(all.len() > 12, "{}", all.len());
    let pulled = Experiment { speed_pull: Some((vec![40.0; e.len()], 50.0)), ..e.clone() };
    let imposed = Experiment { imposed_speed: Some((0..e.len()).map(|k| 30.0 + 0.1 * k as f64).collect()), ..e.clone() };
    for (name, e) in [("free", &e), ("pulled", &pulled), ("imposed", &imposed)] {
        let whole = linearize(&machine, e, &start, 0, &all);
        for (a, b) in whole.residuals.iter().flatten().zip(residuals(&machine, e, &start).iter().flatten()) {
            assert!((a - b).abs() <= 1e-9 * (1.0 + b.abs()), "{name}: {a} {b}");
        }
        for n in [1, 4, 5, 7, 9, 11] {
            let part = linearize(&machine, e, &start, 0, &all[..n]);
            assert_eq!(part.slopes.len(), n);
            for (a, b) in part.slopes.iter().flatten().flatten().zip(whole.slopes[..n].iter().flatten().flatten()) {
                assert!((a - b).abs() <= 1e-9 * (1.0 + b.abs()), "{name}, {n} at once: {a} {b}");
            }
        }
        for (f, slopes) in all.iter().zip(&whole.slopes) {
            let at = |v: f64| match &f.target {
                Target::Machine(ids) => {
                    let set: Vec<_> = ids.iter().map(|i| (*i, f.value(machine.get(*i), v))).collect();
                    residuals(&machine.with(&set).unwrap(), e, &start)
                }
                Target::Initial { component, .. } => {
                    let mut x = start;
                    let part = [&mut x.psi_s.re, &mut x.psi_s.im, &mut x.psi_r.re, &mut x.psi_r.im, &mut x.omega_m];
                    for (k, p) in part.into_iter().enumerate() {
                        if k == *component {
                            *p = f.value(*p, v);
                        }
                    }
                    x.omega_load = x.omega_m;
                    residuals(&machine, e, &x)
                }
            };
            // One-sided where the effect is off, and at zero: its strength is not negative.
            let zero = matches!(&f.target, Target::Machine(ids) if machine.get(ids[0]) == 0.0);
            let step = 1e-5;
            let (low, high) = (if zero { at(0.0) } else { at(-step) }, at(step));
            let width = if zero { step } else { 2.0 * step };
            let size = slopes.iter().flatten().fold(0.0f64, |m, s| m.max(s.abs()));
            for ((s, low), high) in slopes.iter().flatten().zip(low.iter().flatten()).zip(high.iter().flatten()) {
                assert!(
                    ((low - high) / width - s).abs() < 2e-3 * size + 1e-5,
                    "{name}, {}: {s} {}",
                    f.name(),
                    (low - high) / width
                );
            }
        }
    }
}

/// (measured − predicted)/σ where a row counts, zero where not; nothing is predicted from a row's own measurement.
#[test]
fn residuals_are_in_noise_deviations_and_zero_where_rows_do_not_count() {
    let (e, start) = odd();
    let y = predict(&truth(), &e, &start);
    let r = residuals(&truth(), &e, &start);
    for (c, channel) in e.channels.iter().enumerate() {
        for k in 0..e.len() {
            let expected = if channel.is_valid(k) { (channel.values[k] - y[c][k]) / channel.sigma } else { 0.0 };
            assert_eq!(r[c][k], expected);
        }
        let counted = (0..e.len()).filter(|k| channel.is_valid(*k)).count();
        assert_eq!(channel.count(), counted);
    }
    assert_eq!(e.count(), 3 * 400 - 57);
    // Phase b is −α/2 + √3/2 β.
    let mut axes = e.clone();
    axes.channels[1].kind = ChannelKind::Current { direction_rad: core::f64::consts::FRAC_PI_2 };
    let z = predict(&truth(), &axes, &start);
    assert_eq!(z[0], y[0]);
    for ((alpha, beta), b) in z[0].iter().zip(&z[1]).zip(&y[1]) {
        assert!((-0.5 * alpha + 0.75f64.sqrt() * beta - b).abs() < 1e-9);
    }
}

#[test]
fn an_imposed_speed_is_what_the_machine_turns_at_and_a_pulled_one_comes_near() {
    let (e, start) = odd();
    let wanted: Vec<f64> = (0..e.len()).map(|k| 30.0 + 0.05 * k as f64).collect();
    let imposed = Experiment { imposed_speed: Some(wanted.clone()), ..e.clone() };
    let shown = &predict(&truth(), &imposed, &start)[2];
    assert!(shown.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-9));
    assert_eq!(imposed.drive(7).imposed_speed, Some([wanted[7], wanted[8]]));
    assert_eq!(imposed.drive(e.len() - 1).imposed_speed, Some([wanted[e.len() - 1]; 2]));
    // The pull lags the ramp of 250 rad/s² by its inverse rate, 2.5 ms, and what torque there is moves it by τ/J over the rate.
    let pulled = Experiment { speed_pull: Some((wanted.clone(), 400.0)), ..e };
    let shown = &predict(&truth(), &pulled, &start)[2];
    let free = &predict(&truth(), &Experiment { speed_pull: None, ..pulled.clone() }, &start)[2];
    let off = |y: &[f64]| y[200..].iter().zip(&wanted[200..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off(shown) < 0.3 * off(free), "{} {}", off(shown), off(free));
    assert_eq!(pulled.drive(7).speed_pull, Some([wanted[7], 400.0]));
}

/// The least-squares vector of two or more directions; one direction, or two that count as one, say nothing of the other axis.
#[test]
fn the_current_vector_is_that_of_its_projections() {
    let (mut e, _) = odd();
    let i = Complex::new(3.0, -7.0);
    let along = |e: &Experiment, c: usize| match e.channels[c].kind {
        ChannelKind::Current { direction_rad } => i.re * direction_rad.cos() + i.im * direction_rad.sin(),
        _ => f64::NAN,
    };
    let got = e.current_vector(0, |c| along(&e, c)).unwrap();
    assert!((got - i).norm() < 1e-12, "{got}");
    assert_eq!(e.current_vector(3, |c| along(&e, c)), None, "α does not count in row 3");
    let third =
        Channel { kind: ChannelKind::Current { direction_rad: -2.0 * core::f64::consts::FRAC_PI_3 }, ..e.channels[1].clone() };
    e.channels.push(third);
    let e = e;
    for k in [0, 3] {
        assert!((e.current_vector(k, |c| along(&e, c)).unwrap() - i).norm() < 1e-12);
    }
    // Three phases with an error each: the common one drops out.
    let off = e.current_vector(0, |c| along(&e, c) + 0.5 * f64::from(u8::from(c != 2))).unwrap();
    let phases = Experiment {
        channels: e.channels[..1].iter().chain(&e.channels[1..2]).chain(&e.channels[3..]).cloned().collect(),
        ..e.clone()
    };
    let all = phases.current_vector(0, |c| along(&phases, c) + 0.5).unwrap();
    assert!((off - all).norm() < 1e-12 && (all - i).norm() < 1e-12, "{off} {all}");
}

#[test]
fn an_experiment_that_does_not_fit_together_is_named() {
    let (e, _) = odd();
    assert!(e.validate().is_ok());
    let n = e.len();
    let short = || vec![0.0; n - 1];
    let mut bad = vec![
        ("tau_load_Nm", Experiment { tau_load: short(), ..e.clone() }),
        ("imposed speed", Experiment { imposed_speed: Some(short()), ..e.clone() }),
        ("speed pull", Experiment { speed_pull: Some((short(), 1.0)), ..e.clone() }),
        ("no channel", Experiment { channels: Vec::new(), ..e.clone() }),
    ];
    for sigma in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let mut x = e.clone();
        x.channels[2].sigma = sigma;
        bad.push(("omega_m_rad_s", x));
    }
    for change in 0..2 {
        let mut x = e.clone();
        if change == 0 {
            x.channels[0].values.pop().map(|_| ())
        } else {
            x.channels[0].valid.as_mut().and_then(Vec::pop).map(|_| ())
        };
        bad.push(("i_alpha_A", x));
    }
    for (what, e) in bad {
        let text = e.validate().unwrap_err().to_string();
        assert!(text.contains(what), "{what}: {text}");
        assert!(fit(&truth(), &[e], &[], &FitOptions::near()).is_err());
    }
}

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
    assert!((first.omega_m - r.omega_m[from]).abs() < 1.0 && first.omega_load == first.omega_m);
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
    assert_eq!(free.iter().map(Free::name).collect::<Vec<_>>()[2..], ["initial theta_m_rad of run 2"]);
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
    assert!(matches!(guess_start(&turned), Start::Estimated(x) if x.omega_m == 20.0 && x.omega_load == 20.0));
}

/// No-load, load and locked-rotor rows: what they show follows from the circuit, and from them the circuit.
#[test]
fn a_table_of_steady_states_shows_the_circuit_and_gives_it_back() {
    let hz = 50.0;
    let rows = [(326.6, 0.0), (200.0, 0.0), (100.0, 0.0), (326.6, 8.0), (326.6, 14.0), (260.0, 10.0)];
    let table = |machine: &Machine<f64>, locked: bool| {
        let kinds = [
            ("i_rms_A", ChannelKind::RmsCurrent, 0.005),
            ("p_W", ChannelKind::ActivePower, 1.0),
            ("q_var", ChannelKind::ReactivePower, 1.0),
            ("omega_m_rad_s", ChannelKind::Speed, 0.01),
        ];
        let scale = if locked { 0.2 } else { 1.0 };
        let mut e = Experiment {
            name: "table".into(),
            sample_time_s: 1.0,
            supply_frequency_hz: Some(hz),
            u_s: rows.iter().map(|(u, _)| Complex::new(0.0, scale * u)).collect(),
            tau_load: rows.iter().map(|r| r.1).collect(),
            imposed_speed: locked.then(|| vec![0.0; rows.len()]),
            speed_pull: None,
            channels: kinds
                .map(|(name, kind, sigma)| Channel { name: name.into(), kind, values: vec![0.0; rows.len()], valid: None, sigma })
                .to_vec(),
            start: Start::Rest,
        };
        let shown = predict(machine, &e, &State::default());
        for (c, y) in e.channels.iter_mut().zip(shown) {
            c.values = y;
        }
        e
    };
    let (running, locked) = (table(&truth(), false), table(&truth(), true));
    assert!(running.is_table() && guess_start(&running) == Start::Rest);
    let p = M.parameters();
    let v = |e: &Experiment, c: usize, k: usize| e.channels[c].values[k];
    for e in [&running, &locked] {
        for (k, &(_, load)) in rows.iter().enumerate() {
            let (u, i, active, reactive) = (e.u_s[k].norm(), v(e, 0, k) * 2f64.sqrt(), v(e, 1, k), v(e, 2, k));
            assert!((active.hypot(reactive) - 1.5 * u * i).abs() < 1e-9 * u * i, "apparent power in row {k}");
            assert!(reactive > 0.0, "a machine takes lagging current");
            let held = if e.imposed_speed.is_some() { Held::Speed(0.0) } else { Held::Load(load) };
            let x = steady_state(&truth(), u, hz, held).unwrap();
            if e.imposed_speed.is_none() {
                // Air-gap power is torque times the speed of the field.
                let torque = load + p.viscous_friction_nm_s_per_rad * x.omega_m;
                let air_gap = torque * std::f64::consts::TAU * hz / f64::from(M.pole_pairs);
                let copper = 1.5 * p.stator_resistance_ohm * i * i;
                assert!((active - copper - air_gap).abs() < 1e-6 * active.abs().max(1.0), "row {k}: {active} {copper} {air_gap}");
                assert!((v(e, 3, k) - x.omega_m).abs() < 1e-9);
            } else {
                // Locked: an impedance that does not depend on the voltage.
                assert!((active / reactive - v(e, 1, 0) / v(e, 2, 0)).abs() < 1e-9 && v(e, 3, k) == 0.0);
            }
        }
    }
    let both = [running, locked];
    let free = base_parameters_in(&guess(), &both);
    assert!(free.iter().all(|f| f.id() != Some(id(BaseParameter::Inertia))), "nothing accelerates in a table");
    let found = fit(&guess(), &both, &free, &FitOptions::default()).unwrap();
    for (f, value) in free.iter().zip(found.values()) {
        let true_value = truth().get(f.id().unwrap());
        assert!((value - true_value).abs() < 1e-3 * true_value + 1e-6, "{}: {value} {true_value}", f.name());
    }
}

#[test]
fn search_variables_move_quantities_by_factors_or_amounts_and_stop_at_limits() {
    let log = Free { target: Target::Machine(vec![id(BaseParameter::Inertia)]), transform: Transform::Log, limits: (0.5, 4.0) };
    assert!((log.value(2.0, 0.1) - 2.0 * 0.1f64.exp()).abs() < 1e-15 && log.slope(2.0) == 2.0);
    assert_eq!((log.value(2.0, 5.0), log.value(2.0, -5.0)), (4.0, 0.5));
    let linear = Free { transform: Transform::Linear(0.25), ..log.clone() };
    assert_eq!((linear.value(2.0, 2.0), linear.value(2.0, -2.0), linear.slope(2.0)), (2.5, 1.5, 0.25));
    let names: Vec<String> = start_parameters(&[odd().0], &M.rating, false).iter().map(Free::name).collect();
    assert_eq!(names[0], "initial psi_s_alpha_Vs of run 1");
    assert_eq!(names[4], "initial omega_m_rad_s of run 1");
    // Effects: strengths by amounts from zero on, shapes that are positive by factors near what is usual.
    for effect in im_model::EffectId::ALL {
        for f in effect_parameters(*effect, &truth(), &M.rating) {
            let (low, high) = f.limits;
            assert!(low < high, "{}: {low} {high}", f.name());
            if f.transform == Transform::Log {
                assert!(low > 0.0 && high / low >= 16.0 - 1e-9, "{}: {low} {high}", f.name());
            }
        }
    }
}
