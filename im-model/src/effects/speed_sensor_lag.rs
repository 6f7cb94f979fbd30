//! Speed-sensor lag: two first-order filters in series, solved exactly for speed that is linear over the sample.
//!
//! τ ẏ₁ = ω − y₁,   ρτ ẏ₂ = y₁ − y₂,   ω_shown = y₂.  ρ = 0 is a plain first-order filter; two like poles stand for an encoder's
//! averaging window too.

use super::effect;
use crate::error::Bound;
use crate::scalar::Scalar;

effect! {
    /// Filter of the speed measurement.
    SpeedSensorLag, "speed_sensor_lag",
    card: super::Card {
        title: "Speed-sensor lag",
        what: "The speed shown follows the true speed through a filter: time constant τ, then a second one of ρτ.",
        shows: "A speed error in proportion to acceleration, none in the steady state; the currents are right.",
        rivals: &[
            ("shaft_compliance", "rings after a load step; a filter does not"),
            ("voltage_delay", "shows in the currents too"),
        ],
        test: "Quick speed ramps and load steps.",
        place: "speed sensor",
        source: "first-order filters, exact for first-order-hold input",
    },
    parameters: {
        /// Time constant.
        time_constant_s: Strength, default 0.0, "s", One, typical 3e-4 to 2e-2, Bound::Within(0.0, 10.0);
        /// Second time constant over the first.
        second_pole_ratio: Shape, default 0.3, "", One, typical 0.0 to 1.0, Bound::Within(0.0, 1.0);
    },
    hooks: {}
}

impl<T: Scalar> SpeedSensorLag<T> {
    /// The states of the two filters after a sample of length `t` in which the speed went from `before` to `now`; the second is shown.
    pub(crate) fn shown(&self, [y1, y2]: [T; 2], before: T, now: T, t: T) -> [T; 2] {
        if self.time_constant_s.is_zero() {
            return [now; 2];
        }
        let first = filtered(y1, before, now, self.time_constant_s, t);
        [first, filtered(y2, y1, first, self.time_constant_s * self.second_pole_ratio, t)]
    }
}

/// y after a sample in which the input of τ ẏ = x − y went linearly from `before` to `now`.
fn filtered<T: Scalar>(y: T, before: T, now: T, tau: T, t: T) -> T {
    // A particular solution for x = before + s t is x − τ s; the rest decays.
    let lag = tau * (now - before) / t;
    let decay = if tau.value() > 0.0 { (-t / tau).exp() } else { T::zero() };
    now - lag + (y - before + lag) * decay
}
