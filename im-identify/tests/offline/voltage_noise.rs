//! Noise of a measured voltage: it drives the model, and what that makes of currents and speed is no error.

use im_model::EffectId;

use super::*;

/// Numbers of N(0, 1), near enough: sums of twelve uniform ones.
fn gaussian(seed: u64) -> impl FnMut() -> f64 {
    let mut s = seed;
    let mut uniform = move || {
        s = s.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (s >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    move || (0..12).map(|_| uniform()).sum()
}

/// White noise of this standard deviation on both axes of the voltage.
fn noisy(r: &Recording, sigma_v: f64, seed: u64) -> Recording {
    let mut draw = gaussian(seed);
    let u_s = r.u_s.iter().map(|u| u + Complex::new(sigma_v * draw(), sigma_v * draw())).collect();
    Recording { u_s, ..r.clone() }
}

/// Mean square, and that of means over 50 rows in their standard deviation: 1 of white noise of the sensors.
fn left(e: &Experiment) -> Vec<[f64; 2]> {
    let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64;
    let of = |r: &Vec<f64>| {
        let means: Vec<f64> = r.chunks_exact(50).map(|c| c.iter().sum::<f64>() / 50f64.sqrt()).collect();
        [square(r), square(&means)]
    };
    residuals(&truth(), e, &e.start_state()).iter().map(of).collect()
}

fn counted(e: &Experiment, sigma_v: f64) -> Experiment {
    Experiment { voltage_noise: VoltageNoise::of(Volts::white(sigma_v)), ..e.clone() }.with_inputs_by(&truth(), &e.start_state())
}

/// With the torque known, unknown, and neither torque nor speed known; followed freely and nudged.
#[test]
fn noise_of_the_voltage_is_no_error_of_currents_and_speed() {
    let sigma_v = 1.4;
    let r = noisy(&recording(true), sigma_v, 3);
    let known = experiment(&r);
    let unknown = experiment(&Recording { tau_load: None, ..r.clone() }).driven_by_speed();
    let unseen = known.clone().with_unmeasured_speed(&truth(), &M.rating);
    for (name, e) in [("known", known), ("unknown", unknown), ("unseen", unseen)] {
        let (before, after) = (left(&e), left(&counted(&e, sigma_v)));
        assert!(before.iter().all(|x| x[0] > 1.2 && x[1] > 5.0), "{name}: {before:?}");
        for [all, slow] in after {
            // A speed that is found takes part of what is slow.
            assert!((0.94..1.06).contains(&all) && (0.4..1.4).contains(&slow), "{name}: {all} {slow}");
        }
    }
    let nudged = |e: Experiment| e.nudged_towards(r.omega_m.clone(), 30.0);
    let (plain, at_once) = (experiment(&r), nudged(counted(&experiment(&r), sigma_v)));
    assert!(left(&nudged(plain)).iter().any(|x| x[1] > 2.0));
    assert!(
        left(&at_once).iter().all(|[all, slow]| (0.94..1.06).contains(all) && (0.7..1.4).contains(slow)),
        "{:?}",
        left(&at_once)
    );
}

/// What is printed is what was simulated; only what an error counts for changes.
#[test]
fn predictions_are_those_of_the_voltage_as_measured() {
    let r = noisy(&recording(true), 1.4, 4);
    let e = experiment(&r);
    let [plain, with] = [&e, &counted(&e, 1.4)].map(|e| predict(&truth(), e, &e.start_state()));
    assert_eq!(plain, with);
}

/// Intervals hold the truth, which those without the noise do not.
#[test]
fn a_fit_with_a_noisy_voltage_knows_how_little_it_knows() {
    let sigma_v = 1.0;
    let free = base_parameters(&truth());
    // Mean square of what the electrical parameters are off by, in their standard deviations.
    let off = |count: bool| {
        let of = |seed: u64| {
            let e = experiment(&noisy(&recording(true), sigma_v, 10 + seed));
            let e = if count { counted(&e, sigma_v) } else { e };
            let f = fit(&truth(), &[e], &free, &FitOptions::near()).unwrap();
            let (values, std) = (f.values(), f.standard_deviations());
            (0..4).map(|k| ((values[k] - truth().get(free[k].id().unwrap())) / std[k]).powi(2)).sum::<f64>() / 4.0
        };
        (0..8).map(of).sum::<f64>() / 8.0
    };
    let (without, with) = (off(false), off(true));
    assert!(with < 2.0 && without > 5.0 * with, "{without} {with}");
}

/// A switch closes anywhere between two rows: the volt-seconds of its row are not known, and what follows from them is no error.
#[test]
fn a_switch_between_two_samples_is_no_error() {
    let r = recording(true);
    let (row, jump) = (400, 200.0);
    let mut all = vec![0.0; 3];
    for part in 0..10 {
        let mut other = r.clone();
        other.u_s[row] += Complex::new(jump * (0.1 * f64::from(part) - 0.45), 0.0);
        let e = experiment(&other);
        let known = Volts { switched: vec![(row, jump / 12f64.sqrt())], ..Volts::default() };
        let known = Experiment { voltage_noise: VoltageNoise::of(known), ..e.clone() }.with_inputs_by(&truth(), &e.start_state());
        assert!(known.voltage_noise.counted().is_none() && known.inert == e.inert);
        let after = |e: &Experiment| -> Vec<f64> {
            residuals(&truth(), e, &e.start_state())
                .iter()
                .map(|r| r[row..row + 300].iter().map(|x| x * x).sum::<f64>() / 300.0)
                .collect()
        };
        all.iter_mut().zip(after(&known)).for_each(|(all, x)| *all += 0.1 * x);
        if part == 0 {
            assert!(after(&e)[0] > 5.0, "{:?}", after(&e));
        }
    }
    assert!(all.iter().all(|x| (0.85..1.15).contains(x)), "{all:?}");
}

/// Mains that were found behind noise are off by a little at each harmonic: with the load known, and on the measured speed.
#[test]
fn mains_that_are_off_by_what_is_known_of_them_are_no_error() {
    let r = recording(true);
    let (from, off_v, angle) = (150, 0.3, 314.0 * r.sample_time_s);
    let wander = |order: f64| Wander {
        first_v2: off_v * off_v,
        // Forgotten within a thousand rows, and made anew.
        onward: Complex::from_polar(0.999, order * angle),
        added_v2: off_v * off_v * (1.0 - 0.999f64.powi(2)),
    };
    let known = Volts { taken_v: 5.0, mains: vec![Stretch { from, off: [0.0, 1.0, -1.0].map(wander) }], ..Volts::default() };
    let mut draw = gaussian(11);
    let mut all = [[0.0; 2]; 2];
    let draws = 12;
    for _ in 0..draws {
        let mut other = r.clone();
        let mut vector = |size: f64| Complex::new(size * draw(), size * draw());
        let mut off = [(); 3].map(|()| vector(off_v));
        for u in &mut other.u_s[from..] {
            *u += off.iter().sum::<Complex<f64>>();
            for (off, z) in off.iter_mut().zip(known.mains[0].off) {
                *off = *off * z.onward + vector(z.added_v2.sqrt());
            }
        }
        let unknown = Recording { tau_load: None, ..other.clone() };
        for (n, e) in [experiment(&other), experiment(&unknown).driven_by_speed()].into_iter().enumerate() {
            let with = Experiment { voltage_noise: VoltageNoise::of(known.clone()), ..e.clone() };
            let with = with.with_inputs_by(&truth(), &e.start_state());
            assert_eq!(with.inert, Some(EffectId::InverterNonlinearity));
            let slow = |e: &Experiment| left(e)[..2].iter().map(|x| x[1]).sum::<f64>() / 2.0;
            all[n][0] += slow(&e) / f64::from(draws);
            all[n][1] += slow(&with) / f64::from(draws);
        }
    }
    for [before, after] in all {
        assert!(before > 3.0 && (0.75..1.25).contains(&after), "{before} {after}");
    }
}

/// A noise that the currents' own hides is not followed, nor one by which estimates would lean.
#[test]
fn noise_that_does_not_show_or_is_too_large_changes_nothing() {
    let e = experiment(&recording(true));
    for sigma_v in [1e-3, 5.0] {
        assert_eq!(left(&counted(&e, sigma_v)), left(&e));
    }
    assert!(counted(&e, 5.0).is_voltage_too_noisy(&truth()) && !counted(&e, 1.4).is_voltage_too_noisy(&truth()));
}
