//! Loads that no column holds: the measured speed drives the machine and the torque follows; or a law whose sizes are fitted.

use im_identify::offline::{Load, Size};
use im_model::{EffectId, Plant, Rating};

use super::*;

fn driven(r: &Recording) -> Experiment {
    experiment(&Recording { tau_load: None, ..r.clone() }).driven_by_speed()
}

#[test]
fn without_a_load_torque_the_electrical_parameters_are_found_and_the_load_with_them() {
    let r = recording(true);
    let e = driven(&r);
    assert!(e.speed_is_imposed() && e.channels.len() == 2 && e.validate().is_ok());
    let free = base_parameters_in(&guess(), std::slice::from_ref(&e));
    let mechanical = [id(BaseParameter::Inertia), id(BaseParameter::ViscousFriction)];
    assert!(free.len() == 4 && free.iter().all(|f| f.id().is_none_or(|x| !mechanical.contains(&x))));
    // J as it is: that of the guess is what nobody can see here.
    let given = guess().with(&[(mechanical[0], M.parameters().inertia_kg_m2)]).unwrap();
    let f = fit(&given, std::slice::from_ref(&e), &free, &FitOptions::default()).unwrap();
    assert!((0.9..1.15).contains(&f.chi2_per_sample()), "{}", f.chi2_per_sample());
    let (found, true_) = (f.machine.parameters().inverse_gamma(), M.parameters().inverse_gamma());
    for (a, b) in [
        (found.stator_resistance_ohm, true_.stator_resistance_ohm),
        (found.rotor_resistance_ohm, true_.rotor_resistance_ohm),
        (found.leakage_inductance_h, true_.leakage_inductance_h),
        (found.magnetizing_inductance_h, true_.magnetizing_inductance_h),
    ] {
        assert!((a / b - 1.0).abs() < 0.03, "{a} {b}");
    }
    let load = load_torque(&f.machine, &e, &f.starts[0]).unwrap();
    // 8 Nm from 0.6 s on, nothing before.
    let mean = |from: usize, to: usize| load.torque_nm[from..to].iter().sum::<f64>() / (to - from) as f64;
    assert!(mean(1000, 2800).abs() < 0.3 && (mean(3500, 4800) - 8.0).abs() < 0.3, "{} {}", mean(1000, 2800), mean(3500, 4800));
    let inside = (3500..4800).filter(|&k| (load.torque_nm[k] - 8.0).abs() < 3.0 * load.std_nm[k] + 0.1).count();
    assert!(inside > 1200, "{inside}");
    assert!(load_torque(&f.machine, &experiment(&r), &f.starts[0]).is_none());
}

#[test]
fn the_noise_of_the_speed_sensor_is_no_error_of_the_currents() {
    // A poor sensor of the speed.
    let sensors = Sensors { speed_noise_rad_s: 1.0, ..scenario(true).sensors };
    let r = Simulation::new(&truth(), &Scenario { sensors, ..scenario(true) }).run().unwrap().recording;
    let raw = driven(&r).smoothed_by_torque(&truth(), &State::default());
    let counted = raw.clone().with_speed_found_by(&truth(), &State::default());
    // Mean square of means over 50 rows, in their standard deviation: 1 where nothing lasts.
    let slow = |e: &Experiment| {
        let r = residuals(&truth(), e, &State::default());
        let means: Vec<f64> = r.iter().flat_map(|r| r.chunks_exact(50).map(|c| c.iter().sum::<f64>() / 50f64.sqrt())).collect();
        means.iter().map(|x| x * x).sum::<f64>() / means.len() as f64
    };
    let (before, after) = (slow(&raw), slow(&counted));
    assert!(before > 2.0 && (0.75..1.3).contains(&after), "{before} {after}");
    let left = residuals(&truth(), &counted, &State::default());
    let chi2 = left.iter().flatten().map(|r| r * r).sum::<f64>() / counted.count() as f64;
    assert!((0.93..1.07).contains(&chi2), "{chi2}");
}

#[test]
fn a_speed_as_its_sensor_shows_it_leads_back_to_the_speed_of_the_rotor() {
    let mut effects = *truth().effects();
    effects.speed_sensor_lag.time_constant_s = 0.01;
    effects.speed_sensor_scale.gain = 0.02;
    let machine = truth().with_effects(effects).unwrap();
    let sim = |m: &Machine<f64>| Simulation::new(m, &scenario(false)).run().unwrap().recording;
    let (shown, true_) = (sim(&machine), sim(&truth()));
    let e = driven(&shown);
    let Load::Unknown(speed) = &e.load else { panic!("no shown speed") };
    let plant = Plant::new(&machine);
    let rms = |of: &dyn Fn(usize) -> f64| {
        ((200..e.len() - 200).map(|k| (of(k) - true_.omega_m[k]).powi(2)).sum::<f64>() / (e.len() - 400) as f64).sqrt()
    };
    let (raw, back) = (rms(&|k| shown.omega_m[k]), rms(&|k| plant.speed_behind(speed.smooth[k])));
    assert!(raw > 1.5 && back < 0.1 * raw, "{raw} {back}");
    // And the currents that follow are the machine's.
    let y = predict(&machine, &e, &State::default());
    let off = y[0].iter().zip(&true_.i_s).map(|(a, b)| (a - b.re).powi(2)).sum::<f64>() / e.len() as f64;
    assert!(off.sqrt() < 0.1, "{}", off.sqrt());
}

#[test]
fn the_sizes_of_a_constant_and_a_fans_load_are_fitted() {
    let law = |w: f64| 3.0 + 2e-4 * w * w.abs();
    // The load acts in the model as it does in its law: no column holds it.
    let given = Load::Law { constant: Size::Given(3.0), fan: Size::Given(2e-4) };
    let quiet = Recording { tau_load: None, ..recording(false) };
    let mut e = Experiment { load: given, ..experiment(&quiet) };
    let start = e.start_state();
    let y = predict(&truth(), &e, &start);
    for (c, y) in e.channels.iter_mut().zip(y) {
        c.values = y;
    }
    let w = &e.channels[2].values;
    assert!(w.iter().any(|w| law(*w) > 5.0));
    let open = Experiment { load: Load::Law { constant: Size::Fitted, fan: Size::Fitted }, ..e };
    let rating = M.rating;
    let mut free = base_parameters_in(&truth(), std::slice::from_ref(&open));
    free.extend(start_parameters(std::slice::from_ref(&open), &rating, false));
    // D and the law are near each other: D is held.
    free.retain(|f| f.id() != Some(id(BaseParameter::ViscousFriction)));
    let f = fit(&truth(), std::slice::from_ref(&open), &free, &FitOptions::default()).unwrap();
    let load = f.starts[0].load;
    assert!((load.constant_nm - 3.0).abs() < 0.02 && (load.fan_nm_s2 / 2e-4 - 1.0).abs() < 0.05, "{load:?}");
    // For a recording that no fit has seen they are found anew.
    let again = start_on(&truth(), &open, &rating).load;
    assert!((again.constant_nm - 3.0).abs() < 0.05, "{again:?}");
}

#[test]
fn effects_on_the_shaft_are_not_fitted_where_no_torque_is_balanced() {
    let r = recording(false);
    let (known, unknown) = (experiment(&r), driven(&r));
    let rating: Rating = M.rating;
    let count = |e: &[Experiment]| effect_parameters_in(EffectId::CoulombFriction, &truth(), &rating, e).len();
    assert!(count(std::slice::from_ref(&unknown)) == 0 && count(&[unknown, known]) > 0);
}

#[test]
fn a_common_gain_of_the_currents_is_not_fitted_where_no_torque_tells_it_from_the_impedances() {
    let r = recording(true);
    let (known, unknown) = (experiment(&r), driven(&r));
    let gain = EffectId::CurrentSensorGain;
    let count = |e: &[Experiment]| effect_parameters_in(gain, &truth(), &M.rating, e).len();
    assert_eq!((count(std::slice::from_ref(&unknown)), count(&[unknown.clone(), known])), (2, 3));
    // All impedances by a factor, from rest: the same currents as through sensors of that gain, with any size of the machine.
    use BaseParameter as P;
    let impedances = [P::StatorResistance, P::RotorResistance, P::StatorLeakageInductance, P::RotorLeakageInductance];
    let scaled: Vec<_> =
        impedances.into_iter().chain([P::MagnetizingInductance]).map(|p| (id(p), truth().get(id(p)) / 1.2)).collect();
    let smaller = truth().with(&scaled).unwrap();
    let through = truth().with(&[(ParameterId::Effect(gain, 0), 0.2)]).unwrap();
    let of = |m: &Machine<f64>| residuals(m, &unknown, &State::default());
    for (a, b) in of(&smaller).iter().flatten().zip(of(&through).iter().flatten()) {
        assert!((a - b).abs() < 1e-6 * (1.0 + a.abs()), "{a} {b}");
    }
}
