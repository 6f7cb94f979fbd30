//! The equations of Kenné et al., Sections II and III: each against the machine of `im-model`.

use im_control::kenne::switching_gain;
use im_model::space_vector::{cross, dot, j};
use im_model::{Plant, PlantInput, State};

use crate::claim::Origin::{Extends, Says};
use crate::claim::{C, Claim, ClaimCase, Cost, Found, Paper};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[
    Claim {
        number: 26,
        name: "kenne_8_as_printed",
        paper: Paper::Kenne,
        place: "Section III-A, (8)",
        origin: Says(
            "it follows that d²ω/dt² = −(k/m)T_e − n_pωμ((M/σL_sL_r)‖λ_r‖² + λ_rᵀi_s) + (mμ/σL_s)λ_rᵀJv_s − (α/m)dω/dt − (1/m)dT_L/dt",
        ),
        statement: "ω̈ = −(k/m)T_e − n_pωμ(M/(σL_sL_r)‖λ‖² + λᵀi) + (mμ/σL_s)λᵀJv − (α/m)ω̇ − Ṫ_L/m.",
        assumptions: "The model (1) to (3); any state and voltage, constant load.",
        found: Found::Fails { rate: 0.99 },
        finding: "The voltage term is +(μ/σL_s) λ × v: no m, and the other sign, since λᵀJv = −λ × v. (13) has the same m. Put right in claim 27.",
        cost: Cost::Equation,
        variables: &STATE,
        check: |case| {
            let m = case.parameters().inertia_kg_m2;
            speed_equation(case, |mu_over, cross| -m * mu_over * cross)
        },
    },
    Claim {
        number: 27,
        name: "kenne_13_without_the_m",
        paper: Paper::Kenne,
        place: "Section III-B, (13)",
        origin: Extends("the dynamics equations for the rotor speed and flux (8) and (11) become … + (mμ/σL_s)‖λ_r‖v_sq"),
        statement: "(13) holds with +(μ/σL_s)‖λ‖v_sq in place of its voltage term.",
        assumptions: "As claim 26.",
        found: Found::HoldsIf,
        finding: "Holds to rounding once the m of (13) is left out.",
        cost: Cost::Equation,
        variables: &STATE,
        check: |case| speed_equation(case, |mu_over, cross| mu_over * cross),
    },
    Claim {
        number: 28,
        name: "kenne_9_and_10",
        paper: Paper::Kenne,
        place: "Section III-A, (9), (10)",
        origin: Says("the following expression for the derivative of ‖λ_r‖² is obtained: (9) … summing them up, yields (10)"),
        statement: "The derivatives of ‖λ‖² and of iᵀλ.",
        assumptions: "As claim 26.",
        found: Found::Holds,
        finding: "Both hold to rounding.",
        cost: Cost::Equation,
        variables: &STATE,
        check: first_derivatives,
    },
    Claim {
        number: 29,
        name: "kenne_11_as_printed",
        paper: Paper::Kenne,
        place: "Section III-A, (11); (14), (21)",
        origin: Says(
            "the dynamic equation for the rotor flux containing the control input v_s is obtained as follows d²(‖λ_r‖²)/dt² = −2(R_r/L_r)[−d(‖λ_r‖²)/dt + M(−ki_sᵀλ_r + …)]",
        ),
        statement: "d²‖λ‖²/dt² = −2(R_r/L_r)[−d‖λ‖²/dt + M(d(iᵀλ)/dt)].",
        assumptions: "As claim 26.",
        found: Found::Fails { rate: 0.99 },
        finding: "The sign before the bracket must be +: (9) differentiated is 2(R_r/L_r)[−d‖λ‖²/dt + M d(iᵀλ)/dt]. (18), which the paper uses, is right.",
        cost: Cost::Equation,
        variables: &STATE,
        check: |case| flux_equation(case, -1.0),
    },
    Claim {
        number: 30,
        name: "kenne_11_with_its_sign_put_right",
        paper: Paper::Kenne,
        place: "Section III-A, (11); (14), (21)",
        origin: Extends("the dynamic equation for the rotor flux containing the control input v_s is obtained as follows"),
        statement: "(11) holds with +2(R_r/L_r) before the bracket.",
        assumptions: "As claim 26.",
        found: Found::HoldsIf,
        finding: "Holds to rounding.",
        cost: Cost::Equation,
        variables: &STATE,
        check: |case| flux_equation(case, 1.0),
    },
    Claim {
        number: 31,
        name: "kenne_18_and_19_keep_the_surfaces_still",
        paper: Paper::Kenne,
        place: "Section III-B, (18), (19)",
        origin: Says("where v̂_sq, v̂_sd are the unique solutions of ṡ_ω = 0 and ṡ_λr = 0, respectively"),
        statement: "v̂_sd and v̂_sq of (18), (19) are the solutions of ṡ_λ = 0 and ṡ_ω = 0.",
        assumptions: "Right parameters and flux, constant references and load.",
        found: Found::Holds,
        finding: "Both hold as printed, although (8) and (11), which they come from, do not.",
        cost: Cost::Equation,
        variables: &STATE,
        check: surfaces_stand_still,
    },
    Claim {
        number: 32,
        name: "kenne_25_and_26_enforce_sliding",
        paper: Paper::Kenne,
        place: "Section III-B, (24) to (26)",
        origin: Says(
            "In order to satisfy the sliding condition … despite uncertainties on f_j and b_j … one can easily show that the control discontinuity k_vsq and k_vsd in (15) and (16) must verify: (25), (26)",
        ),
        statement: "With k ≥ (F + η)/b_min + |1 − b_max/b_min||v̂|, ½ ds²/dt ≤ −η|s| whatever f and b are within their bounds.",
        assumptions: "v̂ made with a b̂ within [b_min, b_max].",
        found: Found::Holds,
        finding: "Holds, and is reached: with half the gain it does not (the mutation of this claim). With b̂ outside its bounds it may fail.",
        cost: Cost::Equation,
        variables: &[
            Variable::ratio("input_gain_least", 0.1, 10.0, 1.0),
            Variable::even("input_gain_range", 1.0, 4.0).simplest_at(1.0),
            Variable::even("input_gain_place", 0.0, 1.0),
            Variable::even("input_gain_of_the_law_place", 0.0, 1.0),
            Variable::even("model_bound", 0.0, 100.0).simplest_at(0.0),
            Variable::even("model_error_place", -1.0, 1.0),
            Variable::ratio("reach", 0.1, 100.0, 1.0),
            Variable::even("equivalent_v", -100.0, 100.0),
        ],
        check: gains_enforce_sliding,
    },
    Claim {
        number: 33,
        name: "kenne_27_is_the_second_derivative_of_the_current",
        paper: Paper::Kenne,
        place: "Section III-C1, (27)",
        origin: Says(
            "Using this assumption and differentiating (3) combined with (2), the following expression is obtained … d²i_s/dt² = f₀ + R_rf₁",
        ),
        statement: "d²i_s/dt² = f₀ + R_r f₁.",
        assumptions: "Assumption 2: speed and resistances constant. Any state, voltage and its derivative.",
        found: Found::Holds,
        finding: "Holds to rounding.",
        cost: Cost::Equation,
        variables: &STATE_27,
        check: |case| second_derivative(case, false),
    },
    Claim {
        number: 34,
        name: "kenne_27_while_the_speed_varies",
        paper: Paper::Kenne,
        place: "Section III-C1, (27); Section IV, end",
        origin: Extends(
            "Assumption 2 does not seem to be verified both in Fig. 1 and Fig. 2. This assumption is limited to steady states.",
        ),
        statement: "While the speed changes, which Assumption 2 excludes and the paper's simulations do, R_r from (27) is within 10 %.",
        assumptions: "The torque of the state accelerates the machine; rotor current from a fifth of the stator's on.",
        found: Found::Fails { rate: 0.24 },
        finding: "A changing speed adds −jβn_pω̇λ to (27), in the direction of f₁ in part: small machines of little inertia are off by more than \
                  10 % while they accelerate.",
        cost: Cost::Equation,
        variables: &STATE_27,
        check: |case| second_derivative(case, true),
    },
];

const STATE: [Variable; 8] = [
    Variable::even("flux_share", 0.2, 1.2).simplest_at(1.0),
    Variable::angle("flux_angle_rad"),
    Variable::even("current_share", 0.1, 2.0).simplest_at(1.0),
    Variable::angle("current_angle_rad"),
    Variable::even("speed_share", -1.2, 1.2).simplest_at(1.0),
    Variable::even("voltage_share", 0.1, 1.2).simplest_at(1.0),
    Variable::angle("voltage_angle_rad"),
    Variable::even("load_share", -1.0, 1.0),
];

const STATE_27: [Variable; 8] =
    [STATE[0], STATE[1], STATE[2], STATE[3], STATE[4], STATE[5], STATE[6], Variable::even("voltage_rate_per_s", -500.0, 500.0)];

/// A state with what drives it.
struct At {
    plant: Plant<f64>,
    x: State<f64>,
    u: C,
    load: f64,
}

impl At {
    fn of(case: &ClaimCase) -> (Self, f64) {
        let [flux, flux_angle, current, current_angle, speed, voltage, voltage_angle, last] = case.values();
        let c = case.constants();
        let psi_r = C::from_polar(flux * case.rating().rotor_flux_vs, flux_angle);
        let i = C::from_polar(current * case.current(), current_angle);
        let psi_s = i * c.sigma_l_s + psi_r * (c.beta * c.sigma_l_s);
        let x = State { psi_s, psi_r, omega_m: speed * case.speed(), ..State::default() };
        let u = C::from_polar(voltage * case.rating().phase_voltage_peak_v, voltage_angle);
        (Self { plant: Plant::new(case.machine()), x, u, load: last * case.rating().torque_nm }, last)
    }

    fn rates(&self, x: &State<f64>) -> State<f64> {
        self.plant.evaluate(x, &PlantInput::new(self.u, self.load)).rates
    }

    /// The derivative along the flow of something quadratic in the state: its central difference has no error but rounding.
    fn along(&self, g: impl Fn(&State<f64>) -> f64) -> f64 {
        let f = self.rates(&self.x);
        let h = 1e-4;
        let moved = |h: f64| State {
            psi_s: self.x.psi_s + f.psi_s * h,
            psi_r: self.x.psi_r + f.psi_r * h,
            omega_m: self.x.omega_m + f.omega_m * h,
            ..self.x
        };
        (g(&moved(h)) - g(&moved(-h))) / (2.0 * h)
    }
}

/// |left − right| over the sizes of the terms.
fn balance(what: &str, left: f64, terms: &[f64]) -> Verdict {
    let right: f64 = terms.iter().sum();
    let size = left.abs() + terms.iter().map(|t| t.abs()).sum::<f64>();
    // Rounding through currents, which are small differences of fluxes, and differences.
    Verdict::at_most(what, (left - right).abs() / size, 1e-7)
}

/// ω̈ with a voltage term made of μ/σL_s and λ × v.
fn speed_equation(case: &ClaimCase, voltage_term: impl Fn(f64, f64) -> f64) -> Verdict {
    let (at, _) = At::of(case);
    let (c, p) = (case.constants(), case.parameters());
    let m = p.inertia_kg_m2;
    let k = p.stator_resistance_ohm / c.sigma_l_s + p.rotor_resistance_ohm / (c.sigma * p.rotor_inductance_h());
    let (lambda, i) = (at.x.psi_r, at.plant.currents(&at.x).i_s);
    let torque = m * c.mu * cross(lambda, i);
    let second = at.along(|x| at.rates(x).omega_m);
    let alpha = p.viscous_friction_nm_s_per_rad;
    let terms = [
        -k / m * torque,
        -c.n_p * at.x.omega_m * c.mu * (c.beta * lambda.norm_sqr() + dot(lambda, i)),
        voltage_term(c.mu / c.sigma_l_s, cross(lambda, at.u)),
        -alpha / m * at.rates(&at.x).omega_m,
    ];
    balance("imbalance of ω̈", second, &terms)
}

/// d(iᵀλ)/dt by (10), term by term.
fn product_rate(case: &ClaimCase, at: &At) -> [f64; 5] {
    let (c, p) = (case.constants(), case.parameters());
    let k = p.stator_resistance_ohm / c.sigma_l_s + p.rotor_resistance_ohm / (c.sigma * p.rotor_inductance_h());
    let (lambda, i) = (at.x.psi_r, at.plant.currents(&at.x).i_s);
    [
        -k * dot(i, lambda),
        c.eta_l_m * i.norm_sqr(),
        c.beta * c.eta * lambda.norm_sqr(),
        c.n_p * at.x.omega_m * cross(lambda, i),
        dot(lambda, at.u) / c.sigma_l_s,
    ]
}

fn first_derivatives(case: &ClaimCase) -> Verdict {
    let (at, _) = At::of(case);
    let c = case.constants();
    let i = |x: &State<f64>| at.plant.currents(x).i_s;
    let squared = at.along(|x| x.psi_r.norm_sqr());
    let nine = [-2.0 * c.eta * at.x.psi_r.norm_sqr(), 2.0 * c.eta_l_m * dot(i(&at.x), at.x.psi_r)];
    let product = at.along(|x| dot(i(x), x.psi_r));
    balance("imbalance of (9)", squared, &nine).and(balance("imbalance of (10)", product, &product_rate(case, &at)))
}

fn flux_equation(case: &ClaimCase, sign: f64) -> Verdict {
    let (at, _) = At::of(case);
    let c = case.constants();
    let rate = |x: &State<f64>| 2.0 * dot(x.psi_r, at.rates(x).psi_r);
    let second = at.along(rate);
    let mut terms = vec![-sign * 2.0 * c.eta * rate(&at.x)];
    terms.extend(product_rate(case, &at).map(|t| sign * 2.0 * c.eta_l_m * t));
    balance("imbalance of d²‖λ‖²/dt²", second, &terms)
}

fn surfaces_stand_still(case: &ClaimCase) -> Verdict {
    let (at, _) = At::of(case);
    let (p, c) = (case.parameters(), case.constants());
    let w = p.windings();
    let [k_0, k_1, k_2, k_3, k_4, k_5, k_6, k_7] = w.kenne(case.machine().pole_pairs()).k;
    let (m, alpha, m_big, r_r) =
        (w.inertia_kg_m2, w.viscous_friction_nm_s_per_rad, w.mutual_inductance_h, w.rotor_resistance_ohm);
    let (c_omega, c_lambda) = (15.0, 10.0);
    let (lambda, i, omega) = (at.x.psi_r, at.plant.currents(&at.x).i_s, at.x.omega_m);
    let (flux, x, torque) = (lambda.norm(), dot(lambda, i), m * c.mu * cross(lambda, i));
    let v_d = k_7 / flux
        * ((c_lambda - 2.0 * c.eta) * (flux * flux - m_big * x)
            + k_2 * x
            + r_r * (k_3 * x - k_4 * i.norm_sqr() - k_5 * flux * flux)
            - omega * k_6 * torque);
    let v_q = k_0 / flux
        * ((alpha / m - c_omega) * (torque - alpha * omega - at.load)
            + (k_2 + r_r * k_3) / m_big * torque
            + c.n_p * omega * m * c.mu * (k_1 * flux * flux + x));
    // (12): along the flux and across it.
    let at = At { u: (lambda + j(lambda) * (v_q / v_d)) * (v_d / flux), ..at };
    let omega_rate = at.rates(&at.x).omega_m;
    let speed = at.along(|x| at.rates(x).omega_m);
    let rate = |x: &State<f64>| 2.0 * dot(x.psi_r, at.rates(x).psi_r);
    // The sizes that cancel are those without v̂.
    let size_q = c.mu / c.sigma_l_s * flux * v_q.abs() + c_omega * omega_rate.abs();
    let size_d = 2.0 * c.eta_l_m / c.sigma_l_s * flux * v_d.abs() + c_lambda * rate(&at.x).abs();
    Verdict::at_most("ṡ_ω over its terms", (speed + c_omega * omega_rate).abs() / size_q, 1e-6).and(Verdict::at_most(
        "ṡ_λ over its terms",
        (at.along(rate) + c_lambda * rate(&at.x)).abs() / size_d,
        1e-6,
    ))
}

fn gains_enforce_sliding(case: &ClaimCase) -> Verdict {
    let [b_min, range, place, law_place, bound, error_place, reach, v_hat] = case.values();
    let b = [b_min, b_min * range];
    let within = |place: f64| b_min * (1.0 + (range - 1.0) * place);
    let (b_true, b_law) = (within(place), within(law_place));
    let k: f64 = switching_gain(bound, reach, b, v_hat);
    // ṡ = f + b v, v = v̂ − k sign s, v̂ = −f̂/b̂, f = f̂ + error.
    let rate = |sign: f64| -v_hat * b_law + error_place * bound + b_true * (v_hat - k * sign);
    let slowest = (-rate(1.0)).min(rate(-1.0));
    Verdict::at_least("reaching speed over η", slowest / reach, 1.0 - 1e-9)
}

fn second_derivative(case: &ClaimCase, accelerating: bool) -> Verdict {
    let (at, voltage_rate) = At::of(case);
    let (p, c) = (case.parameters(), case.constants());
    // Per second of rated voltage in the direction of the voltage's normal: any.
    let du = j(at.u) * voltage_rate;
    let k = p.windings().kenne(case.machine().pole_pairs());
    let ([beta_1, beta_2, beta_3], [gamma_1, gamma_2, gamma_3, gamma_4]) = (k.beta, k.gamma);
    let first = State { omega_m: at.x.omega_m, ..at.rates(&at.x) };
    // The equations are linear in the fluxes: at constant speed the second derivative is the equation of motion of the first.
    let second = at.plant.evaluate(&first, &PlantInput::new(du, 0.0)).rates;
    let currents = |x: &State<f64>| at.plant.currents(x);
    let (i, di, mut ddi) = (currents(&at.x).i_s, currents(&first).i_s, currents(&second).i_s);
    if accelerating {
        let rate = (p.inertia_kg_m2 * c.mu * cross(at.x.psi_r, i)) / p.inertia_kg_m2;
        ddi -= j(at.x.psi_r) * (c.beta * c.n_p * rate);
    }
    let r_s = p.stator_resistance_ohm;
    let f_0 = (du - di * r_s) * gamma_1 + j(i * beta_2 + at.u * beta_3 + di * beta_1) * at.x.omega_m;
    let f_1 = at.u * gamma_2 - i * gamma_3 - di * gamma_4;
    if !accelerating {
        let size = ddi.norm() + f_0.norm() + (f_1 * p.rotor_resistance_ohm).norm() + gamma_1 * du.norm();
        let off = ddi - f_0 - f_1 * p.rotor_resistance_ohm;
        return Verdict::at_most("imbalance of (27)", off.norm() / size, 1e-9);
    }
    // Where the rotor carries current that turns with the supply.
    if currents(&at.x).i_r.norm() < 0.2 * i.norm() {
        return Verdict::Outside;
    }
    let estimate = dot(f_1, ddi - f_0) / f_1.norm_sqr();
    Verdict::at_most("error of R_r from (27)", (estimate / p.rotor_resistance_ohm - 1.0).abs(), 0.1)
}
