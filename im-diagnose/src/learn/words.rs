//! What a learned curve would mean, in words.

use im_model::effects::{Acts, COEFFICIENTS, Over};

use super::{Curve, Formula};
use crate::format::{number, quantity};

/// A harmonic below this part of the largest is not mentioned.
const FAINT: f64 = 0.1;

/// Below this part of the curve a formula is as good as it.
const CLOSE: f64 = 0.05;

impl Curve {
    /// The unit of its values.
    pub fn unit(&self) -> &'static str {
        self.effect.parameters()[0].unit
    }

    /// Its values as a sentence: how large, and where.
    pub fn extent(&self) -> String {
        let Some(form) = self.effect.free_form() else { return String::new() };
        let (low, high) = self.points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[1]), h.max(p[1])));
        let band = self.points.iter().map(|p| p[2]).fold(0.0, f64::max);
        let (x, y) = form.labels();
        let unit = if self.unit().is_empty() { String::new() } else { format!(" {}", self.unit()) };
        let (from, to) = (number(low, 3), number(high, 3));
        format!("{y}: from {from} to {to}{unit} over {x}; known to ±{}{unit} or better (95 %)", number(band, 2))
    }

    /// Of a loss current over speed: n of the |ω|ⁿ that it grows by over the upper half of its range. A loss over an induced voltage that is in
    /// proportion to speed: hysteresis takes an energy per turn, eddy currents a power with the square of speed.
    fn power_of_speed(&self) -> Option<f64> {
        let form = self.effect.free_form()?;
        let top = self.points.last()?[0];
        let at = |x: f64| form.value(&self.values, x);
        let power = (at(top) / at(0.5 * top)).log2();
        ((form.acts(), form.over()) == (Acts::LossCurrent, Over::Speed) && power.is_finite()).then_some(power)
    }

    /// What it may be.
    pub fn meaning(&self) -> Vec<String> {
        let Some(form) = self.effect.free_form() else { return Vec::new() };
        let mut out = vec![self.effect.card().what.to_owned()];
        if form.over().is_angle() {
            let all = self.harmonics();
            let most = all.iter().map(|h| h.1).fold(0.0, f64::max);
            for (order, size) in all.into_iter().filter(|h| h.1 > FAINT * most) {
                out.push(format!("{} times per turn, {}", number(order, 3), quantity(size, self.unit(), 3)));
            }
            if form.over() == Over::ShaftAngle && self.values[COEFFICIENTS + 1] > 4.0 {
                let order = number(self.values[COEFFICIENTS + 1], 3);
                out.push(format!(
                    "Is {order} the number of slots, of teeth of a gear or a coupling, or a multiple of the number of poles?"
                ));
            }
        }
        if form.over() == Over::Lag {
            let delay_ms = 1e3 * form.delay_s(&self.values);
            let late = if delay_ms < 0.0 { "early" } else { "late" };
            out.push(format!("What changes slowly comes {} ms {late}.", number(delay_ms.abs(), 3)));
        }
        if let Some(power) = self.power_of_speed() {
            let power = number((10.0 * power).round() / 10.0 + 0.0, 2);
            out.push(format!("It grows as speed to the power {power}: hysteresis alone would give 0, eddy currents 1."));
        }
        out.extend(self.formulas.first().map(Formula::sentence));
        out
    }
}

impl Formula {
    /// The formula, how far it is off, and what it costs.
    pub fn sentence(&self) -> String {
        let how = if self.off < CLOSE { "It is" } else { "The nearest of the known forms is" };
        format!(
            "{how} {}: {} (off by {} % of the curve; with it −2 log L would rise by {})",
            self.name,
            self.text,
            number(100.0 * self.off, 2),
            number(self.cost, 3)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(place: (Acts, Over), range: (f64, f64), f: fn(f64) -> f64) -> String {
        Curve::of_function(place, range, 1.0, 0.01, f).meaning().join(" ")
    }

    #[test]
    fn hysteresis_and_eddy_currents_grow_differently_with_speed() {
        let loss = |f| said((Acts::LossCurrent, Over::Speed), (0.0, 150.0), f);
        assert!(loss(|_| 0.4).contains("to the power 0:"), "{}", loss(|_| 0.4));
        assert!(loss(|x| 0.003 * x).contains("to the power 1:"), "{}", loss(|x| 0.003 * x));
        assert!(!said((Acts::Torque, Over::Speed), (0.0, 150.0), |x| x).contains("to the power"));
    }

    /// Half of the signal through lags around a millisecond is late by about half of it.
    #[test]
    fn a_filter_says_how_late_it_is() {
        let bump = |x: f64| 0.3 * (-(x + 3.0).powi(2) / 0.1).exp();
        let text = said((Acts::CurrentSensor, Over::Lag), (-4.0, -2.0), bump);
        assert!(text.contains(" ms late."), "{text}");
        assert!(said((Acts::CurrentSensor, Over::Lag), (-4.0, -2.0), |x| 0.0 * x - 0.1).contains(" ms early."));
    }
}
