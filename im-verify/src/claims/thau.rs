//! The fifth-order observer after Thau (Kwon et al., Sections VI and IX), through the code of `im-observers` and `im-design`.

use im_design::machine::Constants;
use im_design::matrix::Matrix;
use im_design::mtpa::{CurrentLaw, SlipLaw};
use im_design::{linalg, model, thau};
use im_model::machines::KWON_TABLE_IV;
use im_model::space_vector::{cross, unit};
use im_model::state_space::StateSpace;
use im_observers::{Basis, Estimate, Input, Kubota, KubotaGains, LoadTorqueModel, Observer, Thau, ThauGains};

use crate::claim::Origin::{Extends, Says};
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
        place: "Section VI, (14), (15)",
        origin: Says(
            "Hence if κ < λ_min(Q)/(2‖B₂‖λ_max(P)), then V̇(e) < 0 and e = 0 is an asymptotically stable equilibrium state of the error equation (12).",
        ),
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
        place: "Section VI, after (15)",
        origin: Says(
            "To evaluate the upper bound on κ that appears in (15), we used Q = I₅, which resulted in κ < 7.5348 × 10⁻⁵.",
        ),
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
        place: "Section VI, after (15)",
        origin: Extends("the Lipschitz condition (15) is nevertheless satisfied at t = 0"),
        statement: "It is satisfied in operation, too, which the paper does not say.",
        assumptions: "A state in operation, 20 to 100 % of rated flux and speed, and an error of up to a tenth of it; friction not zero.",
        found: Found::Fails { rate: 0.99 },
        finding: "At t = 0, x = x̂ = 0 makes both sides zero (claim 66). In operation ‖Δu₂‖/‖e‖ is about the flux in Vs, four orders \
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
        place: "Section IX, Fig. 8",
        origin: Extends(
            "the proposed estimator predicts the rotor speed with good accuracy during the transient period as well as in the steady state period",
        ),
        statement: "The same on any machine, on a ramp of voltage and frequency: within 10 % from zero initial conditions of both with τ̂_L = kω̂.",
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
        place: "Section IX, Fig. 9",
        origin: Extends("the proposed estimator starts to track the actual speed closely in under 2 seconds"),
        statement: "The same on any machine: with τ̂_L equal to the estimated torque, the observer, started from rest, is within 2.5 % after 2 s.",
        assumptions: "L = 0; motoring at 30 to 100 % of rated speed with 30 to 100 % of rated slip, any machine.",
        found: Found::Fails { rate: 0.14 },
        finding: "Holds for the paper's machine (claim 68). It is Kubota's integral law with K_I = μ/(n_pβ) (claim 22): its speed is set by the inertia, \
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
        place: "Section I; Section VI, (12); Section IX",
        origin: Extends("and then describe an alternative rotor flux and speed observer architecture for an induction motor"),
        statement: "With L = 0 and the load torque of the second study, friction in it, the observer is Kubota's with K_P = 0, K_I = μ/(n_pβ).",
        assumptions: "Load and friction together equal to the estimated torque with the measured current; any speed and slip.",
        found: Found::Holds,
        finding: "Holds: the two speeds differ by rounding only. ω̂' = μ λ̂ × (î − i) is Kubota's integral law. As printed, friction not in \
                  τ̂_L, it has the leak D/J besides.",
        cost: Cost::Run,
        variables: &[
            Variable::even("speed_share", -1.0, 1.0).simplest_at(1.0),
            Variable::even("slip_share", -1.0, 1.0).simplest_at(0.5),
        ],
        check: is_kubota,
    },
    Claim {
        number: 66,
        name: "thau_15_is_satisfied_at_the_origin",
        paper: Paper::Kwon,
        place: "Section VI, (11), after (15)",
        origin: Says(
            "Although this upper bound is \"very small\", the Lipschitz condition (15) is nevertheless satisfied at t = 0, that is, at the beginning of \
             the first set of our simulations described in Section IX, where we assume the zero initial conditions for the motor and the observer.",
        ),
        statement: "‖u₂(x̂) − u₂(x)‖ ≤ κ‖x̂ − x‖ with κ of (15) at the origin and in a neighbourhood of it.",
        assumptions: "Friction not zero, τ̂_L = τ_L; x and x̂ within κ/√2 of the origin in the units of (9), the origin itself included.",
        found: Found::Holds,
        finding: "Holds. The neighbourhood is of the size of κ: 10⁻⁵ to 10⁻⁴ rad/s, Wb and A. Beyond: claim 19.",
        cost: Cost::Run,
        variables: &[
            Variable::even("radius_share", 0.0, 1.0).simplest_at(0.0),
            Variable::angle("angle_1_rad"),
            Variable::angle("angle_2_rad"),
            Variable::angle("angle_3_rad"),
            Variable::angle("angle_4_rad"),
        ],
        check: condition_15_at_the_origin,
    },
    Claim {
        number: 67,
        name: "thau_follows_on_its_own_machine",
        paper: Paper::Kwon,
        place: "Section IX, Fig. 8",
        origin: Says(
            "As can be seen in the figure, the proposed estimator predicts the rotor speed with good accuracy during the transient period as well as \
             in the steady state period. Approximately 10% speed error is observed one second into the simulation, which then decreases.",
        ),
        statement: "Its first study: 150 Nm by (30), (31), load kω and kω̂, zero initial conditions: within 10 % of the speed reached, always.",
        assumptions: "The machine of Table IV, current impressed; a k (not printed) for 30 to 185 rad/s. No other machine enters.",
        found: Found::Holds,
        finding: "Holds, by far: the observer is a copy from the same state. The 10 % of the paper's own plant (not described) are not reproduced.",
        cost: Cost::Run,
        variables: &[Variable::even("speed_reached_rad_s", 30.0, 185.0).simplest_at(94.25)],
        check: first_study,
    },
    Claim {
        number: 68,
        name: "thau_tracks_its_own_machine_in_two_seconds",
        paper: Paper::Kwon,
        place: "Section IX, Fig. 9; Section X",
        origin: Says(
            "even though there are big deviations in the transient periods due to different initial conditions, the proposed estimator starts to track \
             the actual speed closely in under 2 seconds … The maximum speed estimation error is around 2.5%.",
        ),
        statement: "Its second study: driven at 900 rpm with 150 Nm, the observer from rest is within 2.5 % after 2 s.",
        assumptions: "The machine of Table IV in its windings' quantities, (30), (31); the flux at any angle at the start. No other machine enters.",
        found: Found::Holds,
        finding: "Holds: 0.1 % are left, the leak's.",
        cost: Cost::Run,
        variables: &[Variable::angle("flux_angle_rad")],
        check: |case| {
            let [angle] = case.values();
            let case = case.on(&KWON_TABLE_IV);
            let (slip, flux) = at_150_nm(&case);
            tracks(&case, &Steady::new(&case, 94.248, slip, flux, angle, 1e-4))
        },
    },
];

/// Slip and rotor flux at the current and slip that (30), (31) give for 150 Nm, in the quantities of the delta windings.
fn at_150_nm(case: &ClaimCase) -> (f64, f64) {
    let c = case.constants();
    let (current, slip) = (CurrentLaw::KWON.at(150.0) * core::f64::consts::SQRT_2, SlipLaw::KWON.at(150.0));
    (slip, c.eta_l_m * current / c.eta.hypot(slip))
}

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

fn condition_15_at_the_origin(case: &ClaimCase) -> Verdict {
    let [radius, a, b, c, d] = case.values();
    let constants = im_design::LinearMachine::from(case.machine()).constants::<f64>();
    let Ok(bound) = thau::paper_bound(&model::linear_part(&constants), &model::bilinear_input(&constants)) else {
        return Verdict::Outside;
    };
    let space = StateSpace::new(&case.parameters().windings(), case.machine().pole_pairs());
    // Points of the sphere; the two need not be far apart.
    let point = |a: f64, b: f64| -> [f64; 5] {
        let r = radius * bound.kappa * core::f64::consts::FRAC_1_SQRT_2;
        [a.cos() * b.cos(), a.sin() * b.cos(), b.sin() * a.cos(), b.sin() * a.sin() * 0.6, b.sin() * a.sin() * 0.8].map(|x| r * x)
    };
    let (x, y) = (point(a, b), point(c, d));
    let apart = x.iter().zip(&y).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt();
    let change = (space.u_2(&y.into(), 0.0) - space.u_2(&x.into(), 0.0)).norm();
    // At the origin itself both sides are zero.
    Verdict::at_most("‖Δu₂‖ over κ‖e‖", change, bound.kappa * apart + f64::MIN_POSITIVE)
}

/// The machine with an impressed current of the law's size at its slip, integrated here; the observer sees the mean voltage of (1).
fn first_study(case: &ClaimCase) -> Verdict {
    let [reached] = case.values();
    let case = case.on(&KWON_TABLE_IV);
    let (c, p) = (case.constants(), *case.parameters());
    let (j_m, d) = (p.inertia_kg_m2, p.viscous_friction_nm_s_per_rad);
    let coefficient_nm_s_per_rad = 150.0 / reached - d;
    let thau = match observer_of(&case, LoadTorqueModel::Proportional { coefficient_nm_s_per_rad }, FINE) {
        Ok(thau) => thau,
        Err(verdict) => return verdict,
    };
    let (current, slip) = (CurrentLaw::KWON.at(150.0) * core::f64::consts::SQRT_2, SlipLaw::KWON.at(150.0));
    // The current is there after 5 ms.
    let i = |t: f64, angle: f64| unit(angle) * (current * (t / 5e-3).min(1.0));
    let rates = |t: f64, (lambda, omega, angle): (C, f64, f64)| {
        let now = i(t, angle);
        let lambda_rate = lambda * C::new(-c.eta, c.n_p * omega) + now * c.eta_l_m;
        let load = (coefficient_nm_s_per_rad + d) * omega / j_m;
        (lambda_rate, c.mu * cross(lambda, now) - load, c.n_p * omega + slip)
    };
    let moved = |x: (C, f64, f64), k: (C, f64, f64), h: f64| (x.0 + k.0 * h, x.1 + k.1 * h, x.2 + k.2 * h);
    let (mut x, mut state, mut worst) = ((C::new(0.0, 0.0), 0.0, 0.0), Default::default(), 0.0f64);
    let h = FINE;
    for k in 0..(3.0 / h) as usize {
        let t = k as f64 * h;
        // The midpoint rule, of second order, is enough at 20 µs.
        let next = moved(x, rates(t + 0.5 * h, moved(x, rates(t, x), 0.5 * h)), h);
        let [before, after] = [i(t, x.2), i(t + h, next.2)];
        let linkage = (after - before) * c.sigma_l_s + (next.0 - x.0) * (c.beta * c.sigma_l_s);
        let u = linkage / h + (before + after) * (0.5 * p.stator_resistance_ohm);
        x = next;
        let e: Estimate<f64> = thau.step(&mut state, &Input::new(u, after));
        worst = worst.max((e.omega_m - x.1).abs());
    }
    Verdict::at_most("largest speed error over the speed reached", worst / reached, 0.1)
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
    tracks(case, &truth)
}

/// The observer from rest, with the estimated torque for the load, against a machine held at speed.
fn tracks(case: &ClaimCase, truth: &Steady) -> Verdict {
    let thau = match observer_of(case, LoadTorqueModel::EqualToTorque, 1e-4) {
        Ok(thau) => thau,
        Err(_) => return Verdict::Outside,
    };
    let mut worst = 0.0f64;
    let zero = C::new(0.0, 0.0);
    observer::run(&thau, truth, [zero, zero], 0.0, 22_000, |k, e| {
        if k > 20_000 {
            worst = worst.max((e.omega_m - truth.omega_m).abs());
        }
    });
    Verdict::at_most("speed error after 2 s over the speed", worst / truth.omega_m.abs(), 0.025)
}

fn is_kubota(case: &ClaimCase) -> Verdict {
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
    Verdict::at_most("largest difference of the speeds over the rated speed", apart / case.speed(), 1e-6)
}
