//! Jadot et al. in motion: the closed loop and the adaptations, through the code of `im-control` and `im-identify`.

use im_control::{Jadot, JadotGains};
use im_identify::online::{
    Adaptation, Estimate, Fixed, Follower, FollowerGains, Identifier, Lambda, RegulationParameters, SchemeSettings, TimeScale,
    TimeVarying,
};
use im_model::simulation::Reference;

use crate::claim::Origin::{Extends, Says};
use crate::claim::{C, Claim, ClaimCase, Cost, Found, Paper};
use crate::properties::controller::{Following, Loop, STEP, dc_voltage_v, follows_speed, known, magnetizing_s, run_up_s};
use crate::properties::{HeldMachine, Operating};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[
    Claim {
        number: 55,
        name: "jadot_proposition_1",
        paper: Paper::Jadot,
        place: "Section III-C, Proposition 1",
        origin: Says(
            "Assume a time-scale separation between the current dynamics (20) and the current-fed dynamics (16). Then, the controller … achieves exponential regulation of the flux and of the mechanical speed for any constant reference and any constant load torque τ_L.",
        ),
        statement: "The controller regulates flux and speed, whatever the constant references and load.",
        assumptions: "Right parameters; time-scale separation: gains of JadotGains::typical, k_i ≤ 0.42(R_s + R_req)/L_f; 100 µs, run-up and load step.",
        found: Found::Holds,
        finding: "Holds on every machine tried: speed within 0.5 %, flux within 2 %, current within 1.2 times its limit.",
        cost: Cost::Study,
        variables: &[
            Variable::even("speed_share", 0.1, 0.8).simplest_at(0.7),
            Variable::even("load_share", 0.0, 0.8).simplest_at(0.8),
        ],
        check: |case| {
            let [speed, load] = case.values();
            let limits = Following { speed: 0.005, flux: 0.02, current: 1.2 };
            regulated(case, [1.0; 4], [speed, load], &limits)
        },
    },
    Claim {
        number: 62,
        name: "jadot_proposition_1_without_the_time_scale_separation",
        paper: Paper::Jadot,
        place: "Section III-C, Proposition 1",
        origin: Extends(
            "The controller structure … leaves considerable flexibility for the design of the gains … Assume a time-scale separation between the current dynamics (20) and the current-fed dynamics (16).",
        ),
        statement: "The same without the time-scale separation that Proposition 1 assumes.",
        assumptions: "As claim 55, but a speed loop of 40 rad/s on every machine, 75 kW included.",
        found: Found::Fails { rate: 0.043 },
        finding: "(20) has the rate (R_s + R_req)/L_f, which no gain changes: about 170 1/s for 0.4 kW, 30 1/s for 75 kW, 10 1/s at worst. With this lag \
                  in the speed loop Routh asks for k_i < (R_s + R_req)/L_f; beyond it speed and current swing for ever, with the right parameters.",
        cost: Cost::Study,
        variables: &[
            Variable::even("speed_share", 0.1, 0.8).simplest_at(0.7),
            Variable::even("load_share", 0.0, 0.8).simplest_at(0.8),
        ],
        check: |case| {
            let limits = Following { speed: 0.005, flux: 0.02, current: 1.2 };
            with_gains(case, [1.0; 4], case.values(), &limits, |mut gains| {
                // Both are in proportion to the bandwidth: k_i is this over √2.
                let faster = 40.0 / (core::f64::consts::SQRT_2 * gains.speed_integral_per_s);
                gains.speed_proportional *= faster;
                gains.speed_integral_per_s *= faster;
                gains
            })
        },
    },
    Claim {
        number: 56,
        name: "jadot_speed_is_regulated_with_wrong_parameters",
        paper: Paper::Jadot,
        place: "Section V-B",
        origin: Says(
            "Even in the absence of parametric estimation, the integral action of the controller of Section II achieves speed and current regulation.",
        ),
        statement: "\"Even in the absence of parametric estimation the integral action achieves speed and current regulation.\"",
        assumptions: "Each of the four parameters up to 25 % wrong, no adaptation.",
        found: Found::Holds,
        finding: "Holds for the speed, within 0.5 %; the flux is biased, as the paper says.",
        cost: Cost::Study,
        variables: &WRONG,
        check: |case| {
            let [speed, load, r_req, l, r_s, l_f] = case.values();
            let limits = Following { speed: 0.005, flux: 1e3, current: 1.5 };
            regulated(case, [1.0 + r_req, 1.0 + l, 1.0 + r_s, 1.0 + l_f], [speed, load], &limits)
        },
    },
    Claim {
        number: 57,
        name: "jadot_torque_estimate_needs_r_req_and_l_only",
        paper: Paper::Jadot,
        place: "Section V-B, (52)",
        origin: Says(
            "the load torque estimation (52) which is biased only by the parametric errors on R_req and L = T_r⁻¹/R_req but not biased by the parametric errors on R_s and L_f",
        ),
        statement: "The estimate of the load torque is biased by errors of R_req and L only, not of R_s and L_f.",
        assumptions: "R_s and L_f up to 25 % wrong, R_req and L right; steady state under load. Within 1 %.",
        found: Found::Holds,
        finding: "Holds, at every speed: the integral action holds the current, and with it the torque, where it should be.",
        cost: Cost::Study,
        variables: &[
            Variable::even("speed_share", 0.05, 0.8).simplest_at(0.5),
            Variable::even("load_share", 0.2, 0.8).simplest_at(0.5),
            Variable::even("r_s_error", -0.25, 0.25),
            Variable::even("l_f_error", -0.25, 0.25),
        ],
        check: |case| {
            let [speed, load, r_s, l_f] = case.values();
            let estimate = truth(case).scaled([1.0, 1.0, 1.0 + r_s, 1.0 + l_f]);
            match Fixed::try_new(estimate) {
                Ok(fixed) => off_or(torque_error(case, fixed, [speed, load], 0.0), |off| {
                    Verdict::at_most("error of the torque", off, 0.01)
                }),
                Err(e) => Verdict::refused(e),
            }
        },
    },
    Claim {
        number: 58,
        name: "jadot_theorem_1",
        paper: Paper::Jadot,
        place: "Section IV-A, Theorem 1",
        origin: Says(
            "the adaptation law (34) enforces local exponential regulation of the flux and of the mechanical speed for any constant reference … and any constant load torque τ_L under persistence of excitation of B = B(t)",
        ),
        statement: "With persistent excitation the time-scale adaptation (34) makes all four estimates converge.",
        assumptions: "Four points of other speed and load in turn; errors up to 20 %; gains 1, 1, 10, 20 on the parameters, 200 µs.",
        found: Found::Holds,
        finding: "Holds. (34) is the law of the error; the estimate moves the other way.",
        cost: Cost::Long,
        variables: &EXCITED,
        check: |case| all_converge(case, |s| TimeScale::try_new(s, 0.5), 60),
    },
    Claim {
        number: 60,
        name: "jadot_theorem_2_with_an_integral_action_that_forgets",
        paper: Paper::Jadot,
        place: "Section IV-B, Theorem 2",
        origin: Extends(
            "the adaptation law defined by (42) and (47) enforces (local) exponential regulation … under persistence of excitation of the vector (46)",
        ),
        statement: "With η' = K_IΔi − ρη the time-varying adaptation with the gain of Section V-C makes all four estimates converge on the machine.",
        assumptions: "As claim 58; 40 rounds, ρ = 1000 1/s.",
        found: Found::HoldsIf,
        finding: "Holds.",
        cost: Cost::Long,
        variables: &EXCITED,
        check: |case| all_converge(case, |s| TimeVarying::try_new(s, TimeVarying::<f64>::PAPER_FREQUENCY, 1000.0), 40),
    },
    Claim {
        number: 61,
        name: "jadot_reduced_scheme_is_as_good",
        paper: Paper::Jadot,
        place: "Section VI-A",
        origin: Says(
            "The performance of the reduced adaptation scheme is nevertheless similar to the performance of the full adaptation scheme because of the poor sensitivity of the latter to two of the parameters.",
        ),
        statement: "\"The performance of the reduced adaptation scheme is nevertheless similar to the performance of the full adaptation scheme.\"",
        assumptions: "All four up to 25 % wrong; one point outside the dead zone for 6 s, half rated speed and more. The torque estimate of the \
                      reduced scheme within 5 %.",
        found: Found::Holds,
        finding: "Holds in every case tried: what R_s and L_f are wrong by costs R_req and L little at such a point.",
        cost: Cost::Study,
        variables: &[
            Variable::even("speed_share", 0.5, 0.8).simplest_at(0.5),
            Variable::even("load_share", 0.3, 0.8).simplest_at(0.5),
            Variable::even("r_req_error", -0.25, 0.25),
            Variable::even("l_error", -0.25, 0.25),
            Variable::even("r_s_error", -0.25, 0.25),
            Variable::even("l_f_error", -0.25, 0.25),
        ],
        check: reduced_scheme,
    },
];

const WRONG: [Variable; 6] = [
    Variable::even("speed_share", 0.1, 0.7).simplest_at(0.5),
    Variable::even("load_share", 0.0, 0.6).simplest_at(0.5),
    Variable::even("r_req_error", -0.25, 0.25),
    Variable::even("l_error", -0.25, 0.25),
    Variable::even("r_s_error", -0.25, 0.25),
    Variable::even("l_f_error", -0.25, 0.25),
];

const EXCITED: [Variable; 8] = [
    Variable::even("slip_1", 1.2, 2.0).simplest_at(1.5),
    Variable::even("slip_2", 1.2, 2.0).simplest_at(1.5),
    Variable::even("slip_3", -2.0, -1.2).simplest_at(-1.5),
    Variable::even("slip_4", 0.05, 0.3).simplest_at(0.2),
    Variable::even("r_req_error", -0.2, 0.2),
    Variable::even("l_error", -0.2, 0.2),
    Variable::even("r_s_error", -0.2, 0.2),
    Variable::even("l_f_error", -0.2, 0.2),
];

fn truth(case: &ClaimCase) -> RegulationParameters<f64> {
    case.parameters().inverse_gamma().into()
}

fn controller<A: Adaptation<f64>>(
    case: &ClaimCase,
    adaptation: A,
    gains: impl FnOnce(JadotGains<f64>) -> JadotGains<f64>,
) -> Result<Jadot<f64, A>, Verdict> {
    let known = known(case);
    let typical = JadotGains::typical(&known, case.rating().rotor_flux_vs, STEP);
    Jadot::try_new(&known, &gains(typical), adaptation).map_err(Verdict::refused)
}

/// Without adaptation, with estimates off by factors.
fn with_gains(
    case: &ClaimCase,
    factors: [f64; 4],
    at: [f64; 2],
    limits: &Following,
    gains: impl FnOnce(JadotGains<f64>) -> JadotGains<f64>,
) -> Verdict {
    let fixed = Fixed::try_new(truth(case).scaled(factors)).map_err(Verdict::refused);
    match fixed.and_then(|fixed| controller(case, fixed, gains)) {
        Ok(mut drive) => follows_speed(case, case.machine(), &mut drive, at, limits),
        Err(verdict) => verdict,
    }
}

fn regulated(case: &ClaimCase, factors: [f64; 4], at: [f64; 2], limits: &Following) -> Verdict {
    with_gains(case, factors, at, limits, |gains| gains)
}

fn off_or(result: Result<f64, Verdict>, judge: impl FnOnce(f64) -> Verdict) -> Verdict {
    match result {
        Ok(off) => judge(off),
        Err(verdict) => verdict,
    }
}

/// |τ̂/τ − 1| after `settling_s` and more under load; the torque of the load with the friction.
fn torque_error<A: Adaptation<f64>>(
    case: &ClaimCase,
    adaptation: A,
    [speed, load]: [f64; 2],
    settling_s: f64,
) -> Result<f64, Verdict> {
    let mut drive = controller(case, adaptation, |gains| gains)?;
    let (w, flux) = (speed * case.speed(), 0.95 * case.rating().rotor_flux_vs);
    let (up, load) = (magnetizing_s(case), load * case.rating().torque_nm);
    let on = up + run_up_s(case);
    let end = on + settling_s + up.max(2.0);
    let mut machine = Loop::new(case.machine(), dc_voltage_v(case), STEP);
    let (mut sum, mut count) = (0.0, 0);
    for k in 0..(end / STEP) as usize {
        let t = STEP * k as f64;
        let reference =
            Reference { omega_m: w * ((t - up) / run_up_s(case)).clamp(0.0, 1.0), rotor_flux_vs: flux, torque_nm: 0.0 };
        let measured = machine.measured();
        machine.advance(&mut drive, &measured, &reference, if t > on { load } else { 0.0 });
        if end - t < 0.05 {
            let torque = load + case.parameters().viscous_friction_nm_s_per_rad * machine.state.omega_m;
            (sum, count) = (sum + drive.load_torque_nm() / torque - 1.0, count + 1);
        }
    }
    Ok((sum / f64::from(count)).abs())
}

fn reduced_scheme(case: &ClaimCase) -> Verdict {
    let [speed, load, r_req, l, r_s, l_f] = case.values();
    let a = truth(case).inverse_rotor_time_constant();
    // Outside the dead zone by a factor of two.
    if load * case.slip() < 0.5 * a || speed * case.speed() * case.constants().n_p < 8.0 * a {
        return Verdict::Outside;
    }
    let start = truth(case).scaled([1.0 + r_req, 1.0 + l, 1.0 + r_s, 1.0 + l_f]);
    match TimeScale::try_new(&SchemeSettings::reduced(start, STEP), TimeScale::<f64>::PAPER_SHARE) {
        Ok(scheme) => off_or(torque_error(case, scheme, [speed, load], 6.0), |off| {
            Verdict::at_most("error of the torque estimate", off, 0.05)
        }),
        Err(e) => Verdict::refused(e),
    }
}

/// A follower over four points in turn, four rotor time constants each.
fn all_converge<A: Adaptation<f64>>(
    case: &ClaimCase,
    adaptation: impl FnOnce(&SchemeSettings<f64>) -> Result<A, im_model::ModelError>,
    rounds: usize,
) -> Verdict {
    const H: f64 = 2e-4;
    let [s1, s2, s3, s4, e1, e2, e3, e4] = case.values();
    let truth = truth(case);
    let off = [e1, e2, e3, e4];
    let settings = SchemeSettings {
        weights: [1.0, 1.0, 10.0, 20.0],
        excitation_window_s: 20.0,
        least_regressor_v: 0.5,
        ..SchemeSettings::full(truth.scaled(off.map(|e| 1.0 - e)), H)
    };
    let bandwidth = 800.0;
    let k_p = core::f64::consts::SQRT_2 * bandwidth * truth.leakage_inductance_h;
    let gains = FollowerGains {
        pole_pairs: case.machine().pole_pairs(),
        current_proportional_ohm: k_p,
        current_integral_per_s: truth.leakage_inductance_h * bandwidth * bandwidth / k_p,
        lambda: Lambda::Scheduled,
        sample_time_s: H,
    };
    let follower = match adaptation(&settings).and_then(|a| Follower::try_new(gains, a)) {
        Ok(follower) => follower,
        Err(e) => return Verdict::refused(e),
    };
    let a = truth.inverse_rotor_time_constant();
    let points = [(300.0, s1), (12.0, s2), (150.0, s3), (60.0, s4)].map(|(omega_r, s)| Operating {
        omega_r,
        omega_g: s * a,
        flux_vs: 0.9,
    });
    let mut machine = HeldMachine::new(case.machine(), &points[0], H);
    let mut state = follower.start();
    state.direction = machine.direction();
    state.phi_ref = C::new(points[0].flux_vs, 0.0);
    state.i_ref = machine.sample().i_s * state.direction.conj();
    let mut last: Option<Estimate<f64, 4>> = None;
    for k in 0..rounds * points.len() {
        for _ in 0..(4.0 / a / H) as usize {
            machine.advance(&points[k % points.len()], 400.0);
            last = Some(follower.step(&mut state, &machine.sample()));
        }
    }
    let Some(last) = last else { return Verdict::Outside };
    if last.excitation.smallest <= 1e-3 {
        return Verdict::Outside;
    }
    let size = |e: &[f64; 4]| e.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let t = truth.values();
    let left: [f64; 4] = core::array::from_fn(|k| 1.0 - last.values[k] / t[k]);
    // L_f is a hundred times slower than the others; 0.5 % is what 200 µs leave.
    Verdict::at_most("largest relative error left over what is allowed", size(&left) / (0.15 * size(&off) + 0.005), 1.0)
}
