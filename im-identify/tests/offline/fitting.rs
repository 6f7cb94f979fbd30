//! What is found, how sure that is, and what limits do.

use super::*;

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
    let of = |a, b| found.correlation(a, b).unwrap();
    let c = of(0, 2);
    assert!((c - of(2, 0)).abs() < 1e-9 && c.abs() < 1.0, "{c}");
    assert!((of(3, 3) - 1.0).abs() < 1e-9);
    let known = Fit { covariance: &found.covariance * 0.0, ..found.clone() };
    assert_eq!(known.correlation(0, 2), None);
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

/// A limit that the data would have a parameter cross is where it stays, from either side; the others do what they can.
#[test]
fn a_parameter_stays_at_its_limit_and_the_others_make_the_best_of_it() {
    let e = [experiment(&recording(true))];
    let r_s = M.parameters().stator_resistance_ohm;
    for (limits, stop) in [((1.2, 2.0), 1.2), ((0.4, 0.9), 0.9)] {
        let mut free = base_parameters(&truth());
        free[0].limits = (limits.0 * r_s, limits.1 * r_s);
        let start = truth().with(&[(id(BaseParameter::StatorResistance), 0.5 * (limits.0 + limits.1) * r_s)]).unwrap();
        let found = fit(&start, &e, &free, &FitOptions::near()).unwrap();
        assert!((found.values()[0] / (stop * r_s) - 1.0).abs() < 1e-9, "{}", found.values()[0]);
        let held = truth().with(&[(id(BaseParameter::StatorResistance), stop * r_s)]).unwrap();
        let others = fit(&held, &e, &free[1..], &FitOptions::near()).unwrap();
        assert!((found.cost / others.cost - 1.0).abs() < 1e-4, "{} {}", found.cost, others.cost);
    }
}

/// (JᵀJ)⁻¹ at the end, though the descent came from far; what is left beyond the noise widens the deviations, a noise smaller than said does not
/// narrow them. In which unit the noise is counted does not change the way.
#[test]
fn deviations_are_those_of_the_end_and_widened_by_what_is_left() {
    let e = experiment(&recording(true));
    let free = base_parameters(&guess());
    let with_noise = |by: f64| {
        let mut e = e.clone();
        e.channels.iter_mut().for_each(|c| c.sigma *= by);
        fit(&guess(), &[e], &free, &FitOptions::default()).unwrap()
    };
    let found = with_noise(1.0);
    let slopes = linearize(&found.machine, &e, &found.starts[0], 0, &free).slopes;
    let normal =
        |a: usize, b: usize| -> f64 { slopes[a].iter().flatten().zip(slopes[b].iter().flatten()).map(|(x, y)| x * y).sum() };
    let scale = |k: usize| found.covariance[(k, k)].sqrt();
    for a in 0..free.len() {
        for b in 0..free.len() {
            let product: f64 = (0..free.len()).map(|k| found.covariance[(a, k)] * normal(k, b)).sum();
            // From slopes of up to 3 % before the end.
            assert!((product - f64::from(u8::from(a == b))).abs() * scale(b) / scale(a) < 0.1, "{a} {b}: {product}");
        }
    }
    for (by, wider) in [(0.25, 1.0), (4.0, 4.0)] {
        let other = with_noise(by);
        assert_eq!(other.iterations, found.iterations);
        assert!((other.chi2_per_sample() * by * by / found.chi2_per_sample() - 1.0).abs() < 1e-6);
        for ((a, b), (v, w)) in
            other.standard_deviations().iter().zip(found.standard_deviations()).zip(other.values().iter().zip(found.values()))
        {
            // χ² per sample of 1 ± 0.01 is within rounding of the floor.
            assert!((a / b / wider - 1.0).abs() < 0.02 && (v - w).abs() < 1e-3 * b, "{by}: {a} {b} {v} {w}");
        }
        // The same deviations, as shares of the search variables' units, are what `undetermined` asks for.
        let inflation = other.chi2_per_sample().max(1.0).sqrt();
        for k in 0..free.len() {
            let share = other.covariance[(k, k)].sqrt() * inflation;
            assert!(other.undetermined(share * 1.001).iter().all(|&j| j != k), "{k}");
            assert!(other.undetermined(share * 0.999).contains(&k), "{k}");
        }
    }
}

/// A simulation that runs away is refused by the name of its experiment, whether or not anything is free.
#[test]
fn what_diverges_is_named() {
    let r = recording(false);
    let (mut good, mut bad) = (experiment(&r), experiment(&r));
    (good.name, bad.name) = ("good".into(), "bad".into());
    bad.u_s[20] = Complex::new(f64::INFINITY, 0.0);
    for free in [Vec::new(), base_parameters(&truth())] {
        for order in [[&good, &bad], [&bad, &good]] {
            let error = fit(&truth(), &order.map(Clone::clone), &free, &FitOptions::near()).unwrap_err();
            assert_eq!(error, FitError::Diverges { experiment: "bad".into() });
        }
        let found = fit(&truth(), std::slice::from_ref(&good), &free, &FitOptions::near()).unwrap();
        assert!(found.converged && found.values().len() == free.len() && found.covariance.nrows() == free.len());
    }
}

/// Without a step to take, what there is is reported: its cost, its deviations, that it has not converged.
#[test]
fn a_fit_without_steps_says_how_it_stands() {
    let e = [experiment(&recording(true))];
    let found = fit(&guess(), &e, &base_parameters(&guess()), &FitOptions { iterations: 0, ..FitOptions::near() }).unwrap();
    assert!(!found.converged && found.iterations == 0 && found.machine == guess());
    assert_eq!(found.cost, cost(&guess(), &e, &found.starts));
    assert!(found.standard_deviations().iter().all(|d| d.is_finite() && *d > 0.0));
}

/// From the truth there is nothing to do but to say so, and no short horizon is asked to do it.
#[test]
fn options_for_a_near_start_go_straight_to_the_whole() {
    let near = FitOptions::near();
    assert!(near.horizons.is_empty() && near.iterations == FitOptions::default().iterations);
    assert!(near.tolerance > FitOptions::default().tolerance);
    assert!(FitOptions::default().horizons.iter().all(|f| *f > 0.0 && *f < 1.0));
    let e = [experiment(&recording(true))];
    let free = base_parameters(&truth());
    let found = fit(&truth(), &e, &free, &near).unwrap();
    assert!(found.converged && found.iterations <= 3, "{}", found.iterations);
}
