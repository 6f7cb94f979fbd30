//! Kubota's adaptive observer (Kwon et al., Section III), through the code of `im-observers`.

use im_design::DesignModel;
use im_design::kubota::{KubotaDesign, KubotaRequest, closed_form};
use im_design::matrix::Matrix;
use im_model::Bound;
use im_model::space_vector::{cross, dot, unit};
use im_observers::{Basis, Discretization, Input, Kubota, KubotaGains, Observer};

use super::PERFORM_WELL;
use crate::claim::Origin::{Extends, Says};
use crate::claim::{C, Claim, ClaimCase, Cost, Found, Paper};
use crate::properties::{Steady, observer};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[
    Claim {
        number: 2,
        name: "kubota_3_is_feasible",
        paper: Paper::Kwon,
        place: "Section III, (3)",
        origin: Says(
            "Kubota et al. [1] next postulate selecting L_r so that (A_r − L_rC_r)ᵀ + (A_r − L_rC_r) < 0 … sufficiency conditions for the existence of the gain matrix L_r such that (3) is satisfied is not discussed in their paper and appears to be unknown",
        ),
        statement: "There is a gain L_r with (A_r − L_rC_r)ᵀ + (A_r − L_rC_r) < 0; conditions for it \"appear to be unknown\".",
        assumptions: "Any machine, any speed.",
        found: Found::Holds,
        finding: "Always: l₁ = ηL_m + β(η + jn_pω) makes the matrix diag(−2η, −2η, −2γ, −2γ). No gain does better than −2η on the fluxes.",
        cost: Cost::Run,
        variables: &[Variable::even("speed_share", -1.2, 1.2)],
        check: condition_3_is_feasible,
    },
    Claim {
        number: 3,
        name: "kubota_v_falls_for_any_error",
        paper: Paper::Kwon,
        place: "Section III, (4), (5)",
        origin: Extends("Kubota et al. [1] assume, without stating this explicitly, that λ_ar n_p λ̂_br = λ_br n_p λ̂_ar"),
        statement: "With ω̂' = α n_pβ(e_a λ̂_b − e_b λ̂_a) and (3), V = eᵀe + Δω²/α has V̇ = −eᵀQe ≤ 0.",
        assumptions: "Constant speed, any error; (5), λ_aλ̂_b = λ̂_aλ_b, which the paper names as a silent assumption, is not assumed.",
        found: Found::Fails { rate: 0.028 },
        finding: "V̇ has the term 2n_pΔω(λ × λ̂) besides, which (5) assumes away. Without a current error V grows wherever \
                  this is positive and more than 2η|λ − λ̂|²: a lag of the flux and a speed error are enough. Holds under (5): claim 4.",
        cost: Cost::Equation,
        variables: &ERRORS,
        check: |case| v_falls(case, false),
    },
    Claim {
        number: 4,
        name: "kubota_v_falls_where_fluxes_are_collinear",
        paper: Paper::Kwon,
        place: "Section III, after (5)",
        origin: Says(
            "then d/dt V(e, Δω) = −eᵀQe ≤ 0 in the augmented [e, Δω]-space. Recall that the adaptive scheme was obtained under the assumption that ω is constant.",
        ),
        statement: "With ω̂' = α n_pβ(e_a λ̂_b − e_b λ̂_a) and L_r of (3), V = eᵀe + Δω²/α has V̇ = −eᵀQe ≤ 0.",
        assumptions: "The paper's: constant speed, and (5), λ_aλ̂_b = λ̂_aλ_b: the fluxes have one direction, their sizes differ.",
        found: Found::Holds,
        finding: "Holds, with the sign i − î of the correction that (2) needs and the summary misprints. A speed error turns λ̂ away from λ \
                  at once, so that (5) does not last: claim 3.",
        cost: Cost::Equation,
        variables: &ERRORS,
        check: |case| v_falls(case, true),
    },
    Claim {
        number: 5,
        name: "kubota_errors_decay_at_the_certified_rate",
        paper: Paper::Kwon,
        place: "Section III, (2), (3)",
        origin: Extends("V(e) = eᵀe is a Lyapunov function for the system ė = (A_r − L_rC_r)e"),
        statement: "The same in sampled time and with a rate: with L_r of (3) and the true speed ‖e‖_P falls like e^(−αt).",
        assumptions: "ω̂ = ω; P = diag(β², β², 1, 1), α = η/2; sampled at 100 µs. A wrong flux at the start, in any direction.",
        found: Found::Holds,
        finding: "Holds in sampled time too: the observer's discretization keeps the certificate at any step.",
        cost: Cost::Run,
        variables: &[
            Variable::even("speed_share", -1.2, 1.2).simplest_at(1.0),
            Variable::even("slip_share", -1.5, 1.5).simplest_at(0.0),
            Variable::even("flux_error_share", 0.02, 0.3).simplest_at(0.1),
            Variable::angle("flux_error_angle_rad"),
        ],
        check: errors_decay,
    },
    Claim {
        number: 6,
        name: "kubota_speed_converges_without_feedback",
        paper: Paper::Kwon,
        place: "Section III, summary; Section XI",
        origin: Extends(PERFORM_WELL),
        statement: "Without feedback, L_r = 0, the observer with the PI law finds speed and flux.",
        assumptions: "Constant speed up to 40 % of rated, any quadrant, ω_e beyond 2 % of rated; L_r = 0, which (3) excludes but at low speed. \
                      From 5 % of speed and 3° of flux.",
        found: Found::Fails { rate: 0.006 },
        finding: "Fails when regenerating at low frequency, 0 < ω_e/(n_pω) < (R_s/σL_s)/(γ + η), where the linearized loop is unstable \
                  for any gains of the PI law. Claim 7 has a gain without such a region.",
        cost: Cost::Run,
        variables: &QUADRANTS,
        check: |case| {
            converges(case, |case| {
                let (p, i) = KubotaGains::speed_law(case.machine(), case.rating(), 400.0);
                Ok(KubotaGains::without_feedback(p, i))
            })
        },
    },
    Claim {
        number: 7,
        name: "kubota_speed_converges_with_the_stabilized_gain",
        paper: Paper::Kwon,
        place: "Section III, summary; Section XI",
        origin: Extends(PERFORM_WELL),
        statement: "With a gain L_r made for the loop with the speed law, the observer finds speed and flux.",
        assumptions: "As claim 6, with l₁ = ((η + jn_pω)/ρ − R_s/σL_s)/β, ρ = 0.3, faded where the current error is large.",
        found: Found::HoldsIf,
        finding: "Holds at every speed and load tried, but for ω_e = 0, where no observer of this kind sees the speed.",
        cost: Cost::Run,
        variables: &QUADRANTS,
        check: |case| converges(case, |case| KubotaGains::for_machine(case.machine(), case.rating()).map_err(|e| e.to_string())),
    },
    Claim {
        number: 63,
        name: "kubota_loop_with_a_gain_of_3_has_no_growing_mode",
        paper: Paper::Kwon,
        place: "Section III, (3), summary; Section XI",
        origin: Extends(PERFORM_WELL),
        statement: "With an L_r of (3) the loop of observer and PI law, linearized, has no positive real pole.",
        assumptions: "L_r in closed form (claim 2), constant speed up to a tenth of the rated, ω_e/(n_pω) from −0.5 to 1.5; K_P and K_I drop out.",
        found: Found::Fails { rate: 0.45 },
        finding: "The constant term of the characteristic polynomial has the sign of ω_e((γ + η)ω_e − γn_pω): there is a positive real pole for \
                  0 < ω_e/(n_pω) < γ/(γ + η), 0.98 on Jadot's machine against 0.63 with L_r = 0, and nowhere else. (3) is not the reason: it \
                  admits gains without such a region, l₁ = β(η + jn_pω) − R_s/(βσL_s) where γ < 4ηβ².",
        cost: Cost::Equation,
        variables: &LOW_FREQUENCY,
        check: |case| no_growing_mode(case, |c, omega| C::new(c.eta_l_m + c.beta * c.eta, c.beta * c.n_p * omega)),
    },
    Claim {
        number: 64,
        name: "kubota_loop_with_another_gain_of_3_has_no_growing_mode",
        paper: Paper::Kwon,
        place: "Section III, (3), summary; Section XI",
        origin: Extends(PERFORM_WELL),
        statement: "The same with l₁ = β(η + jn_pω) − R_s/(βσL_s), which satisfies (3), too.",
        assumptions: "As claim 63; γ < 4ηβ², as on all machines tried.",
        found: Found::HoldsIf,
        finding: "Holds: the constant term has the sign of ω_e².",
        cost: Cost::Equation,
        variables: &LOW_FREQUENCY,
        check: |case| {
            let (c, r_s) = (case.constants(), case.parameters().stator_resistance_ohm);
            // (3) on the fluxes and currents: 4ηγ > |ηL_m − l₁ + β(η + jn_pω)|² = (γ/β)².
            if 4.0 * c.eta * c.beta * c.beta <= c.gamma {
                return Verdict::Outside;
            }
            no_growing_mode(case, |c, omega| C::new(c.eta, c.n_p * omega) * c.beta - r_s / (c.beta * c.sigma_l_s))
        },
    },
];

const LOW_FREQUENCY: [Variable; 2] = [
    Variable::even("speed_share", -0.1, 0.1).simplest_at(0.05),
    Variable::even("frequency_over_speed", -0.5, 1.5).simplest_at(0.5),
];

const ERRORS: [Variable; 7] = [
    Variable::even("speed_share", -1.2, 1.2).simplest_at(1.0),
    Variable::even("slip_share", -1.5, 1.5).simplest_at(0.0),
    Variable::even("flux_error_share", 0.0, 0.5).simplest_at(0.0),
    Variable::angle("flux_error_angle_rad"),
    Variable::even("current_error_share", 0.0, 0.5).simplest_at(0.0),
    Variable::angle("current_error_angle_rad"),
    Variable::even("speed_error_share", -0.3, 0.3).simplest_at(0.0),
];

const QUADRANTS: [Variable; 2] =
    [Variable::even("speed_share", -0.4, 0.4).simplest_at(0.4), Variable::even("slip_share", -1.5, 1.5).simplest_at(0.0)];

/// The gain of (3) over the speeds of a machine.
fn gain(case: &ClaimCase, rate_per_s: f64, flux_weight: f64) -> Result<KubotaDesign, im_design::DesignError> {
    let top = 1.3 * case.speed();
    let request = KubotaRequest { speed_rad_s: [-top, top], rate_per_s, flux_weight };
    Ok(closed_form(DesignModel::Machine(case.machine().into()), &request)?.0)
}

fn condition_3_is_feasible(case: &ClaimCase) -> Verdict {
    let [speed] = case.values();
    let c = case.constants();
    let design = match gain(case, 0.5 * c.eta, 1.0) {
        Ok(design) => design,
        Err(e) => return Verdict::refused(e),
    };
    let error = design.error_matrix(&im_design::LinearMachine::from(case.machine()).constants::<f64>(), speed * case.speed());
    let largest = *im_design::linalg::symmetric_eigenvalues(&error.plus_transpose()).last().unwrap_or(&f64::NAN);
    Verdict::at_least("least decay over 2η", -largest / (2.0 * c.eta), 1.0 - 1e-6)
}

/// V̇ from the observer's own steps, against −eᵀQe. A step of forward Euler is h times the rates at its beginning: nothing is lost.
fn v_falls(case: &ClaimCase, collinear: bool) -> Verdict {
    let [speed, slip, flux_error, flux_angle, current_error, current_angle, speed_error] = case.values();
    const H: f64 = 1e-6;
    let (c, r) = (case.constants(), case.rating());
    let omega = speed * case.speed();
    let truth = Steady::new(case, omega, slip * case.slip(), r.rotor_flux_vs, 0.3, H);
    // In the direction of the flux, or in any.
    let direction = if collinear { C::new(flux_angle.cos().signum(), 0.0) } else { unit(flux_angle) };
    let e = [truth.flux(0) * direction * flux_error, unit(current_angle) * current_error * case.current()];
    let before = omega + speed_error * case.speed();
    // The gain of (3), in closed form (claim 2).
    let l = C::new(c.eta_l_m + c.beta * c.eta, c.beta * c.n_p * omega);
    // Of the size of a drive's: rated current in error moves ω̂ by ten times the rated speed a second.
    let alpha = 10.0 * case.speed() / (c.n_p * c.beta * r.rotor_flux_vs * case.current());
    // The correction Le is linear and is added below: at a wrong ω̂ this gain, fixed at the true ω, is beyond any step limit.
    let gains = KubotaGains::without_feedback(0.0, alpha);
    let euler = Discretization::ForwardEuler;
    let observer = match Basis::try_new(case.machine(), r, H).and_then(|b| Kubota::discretized(b, gains, euler)) {
        Ok(observer) => observer,
        Err(e) => return Verdict::refused(e),
    };
    let mut state = observer.state_at(truth.flux(0) - e[0], truth.current(0) - e[1], before);
    // The first sample makes ω̂'; the second the other rates at the same state.
    let x = observer.step(&mut state, &truth.input(1));
    let y = observer.step(&mut state, &Input::new(truth.voltage_now(1), truth.current(1)));
    let omega_rate = (x.omega_m - before) / H;
    let flux_rate = (y.rotor_flux_vs - x.rotor_flux_vs) / H + l * x.residual_a;
    let current_rate = (x.residual_a - y.residual_a) / H;
    let (e_flux, e_i, delta) = (truth.flux(1) - x.rotor_flux_vs, x.residual_a, x.omega_m - omega);
    let turning = C::new(0.0, truth.omega_e);
    // (4), term by term.
    let terms = [
        2.0 * dot(e_flux, turning * truth.flux(1) - flux_rate),
        2.0 * dot(e_i, turning * truth.current(1) - current_rate),
        2.0 * delta * omega_rate / alpha,
    ];
    let promised = -2.0 * c.eta * e_flux.norm_sqr() - 2.0 * c.gamma * e_i.norm_sqr();
    let rate: f64 = terms.iter().sum();
    // Rounding of the differences over H.
    let size = terms.iter().map(|t| t.abs()).sum::<f64>()
        + 1e-14 / H * (e_i.norm() * truth.current(1).norm() + e_flux.norm() + delta.abs() * omega.abs() / alpha);
    if collinear {
        // The first sample turns λ̂ away a little: what (5) assumes away comes in with that.
        let off = 2.0 * c.n_p * delta * cross(truth.flux(1), x.rotor_flux_vs);
        return Verdict::at_most("|V̇ + eᵀQe| over rounding", (rate - promised).abs(), 1.01 * off.abs() + 1e-6 * size + 1e-9);
    }
    let v = e_flux.norm_sqr() + e_i.norm_sqr() + delta * delta / alpha;
    Verdict::at_most("growth of V, 1/s", rate / v, 0.01)
}

/// Sampling time of runs, s.
const STEP: f64 = 1e-4;

fn errors_decay(case: &ClaimCase) -> Verdict {
    let [speed, slip, size, angle] = case.values();
    let (c, r) = (case.constants(), case.rating());
    let rate = 0.5 * c.eta;
    let observer = gain(case, rate, c.beta * c.beta).map_err(|e| e.to_string()).and_then(|d| {
        // A speed law so weak that ω̂ stays where it is put.
        let gains = KubotaGains {
            gain: rows(&d.gain),
            gain_per_speed: rows(&d.gain_per_speed),
            proportional: 0.0,
            integral: Bound::SMALLEST,
            fade_a: 0.0,
        };
        let basis = Basis::try_new(case.machine(), r, STEP);
        basis.and_then(|b| Kubota::try_new(b, gains)).map_err(|e| e.to_string())
    });
    let observer = match observer {
        Ok(observer) => observer,
        Err(e) => return Verdict::refused(e),
    };
    let truth = Steady::new(case, speed * case.speed(), slip * case.slip(), r.rotor_flux_vs, 0.0, STEP);
    let start = [truth.flux(0) + unit(angle) * (size * r.rotor_flux_vs), truth.current(0)];
    let begin = size * r.rotor_flux_vs;
    // A mean voltage in place of a turning one: (hω_e)²/12 of the flux.
    let floor = 2e-3 * r.rotor_flux_vs;
    let mut worst = 0.0f64;
    observer::run(&observer, &truth, start, truth.omega_m, (2.0 / rate / STEP).min(20_000.0) as usize, |k, e| {
        let norm = (truth.flux(k) - e.rotor_flux_vs).norm().hypot(e.residual_a.norm() / c.beta);
        worst = worst.max(norm / (begin * (-rate * STEP * k as f64).exp() + floor));
    });
    Verdict::at_most("‖e‖_P over what the rate allows", worst, 1.0)
}

fn converges(case: &ClaimCase, gains: impl Fn(&ClaimCase) -> Result<KubotaGains, String>) -> Verdict {
    let [speed, slip] = case.values();
    let truth = Steady::new(case, speed * case.speed(), slip * case.slip(), case.rating().rotor_flux_vs, 0.0, STEP);
    if truth.omega_e.abs() < 0.02 * 2.0 * core::f64::consts::PI * case.rating().electrical_frequency_hz {
        return Verdict::Outside;
    }
    let basis = Basis::try_new(case.machine(), case.rating(), STEP).map_err(|e| e.to_string());
    match basis.and_then(|b| gains(case).and_then(|g| Kubota::try_new(b, g).map_err(|e| e.to_string()))) {
        Ok(o) => observer::speed_converges(&o, &truth, 0.05, 0.05 * case.speed(), 4.0, 0.02 * case.speed()),
        Err(e) => Verdict::refused(e),
    }
}

/// Whether the loop, linearized in the frame of the flux, has a positive real pole: det(−A) < 0. A is that of e_λ, e_i and ∫ε with l₂ = 0,
/// written down here anew, for K_P = 0 and K_I = 1, which change the determinant by a positive factor only.
fn no_growing_mode(case: &ClaimCase, gain: impl Fn(&im_model::DerivedConstants<f64>, f64) -> C) -> Verdict {
    let [speed, frequency] = case.values();
    let (c, omega) = (case.constants(), speed * case.speed());
    let (w, lambda) = (c.n_p * omega, case.rating().rotor_flux_vs);
    let omega_e = w * frequency;
    let (turning, a) = (C::new(0.0, omega_e), C::new(c.eta, -w));
    // e_λ' = −(a + jω_e)e_λ + (ηL_m − l₁)e_i − jn_pλΔω,   e_i' = βa e_λ − (γ + jω_e)e_i + jn_pβλΔω,   Δω = ∫ε,   ε = −n_pβλ × e_i
    let blocks = [[-(a + turning), -gain(&c, omega) + c.eta_l_m], [a * c.beta, -(turning + c.gamma)]];
    let mut m = [[0.0; 5]; 5];
    for (k, row) in blocks.iter().enumerate() {
        for (l, z) in row.iter().enumerate() {
            (m[2 * k][2 * l], m[2 * k][2 * l + 1], m[2 * k + 1][2 * l], m[2 * k + 1][2 * l + 1]) = (-z.re, z.im, -z.im, -z.re);
        }
    }
    m[1][4] = c.n_p * lambda;
    m[3][4] = -c.n_p * c.beta * lambda;
    m[4][3] = c.n_p * c.beta * lambda;
    let d = (turning + a) * (turning + c.gamma) - a * c.beta * blocks[0][1];
    // |D|ω_e is what the determinant is at most, but for the levers.
    let size = (c.n_p * c.beta * lambda).powi(2) * d.norm() * omega_e.abs();
    Verdict::at_most("1 − det(−A) over its size", 1.0 - super::determinant(m) / size, 1.0 + 1e-9)
}

fn rows<const R: usize>(m: &Matrix<f64>) -> [[f64; 2]; R] {
    core::array::from_fn(|r| [m[(r, 0)], m[(r, 1)]])
}
