//! Maximum torque per ampere (Kwon et al., Section VIII), through the code of `im-design` and `im-model`.

use im_design::mtpa::{AirGap, Aqdm, CurrentLaw, SlipLaw, for_torque};
use im_model::machines::KWON_TABLE_IV;
use im_model::space_vector::cross;
use im_model::{Held, Plant, steady_state};

use crate::claim::Origin::{Extends, Says};
use crate::claim::{Claim, ClaimCase, Cost, Found, Paper};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[
    Claim {
        number: 23,
        name: "mtpa_torque_does_not_depend_on_the_supply_frequency",
        paper: Paper::Kwon,
        place: "Section VIII, after (25)",
        origin: Says("and so T_e(ω_s, I_s) is independent of ω_e"),
        statement: "T_e(ω_s, I_s) is independent of ω_e.",
        assumptions: "Steady state, linear machine; one slip frequency at two supply frequencies.",
        found: Found::Holds,
        finding: "Holds to rounding.",
        cost: Cost::Equation,
        variables: &[
            Variable::even("slip_share", 0.05, 3.0).simplest_at(1.0),
            Variable::even("frequency_share", 0.1, 0.9).simplest_at(0.5),
        ],
        check: torque_is_independent_of_frequency,
    },
    Claim {
        number: 24,
        name: "mtpa_law_31_is_best_over_the_entire_torque_range",
        paper: Paper::Kwon,
        place: "Section VIII, (31)",
        origin: Extends(
            "for the entire torque range, the proposed control strategy can find a slip frequency at which the produced torque is optimal for a given stator current",
        ),
        statement: "At the slip of (31) the torque is larger than at 0.9 and 1.1 times that slip with the same current, far beyond the rated torque, too.",
        assumptions: "The circuit of Table V; 1 to 510 N m. No other machine enters.",
        found: Found::Fails { rate: 0.41 },
        finding: "The published slip law leaves the optimum at both ends: 10 % off at 1 N m, 7.5 % at 257 N m and far off beyond. Laws that do \
                  not are fitted by im design mtpa.",
        cost: Cost::Run,
        variables: &[Variable::ratio("torque_nm", 1.0, 510.0, 100.0)],
        check: |case| {
            let [torque] = case.values();
            slip_law_is_best(torque)
        },
    },
    Claim {
        number: 25,
        name: "mtpa_laws_are_near_the_optimum_from_19_to_215_nm",
        paper: Paper::Kwon,
        place: "Section VIII, (30), (31)",
        origin: Extends("The objective of this control strategy is to produce a desired torque with the minimum current"),
        statement: "(30) and (31) give a torque with the least current, in numbers.",
        assumptions: "The circuit of Table V, 19 to 215 N m: the current within 2 %, the slip within 3.5 %, better than at 0.9 and 1.1 times the slip.",
        found: Found::HoldsIf,
        finding: "Holds. The paper names no range for (30), (31).",
        cost: Cost::Run,
        variables: &[Variable::ratio("torque_nm", 19.0, 215.0, 100.0)],
        check: |case| {
            let [torque] = case.values();
            let best = match for_torque(&Aqdm::kwon_table_v(), torque) {
                Ok(best) => best,
                Err(e) => return Verdict::refused(e),
            };
            let (current, slip) = (CurrentLaw::KWON.at(torque), SlipLaw::KWON.at(torque));
            Verdict::at_most("(30) off the least current", (current / best.current_rms_a - 1.0).abs(), 0.02)
                .and(Verdict::at_most("(31) off the best slip", (slip / best.slip_rad_s - 1.0).abs(), 0.035))
                .and(slip_law_is_best(torque))
        },
    },
    Claim {
        number: 69,
        name: "mtpa_law_31_is_best_at_150_nm",
        paper: Paper::Kwon,
        place: "Section X, Fig. 12",
        origin: Says(
            "In both cases, the torque measured at the estimated optimal slip frequency command ω_s* in (31) is larger than the torque produced at any \
             other slip frequency",
        ),
        statement: "At the current for 150 Nm the slip of (31) gives more torque than 0.9 and 1.1 times it, the paper's two others.",
        assumptions: "The circuit of Table V at 150 Nm, the speed measured. No other machine enters.",
        found: Found::Holds,
        finding: "Holds: 1.0 % less torque at 0.9, 1.3 % less at 1.1.",
        cost: Cost::Run,
        variables: &[],
        check: |_| slip_law_is_best(150.0),
    },
    Claim {
        number: 70,
        name: "mtpa_is_nearly_optimal_in_efficiency",
        paper: Paper::Kwon,
        place: "Section VIII",
        origin: Says(
            "to produce a desired torque with the minimum current that is favorable in terms of inverter losses and nearly optimal in terms of \
             efficiency [16, Chapter 14]",
        ),
        statement: "At 900 rpm the efficiency at the slip of least current is within 0.1 points of the best over all slips.",
        assumptions: "The circuit of Table V with R_s of Table IV: copper losses, as it has no others; 10 to 215 N m. No other machine enters.",
        found: Found::Holds,
        finding: "Holds: 0.07 to 0.08 points are given away, of 95.8 % at 150 Nm.",
        cost: Cost::Run,
        variables: &[Variable::ratio("torque_nm", 10.0, 215.0, 150.0)],
        check: |case| {
            let [torque] = case.values();
            nearly_best_efficiency(torque)
        },
    },
];

/// Output over output and copper losses at 900 rpm, at a slip whose flux gives the torque.
fn efficiency(circuit: &Aqdm, torque: f64, slip: f64) -> f64 {
    let (mut low, mut high) = (1e-6f64, 3.0f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if circuit.operate(middle, slip).1 < torque { low = middle } else { high = middle }
    }
    let (current, torque) = circuit.operate(0.5 * (low + high), slip);
    let stator = 3.0 * KWON_TABLE_IV.windings.stator_resistance_ohm * current * current;
    let output = torque * 94.248;
    output / (output + stator + torque * slip / f64::from(circuit.pole_pairs))
}

fn nearly_best_efficiency(torque: f64) -> Verdict {
    let circuit = Aqdm::kwon_table_v();
    let least = match for_torque(&circuit, torque) {
        Ok(least) => least,
        Err(e) => return Verdict::refused(e),
    };
    let slips = (0..400).map(|k| least.slip_rad_s * 4f64.powf(f64::from(k) / 200.0 - 1.0));
    let best = slips.map(|slip| efficiency(&circuit, torque, slip)).fold(0.0, f64::max);
    Verdict::at_most("efficiency given away", best - efficiency(&circuit, torque, least.slip_rad_s), 1e-3)
}

fn torque_is_independent_of_frequency(case: &ClaimCase) -> Verdict {
    let [slip, frequency] = case.values();
    let plant = Plant::new(case.machine());
    let c = case.constants();
    let per_current = |hz: f64| {
        let omega = (2.0 * core::f64::consts::PI * hz - slip * case.slip()) / c.n_p;
        let x = steady_state(case.machine(), 100.0, hz, Held::Speed(omega))?;
        let i = plant.currents(&x).i_s;
        Ok::<f64, im_model::ModelError>(1.5 * c.n_p * cross(x.psi_s, i) / i.norm_sqr())
    };
    let hz = case.rating().electrical_frequency_hz;
    match (per_current(hz), per_current(frequency * hz)) {
        (Ok(a), Ok(b)) => Verdict::at_most("relative difference of T/I²", (b / a - 1.0).abs(), 1e-6),
        (Err(e), _) | (_, Err(e)) => Verdict::refused(e),
    }
}

/// Torque of a circuit at an rms current and a slip: the flux by bisection, since the current grows with it.
fn torque_at(circuit: &Aqdm, current: f64, slip: f64) -> f64 {
    let (mut low, mut high) = (1e-6f64, 3.0f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if circuit.operate(middle, slip).0 < current { low = middle } else { high = middle }
    }
    circuit.operate(0.5 * (low + high), slip).1
}

fn slip_law_is_best(torque: f64) -> Verdict {
    let circuit = Aqdm::kwon_table_v();
    // The current that gives the torque at the slip of the law.
    let slip = SlipLaw::KWON.at(torque);
    let (mut low, mut high) = (0.01f64, 1000.0f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if torque_at(&circuit, middle, slip) < torque { low = middle } else { high = middle }
    }
    let current = 0.5 * (low + high);
    let around = torque_at(&circuit, current, 0.9 * slip).max(torque_at(&circuit, current, 1.1 * slip));
    Verdict::at_most("torque at 0.9 or 1.1 of the slip over that at the slip", around / torque_at(&circuit, current, slip), 1.0)
}
