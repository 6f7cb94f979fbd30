//! What a learned curve would mean, in words.

use im_model::effects::{COEFFICIENTS, Over};

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
        out.extend(self.formulas.first().map(Formula::sentence));
        out
    }
}

impl Formula {
    /// The formula, how far it is off, and what it costs.
    pub fn sentence(&self) -> String {
        let how = if self.off < CLOSE { "It is" } else { "The nearest of the known forms is" };
        format!(
            "{how} {}: {} (off by {} % of the curve; costs {} of the fit in D)",
            self.name,
            self.text,
            number(100.0 * self.off, 2),
            number(self.cost, 3)
        )
    }
}
