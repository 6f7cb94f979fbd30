//! Tables of steady states.

use super::*;
use im_model::{Held, steady_state};

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
            is_smooth: false,
            voltage_noise: Default::default(),
            tau_load: rows.iter().map(|r| r.1).collect(),
            load: im_identify::offline::Load::Known,
            imposed_speed: locked.then(|| vec![0.0; rows.len()]),
            speed_nudge: None,
            warmth: Vec::new(),
            inert: None,
            nudge_part: 1.0,
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

/// A table of this machine: currents along directions, powers and speed, loaded or at a speed.
pub(crate) fn shown(machine: &Machine<f64>, loads: &[f64], speed: Option<f64>) -> Experiment {
    let kinds = [
        ChannelKind::RmsCurrent,
        ChannelKind::ActivePower,
        ChannelKind::ReactivePower,
        ChannelKind::Speed,
        ChannelKind::Current { direction_rad: 0.0 },
        ChannelKind::Current { direction_rad: core::f64::consts::FRAC_PI_2 },
        ChannelKind::Current { direction_rad: 2.0 },
    ];
    let n = loads.len();
    let channel = |kind| Channel { name: "shown".into(), kind, values: vec![1.0; n], valid: None, sigma: 0.5 };
    let mut e = Experiment {
        name: "table".into(),
        sample_time_s: 1.0,
        supply_frequency_hz: Some(50.0),
        u_s: vec![Complex::new(326.6, 0.0); n],
        is_smooth: false,
        voltage_noise: Default::default(),
        tau_load: loads.to_vec(),
        load: im_identify::offline::Load::Known,
        imposed_speed: speed.map(|w| vec![w; n]),
        speed_nudge: None,
        warmth: Vec::new(),
        inert: None,
        nudge_part: 1.0,
        channels: kinds.map(channel).to_vec(),
        start: Start::Rest,
    };
    let shown = predict(machine, &e, &State::default());
    for (c, y) in e.channels.iter_mut().zip(shown) {
        c.values = y;
    }
    e
}

/// Along the voltage flows what makes active power, across it what makes reactive power; a direction between sees its projection.
#[test]
fn currents_of_a_table_are_seen_from_the_voltage() {
    for e in [shown(&truth(), &[0.0, 10.0], None), shown(&truth(), &[0.0], Some(140.0))] {
        for k in 0..e.len() {
            let v = |c: usize| e.channels[c].values[k];
            let (along, across) = (v(1) / (1.5 * 326.6), -v(2) / (1.5 * 326.6));
            assert!((v(4) - along).abs() < 1e-9 && (v(5) - across).abs() < 1e-9);
            assert!((v(6) - (along * 2f64.cos() + across * 2f64.sin())).abs() < 1e-9);
            assert!((v(0) * 2f64.sqrt() - along.hypot(across)).abs() < 1e-9);
            assert!(e.imposed_speed.is_none() || v(3) == 140.0);
        }
    }
}

/// A load beyond the pull-out torque has no steady state: its row is not a number, the others are as they are, and a fit refuses it by name.
#[test]
fn a_row_without_a_steady_state_is_not_a_number() {
    let e = shown(&truth(), &[5.0, 500.0, 10.0], None);
    for c in &e.channels {
        assert_eq!(c.values.iter().map(|v| v.is_finite()).collect::<Vec<_>>(), [true, false, true]);
    }
    let mut asked = e;
    asked.channels.iter_mut().for_each(|c| c.values[1] = 1.0);
    let error = fit(&truth(), &[asked.clone()], &base_parameters_in(&truth(), &[asked]), &FitOptions::near()).unwrap_err();
    assert_eq!(error, FitError::Diverges { experiment: "table".into() });
}

/// Against differences of a tenth of the step; where a limit leaves one side only, that side; a row has no start to depend on.
#[test]
fn slopes_of_a_table_are_derivatives_up_to_a_limit() {
    let machine = truth();
    for e in [shown(&machine, &[0.0, 10.0], None), shown(&machine, &[0.0], Some(0.0))] {
        let mut free = base_parameters_in(&machine, std::slice::from_ref(&e));
        let at = machine.get(free[0].id().unwrap());
        let (mut up, mut down, mut none) = (free[0].clone(), free[0].clone(), free[0].clone());
        (up.limits, down.limits, none.limits) = ((at, 2.0 * at), (0.5 * at, at), (at, at));
        free.extend([up, down, none]);
        free.push(Free {
            target: Target::Initial { experiment: 0, component: 4 },
            transform: Transform::Linear(1.0),
            limits: (-1e9, 1e9),
            priors: Vec::new(),
        });
        let n = free.len();
        let slopes = linearize(&machine, &e, &State::default(), 0, &free).slopes;
        for (k, f) in free[..n - 2].iter().enumerate() {
            let Target::Machine(ids) = &f.target else { panic!() };
            let moved = |v: f64| {
                let set: Vec<_> =
                    ids.iter().map(|i| (*i, Free { limits: (-1e12, 1e12), ..f.clone() }.value(machine.get(*i), v))).collect();
                residuals(&machine.with(&set).unwrap(), &e, &State::default())
            };
            let h = 1e-5;
            let (low, high) = (moved(if machine.get(ids[0]) == 0.0 { 0.0 } else { -h }), moved(h));
            let width = if machine.get(ids[0]) == 0.0 { h } else { 2.0 * h };
            for c in 0..e.channels.len() {
                let size = slopes[k][c].iter().fold(0.0f64, |m, s| m.max(s.abs()));
                for row in 0..e.len() {
                    let difference = (low[c][row] - high[c][row]) / width;
                    // A one-sided step of 1e-4 sees a ten-thousandth of the curvature, which is up to tens of slopes.
                    assert!(
                        (slopes[k][c][row] - difference).abs() < 5e-3 * size + 1e-4,
                        "{k} {c} {row}: {} {difference}",
                        slopes[k][c][row]
                    );
                }
            }
        }
        assert!(slopes[n - 2..].iter().flatten().flatten().all(|s| *s == 0.0), "what cannot move has no slope");
        assert!(
            slopes[..n - 2].iter().all(|s| s.iter().flatten().any(|s| *s != 0.0)) || machine.get(free[4].id().unwrap()) == 0.0
        );
    }
}
