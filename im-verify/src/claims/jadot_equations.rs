//! The equations of Jadot et al., Sections II to V: each against the machine of `im-model` and the laws of `im-identify`.

use im_identify::online::{Lambda, RegulationParameters, relative_sensitivity, steady_regressor};
use im_model::space_vector::{dot, j};
use im_model::{Machine, Plant, PlantInput, State};

use crate::claim::Origin::{Extends, Says};
use crate::claim::{C, Claim, ClaimCase, Cost, Found, Paper};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[
    Claim {
        number: 44,
        name: "jadot_5_in_any_frame",
        paper: Paper::Jadot,
        place: "Section II, (1) to (6)",
        origin: Says("In those variables, (2) is rewritten as (5)"),
        statement: "In the variables i_s and φ_r = (L_m/L_r)ψ_r, in a frame at ω_s, the machine is (5).",
        assumptions: "Linear magnetics. Any state, voltage and frame.",
        found: Found::Holds,
        finding: "Holds to rounding.",
        cost: Cost::Equation,
        variables: &STATE,
        check: five_in_any_frame,
    },
    Claim {
        number: 45,
        name: "jadot_four_parameters_are_enough",
        paper: Paper::Jadot,
        place: "Section II, after (4), (7)",
        origin: Says("the dependence of the design in unknown parameters can be reduced to four independent parameters"),
        statement: "The five electrical parameters act through four, R_req, L, R_s, L_f.",
        assumptions: "Two T circuits of the same four, with other shares of stator and rotor leakage. Any state and voltage.",
        found: Found::Holds,
        finding: "Holds to rounding: the split of the leakages does not show at the terminals.",
        cost: Cost::Equation,
        variables: &STATE,
        check: four_are_enough,
    },
    Claim {
        number: 46,
        name: "jadot_16_is_globally_stable",
        paper: Paper::Jadot,
        place: "Section III-B, (16)",
        origin: Says("The desired equilibrium is globally asymptotically stable."),
        statement: "With currents at their set points flux, speed and integral converge from any start.",
        assumptions: "Any k_p, k_i > 0, given as bandwidth and damping; flux errors up to twice the flux, speed errors to 20 % of rated.",
        found: Found::Holds,
        finding: "Holds. The flux error obeys e' = −(T_r⁻¹ + jω_g)e whatever the slip, so that it falls as e^(−t/T_r) and then leaves the speed loop \
                  alone. The sign of jk_p in (16) is misprinted: ω_g = −k_p(Δω + ξ).",
        cost: Cost::Run,
        variables: &[
            Variable::ratio("bandwidth_rad_s", 3.0, 50.0, 10.0),
            Variable::even("damping", 0.4, 1.5).simplest_at(1.0),
            Variable::even("flux_error", 0.0, 2.0).simplest_at(0.0),
            Variable::angle("flux_error_angle_rad"),
            Variable::even("speed_error_share", -0.2, 0.2),
            Variable::even("load_share", -0.8, 0.8),
        ],
        check: current_fed_machine,
    },
    Claim {
        number: 47,
        name: "jadot_24_is_the_rate_of_the_storage_function",
        paper: Paper::Jadot,
        place: "Section III-C, (22) to (24)",
        origin: Says(
            "achieves strict passivity from v_s to Δi_s, as shown by the storage function V = ½|Δφ_r|² + (λ/2)L_f|Δi_s|² which satisfies V̇ = −T_r⁻¹|Δφ_r|² − λ[R_s + R_req]|Δi_s|² + λ⟨Δi_s, v_s⟩",
        ),
        statement: "V = ½|Δφ|² + (λ/2)L_f|Δi|² has V̇ = −T_r⁻¹|Δφ|² − λ(R_s + R_req)|Δi|² + λ⟨Δi, v_s⟩: passive from v_s to Δi.",
        assumptions: "Right parameters, λ constant. Any state, reference, speed and v_s; v_r by the code of im-identify.",
        found: Found::Holds,
        finding: "Holds to rounding, at any speed.",
        cost: Cost::Equation,
        variables: &ERRORS,
        check: storage_function,
    },
    Claim {
        number: 48,
        name: "jadot_23_with_the_lambda_of_section_v",
        paper: Paper::Jadot,
        place: "Section V-C",
        origin: Extends(
            "The control gain λ in (22) is chosen as λ = (R_req/L_f)√(T_r⁻² + ω_r²). … (Note the state-dependent scaling of the gains, whereas the Lyapunov functions used in the convergence analysis require constant gains)",
        ),
        statement: "With the λ of Section V-C as printed, which follows the speed, V of (23) still falls. (The paper asks for constant gains.)",
        assumptions: "v_s = 0. The speed changes, by up to the acceleration that three times the rated torque gives.",
        found: Found::Fails { rate: 0.035 },
        finding: "A λ that follows the speed adds ½λ̇L_f|Δi|² to V̇, which outweighs the decay while a machine of little inertia is accelerated \
                  hard at low speed; with the unit put right, R_req/√(T_r⁻² + ω_r²), while it is braked. With λ constant: claim 47.",
        cost: Cost::Equation,
        variables: &[
            Variable::even("speed_share", -1.0, 1.0).simplest_at(0.0),
            Variable::even("acceleration_share", -3.0, 3.0).simplest_at(0.0),
            Variable::even("flux_error_share", 0.0, 1.0).simplest_at(0.0),
            Variable::even("current_error_share", 0.1, 1.0).simplest_at(1.0),
        ],
        check: scheduled_lambda,
    },
    Claim {
        number: 49,
        name: "jadot_48_as_printed",
        paper: Paper::Jadot,
        place: "Section IV-B, (48), (49)",
        origin: Says(
            "as shown with the Lyapunov function V = ½|Δz|² + (λL_f/2)|Δi_s|² + (λ/2)(Δθ)ᵀK_W⁻¹Δθ + (λ/2K_I)|η|² whose time-derivative satisfies V̇ = −T_r⁻¹|Δz|² − λ[R_s + R_req + K_P]|Δi_s|²",
        ),
        statement: "With (25), V + (λ/2K_I)|η|² has V̇ = −T_r⁻¹|Δz|² − λ(R_s + R_req + K_P)|Δi|².",
        assumptions: "Right parameters, so that Δz = Δφ; K_P, K_I of a current loop of 100 to 1000 rad/s.",
        found: Found::Fails { rate: 0.99 },
        finding: "The cross term λ(1 − K_P)⟨Δi, η⟩ is left over, and V may grow. The last term must be λK_P/(2K_I)|η|²: claim 50.",
        cost: Cost::Equation,
        variables: &ERRORS,
        check: |case| integral_storage(case, |_| 1.0),
    },
    Claim {
        number: 50,
        name: "jadot_48_with_k_p_in_its_last_term",
        paper: Paper::Jadot,
        place: "Section III-C, (25); Section IV-B, (48)",
        origin: Extends("a PI control … achieves global convergence of the error system to zero for any K_P, K_I > 0"),
        statement: "(49) holds with (λK_P/2K_I)|η|² in (48), so that the PI control gives global convergence for any K_P, K_I > 0.",
        assumptions: "As claim 49.",
        found: Found::HoldsIf,
        finding: "Holds to rounding.",
        cost: Cost::Equation,
        variables: &ERRORS,
        check: |case| integral_storage(case, |k_p| k_p),
    },
    Claim {
        number: 51,
        name: "jadot_36_as_printed",
        paper: Paper::Jadot,
        place: "Section IV-A, (36); Theorem 2",
        origin: Says("L̂_f di_s^ref/dt = −[R̂_s + R̂_req][i_s^cons − i_s^ref]"),
        statement: "L̂_f di_ref/dt = −(R̂_s + R̂_req)(i_cons − i_ref): the reference goes to its set point.",
        assumptions: "Any machine, any first reference.",
        found: Found::Fails { rate: 0.99 },
        finding: "The sign is wrong: the distance grows as e^{+(R_s+R_req)t/L_f}. (20) is right.",
        cost: Cost::Equation,
        variables: &[Variable::even("distance_share", -1.0, 1.0).simplest_at(1.0)],
        check: |case| {
            let [distance] = case.values::<1>();
            let p = regulation(case);
            let rate = (p.stator_resistance_ohm + p.rotor_resistance_ohm) / p.leakage_inductance_h;
            // d(i_ref − i_cons)/dt = +rate (i_ref − i_cons), over three of its time constants.
            let later = (0..3000).fold(distance, |d: f64, _| d + 1e-3 / rate * rate * d);
            Verdict::at_most("distance after 3 L_f/(R_s + R_req) over that before", later / distance, 1.0)
        },
    },
    Claim {
        number: 52,
        name: "jadot_32_is_the_steady_state_to_first_order",
        paper: Paper::Jadot,
        place: "Section IV-A, (30) to (33); Appendix",
        origin: Says("(31) can be rewritten as K_Pη = BᵀΔθ + 0(‖Δθ‖²)"),
        statement: "K_Pη = BᵀΔθ + O(‖Δθ‖²) in the steady state.",
        assumptions: "Relative errors up to 5 %; any speed, slips up to twice the rated. B by the code of im-identify.",
        found: Found::Holds,
        finding: "Holds: the remainder is below 2‖B‖‖Δθ‖².",
        cost: Cost::Equation,
        variables: &[
            Variable::even("speed_share", -1.0, 1.0).simplest_at(1.0),
            Variable::even("slip_share", -2.0, 2.0).simplest_at(1.0),
            Variable::even("r_req_error", -0.05, 0.05),
            Variable::even("l_error", -0.05, 0.05),
            Variable::even("r_s_error", -0.05, 0.05),
            Variable::even("l_f_error", -0.05, 0.05),
        ],
        check: regressor,
    },
    Claim {
        number: 53,
        name: "jadot_r_req_and_l_are_seen_outside_the_dead_zone",
        paper: Paper::Jadot,
        place: "Section V-A, conclusions 1 and 2; Fig. 2; (53)",
        origin: Says(
            "The sensitivity of the adaptation to the rotor resistance (parameter R_req) is high across the entire region of operating conditions except when |T_rω_s| or |T_rω_g| is small … to the inductance L is high across the entire region of operating conditions except when |T_rω_s| is small",
        ),
        statement: "The adaptation is sensitive to R_req and L except where |T_rω_s| or |T_rω_g| is small.",
        assumptions: "|T_rω_s| ≥ 4, |T_rω_g| ≥ 1/4, speed and load up to the rated; shares of both above 0.1, the paper's black.",
        found: Found::Holds,
        finding: "Holds on every machine.",
        cost: Cost::Equation,
        variables: &LOADED,
        check: |case| match shares(case) {
            Some([r_req, l, _, _]) => {
                Verdict::at_least("share of R_req over 0.1", r_req, 0.1).and(Verdict::at_least("share of L over 0.1", l, 0.1))
            }
            None => Verdict::Outside,
        },
    },
    Claim {
        number: 54,
        name: "jadot_r_req_and_l_dominate_outside_the_dead_zone",
        paper: Paper::Jadot,
        place: "Section V-A, Fig. 2",
        origin: Extends(
            "Because the largest two elements of the vector are well separated from the smallest two (in modulus), they provide a close approximation of the dominant eigensubspace. … [L_f is low] except when |T_rω_s| and |T_rω_g| are large",
        ),
        statement: "The largest two elements of B are those of R_req and L everywhere outside the dead zone.",
        assumptions: "As claim 53; R_s and L_f below the smaller of R_req and L.",
        found: Found::Fails { rate: 0.011 },
        finding: "At high load and low speed (rated slip at 4 % of the speed, where |T_rω_s| is above 4 still) R_s passes L, and at high load L_f may, \
                  as the paper says itself. Two combinations are seen at a point, but not those of these two parameters.",
        cost: Cost::Equation,
        variables: &LOADED,
        check: |case| match shares(case) {
            Some([r_req, l, r_s, l_f]) => {
                Verdict::at_most("larger of R_s, L_f over smaller of R_req, L", r_s.max(l_f) / r_req.min(l), 1.0)
            }
            None => Verdict::Outside,
        },
    },
    Claim {
        number: 74,
        name: "jadot_r_req_and_l_dominate_at_most_operating_points",
        paper: Paper::Jadot,
        place: "Section V-A, Fig. 2",
        origin: Says(
            "For most operating conditions of the motor, the adaptation of R_req and L largely dominates the adaptation of R_s and L_f.",
        ),
        statement: "At more than half of the plane of speed and load the elements of B of R_req and L are together above twice those of R_s and L_f.",
        assumptions: "2500 points from 2 % of speed and load to the rated, the dead zone included.",
        found: Found::Holds,
        finding: "Holds on every machine, at 85 % of the plane or more.",
        cost: Cost::Run,
        variables: &[],
        check: |case| Verdict::at_least("share of the plane", share_of_the_plane(case), 0.5),
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
    Variable::even("frame_speed_share", -1.5, 1.5).simplest_at(1.0),
];

const ERRORS: [Variable; 8] = [
    Variable::even("flux_error_share", 0.0, 1.0).simplest_at(0.0),
    Variable::angle("flux_error_angle_rad"),
    Variable::even("current_error_share", 0.0, 1.0).simplest_at(0.0),
    Variable::angle("current_error_angle_rad"),
    Variable::even("speed_share", -1.2, 1.2).simplest_at(1.0),
    Variable::even("slip_share", -2.0, 2.0).simplest_at(0.0),
    Variable::even("input_share", 0.0, 1.0).simplest_at(0.0),
    Variable::ratio("lambda_ratio", 0.1, 10.0, 1.0),
];

/// Points of the plane of speed and slip, from 2 % to the rated, at which the elements of R_req and L together are above twice those of R_s and L_f.
fn share_of_the_plane(case: &ClaimCase) -> f64 {
    let p = regulation(case);
    let k = case.parameters().magnetizing_inductance_h / case.parameters().rotor_inductance_h();
    const SIDE: u32 = 50;
    let points = (0..SIDE * SIDE).map(|n| [n % SIDE, n / SIDE].map(|n| 0.02 + 0.98 * f64::from(n) / f64::from(SIDE - 1)));
    let dominate = points.filter(|[speed, slip]| {
        let (omega_r, omega_g) = (case.constants().n_p * speed * case.speed(), slip * case.slip());
        let [r_req, l, r_s, l_f] = relative_sensitivity(&p, k * case.rating().rotor_flux_vs, omega_r, omega_g);
        r_req.hypot(l) > 2.0 * r_s.hypot(l_f)
    });
    dominate.count() as f64 / f64::from(SIDE * SIDE)
}

const LOADED: [Variable; 2] =
    [Variable::even("speed_share", 0.02, 1.0).simplest_at(1.0), Variable::even("slip_share", 0.05, 1.0).simplest_at(1.0)];

fn regulation(case: &ClaimCase) -> RegulationParameters<f64> {
    case.parameters().inverse_gamma().into()
}

/// A state of the T circuit with these φ and i.
fn state(machine: &Machine<f64>, phi: C, i: C, omega_m: f64) -> State<f64> {
    let p = machine.parameters();
    let k = p.magnetizing_inductance_h / p.rotor_inductance_h();
    let psi_s = phi + i * p.inverse_gamma().leakage_inductance_h;
    State { psi_s, psi_r: phi / k, omega_m, ..State::default() }
}

/// Rates of φ and i of a machine, in a frame at ω_s that stands at zero now.
fn rates(machine: &Machine<f64>, [phi, i]: [C; 2], omega_m: f64, u: C, omega_s: f64) -> [C; 2] {
    let p = machine.parameters();
    let k = p.magnetizing_inductance_h / p.rotor_inductance_h();
    let plant = Plant::new(machine);
    let rates = plant.rates_in_frame(&state(machine, phi, i, omega_m), &PlantInput::new(u, 0.0), 0.0, omega_s);
    [rates.psi_r * k, plant.currents(&rates).i_s]
}

struct At {
    phi: C,
    i: C,
    omega_m: f64,
    u: C,
    omega_s: f64,
}

fn at(case: &ClaimCase) -> At {
    let [flux, flux_angle, current, current_angle, speed, voltage, voltage_angle, frame] = case.values();
    At {
        phi: C::from_polar(flux * case.rating().rotor_flux_vs, flux_angle),
        i: C::from_polar(current * case.current(), current_angle),
        omega_m: speed * case.speed(),
        u: C::from_polar(voltage * case.rating().phase_voltage_peak_v, voltage_angle),
        omega_s: frame * 2.0 * core::f64::consts::PI * case.rating().electrical_frequency_hz,
    }
}

fn near(what: &str, a: C, b: C, size: f64) -> Verdict {
    // Rounding through currents, which are small differences of fluxes.
    Verdict::at_most(what, (a - b).norm() / size, 1e-9)
}

fn five_in_any_frame(case: &ClaimCase) -> Verdict {
    let x = at(case);
    let p = regulation(case);
    let omega_r = case.constants().n_p * x.omega_m;
    let (a, r) = (p.inverse_rotor_time_constant(), p.rotor_resistance_ohm);
    let [phi_rate, i_rate] = rates(case.machine(), [x.phi, x.i], x.omega_m, x.u, x.omega_s);
    let phi_terms = [-x.phi * C::new(a, x.omega_s - omega_r), x.i * r];
    let i_terms =
        [-x.i * C::new(p.stator_resistance_ohm + r, p.leakage_inductance_h * x.omega_s), x.phi * C::new(a, -omega_r), x.u];
    let size = |t: &[C]| t.iter().map(|t| t.norm()).sum::<f64>();
    near("imbalance of φ'", phi_rate, phi_terms.iter().sum(), size(&phi_terms)).and(near(
        "imbalance of L_f i'",
        i_rate * p.leakage_inductance_h,
        i_terms.iter().sum(),
        size(&i_terms),
    ))
}

fn four_are_enough(case: &ClaimCase) -> Verdict {
    let x = at(case);
    let p = case.parameters();
    // Another share of the leakages, from 0.3 to 3.
    let ratio = 10f64.powf(0.5 * x.omega_s.sin());
    let other = p.inverse_gamma().to_t(ratio, p.inertia_kg_m2, p.viscous_friction_nm_s_per_rad);
    let other = match Machine::base(other, case.machine().pole_pairs()) {
        Ok(other) => other,
        Err(e) => return Verdict::refused(e),
    };
    let [a, b] = [case.machine(), &other].map(|m| rates(m, [x.phi, x.i], x.omega_m, x.u, x.omega_s));
    near("difference of φ'", a[0], b[0], a[0].norm() + x.phi.norm() * x.omega_s.abs() + 1.0).and(near(
        "difference of i'",
        a[1],
        b[1],
        a[1].norm() + x.u.norm() / regulation(case).leakage_inductance_h,
    ))
}

fn current_fed_machine(case: &ClaimCase) -> Verdict {
    let [bandwidth, damping, size, angle, speed_error, load] = case.values();
    let (p, n_p) = (regulation(case), case.constants().n_p);
    let (a, r) = (p.inverse_rotor_time_constant(), p.rotor_resistance_ohm);
    let k = case.parameters().magnetizing_inductance_h / case.parameters().rotor_inductance_h();
    let flux = k * case.rating().rotor_flux_vs;
    // κR of (16), and its loop with ω_g = −k_p(Δω + ξ): s² + κφ²k_p/R s + κφ²k_pk_i/R.
    let torque = 1.5 * n_p * n_p / case.parameters().inertia_kg_m2;
    let k_p = 2.0 * damping * bandwidth / (torque * flux * flux / r);
    let k_i = bandwidth / (2.0 * damping);
    let load = n_p * load * case.rating().torque_nm / case.parameters().inertia_kg_m2;
    let f = |[xi, omega, d, q]: [f64; 4]| {
        let phi = C::new(d, q);
        let omega_g = -k_p * (omega + xi);
        let i = C::new(a, omega_g) * (flux / r);
        let rate = -phi * C::new(a, omega_g) + i * r;
        [k_i * omega, torque * dot(i, j(phi)) - load, rate.re, rate.im]
    };
    let start = C::new(flux, 0.0) + C::from_polar(size * flux, angle);
    let mut x = [0.0, speed_error * case.speed() * n_p, start.re, start.im];
    // Until what decays at the slower of both rates is below a thousandth, and the flux has left the speed alone.
    let slowest = a.min(bandwidth * damping.min(0.5 / damping));
    let h = (0.02 / (bandwidth + a)).min(1e-3).min(0.2 / (k_p * (case.speed() * n_p * 0.4)).max(1.0));
    for _ in 0..((16.0 / slowest) / h).min(400_000.0) as usize {
        let step = |x: [f64; 4], k: [f64; 4], h: f64| core::array::from_fn(|n| x[n] + h * k[n]);
        let k1 = f(x);
        let k2 = f(step(x, k1, 0.5 * h));
        let k3 = f(step(x, k2, 0.5 * h));
        let k4 = f(step(x, k3, h));
        x = core::array::from_fn(|n| x[n] + h / 6.0 * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n]));
    }
    let off = (C::new(x[2], x[3]) - flux).norm();
    Verdict::at_most("flux error at the end over the flux", off / flux, 1e-3).and(Verdict::at_most(
        "speed error at the end over the rated speed",
        x[1].abs() / (n_p * case.speed()),
        1e-3,
    ))
}

/// Δφ, Δi, v_s, and the rates of both errors by the machine and by (17), (18).
struct Errors {
    delta_phi: C,
    delta_i: C,
    v_s: C,
    lambda: f64,
    rates: [C; 2],
}

fn errors(case: &ClaimCase) -> Errors {
    let [flux, flux_angle, current, current_angle, speed, slip, input, ratio] = case.values();
    let (p, n_p) = (regulation(case), case.constants().n_p);
    let (a, r, l_f) = (p.inverse_rotor_time_constant(), p.rotor_resistance_ohm, p.leakage_inductance_h);
    let delta_phi = C::from_polar(flux * case.rating().rotor_flux_vs, flux_angle);
    let delta_i = C::from_polar(current * case.current(), current_angle);
    let (omega_m, omega_g) = (speed * case.speed(), slip * case.slip());
    let omega_r = n_p * omega_m;
    let v_s = C::from_polar(input * 0.1 * case.rating().phase_voltage_peak_v, flux_angle - current_angle);
    let lambda = ratio * r / C::new(a, case.speed() * n_p).norm();
    let v_r = Lambda::Constant(lambda).flux_correction(r, a, omega_r, delta_i);
    // Any reference and voltage: they drop out.
    let (phi_ref, i_ref, u) = (C::new(0.9, 0.1), C::new(1.0, 2.0) * case.current(), C::new(50.0, 200.0));
    let omega_s = omega_r + omega_g;
    let machine = rates(case.machine(), [phi_ref + delta_phi, i_ref + delta_i], omega_m, u, omega_s);
    let phi_ref_rate = -phi_ref * C::new(a, omega_g) + i_ref * r - v_r;
    let i_ref_rate =
        (-i_ref * C::new(p.stator_resistance_ohm + r, l_f * omega_s) + phi_ref * C::new(a, -omega_r) + u - v_s) / l_f;
    Errors { delta_phi, delta_i, v_s, lambda, rates: [machine[0] - phi_ref_rate, machine[1] - i_ref_rate] }
}

fn storage_function(case: &ClaimCase) -> Verdict {
    let (e, p) = (errors(case), regulation(case));
    let terms = [dot(e.delta_phi, e.rates[0]), e.lambda * p.leakage_inductance_h * dot(e.delta_i, e.rates[1])];
    let resistance = p.stator_resistance_ohm + p.rotor_resistance_ohm;
    let promised = [
        -p.inverse_rotor_time_constant() * e.delta_phi.norm_sqr(),
        -e.lambda * resistance * e.delta_i.norm_sqr(),
        e.lambda * dot(e.delta_i, e.v_s),
    ];
    let size: f64 = terms.iter().chain(&promised).map(|t| t.abs()).sum::<f64>()
        + e.delta_phi.norm() * e.rates[0].norm()
        + e.lambda * p.leakage_inductance_h * e.delta_i.norm() * e.rates[1].norm()
        + 1e-6;
    let off = terms.iter().sum::<f64>() - promised.iter().sum::<f64>();
    Verdict::at_most("imbalance of (24) over its terms", off.abs() / size, 1e-8)
}

fn scheduled_lambda(case: &ClaimCase) -> Verdict {
    let [speed, acceleration, flux, current] = case.values();
    let (p, n_p) = (regulation(case), case.constants().n_p);
    let (a, r, l_f) = (p.inverse_rotor_time_constant(), p.rotor_resistance_ohm, p.leakage_inductance_h);
    let omega_r = n_p * speed * case.speed();
    let omega_rate = n_p * acceleration * case.rating().torque_nm / case.parameters().inertia_kg_m2;
    let (delta_phi, delta_i) = (flux * case.rating().rotor_flux_vs, current * case.current());
    let size = C::new(a, omega_r).norm();
    let (lambda, lambda_rate) = (r / l_f * size, r / l_f * omega_r * omega_rate / size);
    let growth = 0.5 * lambda_rate * l_f * delta_i * delta_i;
    let decay = a * delta_phi * delta_phi + lambda * (p.stator_resistance_ohm + r) * delta_i * delta_i;
    Verdict::at_most("growth of V over its decay", growth / decay, 1.0)
}

/// V̇ with v_s by (25) and a last term weight·λ/(2K_I)|η|².
fn integral_storage(case: &ClaimCase, weight: impl Fn(f64) -> f64) -> Verdict {
    let (e, p) = (errors(case), regulation(case));
    let l_f = p.leakage_inductance_h;
    // The input is taken for η, as a share of the current; K_P from the place of λ in its range.
    let eta = e.v_s * (10.0 * case.current() / case.rating().phase_voltage_peak_v);
    let bandwidth = 300.0 * e.lambda
        / (p.rotor_resistance_ohm / C::new(p.inverse_rotor_time_constant(), case.speed() * case.constants().n_p).norm());
    let k_p = core::f64::consts::SQRT_2 * bandwidth.clamp(100.0, 1000.0) * l_f;
    let v_s = -(e.delta_i + eta) * k_p;
    // The rates of the errors with this v_s in place of the drawn one.
    let i_rate = e.rates[1] + (v_s - e.v_s) / l_f;
    // η' = K_IΔi: K_I drops out.
    let terms =
        [dot(e.delta_phi, e.rates[0]), e.lambda * l_f * dot(e.delta_i, i_rate), weight(k_p) * e.lambda * dot(eta, e.delta_i)];
    let resistance = p.stator_resistance_ohm + p.rotor_resistance_ohm + k_p;
    let promised = [-p.inverse_rotor_time_constant() * e.delta_phi.norm_sqr(), -e.lambda * resistance * e.delta_i.norm_sqr()];
    let size: f64 = terms.iter().chain(&promised).map(|t| t.abs()).sum::<f64>()
        + e.delta_phi.norm() * e.rates[0].norm()
        + e.lambda * l_f * e.delta_i.norm() * i_rate.norm()
        + 1e-6;
    let off = terms.iter().sum::<f64>() - promised.iter().sum::<f64>();
    Verdict::at_most("imbalance of (49) over its terms", off.abs() / size, 1e-8)
}

fn regressor(case: &ClaimCase) -> Verdict {
    let [speed, slip, r_req, l, r_s, l_f] = case.values();
    let theta = [r_req, l, r_s, l_f];
    let truth = regulation(case);
    // Δθ = (truth − estimate)/truth.
    let estimate = truth.scaled(theta.map(|e| 1.0 - e));
    let k = case.parameters().magnetizing_inductance_h / case.parameters().rotor_inductance_h();
    let (omega_r, omega_g) = (case.constants().n_p * speed * case.speed(), slip * case.slip());
    let omega_s = omega_r + omega_g;
    let phi_ref = C::new(k * case.rating().rotor_flux_vs, 0.0);
    let (a, a_hat) = (truth.inverse_rotor_time_constant(), estimate.inverse_rotor_time_constant());
    // The reference in its own steady state, (37); Δi = 0.
    let i_ref = phi_ref * C::new(a_hat, omega_g) / estimate.rotor_resistance_ohm;
    // (30), exactly.
    let delta_phi =
        (i_ref * (truth.rotor_resistance_ohm - estimate.rotor_resistance_ohm) - phi_ref * (a - a_hat)) / C::new(a, omega_g);
    // (31).
    let delta_resistance =
        truth.stator_resistance_ohm - estimate.stator_resistance_ohm + truth.rotor_resistance_ohm - estimate.rotor_resistance_ohm;
    let held = delta_phi * C::new(a, -omega_r) + phi_ref * (a - a_hat)
        - i_ref * C::new(delta_resistance, omega_s * (truth.leakage_inductance_h - estimate.leakage_inductance_h));
    let b = steady_regressor(&estimate, phi_ref, i_ref, omega_s, omega_g);
    let first: C = b.iter().zip(theta).map(|(b, e)| *b * e).sum();
    let size = b.iter().map(|b| b.norm_sqr()).sum::<f64>().sqrt();
    let square = theta.iter().map(|e| e * e).sum::<f64>();
    Verdict::at_most("remainder over 2‖B‖‖Δθ‖²", (held - first).norm() / (2.0 * size * square + 1e-9), 1.0)
}

/// |B|/‖B‖ of the four, outside the dead zone (53).
fn shares(case: &ClaimCase) -> Option<[f64; 4]> {
    let [speed, slip] = case.values();
    let p = regulation(case);
    let a = p.inverse_rotor_time_constant();
    let (omega_r, omega_g) = (case.constants().n_p * speed * case.speed(), slip * case.slip());
    let k = case.parameters().magnetizing_inductance_h / case.parameters().rotor_inductance_h();
    let outside = omega_r + omega_g >= 4.0 * a && omega_g >= 0.25 * a;
    outside.then(|| relative_sensitivity(&p, k * case.rating().rotor_flux_vs, omega_r, omega_g))
}
