//! The lowest stator frequency at which each observer holds with a wrong R_s and an inverter that keeps a part of its voltage: through the code of
//! `im-observers`.

use im_model::effects::{Hooks, InverterNonlinearity};
use im_model::{BaseParameter, ParameterId};
use im_observers::{Basis, Derdiyok, FullOrder, Kalman, Kubota, Named, ObserverError, StartingGains, Thau, Utkin};

use super::PERFORM_WELL;
use crate::claim::Origin::Extends;
use crate::claim::{Claim, ClaimCase, Cost, Found, Paper};
use crate::properties::Steady;
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[
    FULL_ORDER,
    Claim {
        number: 78,
        name: "kubota_holds_above_its_lowest_frequency",
        statement: "Kubota's with the stabilized gain the same from ω_e = 10(|ΔR_s| i + u_d)/λ on.",
        assumptions: "As claim 77.",
        found: Found::Fails { rate: 1e-3 },
        finding: "A rule, and no law: six of 4000 are lost, all braking. It does not learn R_s, and needs twice the frequency.",
        check: |case| holds::<Kubota<f64>>(case, 10.0),
        ..FULL_ORDER
    },
    Claim {
        number: 79,
        name: "derdiyok_holds_above_its_lowest_frequency",
        statement: "Derdiyok's the same from ω_e = 15(|ΔR_s| i + u_d)/λ on.",
        assumptions: "As claim 77.",
        found: Found::Fails { rate: 7e-5 },
        finding: "A rule, and no law: one of 14000 is lost. Three times the frequency of the full-order observer.",
        check: |case| holds::<Derdiyok<f64>>(case, 15.0),
        ..FULL_ORDER
    },
    Claim {
        number: 80,
        name: "utkin_holds_above_its_lowest_frequency",
        statement: "Utkin's the same from ω_e = 20(|ΔR_s| i + u_d)/λ on.",
        assumptions: "As claim 77.",
        found: Found::Fails { rate: 1e-3 },
        finding: "Five of 4000 are lost, braking, where nearly everything is known and the rule asks for next to no frequency: as Kubota's without \
                  feedback (claim 6) it has a region near zero where it finds another speed.",
        check: |case| holds::<Utkin<f64>>(case, 20.0),
        ..FULL_ORDER
    },
    Claim {
        number: 81,
        name: "thau_holds_above_its_lowest_frequency",
        statement: "Thau's the same from ω_e = 20(|ΔR_s| i + u_d)/λ on.",
        assumptions: "As claim 77.",
        found: Found::Fails { rate: 0.09 },
        finding: "One in eleven is lost, motoring and braking, some far above the rule: the gain is designed at one speed, and at some others \
                  it loses the machine.",
        check: |case| holds::<Thau<f64>>(case, 20.0),
        ..FULL_ORDER
    },
    Claim {
        number: 82,
        name: "kalman_holds_above_its_lowest_frequency",
        statement: "The extended Kalman filter the same from ω_e = 15(|ΔR_s| i + u_d)/λ on.",
        assumptions: "As claim 77.",
        found: Found::Fails { rate: 8e-4 },
        finding: "A rule, and no law: three of 4000 are lost, all braking; with 10 in place of 15 ten of 1000.",
        check: |case| holds::<Kalman<f64>>(case, 15.0),
        ..FULL_ORDER
    },
];

/// What the others have in common with it.
const FULL_ORDER: Claim = Claim {
    number: 77,
    name: "full_order_holds_above_its_lowest_frequency",
    paper: Paper::Kwon,
    place: "Section III, summary; Section XI",
    origin: Extends(PERFORM_WELL),
    statement: "With a wrong R_s and an inverter that keeps a part of its voltage, the full-order observer holds a machine at every stator \
                frequency from ω_e = 5(|ΔR_s| i + u_d)/λ on.",
    assumptions: "R_s up to 20 % wrong, u_d up to 1 % of rated voltage, held at rated flux, load from rated to rated braking, 6 s from the \
                  right state; it holds where in the last second the speed is within the rated slip and the flux within 30 %.",
    found: Found::Fails { rate: 2e-4 },
    finding: "A rule, and no law: one of 4000 is lost, braking, up to 2.6 times that frequency; with 4 in place of 5 four of 1000. What of the voltage \
              is not known may be a fifth of the emf. Per observer, load and error: the map of observers.md.",
    cost: Cost::Run,
    variables: &LOW_FREQUENCY,
    check: |case| holds::<FullOrder<f64>>(case, 5.0),
};

const LOW_FREQUENCY: [Variable; 4] = [
    Variable::even("stator_resistance_error", -0.2, 0.2),
    Variable::even("lost_voltage_share", 0.0, 0.01).simplest_at(0.0),
    Variable::even("load_share", -1.0, 1.0).simplest_at(-1.0),
    // Over the lowest frequency.
    Variable::ratio("frequency_ratio", 1.0, 10.0, 1.0),
];

/// Sampling time, s.
const STEP: f64 = 1e-4;

/// From the right state, an observer that believes another R_s and knows nothing of what the inverter keeps, at a stator frequency that is
/// `factor` times what of the voltage is not known, over the flux, or more.
fn holds<O: Named<f64>>(case: &ClaimCase, factor: f64) -> Verdict {
    let [error, lost, load, ratio] = case.values();
    let (r, r_s) = (case.rating(), case.parameters().stator_resistance_ohm);
    let lost_v = lost * r.phase_voltage_peak_v;
    let slip = load * case.slip();
    let omega_e = ratio * factor * (error.abs() * r_s * case.current() + lost_v) / r.rotor_flux_vs;
    if omega_e > core::f64::consts::TAU * r.electrical_frequency_hz {
        return Verdict::Outside;
    }
    let omega_m = (omega_e - slip) / case.constants().n_p;
    let truth = Steady::new(case, omega_m, slip, r.rotor_flux_vs, 0.0, STEP);
    let r_s = ParameterId::Base(BaseParameter::StatorResistance);
    let believed = case.machine().with(&[(r_s, (1.0 + error) * case.parameters().stator_resistance_ohm)]);
    let made = believed.map_err(ObserverError::from).and_then(|m| O::made(Basis::try_new(&m, r, STEP)?, &m, r, &StartingGains));
    let observer = match made {
        Ok(observer) => observer,
        Err(e) => return Verdict::refused(e),
    };
    let inverter =
        InverterNonlinearity { voltage_v: lost_v, zero_crossing_current_a: 0.02 * case.current(), ..Default::default() };
    let mut state = observer.state_at(truth.flux(0), truth.current(0), omega_m);
    let (speed_allowed, flux_allowed) = (case.slip() / case.constants().n_p, 0.3 * r.rotor_flux_vs);
    let (samples, last) = ((6.0 / STEP) as usize, (5.0 / STEP) as usize);
    let mut worst = 0.0f64;
    for k in 1..=samples {
        let mut input = truth.input(k);
        // What was commanded is what the machine got and what the inverter kept.
        let mean = (truth.current(k - 1) + truth.current(k)) * 0.5;
        input.u_s += input.u_s - inverter.applied_voltage(input.u_s, mean);
        let e = observer.step(&mut state, &input);
        if k > last {
            let off = [(e.omega_m - omega_m).abs() / speed_allowed, (e.rotor_flux_vs - truth.flux(k)).norm() / flux_allowed];
            worst = worst.max(off[0]).max(off[1]);
        }
    }
    Verdict::at_most("error of speed or flux over what is allowed", worst, 1.0)
}
