//! The steps of a descent, how far it looks, and when it says that it has arrived.

use super::*;
use crate::offline::{base_parameters, linearize, predict};
use im_model::machines::MOTULATOR_2_2_KW;
use im_model::{Complex, Recording};

const SIGMA: [f64; 2] = [0.1, 0.2];

fn truth() -> Machine<f64> {
    Machine::base(MOTULATOR_2_2_KW.parameters(), MOTULATOR_2_2_KW.pole_pairs).unwrap()
}

/// R_s, R_r, both leakages, L_m, J and D of the truth, times these.
fn off(by: [f64; 6]) -> Machine<f64> {
    let changes: Vec<_> = base_parameters(&truth())
        .iter()
        .zip(by)
        .flat_map(|(f, by)| match &f.target {
            Target::Machine(ids) => ids.iter().map(|&id| (id, by * truth().get(id))).collect(),
            Target::Initial { .. } => vec![],
        })
        .collect();
    truth().with(&changes).unwrap()
}

/// What a machine shows of a direct start of 0.1 s, and noise of about `SIGMA`.
fn run_up(machine: &Machine<f64>) -> Experiment {
    measured(machine, 500, 2e-4, |k, c| 1.7 * (((k * 7919 + c * 31) % 101) as f64 / 50.0 - 1.0))
}

/// A direct start in so many rows, with the noise of each row and channel in σ.
fn measured(machine: &Machine<f64>, rows: usize, sample_time_s: f64, mut noise: impl FnMut(usize, usize) -> f64) -> Experiment {
    let r = Recording {
        name: "run-up".into(),
        start_s: 0.0,
        sample_time_s,
        u_s: (0..rows).map(|k| Complex::from_polar(326.6, 314.159 * sample_time_s * (k as f64 + 0.5))).collect(),
        i_s: vec![Complex::new(0.0, 0.0); rows],
        omega_m: vec![0.0; rows],
        tau_load: None,
    };
    let mut e = Experiment::from_recording(&r, [SIGMA[0]; 2], SIGMA[1]);
    let clean = predict(machine, &e, &State::default());
    for (c, (channel, y)) in e.channels.iter_mut().zip(clean).enumerate() {
        channel.values = y.iter().enumerate().map(|(k, y)| y + channel.sigma * noise(k, c)).collect();
    }
    e
}

/// What a Gauss-Newton step would still gain, as a share of the cost: gᵀ(JᵀJ)⁻¹g. Zero at a minimum.
fn promised(machine: &Machine<f64>, e: &Experiment, start: &State<f64>, free: &[Free]) -> f64 {
    let l = linearize(machine, e, start, 0, free);
    let normal = DMatrix::from_fn(free.len(), free.len(), |a, b| dot(&l.slopes[a], &l.slopes[b]));
    let g = DVector::from_fn(free.len(), |k, _| dot(&l.slopes[k], &l.residuals));
    g.dot(&normal.lu().solve(&g).unwrap()) / l.residuals.iter().flatten().map(|r| r * r).sum::<f64>()
}

/// (A + λ diag A) d = g, whatever the units; who is stopped stays, and the others move as if it were not there.
#[test]
fn a_damped_step_solves_the_damped_normal_equations_of_those_that_may_move() {
    let units = DVector::from_vec(vec![0.5, 1.0, 200.0]);
    let j = DMatrix::from_row_slice(4, 3, &[1.0, 0.5, -0.2, 0.3, 2.0, 0.4, -0.6, 0.1, 1.5, 0.2, -0.3, 0.7]);
    let normal = DMatrix::from_diagonal(&units) * j.transpose() * j * DMatrix::from_diagonal(&units);
    let aim = DVector::from_vec(vec![0.3, -0.2, 1e-3]);
    let g = &normal * &aim;
    let free = [false; 3];
    let near = |a: &DVector<f64>, b: &DVector<f64>| a.iter().zip(b.iter()).all(|(a, b)| (a - b).abs() < 1e-9 * (1.0 + b.abs()));
    assert!(near(&damped_step(&normal, &g, &free, 0.0).unwrap().0, &aim));
    for damping in [1e-3, 0.5, 30.0] {
        let step = damped_step(&normal, &g, &free, damping).unwrap().0;
        let damped = DMatrix::from_fn(3, 3, |a, b| normal[(a, b)] * if a == b { 1.0 + damping } else { 1.0 });
        assert!((&damped * &step - &g).component_div(&units).amax() < 1e-9, "{damping}");
    }
    let step = damped_step(&normal, &g, &[false, true, false], 0.1).unwrap().0;
    let alone = normal.clone().remove_row(1).remove_column(1);
    let others = damped_step(&alone, &g.clone().remove_row(1), &free[1..], 0.1).unwrap().0;
    assert!(step[1] == 0.0 && near(&step.remove_row(1), &others));
    // No farther than a factor e, in either direction.
    let far = damped_step(&normal, &(&normal * DVector::from_vec(vec![5.0, -7.0, 0.5])), &free, 0.0).unwrap().0;
    assert!(far[0] == 1.0 && far[1] == -1.0 && (far[2] - 0.5).abs() < 1e-9, "{far}");
    // Without damping, two that do the same are not determined, and with it move alike; what does nothing stays.
    let alike = DMatrix::from_element(2, 2, 4.0);
    let half = damped_step(&alike, &DVector::from_vec(vec![1.0, 1.0]), &free[..2], 1e-3).unwrap().0;
    assert!((half[0] - half[1]).abs() < 1e-12 && (half[0] - 0.125).abs() < 1e-3, "{half}");
    assert!(damped_step(&-alike, &DVector::from_vec(vec![1.0, 1.0]), &free[..2], 0.0).is_none());
    let idle = DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 0.0]));
    let step = damped_step(&idle, &DVector::from_vec(vec![2.0, 0.0]), &free[..2], 0.0).map(|(s, _)| (s[0], s[1]));
    assert!(step.is_none(), "without damping there is no telling: {step:?}");
    let step = damped_step(&idle, &DVector::from_vec(vec![2.0, 0.0]), &free[..2], 1e-6).unwrap().0;
    assert!((step[0] - 0.5).abs() < 1e-5 && step[1] == 0.0, "{step}");
}

/// The covariance of what is known is that of a fit without the rest; of the rest next to nothing is known.
#[test]
fn a_direction_without_information_is_unknown_and_does_not_spoil_the_others() {
    let known = DMatrix::from_row_slice(2, 2, &[4e6, 3.0, 3.0, 9e-6]);
    let truth = known.clone().try_inverse().unwrap();
    let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
    let got = inverse_of_normal(&known);
    assert!(got.iter().zip(truth.iter()).all(|(a, b)| same(*a, *b)), "{got} {truth}");
    // A third that acts on nothing.
    let more = inverse_of_normal(&known.clone().resize(3, 3, 0.0));
    assert!(same(more[(0, 0)], truth[(0, 0)]) && same(more[(1, 1)], truth[(1, 1)]) && same(more[(0, 1)], truth[(0, 1)]));
    assert!(more[(2, 2)] > 1e100 && more[(0, 2)].abs() < 1e-9 && more[(2, 1)].abs() < 1e-9, "{more}");
    // Two that act alike: their difference is unknown, by fourteen orders; the third is as if alone.
    let alike = DMatrix::from_row_slice(3, 3, &[4.0, 4.0, 0.0, 4.0, 4.0, 0.0, 0.0, 0.0, 25.0]);
    let got = inverse_of_normal(&alike);
    assert!(got[(0, 0)] > 1e12 && got[(0, 1)] < -1e12 && same(got[(2, 2)], 0.04), "{got}");
}

/// Two rows at least, and no more than there are.
#[test]
fn a_horizon_is_a_share_of_the_rows() {
    let e = run_up(&truth());
    let of = |n: usize| Experiment { u_s: e.u_s[..n].to_vec(), ..e.clone() };
    assert_eq!([0.08, 0.3, 1.0, 2.0, 0.0].map(|f| rows(&e, f)), [40, 150, 500, 500, 2]);
    assert_eq!([0, 1, 2, 3].map(|n| rows(&of(n), 0.1)), [0, 1, 2, 2]);
}

/// What comes after the horizon has no say: another machine's second half does not move the fit of the first.
#[test]
fn a_descent_over_a_horizon_sees_nothing_beyond_it() {
    let free = base_parameters(&truth());
    let mut e = run_up(&truth());
    let other = run_up(&off([2.0, 0.5, 1.5, 0.7, 3.0, 1.0]));
    for (c, o) in e.channels.iter_mut().zip(other.channels) {
        c.values[250..].copy_from_slice(&o.values[250..]);
    }
    let mut here = Point::new(&off([1.0, 1.2, 1.1, 1.0, 0.9, 1.0]), vec![State::default()]);
    let (runs, effort) = ([e.clone()], Effort { iterations: 40, tolerance: 1e-8, every_row: EveryRow::AtLast });
    let mut room = Room::of(&here.machine, &runs, &free).unwrap();
    let end = descend(&mut here, &mut room, &Thinned::of(&runs), &free, 0.5, &effort).unwrap();
    assert!(end.converged && here.residuals[0].iter().all(|c| c.len() == 250));
    // A noise of 1.7²/3 ≈ 0.98 σ².
    assert!((here.cost / 750.0 - 0.98).abs() < 0.1, "{}", here.cost / 750.0);
    for (f, tolerance) in free[..5].iter().zip([0.1, 0.02, 0.02, 0.1, 0.02]) {
        let id = f.id().unwrap();
        assert!((here.machine.get(id) / truth().get(id) - 1.0).abs() < tolerance, "{}: {}", f.name(), here.machine.get(id));
    }
    let whole = fit(&here.machine, &[e], &free, &FitOptions::near()).unwrap();
    assert!(whole.chi2_per_sample() > 10.0, "{}", whole.chi2_per_sample());
}

/// r(x + v) = r − S v − c(v)/2 with a quadratic c: half the second derivative along v is −c(v)/2, exactly.
#[test]
fn the_turn_of_a_way_is_half_its_second_derivative() {
    let s = DMatrix::from_row_slice(4, 3, &[1.0, 0.5, -0.2, 0.3, 2.0, 0.4, -0.6, 0.1, 1.5, 0.2, -0.3, 0.7]);
    let (r, bend) = (DVector::from_vec(vec![1.0, -0.4, 0.2, 2.0]), DVector::from_vec(vec![0.3, -2.0, 0.9, 0.1]));
    let step = DVector::from_vec(vec![0.7, -0.2, 0.4]);
    let gradient = |part: f64| s.transpose() * (&r - &s * &step * part - &bend * (0.5 * part * part));
    let slopes = Slopes { per_run: Vec::new(), normal: s.transpose() * &s, way: 0.0 };
    let turn = slopes.turn(&step, &gradient(0.0), &gradient(PROBE));
    assert!((turn + s.transpose() * bend * 0.5).norm() < 1e-12);
}

/// From starts so far off that full steps lead astray: it climbs nowhere, and where it says it has converged nothing is left to gain.
#[test]
fn a_descent_never_climbs_and_has_arrived_when_it_says_so() {
    let e = [run_up(&truth())];
    let free = base_parameters(&truth());
    let starts = [
        [1.0; 6],
        [0.4, 2.5, 0.4, 2.0, 0.4, 1.0],
        [3.0, 0.3, 2.0, 0.5, 3.0, 1.0],
        [1.0, 4.0, 1.0, 1.0, 5.0, 1.0],
        [0.3, 0.3, 0.3, 0.3, 0.3, 1.0],
    ];
    for by in starts {
        let from = off(by);
        let whole = FitOptions { horizons: Vec::new(), ..FitOptions::default() };
        let mut last = cost(&from, &e, &[State::default()]);
        for iterations in [1, 2, 3, 5, 9, 40] {
            let found = fit(&from, &e, &free, &FitOptions { iterations, ..whole.clone() }).unwrap();
            assert!(found.cost <= last && found.iterations <= iterations, "{by:?}, {iterations}: {} {last}", found.cost);
            let spent = found.work >= MOST_SLOPES * (free.len() + 1) as f64;
            assert!(found.converged || found.iterations == iterations || spent, "{by:?}, {iterations}");
            last = found.cost;
        }
        for options in [whole, FitOptions::default()] {
            let found = fit(&from, &e, &free, &options).unwrap();
            let left = promised(&found.machine, &e[0], &found.starts[0], &free);
            assert!(left < 1e-6 || !found.converged, "{by:?}: {left} in {} steps", found.iterations);
            // After short horizons it is the lowest of all minima: the noise.
            let found_all = found.converged && found.cost < 1.1 * found.count as f64;
            assert!(options.horizons.is_empty() || found_all, "{by:?}: {}", found.cost);
        }
    }
}

/// Slopes of every row are left out where white noise is left, and the fit still ends within a thirtieth of the standard deviations (χ² within
/// 0.001 of the least); where anything else is left they are taken.
#[test]
fn slopes_of_every_row_are_taken_where_more_than_noise_is_left() {
    let free = base_parameters(&truth());
    let from = off([1.1, 0.9, 1.05, 0.9, 1.1, 1.0]);
    for seed in 1..6_u64 {
        let mut state = seed;
        let mut noise = |_: usize, _: usize| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            12f64.sqrt() * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
        };
        let clean = measured(&truth(), 6000, 1e-4, &mut noise);
        let hidden = measured(&truth(), 6000, 1e-4, |k, c| noise(k, c) + (k as f64 / 60.0).sin());
        let [few, all] = [clean, hidden].map(|e| {
            let runs = [e];
            let found = fit(&from, &runs, &free, &FitOptions::default()).unwrap();
            let mut least = Point::new(&found.machine, found.starts.clone());
            let mut room = Room::of(&found.machine, &runs, &free).unwrap();
            let effort = Effort { iterations: 40, tolerance: 1e-12, every_row: EveryRow::Never };
            descend(&mut least, &mut room, &Thinned::whole(&runs), &free, 1.0, &effort).unwrap();
            assert!(found.converged);
            (found.work, found.cost + found.prior_cost - least.cost)
        });
        assert!(few.0 + 4.0 < all.0 && few.1 < 1e-3 && all.1 < 1e-4, "{seed}: {few:?} {all:?}");
    }
}
