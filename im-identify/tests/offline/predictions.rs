//! What an experiment is predicted to show, and how that changes with what is free.

use super::*;
use im_model::{EffectId, Effects};

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
    let nudged = Experiment { speed_nudge: Some((vec![40.0; e.len()], 50.0)), ..e.clone() };
    let imposed = Experiment { imposed_speed: Some((0..e.len()).map(|k| 30.0 + 0.1 * k as f64).collect()), ..e.clone() };
    let smooth = Experiment { is_smooth: true, ..e.clone() };
    for (name, e) in [("free", &e), ("nudged", &nudged), ("imposed", &imposed), ("smooth", &smooth)] {
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
                    let w = x.omega_m;
                    x.change_speed(|mass| *mass = w);
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
    let plant = im_model::Plant::new(&truth());
    let shown = &predict(&truth(), &imposed, &start)[2];
    assert!(shown.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-9));
    assert_eq!(imposed.input(7, &plant).imposed_speed, Some([wanted[7], wanted[8]]));
    assert_eq!(imposed.input(e.len() - 1, &plant).imposed_speed, Some([wanted[e.len() - 1]; 2]));
    // The nudge lags the ramp of 250 rad/s² by its inverse rate, 2.5 ms, and what torque there is moves it by τ/J over the rate.
    let nudged = Experiment { speed_nudge: Some((wanted.clone(), 400.0)), ..e };
    let shown = &predict(&truth(), &nudged, &start)[2];
    let free = &predict(&truth(), &Experiment { speed_nudge: None, ..nudged.clone() }, &start)[2];
    let off = |y: &[f64]| y[200..].iter().zip(&wanted[200..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off(shown) < 0.3 * off(free), "{} {}", off(shown), off(free));
    assert_eq!(nudged.input(7, &plant).speed_nudge, Some([wanted[7], 400.0]));
}

/// A delayed voltage before a recording that begins magnetized is the one it begins with, along either axis; before one from rest it is none.
#[test]
fn late_voltage_of_a_start_in_motion_has_a_past() {
    let delay = ParameterId::Effect(EffectId::VoltageDelay, 0);
    let late = truth().with(&[(delay, 5e-4)]).unwrap();
    let (mut e, _) = odd();
    for u in [Complex::new(20.0, 0.0), Complex::new(0.0, 20.0)] {
        e.u_s = vec![u; e.len()];
        e.tau_load = vec![0.0; e.len()];
        // Direct current: magnetized through the main inductance, i = u/R_s, for ever.
        let i = u / M.parameters().stator_resistance_ohm;
        let l_m = M.parameters().magnetizing_inductance_h;
        let x = State { psi_s: i * M.parameters().stator_inductance_h(), psi_r: i * l_m, ..State::default() };
        e.start = Start::State(x);
        let shown = predict(&late, &e, &x);
        assert!(
            shown[0].iter().all(|a| (a - i.re).abs() < 1e-9) && shown[2].iter().all(|w| w.abs() < 1e-9),
            "{:?}",
            &shown[0][..9]
        );
        // From rest nothing flows until the voltage arrives, 2.5 samples late.
        let rest = Experiment { start: Start::Rest, ..e.clone() };
        let size = |k: usize| {
            let y = predict(&late, &rest, &State::default());
            y[0][k].hypot(y[1][k])
        };
        assert!(size(2) == 0.0 && size(3) > 0.0, "{} {}", size(2), size(3));
    }
}

/// The start of one experiment is nothing to another; with nothing free there are residuals and no slopes.
#[test]
fn slopes_know_whose_start_is_free() {
    let (e, start) = odd();
    let free = start_parameters(&[e.clone(), e.clone()], &M.rating, false);
    assert_eq!(free.len(), 10);
    for index in [0, 1] {
        let l = linearize(&truth(), &e, &start, index, &free);
        for (k, s) in l.slopes.iter().enumerate() {
            let acts = s.iter().flatten().any(|s| *s != 0.0);
            assert_eq!(acts, k / 5 == index, "{} in experiment {}", free[k].name(), index + 1);
        }
    }
    let l = linearize(&truth(), &e, &start, 0, &[]);
    assert!(l.slopes.is_empty() && l.residuals == residuals(&truth(), &e, &start));
}

/// Nudging helps a machine with most of its inertia behind a stiff shaft as much as a rigid one.
#[test]
fn nudging_accelerates_the_whole_shaft() {
    let (e, start) = odd();
    let target: Vec<f64> = (0..e.len()).map(|k| 30.0 + 0.05 * k as f64).collect();
    let nudged = Experiment { speed_nudge: Some((target, 50.0)), ..e };
    let compliance = |k| ParameterId::Effect(EffectId::ShaftCompliance, k);
    let stiff = truth().with(&[(compliance(0), 0.9), (compliance(1), 2000.0), (compliance(2), 0.5)]).unwrap();
    let shown = |machine| predict(machine, &nudged, &start)[2].clone();
    let (rigid, stiff) = (shown(&truth()), shown(&stiff));
    let free = predict(&truth(), &Experiment { speed_nudge: None, ..nudged.clone() }, &start)[2].clone();
    let apart = |other: &[f64]| rigid.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart(&stiff) < 0.2 && apart(&free) > 2.0, "{} {}", apart(&stiff), apart(&free));
}

/// The mains run on between two rows: in rows of 0.5 ms a smooth voltage makes the currents that rows of 10 µs make, and a held one does not.
#[test]
fn a_smooth_voltage_runs_on_between_its_rows() {
    let omega = 314.159;
    let run = |machine: &Machine<f64>, t_s: f64, is_smooth: bool, imposed: bool| {
        let rows = (0.3 / t_s).round() as usize;
        let whole = |t: f64| Complex::from_polar(326.6 / omega, omega * t) * Complex::new(0.0, -1.0);
        let still = || vec![0.0; rows];
        let r = Recording {
            name: "start".into(),
            start_s: 0.0,
            sample_time_s: t_s,
            u_s: (0..rows).map(|k| (whole((k + 1) as f64 * t_s) - whole(k as f64 * t_s)) / t_s).collect(),
            i_s: vec![Complex::default(); rows],
            omega_m: still(),
            tau_load: Some(still()),
        };
        let imposed_speed = imposed.then(|| vec![150.0; rows]);
        let e = Experiment { is_smooth, imposed_speed, ..Experiment::from_recording(&r, [1.0; 2], 1.0) };
        predict(machine, &e, &State::default())
    };
    let mut effects = Effects::scaled(&M.rating, &M.parameters(), M.pole_pairs);
    effects.iron_loss.conductance_s = 1e-3;
    for machine in [truth(), truth().with_effects(effects).unwrap()] {
        for imposed in [false, true] {
            let fine = run(&machine, 1e-5, false, imposed);
            let off = |is_smooth: bool| -> f64 {
                let coarse = run(&machine, 5e-4, is_smooth, imposed);
                let squares = |c: usize| (100..600).map(|k| (coarse[c][k] - fine[c][50 * k]).powi(2)).sum::<f64>();
                ((squares(0) + squares(1)) / 500.0).sqrt()
            };
            let [held, smooth] = [false, true].map(off);
            assert!(held > 0.02 && smooth < 0.1 * held, "{imposed}: {held} {smooth}");
        }
    }
}
