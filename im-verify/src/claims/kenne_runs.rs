//! Kenné et al. in motion: observers, identifier and the closed loop, through the code of `im-control`, `im-identify` and `im-observers`.

use im_control::{Kenne, KenneGains};
use im_design::DesignModel;
use im_design::kenne::{KenneRegion, design};
use im_identify::online::{Identifier, IdentifierStatus, KenneRotorResistance, KenneSettings, Range, Sample};
use im_model::machines::KENNE_APPENDIX_II;
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::j;
use im_model::{BaseParameter, Machine, ParameterId, WindingParameters};
use im_observers::{Basis, CurrentModel};

use crate::claim::Origin::{Extends, Says};
use crate::claim::{C, Claim, ClaimCase, Cost, Found, Paper};
use crate::properties::controller::{Following, STEP, dc_voltage_v, follows_speed, known};
use crate::properties::{HeldMachine, Operating, Steady, observer};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[
    Claim {
        number: 35,
        name: "kenne_flux_and_torque_observers_converge",
        paper: Paper::Kenne,
        place: "Section III-C2, (39) to (42)",
        origin: Says("Therefore, the observer errors e_λ̂r and e_Te converge exponentially to 0"),
        statement: "With the right R_r the errors of λ̂_r and T̂_e converge exponentially to zero, in the stable region where (R̂_r/L_r)I − n_pωJ > 0.",
        assumptions: "Constant speed, any load; any flux error. The current model of im-observers, 100 µs.",
        found: Found::Holds,
        finding: "Holds with the rate R_r/L_r exactly, and without a region: the symmetric part of the matrix is (R̂_r/L_r)I at every speed.",
        cost: Cost::Run,
        variables: &[
            Variable::even("speed_share", -1.2, 1.2).simplest_at(1.0),
            Variable::even("slip_share", -2.0, 2.0).simplest_at(0.0),
            Variable::even("flux_error_share", 0.02, 0.5).simplest_at(0.1),
            Variable::angle("flux_error_angle_rad"),
        ],
        check: flux_observer_converges,
    },
    Claim {
        number: 36,
        name: "kenne_k_of_150000_satisfies_34",
        paper: Paper::Kenne,
        place: "Section III-C1, (34); Section IV",
        origin: Extends(
            "if the elements of the matrix gain diag(K_x̃1) are chosen sufficiently large (34) a sliding mode regime occurs … K_x̃1d = K_x̃1q = 150000",
        ),
        statement: "K_x = 150 000 is above |f̃₁e_Rr| in every state, which the paper does not say.",
        assumptions: "The machine of Appendix II, R_r wrong by 100 %; any state with 145 rad/s, 0.27 Wb, 5 A and 311 V at most. No other machine enters.",
        found: Found::Fails { rate: 0.44 },
        finding: "f₁ = β di_r/dt = (β/L_r)(dλ/dt − M di_s/dt): with u_s in di_s/dt the bound over this region is 8·10⁵ A/s². The paper's K is \
                  enough for the steady state at rated torque, 10⁵, not for every state there (claim 71). Claim 37 has the bound.",
        cost: Cost::Equation,
        variables: &STATE,
        check: |case| {
            let m = KENNE_APPENDIX_II;
            let at = limits_of_appendix_ii();
            let e = m.windings.rotor_resistance_ohm;
            Verdict::at_most("|f₁e_Rr|, A/s²", e * f_1(&m.windings, m.pole_pairs, state(case, &at)), 150_000.0)
        },
    },
    Claim {
        number: 37,
        name: "kenne_34_with_the_bound_over_all_voltages",
        paper: Paper::Kenne,
        place: "Section III-C1, (34)",
        origin: Extends(
            "if the elements of the matrix gain diag(K_x̃1) are chosen sufficiently large (34) a sliding mode regime occurs",
        ),
        statement: "K_x can be chosen such that |f̃₁e_Rr| stays below it.",
        assumptions: "K of im-design for a region of speed, flux, current and voltage; R_r between half and twice the nominal, R_s within 50 %.",
        found: Found::HoldsIf,
        finding: "Holds, and is reached: K = β e{(R_rM/σL_r² + βR_s)i + |(R_r/L_r) − jn_pω|λ/σL_r + βu} at the largest of each.",
        cost: Cost::Run,
        variables: &STATE,
        check: designed_bound,
    },
    Claim {
        number: 38,
        name: "kenne_theorem_7",
        paper: Paper::Kenne,
        place: "Section III-C1, Theorem 7; Appendix I",
        origin: Says(
            "assuming that conditions (28) and (34) hold, then the estimate of the rotor resistance R̂_r given by (37) converges to the true value R_r in finite time",
        ),
        statement: "R̂_r converges to R_r in finite time: |e| ≤ |e₀| − (k_Rr − μ)t.",
        assumptions: "|Ṙ_r| ≤ μ < k_Rr, loaded steady state (half to one and a half times the rated slip), no noise, 5 µs: the limit of continuous time.",
        found: Found::HoldsIf,
        finding: "Holds with a rotor current to see R_r by (claim 39), but for the delay of the two filters and 1.5 % of R_r.",
        cost: Cost::Study,
        variables: &[
            Variable::even("slip_share", 0.5, 1.5).simplest_at(1.0),
            Variable::even("resistance_error", -0.8, 0.8),
            Variable::even("rate_share", 0.0, 0.35),
            Variable::even("slope_1", -1.0, 1.0),
            Variable::even("slope_2", -1.0, 1.0),
        ],
        check: theorem_7,
    },
    Claim {
        number: 39,
        name: "kenne_f1_does_not_vanish",
        paper: Paper::Kenne,
        place: "Section III-C1, before (36)",
        origin: Says("If the IM operates in its stable region, one has ‖f̃₁‖² > 0."),
        statement: "If the machine \"operates in its stable region, one has ‖f̃₁‖² > 0\".",
        assumptions: "Steady states from no load to the rated slip in tenths, half the rated frequency and more. Above 10⁻⁹ of what rated load gives.",
        found: Found::Fails { rate: 0.04 },
        finding: "f₁ = β di_r/dt is zero in the steady state without load, where the machine is as stable as can be, and (36) divides by it. \
                  The identifier here holds its estimate there and says so.",
        cost: Cost::Equation,
        variables: &[
            Variable::even("frequency_share", 0.5, 1.2).simplest_at(1.0),
            Variable::whole("slip_tenths", -10.0, 10.0, 10.0),
        ],
        check: f_1_does_not_vanish,
    },
    Claim {
        number: 40,
        name: "kenne_high_gain_observer_at_106_us",
        paper: Paper::Kenne,
        place: "Section III-C1, (29); Section IV",
        origin: Extends(
            "During simulation, the sampling time has been set to 106 µs. … The gain of the high-gain observer is 31000",
        ),
        statement: "(29) with gain 31 000 is stable at 106 µs when advanced by an explicit Runge-Kutta method. (The paper names no method.)",
        assumptions: "Orders 1 to 4: forward Euler, Heun, Kutta's third, the classical fourth. No machine enters.",
        found: Found::Fails { rate: 0.99 },
        finding: "hΓ = 3.29 is beyond the limits 2, 2, 2.51 and 2.79 of all four: errors grow by factors of −2.3, 3.1, −2.8 and 2.1 a sample. The \
                  identifier here takes (29) exactly over a sample.",
        cost: Cost::Equation,
        variables: &[Variable::whole("order", 1.0, 4.0, 1.0)],
        check: |case| {
            let [order] = case.values::<1>();
            // x̂' = −Γ(x̂ − x): a step of order p multiplies the error by the first p + 1 terms of e^(−hΓ).
            let z = -106e-6 * 31_000.0;
            let (growth, _) = (1..=order as u32).fold((1.0, 1.0f64), |(sum, term), k| {
                let term = term * z / f64::from(k);
                (sum + term, term)
            });
            Verdict::at_most("growth of an error per sample", growth.abs(), 1.0)
        },
    },
    Claim {
        number: 41,
        name: "kenne_speed_and_flux_follow",
        paper: Paper::Kenne,
        place: "Abstract; Section III-B, (15) to (19)",
        origin: Says("this guarantees the stability of the rotor speed and flux tracking"),
        statement: "ω → ω_ref and ‖λ‖² → F_ref.",
        assumptions: "Right parameters, load torque estimated; run-up and load step with the boundary layers of KenneGains::typical, 100 µs.",
        found: Found::Holds,
        finding: "Holds on every machine tried: speed within 0.5 %, flux within 3 %, current within 1.2 times its limit.",
        cost: Cost::Study,
        variables: &[
            Variable::even("speed_share", 0.2, 0.8).simplest_at(0.7),
            Variable::even("load_share", 0.0, 0.8).simplest_at(0.8),
        ],
        check: |case| {
            let limits = Following { speed: 0.005, flux: 0.03, current: 1.2 };
            let [speed, load] = case.values();
            with_drive(case, |drive| follows_speed(case, case.machine(), drive, [speed, load], &limits))
        },
    },
    Claim {
        number: 42,
        name: "kenne_speed_is_insensitive_to_resistances",
        paper: Paper::Kenne,
        place: "Abstract; Section V",
        origin: Says(
            "the direct speed and flux tracking schemes are insensitive to the stator/rotor resistance variations (up to 50% for R_s and 100% for R_r)",
        ),
        statement: "The speed follows with resistances other than the drive knows.",
        assumptions: "R_s and R_r up to 50 and 100 % above what the drive knows; R_r identified on line; steady speed before and under load.",
        found: Found::Holds,
        finding: "Holds for the speed in the steady state, within 2 %. Not for the flux: claim 43.",
        cost: Cost::Study,
        variables: &RESISTANCES,
        check: |case| resistances(case, &Following { speed: 0.02, flux: 1e3, current: 1e3 }),
    },
    Claim {
        number: 43,
        name: "kenne_flux_is_insensitive_to_resistances",
        paper: Paper::Kenne,
        place: "Abstract; Section V",
        origin: Extends(
            "the direct speed and flux tracking schemes are insensitive to the stator/rotor resistance variations (up to 50% for R_s and 100% for R_r)",
        ),
        statement: "So does the flux on any machine at any load, with the identifier of this workspace, which holds still where f₁ is small.",
        assumptions: "As claim 42; the flux within 5 % of what is asked for, before and under load.",
        found: Found::Fails { rate: 0.005 },
        finding: "Holds where R_r is seen. Where load times frequency is small (half the speed and a fifth of the load are enough) f₁ is too small \
                  to tell R_r by (claim 39): R̂_r stands still at its wrong value, and the flux model (44), which has no feedback, with it.",
        cost: Cost::Study,
        variables: &RESISTANCES,
        check: |case| resistances(case, &Following { speed: 1e3, flux: 0.05, current: 1e3 }),
    },
    Claim {
        number: 71,
        name: "kenne_k_of_150000_satisfies_34_in_its_own_steady_state",
        paper: Paper::Kenne,
        place: "Section III-C1, (34); Section IV, Fig. 1",
        origin: Says(
            "if the elements of the matrix gain diag(K_x̃1) are chosen sufficiently large (34) a sliding mode regime occurs … \
             K_x̃1d = K_x̃1q = 150000",
        ),
        statement: "In the steady state of Fig. 1 K_x = 150 000 is above |f₁e_Rr|.",
        assumptions: "The machine of Appendix II at 145 rad/s, 0.0645 Wb² and 6.89 Nm; R̂_r from 0 to twice R_r. No other machine enters.",
        found: Found::Holds,
        finding: "Holds: 6.6·10⁴ A/s² at the two ends. In every state it does not: claim 36.",
        cost: Cost::Equation,
        variables: &[Variable::even("estimate_share", 0.0, 2.0).simplest_at(0.0)],
        check: k_in_the_first_study,
    },
    Claim {
        number: 72,
        name: "kenne_adaptation_could_save_losses_against_ifo",
        paper: Paper::Kenne,
        place: "Section V",
        origin: Says(
            "the robustness of the control that could result in better efficiency of an electric drive as compared to the commonly used IFO scheme",
        ),
        statement: "There is a load at which field orientation with R_rn has larger copper losses than a drive that knows R_r, R_r being up to twice R_rn.",
        assumptions: "Steady state, rated flux asked for, loads up to the rated; R_r at least 20 % above R_rn.",
        found: Found::Holds,
        finding: "Holds on every machine: at light load the flux of a detuned drive is as high and its current higher. On the machine of Jadot et al. with R_r doubled, 13 % more copper losses at a fifth of the load. Not at rated load: claim 73.",
        cost: Cost::Equation,
        variables: &[Variable::even("rotor_resistance_ratio", 1.2, 2.0).simplest_at(2.0)],
        check: |case| {
            let most = (1..=100).map(|k| extra_losses(case, 0.01 * f64::from(k))).fold(f64::MIN, f64::max);
            Verdict::at_least("most that field orientation loses over what is needed", most, 1e-4)
        },
    },
    Claim {
        number: 73,
        name: "kenne_adaptation_saves_losses_against_ifo_at_rated_load",
        paper: Paper::Kenne,
        place: "Section V",
        origin: Extends(
            "the robustness of the control that could result in better efficiency of an electric drive as compared to the commonly used IFO scheme",
        ),
        statement: "At rated load field orientation with R_rn has larger copper losses than a drive that knows R_r.",
        assumptions: "As claim 72.",
        found: Found::Fails { rate: 0.99 },
        finding: "Fails on every machine: with R_r doubled the flux of the detuned drive rises with the load, and a linear machine then takes less current, 26 % less copper losses on that of Jadot et al. Saturation, which neither the paper nor this model has, works against that.",
        cost: Cost::Equation,
        variables: &[Variable::even("rotor_resistance_ratio", 1.2, 2.0).simplest_at(2.0)],
        check: |case| Verdict::at_most("losses with R_r known over those without", 1.0 / (1.0 + extra_losses(case, 1.0)), 1.0),
    },
];

/// |f₁e_Rr| of the steady state of Fig. 1, in the frame of the flux, from (1) to (3): i = (1 + jω_gL_r/R_r)λ/M.
fn k_in_the_first_study(case: &ClaimCase) -> Verdict {
    let [share] = case.values();
    let m = KENNE_APPENDIX_II;
    let w = m.windings;
    let lambda = 0.0645f64.sqrt();
    let slip = 6.89 * w.rotor_resistance_ohm / (1.5 * f64::from(m.pole_pairs) * lambda * lambda);
    let i = C::new(1.0, slip * w.rotor_inductance_h / w.rotor_resistance_ohm) * (lambda / w.mutual_inductance_h);
    let omega_e = f64::from(m.pole_pairs) * 145.0 + slip;
    let stator = i * w.stator_inductance_h
        + (C::new(lambda, 0.0) - i * w.mutual_inductance_h) * (w.mutual_inductance_h / w.rotor_inductance_h);
    let u = i * w.stator_resistance_ohm + j(stator) * omega_e;
    let gamma = w.kenne(m.pole_pairs).gamma;
    let f_1 = u * gamma[1] - i * gamma[2] - j(i) * (omega_e * gamma[3]);
    Verdict::at_most("|f₁e_Rr|, A/s²", f_1.norm() * (share - 1.0).abs() * w.rotor_resistance_ohm, 150_000.0)
}

/// By how much the copper losses of indirect field orientation that takes R_rn for R_r exceed those with R_r known, over the latter, at a
/// share of the rated torque and the rated flux asked for. Steady state: ω_g = η̂ i_q/i_d, λ = L_m i/(1 + jω_g/η).
fn extra_losses(case: &ClaimCase, load: f64) -> f64 {
    let [ratio] = case.values();
    let (c, p, r) = (case.constants(), case.parameters(), case.rating());
    let (torque, l_m) = (load * r.torque_nm, p.magnetizing_inductance_h);
    let i_d = r.rotor_flux_vs / l_m;
    let (eta, r_r) = (ratio * c.eta, ratio * p.rotor_resistance_ohm);
    let losses = |eta_known: f64| {
        let at = |i_q: f64| {
            let (slip, i2) = (eta_known * i_q / i_d, i_d * i_d + i_q * i_q);
            let flux2 = l_m * l_m * i2 / (1.0 + (slip / eta).powi(2));
            (1.5 * c.n_p * flux2 * slip / r_r, 1.5 * p.stator_resistance_ohm * i2 + 1.5 * flux2 * slip * slip / r_r)
        };
        // The torque grows with i_q.
        let (mut low, mut high) = (0.0f64, 100.0 * case.current());
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if at(middle).0 < torque { low = middle } else { high = middle }
        }
        at(low).1
    };
    losses(c.eta) / losses(eta) - 1.0
}

const STATE: [Variable; 7] = [
    Variable::even("speed_share", -1.0, 1.0).simplest_at(1.0),
    Variable::even("flux_share", 0.2, 1.0).simplest_at(1.0),
    Variable::angle("flux_angle_rad"),
    Variable::even("current_share", 0.0, 1.0).simplest_at(0.5),
    Variable::angle("current_angle_rad"),
    Variable::even("voltage_share", 0.0, 1.0).simplest_at(0.0),
    Variable::angle("voltage_angle_rad"),
];

const RESISTANCES: [Variable; 4] = [
    Variable::even("speed_share", 0.3, 0.7).simplest_at(0.5),
    Variable::even("load_share", 0.2, 0.6).simplest_at(0.4),
    Variable::even("stator_resistance_ratio", 1.0, 1.5).simplest_at(1.0),
    Variable::even("rotor_resistance_ratio", 1.0, 2.0).simplest_at(1.0),
];

fn flux_observer_converges(case: &ClaimCase) -> Verdict {
    let [speed, slip, size, angle] = case.values();
    let flux = case.rating().rotor_flux_vs;
    let truth = Steady::new(case, speed * case.speed(), slip * case.slip(), flux, 0.0, 1e-4);
    let observer = match Basis::try_new(case.machine(), case.rating(), 1e-4) {
        Ok(basis) => CurrentModel::new(basis),
        Err(e) => return Verdict::refused(e),
    };
    let error = C::from_polar(size * flux, angle);
    let eta = case.constants().eta;
    // A chord in place of the turning current: (hω_e)²/12 of the flux.
    observer::flux_error_decays(&observer, &truth, error, 0.999 * eta, (3.0 / eta).min(2.0), 2e-3 * flux)
}

/// Largest speed, flux, current and voltage of a region, in the units of the windings.
struct Limits {
    speed: f64,
    flux: f64,
    current: f64,
    voltage: f64,
}

fn limits_of_appendix_ii() -> Limits {
    Limits { speed: 145.0, flux: 0.27, current: 5.0, voltage: 311.0 }
}

/// Speed, flux, current and voltage of a case.
fn state(case: &ClaimCase, most: &Limits) -> (f64, [C; 3]) {
    let [speed, flux, flux_angle, current, current_angle, voltage, voltage_angle] = case.values();
    let vectors = [
        C::from_polar(flux * most.flux, flux_angle),
        C::from_polar(current * most.current, current_angle),
        C::from_polar(voltage * most.voltage, voltage_angle),
    ];
    (speed * most.speed, vectors)
}

/// |f₁| of (27), with the derivative of the current that the machine has by (3), A/s²/Ω.
fn f_1(w: &WindingParameters<f64>, pole_pairs: u32, (omega, [lambda, i, u]): (f64, [C; 3])) -> f64 {
    let c = w.derived(pole_pairs);
    let a = C::new(-c.eta, c.n_p * omega);
    let i_rate = -(a * lambda) * c.beta - i * c.gamma + u / c.sigma_l_s;
    let gamma = w.kenne(pole_pairs).gamma;
    (u * gamma[1] - i * gamma[2] - i_rate * gamma[3]).norm()
}

fn designed_bound(case: &ClaimCase) -> Verdict {
    let most = Limits {
        speed: case.speed(),
        flux: case.rating().rotor_flux_vs,
        current: 2.0 * case.current(),
        voltage: case.rating().phase_voltage_peak_v,
    };
    let region = KenneRegion {
        stator_resistance_ratio: [0.5, 1.5],
        rotor_resistance_ratio: [0.5, 2.0],
        ..KenneRegion::certain(most.speed, [0.2 * most.flux, most.flux], most.current, most.voltage)
    };
    let k = match design(DesignModel::Machine(case.machine().into()), &region, 1e-6) {
        Ok((design, _)) => design.k_x,
        Err(e) => return Verdict::refused(e),
    };
    // The machine hot, R̂_r at the other end of its range.
    let nominal = case.parameters().windings();
    let mut w = nominal;
    w.stator_resistance_ohm *= 1.5;
    w.rotor_resistance_ohm *= 2.0;
    let e = 1.5 * nominal.rotor_resistance_ohm;
    Verdict::at_most("|f₁e_Rr| over K", e * f_1(&w, case.machine().pole_pairs(), state(case, &most)) / k, 1.0)
}

fn theorem_7(case: &ClaimCase) -> Verdict {
    let [slip, error, share, slope_1, slope_2] = case.values();
    const H: f64 = 5e-6;
    let r_r = case.parameters().rotor_resistance_ohm;
    let (k, mu) = (10.0 * r_r, 10.0 * r_r * share);
    let (gain, averaging) = (4e4, 1e-4);
    let Ok(range_ohm) = Range::try_new("range_ohm", 0.0, 5.0 * r_r) else { return Verdict::Outside };
    let rated = case.slip() * case.rating().rotor_flux_vs / r_r * case.speed();
    let settings = KenneSettings {
        high_gain_per_s: gain,
        sliding_gain_a_per_s2: 1e9,
        averaging_time_s: averaging,
        rate_ohm_per_s: k,
        boundary_layer_ohm: 0.0,
        range_ohm,
        start_ohm: r_r * (1.0 + error),
        least_rotor_current_rate_a_per_s: 0.05 * rated,
        excitation_window_s: 0.05,
    };
    let identifier = match KenneRotorResistance::try_new(&case.parameters().windings(), case.machine().pole_pairs(), &settings, H)
    {
        Ok(identifier) => identifier,
        Err(e) => return Verdict::refused(e),
    };
    let n_p = case.constants().n_p;
    let at = Operating { omega_r: 0.9 * case.speed() * n_p, omega_g: slip * case.slip(), flux_vs: 0.9 };
    let mut machine = HeldMachine::new(case.machine(), &at, H);
    let mut x = identifier.start();
    let (mut truth, mut begun, mut worst) = (r_r, None, f64::MIN);
    const SAMPLES: usize = 20_000;
    for n in 0..SAMPLES {
        let slope = mu * if n < SAMPLES / 2 { slope_1 } else { slope_2 };
        truth = (truth + slope * H).clamp(0.3 * r_r, 3.0 * r_r);
        if let Err(e) = machine.set(BaseParameter::RotorResistance, truth) {
            return Verdict::refused(e);
        }
        machine.advance(&at, 1e3);
        let said = identifier.step(&mut x, &machine.sample());
        let e = (said.values[0] - truth).abs();
        if said.status == IdentifierStatus::Adapting {
            let (from, first) = *begun.get_or_insert((n, e));
            let promised = (first - (k - mu) * H * (n - from) as f64).max(0.0);
            worst = worst.max(e - promised);
        }
    }
    // Late by the two filters; β i_r dR_r/dt against f₁ = β di_r/dt is at most μ/ω; 1.5 % is for the machine's own transients where
    // the slope changes: Assumption 2.
    let late = (k + mu) * (averaging + 1.0 / gain) + mu / at.omega_r + 0.015 * r_r;
    Verdict::at_most("error beyond the promise over what the filters cost", worst / late, 1.0)
}

fn f_1_does_not_vanish(case: &ClaimCase) -> Verdict {
    let [frequency, slip] = case.values();
    let c = case.constants();
    let omega_e = frequency * 2.0 * core::f64::consts::PI * case.rating().electrical_frequency_hz;
    let at = |slip: f64| {
        let steady = Steady::new(case, (omega_e - slip) / c.n_p, slip, case.rating().rotor_flux_vs, 0.0, 1e-4);
        let gamma = case.parameters().windings().kenne(case.machine().pole_pairs()).gamma;
        let i = steady.current(0);
        (steady.voltage_now(0) * gamma[1] - i * gamma[2] - j(i) * (omega_e * gamma[3])).norm()
    };
    Verdict::at_least("|f₁| over that at rated load", at(0.1 * slip * case.slip()) / at(case.slip()), 1e-9)
}

fn with_drive(case: &ClaimCase, run: impl FnOnce(&mut Kenne<f64>) -> Verdict) -> Verdict {
    let known = known(case);
    let gains = KenneGains::typical(&known, case.rating().rotor_flux_vs, dc_voltage_v(case), STEP);
    match Kenne::try_new(&known, &gains) {
        Ok(mut drive) => run(&mut drive),
        Err(e) => Verdict::refused(e),
    }
}

/// The drive with its identifier, (43).
struct Adaptive<'a> {
    drive: &'a mut Kenne<f64>,
    identifier: KenneRotorResistance<f64>,
    state: <KenneRotorResistance<f64> as Identifier<f64, 1>>::State,
}

impl Controller<f64> for Adaptive<'_> {
    fn step(&mut self, measured: &Measured<f64>, reference: &Reference<f64>) -> Command<f64> {
        let estimate = self.identifier.step(&mut self.state, &Sample::from(measured));
        self.drive.set_rotor_resistance_ohm(estimate.values[0]);
        self.drive.step(measured, reference)
    }
}

fn resistances(case: &ClaimCase, limits: &Following) -> Verdict {
    let [speed, load, r_s, r_r] = case.values();
    let p = case.parameters();
    let changed = |p: BaseParameter, ohm: f64| (ParameterId::Base(p), ohm);
    let truth: Result<Machine<f64>, _> = case.machine().with(&[
        changed(BaseParameter::StatorResistance, r_s * p.stator_resistance_ohm),
        changed(BaseParameter::RotorResistance, r_r * p.rotor_resistance_ohm),
    ]);
    let settings = KenneSettings::for_rating(&p.windings(), case.machine().pole_pairs(), case.rating(), STEP);
    let identifier = KenneRotorResistance::try_new(&p.windings(), case.machine().pole_pairs(), &settings, STEP);
    match (truth, identifier) {
        (Ok(truth), Ok(identifier)) => with_drive(case, |drive| {
            let state = identifier.start();
            follows_speed(case, &truth, &mut Adaptive { drive, identifier, state }, [speed, load], limits)
        }),
        (Err(e), _) | (_, Err(e)) => Verdict::refused(e),
    }
}
