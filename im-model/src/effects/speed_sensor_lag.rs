//! Speed-sensor lag: τ dω_shown/dt = ω − ω_shown, solved exactly for speed that is linear over the sample.

use super::effect;
use crate::error::Bound;
use crate::scalar::Scalar;

effect! {
    /// First-order filter of the speed measurement.
    SpeedSensorLag, "speed_sensor_lag",
    card: super::Card {
        title: "Speed-sensor lag",
        what: "The speed shown follows the true speed through a first-order filter of time constant τ.",
        shows: "A speed error in proportion to acceleration, none in the steady state; the currents are right.",
        rivals: &[
            ("shaft_compliance", "rings after a load step; a filter does not"),
            ("voltage_delay", "shows in the currents too"),
        ],
        test: "Quick speed ramps and load steps.",
        place: "speed sensor",
        source: "first-order filter, exact for first-order-hold input",
    },
    parameters: {
        /// Time constant.
        time_constant_s: Strength, default 0.0, "s", One, typical 3e-4 to 2e-2, Bound::Within(0.0, 10.0);
    },
    hooks: {}
}

impl<T: Scalar> SpeedSensorLag<T> {
    /// The speed shown after a sample of length `t` in which the speed went from `before` to `now`.
    pub(crate) fn shown(&self, shown_before: T, before: T, now: T, t: T) -> T {
        if self.time_constant_s.is_zero() {
            return now;
        }
        // A particular solution of τ ẏ = ω − y for ω = before + s t is ω − τ s; the rest decays.
        let tau = self.time_constant_s;
        let lag = tau * (now - before) / t;
        let decay = if tau.value() > 0.0 { (-t / tau).exp() } else { T::zero() };
        now - lag + (shown_before - before + lag) * decay
    }
}
