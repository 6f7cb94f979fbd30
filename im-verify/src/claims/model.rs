//! The model (1) of Kwon et al.

use im_model::state_space::{StateSpace, kwon_state};
use im_model::{Plant, PlantInput, State};

use crate::claim::Origin::Says;
use crate::claim::{C, Claim, ClaimCase, Cost, Found, Paper};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[Claim {
    number: 1,
    name: "kwon_1_is_the_machine",
    paper: Paper::Kwon,
    place: "Section II, (1); Section VI, (9)",
    origin: Says(
        "After some manipulations, we can represent the two-phase equivalent model of a three-phase cage induction motor in the form: (1)",
    ),
    statement: "Voltage equations, linear flux linkages and torque of the machine take the form (1), that is ẋ = Ax + B₁u₁ + B₂u₂(x, τ_L).",
    assumptions: "Linear magnetics, smooth air gap. Any state, voltage and load.",
    found: Found::Holds,
    finding: "The rates of (9), with the u₂ that the paper leaves out derived, are those of the circuit in flux coordinates to rounding.",
    cost: Cost::Equation,
    variables: &STATE,
    check: state_space_is_the_machine,
}];

const STATE: [Variable; 8] = [
    Variable::even("stator_flux_a_vs", -1.5, 1.5).simplest_at(1.0),
    Variable::even("stator_flux_b_vs", -1.5, 1.5),
    Variable::even("rotor_flux_a_vs", -1.5, 1.5).simplest_at(1.0),
    Variable::even("rotor_flux_b_vs", -1.5, 1.5),
    Variable::even("speed_share", -1.5, 1.5).simplest_at(1.0),
    Variable::even("voltage_a_v", -500.0, 500.0),
    Variable::even("voltage_b_v", -500.0, 500.0),
    Variable::even("load_share", -2.0, 2.0),
];

fn state_space_is_the_machine(case: &ClaimCase) -> Verdict {
    let [sa, sb, ra, rb, speed, ua, ub, load] = case.values();
    let machine = case.machine();
    let plant = Plant::new(machine);
    let x = State { psi_s: C::new(sa, sb), psi_r: C::new(ra, rb), omega_m: speed * case.speed(), ..State::default() };
    let load = load * case.rating().torque_nm;
    let rates = plant.evaluate(&x, &PlantInput::new(C::new(ua, ub), load)).rates;
    // Currents are linear in the fluxes: di/dt = i(dψ/dt).
    let di = plant.currents(&rates).i_s;
    let expected = [rates.omega_m, rates.psi_r.re, rates.psi_r.im, di.re, di.im];
    let space = StateSpace::new(&case.parameters().windings(), machine.pole_pairs());
    let got = space.rates(&kwon_state(machine, &x), &[ua, ub].into(), load);
    let worst = expected.iter().zip(got.iter()).fold(0.0f64, |w, (a, b)| w.max((a - b).abs()));
    let size = expected.iter().fold(1.0f64, |s, a| s.max(a.abs()));
    // Rounding, through currents that are small differences of fluxes.
    Verdict::at_most("largest difference of a rate over the largest rate", worst / size, 1e-9)
}
