//! Theorem 2 of Jadot et al. by the system that its proof is about, integrated here in a few lines of its own.
//!
//! ```text
//! Δz' = −(a + jω_g)Δz − λ(a + jω_r)Δi                                       (44)
//! L_f Δi' = (a − jω_r)Δz − (R_s + R + jω_sL_f)Δi + WᵀΔθ − K_P(Δi + η)        (45), (25)
//! Δθ' = −K_W Re(W̄Δi),   η' = K_IΔi                                          (47), (25)
//! ```
//!
//! λ and K_W are constant, as the proof asks; (47) is taken without L_f, which makes (49) the rate of (48) with K_P in its last term (a
//! constant L_f in it is part of K_W). W takes its steady values (33) at two operating points in turn.

use im_identify::online::RegulationParameters;

use crate::claim::Origin::{Extends, Says};
use crate::claim::{C, Claim, ClaimCase, Cost, Found, Paper};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[
    Claim {
        number: 59,
        name: "jadot_theorem_2_as_printed",
        paper: Paper::Jadot,
        place: "Section IV-B, Theorem 2 and its proof, (50)",
        origin: Says(
            "We prove exponential convergence of the equilibrium Δx = (Δz, Δi_s, Δθ, η) = 0 of the linear time-varying system (44), (45), (47) with \
             the PI loop (25). … Uniform observability of the latter system is equivalent to persistence of excitation of W(t).",
        ),
        statement: "With W persistently exciting Δθ falls below a fifth of what it was, in the norm of K_W⁻¹.",
        assumptions: "λ and K_W constant; W of two operating points in turn, ten rotor time constants each, forty times: rank four over both.",
        found: Found::Fails { rate: 0.9 },
        finding: "Δz = Δi = 0 asks for WᵀΔθ = K_Pη only, and η is then constant: every Δθ with (W_A − W_B)ᵀΔθ = 0 stays for ever, a plane of \
                  equilibria, and η takes the voltage. The proof's (50) has no column for η, though (45) has K_Pη in v_s. What must be exciting is \
                  (W, 1): with two points it is not. Put right in claim 75.",
        cost: Cost::Study,
        variables: &TWO_POINTS,
        check: |case| left_of_the_errors(case, 0.0),
    },
    Claim {
        number: 75,
        name: "jadot_theorem_2_in_its_own_system_with_an_integral_action_that_forgets",
        paper: Paper::Jadot,
        place: "Section IV-B, Theorem 2 and its proof, (50)",
        origin: Extends("Uniform observability of the latter system is equivalent to persistence of excitation of W(t)."),
        statement: "The same with η' = K_IΔi − ρη.",
        assumptions: "As claim 59, ρ = 1000 1/s.",
        found: Found::HoldsIf,
        finding: "Holds: η is then among what must vanish with Δi, and W alone need be exciting.",
        cost: Cost::Study,
        variables: &TWO_POINTS,
        check: |case| left_of_the_errors(case, 1000.0),
    },
];

const TWO_POINTS: [Variable; 8] = [
    Variable::even("speed_1_rad_s", 200.0, 300.0).simplest_at(300.0),
    Variable::even("slip_1_over_rotor_rate", 1.2, 2.0).simplest_at(1.5),
    Variable::even("speed_2_rad_s", 20.0, 60.0).simplest_at(30.0),
    Variable::even("slip_2_over_rotor_rate", 0.2, 0.6).simplest_at(0.4),
    Variable::even("r_req_error", -1.0, 1.0).simplest_at(1.0),
    Variable::even("l_error", -1.0, 1.0),
    Variable::even("r_s_error", -1.0, 1.0),
    Variable::even("l_f_error", -1.0, 1.0),
];

/// An operating point with its W, (33).
struct At {
    omega_r: f64,
    omega_g: f64,
    w: [C; 4],
}

fn at(p: &RegulationParameters<f64>, omega_r: f64, omega_g: f64) -> At {
    const FLUX_VS: f64 = 0.9;
    let (a, omega_s) = (p.inverse_rotor_time_constant(), omega_r + omega_g);
    let turning = C::new(a, omega_g);
    let i = turning * (FLUX_VS / p.rotor_resistance_ohm);
    let w = [
        C::new(omega_s * omega_g * FLUX_VS, 0.0) / turning,
        C::new(0.0, -omega_s * a * FLUX_VS) / turning,
        -i * p.stator_resistance_ohm,
        -i * C::new(0.0, omega_s * p.leakage_inductance_h),
    ];
    At { omega_r, omega_g, w }
}

/// Δz, Δi, η; Δθ.
#[derive(Clone, Copy)]
struct State {
    z: C,
    i: C,
    eta: C,
    theta: [f64; 4],
}

impl State {
    fn moved(&self, k: &Self, h: f64) -> Self {
        let theta = core::array::from_fn(|n| self.theta[n] + k.theta[n] * h);
        Self { z: self.z + k.z * h, i: self.i + k.i * h, eta: self.eta + k.eta * h, theta }
    }
}

/// det of the Gram matrix of W over both points, its rows scaled to one: 1 for directions at right angles, 0 for a rank below four.
fn excitation(points: &[At; 2]) -> f64 {
    let gram = |k: usize, l: usize| points.iter().map(|at| (at.w[k].conj() * at.w[l]).re).sum::<f64>();
    let scaled = core::array::from_fn(|k| core::array::from_fn(|l| gram(k, l) / (gram(k, k) * gram(l, l)).sqrt()));
    super::determinant::<4>(scaled)
}

fn left_of_the_errors(case: &ClaimCase, leak: f64) -> Verdict {
    let [omega_1, slip_1, omega_2, slip_2, e1, e2, e3, e4] = case.values();
    let p = RegulationParameters::<f64>::from(case.parameters().inverse_gamma());
    let (a, r, l_f) = (p.inverse_rotor_time_constant(), p.rotor_resistance_ohm, p.leakage_inductance_h);
    let points = [at(&p, omega_1, slip_1 * a), at(&p, omega_2, slip_2 * a)];
    let size = [e1, e2, e3, e4].iter().map(|e| e * e).sum::<f64>().sqrt();
    if size < 0.1 || excitation(&points) < 1e-3 {
        return Verdict::Outside;
    }
    // A current loop of 800 rad/s; K_W so large that each parameter would move at 400 1/s at the points, were it alone and η zero.
    let k_p = core::f64::consts::SQRT_2 * 800.0 * l_f;
    let k_i = l_f * 800.0 * 800.0 / k_p;
    let k_w: [f64; 4] =
        core::array::from_fn(|k| 400.0 * (k_p + r) / (0.5 * points.iter().map(|at| at.w[k].norm_sqr()).sum::<f64>()));
    let lambda = r / C::new(a, 300.0).norm();
    let rates = |at: &At, x: &State| {
        let omega_s = at.omega_r + at.omega_g;
        let seen: C = at.w.iter().zip(x.theta).map(|(w, e)| *w * e).sum();
        let resistance = C::new(p.stator_resistance_ohm + r, omega_s * l_f);
        State {
            z: -x.z * C::new(a, at.omega_g) - x.i * C::new(a, at.omega_r) * lambda,
            i: (x.z * C::new(a, -at.omega_r) - x.i * resistance + seen - (x.i + x.eta) * k_p) / l_f,
            eta: x.i * k_i - x.eta * leak,
            theta: core::array::from_fn(|k| -k_w[k] * (at.w[k].conj() * x.i).re),
        }
    };
    let zero = C::new(0.0, 0.0);
    // A unit vector in the norm of K_W⁻¹, the errors in proportion to the roots of the gains; the system is linear.
    let e = [e1, e2, e3, e4];
    let start = core::array::from_fn(|k| e[k] / size * k_w[k].sqrt());
    let mut x = State { z: zero, i: zero, eta: zero, theta: start };
    // Runge-Kutta of fourth order: the fastest rates are near 1600 1/s.
    const H: f64 = 4e-4;
    for _ in 0..40 {
        for at in &points {
            for _ in 0..(10.0 / a / H) as usize {
                let k1 = rates(at, &x);
                let k2 = rates(at, &x.moved(&k1, 0.5 * H));
                let k3 = rates(at, &x.moved(&k2, 0.5 * H));
                let k4 = rates(at, &x.moved(&k3, H));
                x = x.moved(&k1, H / 6.0).moved(&k2, H / 3.0).moved(&k3, H / 3.0).moved(&k4, H / 6.0);
            }
        }
    }
    let left = x.theta.iter().zip(k_w).map(|(e, k)| e * e / k).sum::<f64>().sqrt();
    Verdict::at_most("‖Δθ‖ at the end over that at the start", left, 0.2)
}
