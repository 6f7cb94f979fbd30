//! The full-order observer with complete stability: through the code of `im-observers`.

use im_observers::{Basis, FullOrder, FullOrderGains};

use super::PERFORM_WELL;
use crate::claim::Origin::Extends;
use crate::claim::{Claim, ClaimCase, Cost, Found, Paper};
use crate::properties::{Steady, observer};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[Claim {
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
}];

const QUADRANTS: [Variable; 2] =
    [Variable::even("speed_share", -0.4, 0.4).simplest_at(0.4), Variable::even("slip_share", -1.5, 1.5).simplest_at(0.0)];

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
