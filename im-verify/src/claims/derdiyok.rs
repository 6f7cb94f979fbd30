//! The sliding-mode observer of Derdiyok et al. (Kwon et al., Section IV), through the code of `im-observers`.

use im_design::{DesignModel, sliding};
use im_model::space_vector::{dot, unit};
use im_observers::{Basis, Derdiyok, DerdiyokGains, Discretization, Input, Observer};

use crate::claim::Origin::{Extends, Says};
use crate::claim::{C, Claim, ClaimCase, Cost, Found, Paper};
use crate::properties::{Steady, observer};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[
    Claim {
        number: 8,
        name: "derdiyok_v_falls_above_the_published_bound",
        paper: Paper::Kwon,
        place: "Section IV, bound on ν₀",
        origin: Says(
            "Therefore, V̇ < 0 if ν₀ > (β|(î_s − i_s)ᵀA_ωλ_r| − (γ/β)‖î_s − i_s‖²)/(|î_sa − i_sa| + |î_sb − i_sb|) … for 0 < |î_sa − i_sa| + |î_sb − i_sb| < 1, [this is] ≤ β max{|ν₁|, |ν₂|} + γ/β",
        ),
        statement: "V = sᵀs/2 has V̇ < 0 if ν₀ > β max(|ν₁|, |ν₂|) + γ/β, for 0 < |s_a| + |s_b| < 1.",
        assumptions: "Any speed, slip and flux; s in any direction, less than 1 A in all.",
        found: Found::Holds,
        finding: "Holds, with β times more gain than needed: the printed ṡ has a β too many, and the term γ/β helps and need not be bounded. \
                  Nor is |s| < 1 needed: claim 9. With β < 1 1/H, on machines far smaller than these, it would not be enough.",
        cost: Cost::Equation,
        variables: &[SPEED, SLIP, Variable::ratio("current_error_a", 1e-3, 0.7, 0.1), Variable::angle("current_error_angle_rad")],
        check: |case| {
            let c = case.constants();
            v_falls(case, |largest| c.beta * largest + c.gamma / c.beta)
        },
    },
    Claim {
        number: 9,
        name: "derdiyok_v_falls_above_the_derived_bound",
        paper: Paper::Kwon,
        place: "Section IV, (7), (8)",
        origin: Extends("the surface {s = 0} is attractive for sufficiently large gain ν₀"),
        statement: "V̇ < 0 for ν₀ > max(|ν₁|, |ν₂|), the components of A_ωλ, without β and without γ/β.",
        assumptions: "Any speed, slip and flux; any s, to twice the rated current.",
        found: Found::Holds,
        finding: "Holds with 0.1 % to spare, for any s.",
        cost: Cost::Equation,
        variables: &[
            SPEED,
            SLIP,
            Variable::ratio("current_error_a", 1e-3, 200.0, 0.1),
            Variable::angle("current_error_angle_rad"),
        ],
        check: |case| v_falls(case, |largest| 1.001 * largest),
    },
    Claim {
        number: 10,
        name: "derdiyok_slides_in_sampled_time",
        paper: Paper::Kwon,
        place: "Section IV, before (8) and \"in sliding\"",
        origin: Says(
            "We now use the arguments of Derdiyok et al. [3] to show that the surface {s = 0} is attractive for sufficiently large gain ν₀.",
        ),
        statement: "The surface {s = 0} is reached and kept.",
        assumptions: "ν₀ of im-design for the speed and flux, with a tenth to spare; 100 µs, implicit. From rated current in error.",
        found: Found::Holds,
        finding: "Holds: the residual vanishes to rounding at every sample, without chatter. With half the gain it does not (the mutation of this claim).",
        cost: Cost::Run,
        variables: &[SPEED, SLIP, Variable::angle("current_error_angle_rad")],
        check: slides,
    },
    Claim {
        number: 11,
        name: "derdiyok_equivalent_control_gives_speed_and_time_constant",
        paper: Paper::Kwon,
        place: "Section IV, end",
        origin: Says("that is, we have an estimate of the motor time constant, η, as well as the rotor speed, ω"),
        statement: "[η, n_pω]ᵀ follows from ν and λ: the speed and the rotor time constant are estimated.",
        assumptions: "The flux is right at the start; sliding; |ω_e| beyond 5 % of rated.",
        found: Found::HoldsIf,
        finding: "Holds for the right flux. Its estimate is a bare integral, so that it stays right only if it starts right: claim 12.",
        cost: Cost::Run,
        variables: &[SPEED, SLIP],
        check: speed_and_time_constant,
    },
    Claim {
        number: 12,
        name: "derdiyok_flux_error_vanishes",
        paper: Paper::Kwon,
        place: "Section I; Section IV, end",
        origin: Extends(
            "the output of a sliding-mode observer is used in the formula for the flux to obtain an estimate of the rotor flux",
        ),
        statement: "A flux error at the start vanishes from the estimate λ̂' = −ν + ηL_m i. (The paper derives the formula with the true flux and does not say so.)",
        assumptions: "A flux error at the start of 5 to 20 %; after five rotor time constants it is half of that at most.",
        found: Found::Fails { rate: 0.99 },
        finding: "Always fails: with βν from (7), λ̂' is the voltage model, (L_r/L_m)(u − R_s i − σL_s i'), a bare integral without any \
                  feedback of λ̂. An error at the start stays for ever.",
        cost: Cost::Run,
        variables: &[
            SPEED,
            SLIP,
            Variable::even("flux_error_share", 0.05, 0.2).simplest_at(0.1),
            Variable::angle("flux_error_angle_rad"),
        ],
        check: |case| flux_comes_in(case, 0.0),
    },
    Claim {
        number: 13,
        name: "derdiyok_flux_error_vanishes_with_the_anchor",
        paper: Paper::Kwon,
        place: "Section I; Section IV, end",
        origin: Extends(
            "the output of a sliding-mode observer is used in the formula for the flux to obtain an estimate of the rotor flux",
        ),
        statement: "The same, drawn to where η̂ is the known η.",
        assumptions: "An anchor of 10 1/s, η known; |ω_e| beyond a quarter of rated.",
        found: Found::HoldsIf,
        finding: "Holds: an error falls as e^(−10t), averaged over a turn of the field.",
        cost: Cost::Run,
        variables: &[
            SPEED,
            SLIP,
            Variable::even("flux_error_share", 0.05, 0.2).simplest_at(0.1),
            Variable::angle("flux_error_angle_rad"),
        ],
        check: |case| flux_comes_in(case, 10.0),
    },
];

const SPEED: Variable = Variable::even("speed_share", -1.2, 1.2).simplest_at(1.0);
const SLIP: Variable = Variable::even("slip_share", -1.5, 1.5).simplest_at(0.0);

fn published(nu0: f64) -> DerdiyokGains {
    DerdiyokGains { nu0, boundary_layer_a: 0.0, filter_rad_s: 0.0, anchor_per_s: 0.0 }
}

/// A_ωλ = (η − jn_pω)λ.
fn disturbance(case: &ClaimCase, omega: f64, flux: C) -> C {
    let c = case.constants();
    C::new(c.eta, -c.n_p * omega) * flux
}

/// V̇ from a step of forward Euler, which is the rate at its beginning.
fn v_falls(case: &ClaimCase, nu0: impl Fn(f64) -> f64) -> Verdict {
    let [speed, slip, size, angle] = case.values();
    const H: f64 = 1e-6;
    let omega = speed * case.speed();
    let truth = Steady::new(case, omega, slip * case.slip(), case.rating().rotor_flux_vs, 0.3, H);
    // The surface is looked at from sample 1: the step before shifts s by at most this.
    let nu = disturbance(case, omega, truth.flux(1));
    let gains = published(nu0(nu.re.abs().max(nu.im.abs())));
    let basis = Basis::try_new(case.machine(), case.rating(), H);
    let observer = match basis.and_then(|b| Derdiyok::discretized(b, gains, Discretization::ForwardEuler)) {
        Ok(observer) => observer,
        Err(e) => return Verdict::refused(e),
    };
    let mut state = observer.state_at(truth.flux(0), truth.current(0) + unit(angle) * size, omega);
    let s = -observer.step(&mut state, &truth.input(1)).residual_a;
    let y = -observer.step(&mut state, &Input::new(truth.voltage_now(1), truth.current(1))).residual_a;
    // î' − i', the current moving by jω_e i at sample 1.
    let rate = (y + truth.current(1) - (s + truth.current(1))) / H - C::new(0.0, truth.omega_e) * truth.current(1);
    let c = case.constants();
    // ‖s‖₁ would fall by βν₀ without a disturbance; rounding of the difference over H.
    let size = c.beta * gains.nu0 * (s.re.abs() + s.im.abs());
    Verdict::at_most("V̇ over βν₀‖s‖₁", dot(s, rate) / size, 1e-14 * truth.current(1).norm() / (H * c.beta * gains.nu0) + 1e-9)
}

fn slides(case: &ClaimCase) -> Verdict {
    let [speed, slip, angle] = case.values();
    let flux = case.rating().rotor_flux_vs;
    let truth = Steady::new(case, speed * case.speed(), slip * case.slip(), flux, 0.0, 1e-4);
    let top = speed.abs().max(0.01) * case.speed();
    let plant = DesignModel::Machine(case.machine().into());
    let observer = sliding::derdiyok(plant, top, 1.1 * flux, 1e-3 * flux).map_err(|e| e.to_string()).and_then(|(design, _)| {
        let basis = Basis::try_new(case.machine(), case.rating(), 1e-4);
        basis.and_then(|b| Derdiyok::try_new(b, published(design.nu0))).map_err(|e| e.to_string())
    });
    let observer = match observer {
        Ok(observer) => observer,
        Err(e) => return Verdict::refused(e),
    };
    let start = [truth.flux(0), truth.current(0) + unit(angle) * case.current()];
    let samples = 4000;
    let mut worst = 0.0f64;
    observer::run(&observer, &truth, start, truth.omega_m, samples, |k, e| {
        if k > samples / 2 {
            worst = worst.max(e.residual_a.norm());
        }
    });
    Verdict::at_most("residual in sliding over the rated current", worst / case.current(), 1e-6)
}

fn speed_and_time_constant(case: &ClaimCase) -> Verdict {
    let [speed, slip] = case.values();
    let flux = case.rating().rotor_flux_vs;
    let truth = Steady::new(case, speed * case.speed(), slip * case.slip(), flux, 0.0, 1e-4);
    if truth.omega_e.abs() < 0.05 * 2.0 * core::f64::consts::PI * case.rating().electrical_frequency_hz {
        return Verdict::Outside;
    }
    let gains = DerdiyokGains { filter_rad_s: 200.0, ..DerdiyokGains::published(case.machine(), 1.2 * flux, 1.5 * case.speed()) };
    let observer = match Basis::try_new(case.machine(), case.rating(), 1e-4).and_then(|b| Derdiyok::try_new(b, gains)) {
        Ok(observer) => observer,
        Err(e) => return Verdict::refused(e),
    };
    let mut state = observer.state_at(truth.flux(0), truth.current(0), truth.omega_m);
    let mut omega = f64::NAN;
    for k in 1..=1000 {
        omega = observer.step(&mut state, &truth.input(k)).omega_m;
    }
    let c = case.constants();
    // ν and λ̂ over a sample, in which both turn: (hω_e)² of what they are.
    let size = c.eta.hypot(c.n_p * truth.omega_m) + 0.01 * truth.omega_e.abs();
    let eta = state.inverse_rotor_time_constant_per_s();
    Verdict::at_most("error of n_pω̂ over √(η² + n_p²ω²)", c.n_p * (omega - truth.omega_m).abs() / size, 0.01)
        .and(Verdict::at_most("error of η̂ over √(η² + n_p²ω²)", (eta - c.eta).abs() / size, 0.01))
}

fn flux_comes_in(case: &ClaimCase, anchor_per_s: f64) -> Verdict {
    let [speed, slip, size, angle] = case.values();
    let flux = case.rating().rotor_flux_vs;
    let truth = Steady::new(case, speed * case.speed(), slip * case.slip(), flux, 0.0, 1e-4);
    let rated = 2.0 * core::f64::consts::PI * case.rating().electrical_frequency_hz;
    if anchor_per_s > 0.0 && truth.omega_e.abs() < 0.25 * rated {
        return Verdict::Outside;
    }
    let gains = DerdiyokGains { anchor_per_s, ..DerdiyokGains::published(case.machine(), 1.4 * flux, 1.5 * case.speed()) };
    let observer = match Basis::try_new(case.machine(), case.rating(), 1e-4).and_then(|b| Derdiyok::try_new(b, gains)) {
        Ok(observer) => observer,
        Err(e) => return Verdict::refused(e),
    };
    let duration = if anchor_per_s > 0.0 { 5.0 / anchor_per_s } else { (5.0 / case.constants().eta).min(2.0) };
    let samples = (duration / 1e-4) as usize;
    let error = unit(angle) * (size * flux);
    let mut last = f64::NAN;
    observer::run(&observer, &truth, [truth.flux(0) + error, truth.current(0)], truth.omega_m, samples, |k, e| {
        last = (e.rotor_flux_vs - truth.flux(k)).norm();
    });
    Verdict::at_most("what is left of the flux error", last / error.norm(), 0.5)
}
