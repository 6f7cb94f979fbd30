//! The full-order observer with complete stability and Kubota's, stabilized, at low stator frequency: through the code of `im-observers`.

use im_model::effects::{Hooks, InverterNonlinearity};
use im_model::{BaseParameter, Machine, ParameterId};
use im_observers::{Basis, FullOrder, FullOrderGains, Kubota, KubotaGains, Observer, ObserverError};

use crate::claim::Origin::Extends;
use crate::claim::{Claim, ClaimCase, Cost, Found, Paper};
use crate::properties::{Steady, observer};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[
    Claim {
        number: 76,
        name: "full_order_speed_converges_in_every_quadrant",
        paper: Paper::Kwon,
        place: "Section III, summary; Section XI",
        origin: Extends(PERFORM_WELL),
        statement: "With the gains of Harnefors and Hinkkanen the full-order observer finds speed and flux.",
        assumptions: "As claim 7: right parameters, constant speed up to 40 % of rated, any quadrant, ω_e beyond 2 % of rated, from 5 % of \
                      speed and 3° of flux. R̂_s is learnt while it does so.",
        found: Found::HoldsIf,
        finding: "Holds at every speed and load tried, but for ω_e = 0, where no observer of this kind sees the speed.",
        cost: Cost::Run,
        variables: &QUADRANTS,
        check: converges,
    },
    Claim {
        number: 77,
        name: "full_order_holds_above_its_lowest_frequency",
        paper: Paper::Kwon,
        place: "Section III, summary; Section XI",
        origin: Extends(PERFORM_WELL),
        statement: "With a wrong R_s and an inverter that keeps a part of its voltage, the full-order observer holds a machine at every stator \
                    frequency from ω_e = 5(|ΔR_s| i + u_d)/λ on.",
        assumptions: "R_s up to 20 % wrong, u_d up to 1 % of rated voltage, held at rated flux, load from rated to rated braking, 6 s from the \
                      right state; it holds where in the last second the speed is within the rated slip and the flux within 30 %.",
        found: Found::HoldsIf,
        finding: "Holds: what of the voltage is not known may be a fifth of the emf. With 4 in place of 5 it does not: 4 of 1000 are lost. Per \
                  observer, load and error: the map of observers.md.",
        cost: Cost::Run,
        variables: &LOW_FREQUENCY,
        check: |case| {
            holds(case, 5.0, |basis, machine, case| {
                FullOrder::try_new(basis, FullOrderGains::for_machine(machine, case.rating()))
            })
        },
    },
    Claim {
        number: 78,
        name: "kubota_holds_above_its_lowest_frequency",
        paper: Paper::Kwon,
        place: "Section III, summary; Section XI",
        origin: Extends(PERFORM_WELL),
        statement: "Kubota's with the stabilized gain the same from ω_e = 10(|ΔR_s| i + u_d)/λ on.",
        assumptions: "As claim 77.",
        found: Found::HoldsIf,
        finding: "Holds: it does not learn R_s, and needs twice the frequency. With 6 in place of 10 one of 1000 is lost.",
        cost: Cost::Run,
        variables: &LOW_FREQUENCY,
        check: |case| {
            holds(case, 10.0, |basis, machine, case| Kubota::try_new(basis, KubotaGains::for_machine(machine, case.rating())?))
        },
    },
];

const PERFORM_WELL: &str = "These observers perform well in the steady state or when the speed does not change aggressively.";

const QUADRANTS: [Variable; 2] =
    [Variable::even("speed_share", -0.4, 0.4).simplest_at(0.4), Variable::even("slip_share", -1.5, 1.5).simplest_at(0.0)];

const LOW_FREQUENCY: [Variable; 4] = [
    Variable::even("stator_resistance_error", -0.2, 0.2),
    Variable::even("lost_voltage_share", 0.0, 0.01).simplest_at(0.0),
    Variable::even("load_share", -1.0, 1.0).simplest_at(-1.0),
    // Over the lowest frequency.
    Variable::ratio("frequency_ratio", 1.0, 10.0, 1.0),
];

/// Sampling time, s.
const STEP: f64 = 1e-4;

fn converges(case: &ClaimCase) -> Verdict {
    let [speed, slip] = case.values();
    let truth = Steady::new(case, speed * case.speed(), slip * case.slip(), case.rating().rotor_flux_vs, 0.0, STEP);
    if truth.omega_e.abs() < 0.02 * core::f64::consts::TAU * case.rating().electrical_frequency_hz {
        return Verdict::Outside;
    }
    let gains = FullOrderGains::for_machine(case.machine(), case.rating());
    match Basis::try_new(case.machine(), case.rating(), STEP).and_then(|b| FullOrder::try_new(b, gains)) {
        Ok(o) => observer::speed_converges(&o, &truth, 0.05, 0.05 * case.speed(), 4.0, 0.02 * case.speed()),
        Err(e) => Verdict::refused(e),
    }
}

/// From the right state, an observer that believes another R_s and knows nothing of what the inverter keeps, at a stator frequency that is `factor` times what of the voltage
/// is not known, over the flux, or more.
fn holds<O: Observer<f64>>(
    case: &ClaimCase,
    factor: f64,
    make: impl Fn(Basis<f64>, &Machine<f64>, &ClaimCase) -> Result<O, ObserverError>,
) -> Verdict {
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
    let made = believed.map_err(ObserverError::from).and_then(|m| make(Basis::try_new(&m, r, STEP)?, &m, case));
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
