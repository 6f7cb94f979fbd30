//! What is known of a run, and what does not fit together.

use super::*;

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
        ("nudged speed", Experiment { speed_nudge: Some((short(), 1.0)), ..e.clone() }),
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

/// α, β and speed as recorded, weighted by what is known of their noise; from rest, without load where none was recorded.
#[test]
fn an_experiment_from_a_recording_has_its_signals() {
    let r = recording(true);
    let e = Experiment::from_recording(&r, [0.05, 0.07], 0.1);
    let half_pi = core::f64::consts::FRAC_PI_2;
    let current = |direction_rad| ChannelKind::Current { direction_rad };
    assert_eq!(e.channels.iter().map(|c| c.kind).collect::<Vec<_>>(), [current(0.0), current(half_pi), ChannelKind::Speed]);
    assert_eq!(e.channels.iter().map(|c| c.sigma).collect::<Vec<_>>(), [0.05, 0.07, 0.1]);
    for (k, i) in r.i_s.iter().enumerate() {
        assert_eq!(e.channels.iter().map(|c| c.values[k]).collect::<Vec<_>>(), [i.re, i.im, r.omega_m[k]]);
    }
    assert!(e.u_s == r.u_s && Some(&e.tau_load) == r.tau_load.as_ref() && e.sample_time_s == r.sample_time_s);
    assert!(e.start == Start::Rest && !e.is_table() && e.imposed_speed.is_none() && e.speed_nudge.is_none());
    let unloaded = Experiment::from_recording(&Recording { tau_load: None, ..r }, [1.0; 2], 1.0);
    assert!(unloaded.validate().is_ok() && unloaded.tau_load.iter().all(|t| *t == 0.0));
    assert!(!e.is_empty() && Experiment { u_s: Vec::new(), ..e }.is_empty());
}

#[test]
fn a_start_is_the_state_that_it_names() {
    let x = State { omega_m: 3.0, psi_s: Complex::new(0.1, 0.2), ..State::default() };
    assert_eq!([Start::Rest, Start::State(x), Start::Estimated(x)].map(|s| s.state()), [State::default(), x, x]);
}
