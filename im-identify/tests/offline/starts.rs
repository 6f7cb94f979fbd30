//! How recordings begin: at rest, in motion, with the shaft at an unknown angle.

use super::*;
use im_model::EffectId;

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
