//! The fifth-order observer after Thau (Kwon et al., Sections VI and IX), through the code of `im-observers` and `im-design`.

use im_design::machine::Constants;
use im_design::matrix::Matrix;
use im_design::{linalg, model, thau};
use im_model::space_vector::unit;
use im_model::state_space::StateSpace;
use im_observers::{Basis, Estimate, Input, Kubota, KubotaGains, LoadTorqueModel, Observer, Thau, ThauGains};

use crate::claim::{C, Claim, ClaimCase, Cost, Found, Paper};
use crate::properties::{RunUp, Steady, observer};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[
    Claim {
        number: 17,
        name: "thau_v_falls_under_15",
        paper: Paper::Kwon,
        place: "(14), (15)",
        statement: "If ‖u₂(x̂) − u₂(x)‖ ≤ κ‖e‖ with κ below the bound (15), V = eᵀPe has V̇ < 0.",
        assumptions: "L = 0, Q = I, friction not zero. Any error, and any difference of u₂ of that size.",
        found: Found::Holds,
        finding: "Holds, with three orders of magnitude to spare: the S-procedure reaches min((D/J)/μ, η/n_p), which no gain can pass.",
        cost: Cost::Run,
        variables: &[
            Variable::even("error_speed", -1.0, 1.0),
            Variable::even("error_flux_a", -1.0, 1.0),
            Variable::even("error_flux_b", -1.0, 1.0),
            Variable::even("error_current_a", -1.0, 1.0),
            Variable::even("error_current_b", -1.0, 1.0),
            Variable::even("input_1", -1.0, 1.0),
            Variable::even("input_2", -1.0, 1.0),
            Variable::even("input_3", -1.0, 1.0),
        ],
        check: v_falls_under_15,
    },
    Claim {
        number: 18,
        name: "thau_printed_bound_follows_from_printed_matrices",
        paper: Paper::Kwon,
        place: "(15), \"7.5348 × 10⁻⁵\"",
        statement: "With Q = I₅ and the matrices of Section VII, κ < 7.5348·10⁻⁵.",
        assumptions: "The printed A and B₂, misprints included; no machine enters.",
        found: Found::Holds,
        finding: "7.534874·10⁻⁵: the printed digits are cut, not rounded. The misprints in B₂ do not change its norm.",
        cost: Cost::Run,
        variables: &[],
        check: |_| {
            let c = Constants::kwon_printed();
            match thau::paper_bound(&model::linear_part(&c), &thau::printed_b2()) {
                Ok(bound) => Verdict::at_most("distance from the printed digits", (bound.kappa - 7.5348e-5).abs(), 1e-9),
                Err(e) => Verdict::refused(e),
            }
        },
    },
    Claim {
        number: 19,
        name: "thau_15_covers_operation",
        paper: Paper::Kwon,
        place: "after (15)",
        statement: "\"The Lipschitz condition (15) is nevertheless satisfied\": it is what the observer's convergence rests on.",
        assumptions: "A state in operation, 20 to 100 % of rated flux and speed, and an error of up to a tenth of it; friction not zero.",
        found: Found::Fails,
        finding: "Satisfied at t = 0 only, where x = x̂ = 0 makes both sides zero. In operation ‖Δu₂‖/‖e‖ is about the flux in Vs, four orders \
                  above the bound: (15) says nothing about any running machine.",
        cost: Cost::Run,
        variables: &[
            Variable::even("speed_share", 0.2, 1.0).simplest_at(0.2),
            Variable::even("flux_share", 0.2, 1.0).simplest_at(0.2),
            Variable::even("error_speed_share", -0.1, 0.1),
            Variable::even("error_flux_share", 0.001, 0.1).simplest_at(0.001),
            Variable::angle("error_flux_angle_rad"),
        ],
        check: condition_15_in_operation,
    },
    Claim {
        number: 20,
        name: "thau_follows_from_the_same_state",
        paper: Paper::Kwon,
        place: "IX, Fig. 8",
        statement: "With zero initial conditions of both and τ̂_L = kω̂, the observer predicts the speed through transient and steady state, to 10 %.",
        assumptions: "L = 0; the load is kω with the same k; parameters right; run-up on a ramp of voltage and frequency; 20 µs, so that two integrators of \
                      one equation stay together.",
        found: Found::Holds,
        finding: "Holds: a copy from the same state follows, mostly to a thousandth. The largest errors are those of machines of small inertia, \
                  which hunt on an open-loop supply: there the difference of two integrators grows, at 100 µs beyond 10 %.",
        cost: Cost::Run,
        variables: &[
            Variable::even("load_share", 0.0, 1.0).simplest_at(0.5),
            Variable::even("frequency_share", 0.4, 1.0).simplest_at(1.0),
        ],
        check: follows_from_the_same_state,
    },
    Claim {
        number: 21,
        name: "thau_tracks_in_two_seconds_from_rest",
        paper: Paper::Kwon,
        place: "IX, Fig. 9; X",
        statement: "With τ̂_L equal to the estimated torque, the observer, started from rest, tracks a machine held at speed in under 2 s, within 2.5 %.",
        assumptions: "L = 0; motoring at 30 to 100 % of rated speed with 30 to 100 % of rated slip, any machine.",
        found: Found::Fails,
        finding: "Holds for the paper's machine. It is Kubota's integral law with K_I = μ/(n_pβ) (claim 22): its speed is set by the inertia, \
                  and the leak D/J leaves a steady error. Machines of large inertia for their size are slower, or settle elsewhere.",
        cost: Cost::Run,
        variables: &[
            Variable::even("speed_share", 0.3, 1.0).simplest_at(0.5),
            Variable::even("slip_share", 0.3, 1.0).simplest_at(0.75),
        ],
        check: tracks_from_rest,
    },
    Claim {
        number: 22,
        name: "thau_with_the_measured_current_is_kubotas_integral_law",
        paper: Paper::Kwon,
        place: "(12), IX",
        statement: "The fifth-order observer is an alternative architecture to the three others.",
        assumptions: "L = 0, load and friction together equal to the estimated torque with the measured current; any speed and slip.",
        found: Found::Fails,
        finding: "It is not one: the two speeds differ by rounding only. ω̂' = μ λ̂ × (î − i) is Kubota's law with K_P = 0, K_I = μ/(n_pβ).",
        cost: Cost::Run,
        variables: &[
            Variable::even("speed_share", -1.0, 1.0).simplest_at(1.0),
            Variable::even("slip_share", -1.0, 1.0).simplest_at(0.5),
        ],
        check: differs_from_kubota,
    },
];

fn v_falls_under_15(case: &ClaimCase) -> Verdict {
    let v: [f64; 8] = case.values();
    let c = im_design::LinearMachine::from(case.machine()).constants::<f64>();
    let (a, b2) = (model::linear_part(&c), model::bilinear_input(&c));
    // Without friction A is not stable.
    let Ok(bound) = thau::paper_bound(&a, &b2) else { return Verdict::Outside };
    let e = Matrix::from_fn(5, 1, |i, _| v[i]);
    let u = Matrix::from_fn(3, 1, |i, _| v[5 + i]);
    // As large as (15) allows, less a millionth.
    let kappa = bound.kappa * (1.0 - 1e-6);
    let u = u.scaled(&(kappa * e.norm() / u.norm().max(1e-9)));
    let rate = &(&a * &e) + &(&b2 * &u);
    let v_rate = 2.0 * (&(&e.t() * &bound.p) * &rate)[(0, 0)];
    let size = linalg::norm2(&bound.p) * e.norm() * (linalg::norm2(&a) * e.norm());
    Verdict::at_most("V̇ over its terms", v_rate / size, 1e-12)
}

fn condition_15_in_operation(case: &ClaimCase) -> Verdict {
    let [speed, flux, speed_error, flux_error, angle] = case.values();
    let c = im_design::LinearMachine::from(case.machine()).constants::<f64>();
    let Ok(bound) = thau::paper_bound(&model::linear_part(&c), &model::bilinear_input(&c)) else { return Verdict::Outside };
    let rated = case.rating().rotor_flux_vs;
    let space = StateSpace::new(&case.parameters().windings(), case.machine().pole_pairs());
    let lambda = flux * rated;
    let i = C::new(c.eta, case.slip()) * (lambda / c.eta_l_m);
    let x: [f64; 5] = [speed * case.speed(), lambda, 0.0, i.re, i.im];
    let off = unit(angle) * (flux_error * rated);
    let e = [speed_error * case.speed(), off.re, off.im, 0.0, 0.0];
    let y: [f64; 5] = core::array::from_fn(|k| x[k] + e[k]);
    let change = space.u_2(&y.into(), 0.0) - space.u_2(&x.into(), 0.0);
    let size = e.iter().map(|x| x * x).sum::<f64>().sqrt();
    Verdict::at_most("‖Δu₂‖/‖e‖ over the bound of (15)", change.norm() / size / bound.kappa, 1.0)
}

fn observer_of(case: &ClaimCase, load: LoadTorqueModel, sample_time_s: f64) -> Result<Thau<f64>, Verdict> {
    let basis = Basis::try_new(case.machine(), case.rating(), sample_time_s);
    basis.and_then(|b| Thau::try_new(b, ThauGains::published(), load)).map_err(Verdict::refused)
}

/// Sampling time of the copy, s.
const FINE: f64 = 2e-5;

fn follows_from_the_same_state(case: &ClaimCase) -> Verdict {
    let [load, frequency] = case.values();
    let coefficient_nm_s_per_rad = load * case.rating().torque_nm / case.speed();
    let thau = match observer_of(case, LoadTorqueModel::Proportional { coefficient_nm_s_per_rad }, FINE) {
        Ok(thau) => thau,
        // The torque loop of a machine of very small inertia is too fast for 100 µs.
        Err(_) => return Verdict::Outside,
    };
    let mut state = Default::default();
    let mut worst = 0.0f64;
    RunUp::new(case, frequency, coefficient_nm_s_per_rad, FINE).run(1.5, |input, truth| {
        let e: Estimate<f64> = thau.step(&mut state, input);
        worst = worst.max((e.omega_m - truth.omega_m).abs());
    });
    Verdict::at_most("largest speed error over the rated speed", worst / case.speed(), 0.1)
}

fn tracks_from_rest(case: &ClaimCase) -> Verdict {
    let [speed, slip] = case.values();
    let truth = Steady::new(case, speed * case.speed(), slip * case.slip(), case.rating().rotor_flux_vs, 0.0, 1e-4);
    let thau = match observer_of(case, LoadTorqueModel::EqualToTorque, 1e-4) {
        Ok(thau) => thau,
        Err(_) => return Verdict::Outside,
    };
    let mut worst = 0.0f64;
    let zero = C::new(0.0, 0.0);
    observer::run(&thau, &truth, [zero, zero], 0.0, 22_000, |k, e| {
        if k > 20_000 {
            worst = worst.max((e.omega_m - truth.omega_m).abs());
        }
    });
    Verdict::at_most("speed error after 2 s over the speed", worst / truth.omega_m.abs(), 0.025)
}

fn differs_from_kubota(case: &ClaimCase) -> Verdict {
    let [speed, slip] = case.values();
    let truth = Steady::new(case, speed * case.speed(), slip * case.slip(), case.rating().rotor_flux_vs, 0.0, 1e-4);
    let Ok(thau) = observer_of(case, LoadTorqueModel::Balanced, 1e-4) else { return Verdict::Outside };
    let c = case.constants();
    let law = KubotaGains::without_feedback(0.0, c.mu / (c.n_p * c.beta));
    let kubota = match Basis::try_new(case.machine(), case.rating(), 1e-4).and_then(|b| Kubota::try_new(b, law)) {
        Ok(kubota) => kubota,
        Err(e) => return Verdict::refused(e),
    };
    let start = 0.9 * truth.omega_m;
    let mut a = thau.state_at(truth.flux(0), truth.current(0), start);
    let mut b = kubota.state_at(truth.flux(0), truth.current(0), start);
    let mut apart = 0.0f64;
    for k in 1..=3000 {
        let input: Input<f64> = truth.input(k);
        apart = apart.max((thau.step(&mut a, &input).omega_m - kubota.step(&mut b, &input).omega_m).abs());
    }
    Verdict::at_least("largest difference of the speeds over the rated speed", apart / case.speed(), 1e-6)
}
