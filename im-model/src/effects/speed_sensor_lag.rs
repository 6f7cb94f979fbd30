//! Speed-sensor lag: three first-order filters in series, each solved exactly for an input that is linear over the sample.
//!
//! τ ẏ₁ = ω − y₁,   ρτ ẏ₂ = y₁ − y₂,   ρ²τ ẏ₃ = y₂ − y₃,   ω_shown = y₃.
//!
//! ρ = 0 is a plain first-order filter, ρ ≈ 0.4 a second-order one with equal poles, and ρ = 1 an encoder's averaging window: mean and
//! variance of the delay are those of a window of 6τ.

use super::lag::behind_ramp;
use super::{About, Card, Place, SteadyState, effect};
use crate::error::Bound;
use crate::scalar::Scalar;

effect! {
    /// Filter of the speed measurement.
    SpeedSensorLag, "speed_sensor_lag",
    about: About { steady_state: SteadyState::Hides, ..About::at(Place::Sensors) },
    card: Card {
        title: "Speed-sensor lag",
        what: "The speed shown follows the true speed through filters of time constants τ, ρτ and ρ²τ: a first- or second-order filter, or an encoder's averaging window.",
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
        /// Each further time constant over the one before.
        pole_ratio: Shape, default 0.3, "", One, typical 0.0 to 1.0, Bound::Within(0.0, 1.0);
    },
    filters: 3,
    hooks: {
        #[inline(always)]
        fn measured_speed(&self, _omega_m: T, filter: &[T]) -> T {
            filter[2]
        }

        #[inline(always)]
        fn filter(&self, filter: &mut [T], before: T, now: T, t: T) {
            let (tau, rho) = (self.time_constant_s, self.pole_ratio);
            let &mut [y1, y2, y3] = filter else { return };
            let z1 = filtered(y1, before, now, tau, t);
            let z2 = filtered(y2, y1, z1, tau * rho, t);
            filter.copy_from_slice(&[z1, z2, filtered(y3, y2, z2, tau * rho * rho, t)]);
        }

        #[inline(always)]
        fn speed_behind(&self, shown: [T; 3]) -> [T; 3] {
            // (1 + τ d/dt)(1 + ρτ d/dt)(1 + ρ²τ d/dt) = 1 + a d/dt + b d²/dt² + …; what the third derivative adds is left out.
            let (tau, rho) = (self.time_constant_s, self.pole_ratio);
            let a = tau * (T::one() + rho + rho * rho);
            let b = tau * tau * rho * (T::one() + rho + rho * rho);
            let [w, rate, curve] = shown;
            [w + a * rate + b * curve, rate + a * curve, curve]
        }
    }
}

/// y after a sample in which the input of τ ẏ = x − y went linearly from `before` to `now`.
fn filtered<T: Scalar>(y: T, before: T, now: T, tau: T, t: T) -> T {
    let decay = if tau.value() > 0.0 { (-t / tau).exp() } else { T::zero() };
    now + behind_ramp(y - before, now - before, tau / t, decay)
}

#[cfg(feature = "std")]
impl super::Drawn for SpeedSensorLag<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "time after a step, s",
            "shown over true",
            (0.0, 6.0 * self.time_constant_s.max(1e-6)),
            "What the sensor shows after a step of the speed.",
        )
    }

    fn law(&self, _on: &super::Rated, x: f64) -> f64 {
        let (a, b) = (self.time_constant_s, self.time_constant_s * self.pole_ratio);
        if a <= 0.0 {
            1.0
        } else if (a - b).abs() < 1e-6 * a {
            1.0 - (1.0 + x / a) * (-x / a).exp()
        } else if b <= 0.0 {
            1.0 - (-x / a).exp()
        } else {
            1.0 - (a * (-x / a).exp() - b * (-x / b).exp()) / (a - b)
        }
    }
}
