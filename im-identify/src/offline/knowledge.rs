//! What is known of parameters before a fit: measured values with their tolerances.
//!
//! ln p is normal around ln of the known value, with ln(1 + tolerance)/1.96 for its standard deviation, so that the truth lies within a
//! factor 1 + tolerance in 95 of 100 cases. Each is one more residual of the fit, in its own σ.

use std::collections::BTreeMap;

use im_model::{Known, Machine, ParameterId};

use super::free::{Free, Prior, Target, Transform};

/// 97.5 % quantile of the normal distribution: half of a 95 % interval, in standard deviations.
pub const HALF_95: f64 = 1.96;

impl Prior {
    /// What is known as a prior; `None` where the value is held, or is zero and has no logarithm.
    fn new(id: ParameterId, known: &Known) -> Option<Self> {
        (known.tolerance > 0.0 && known.value != 0.0).then(|| Self {
            id,
            value: known.value,
            std: known.tolerance.ln_1p() / HALF_95,
        })
    }

    /// (known − p)/σ on the logarithm, and its slope over p.
    fn residual(&self, p: f64) -> (f64, f64) {
        let ratio = p / self.value;
        // A value of the other sign has no logarithm: the straight line from there on.
        if ratio > 0.01 {
            (-ratio.ln() / self.std, 1.0 / (p * self.std))
        } else {
            ((1.0 - ratio - 0.99 + 100f64.ln()) / self.std, 1.0 / (self.value * self.std))
        }
    }
}

/// Leaves out of `free` what is held, and gives the rest what is known of it. Parameters that move by one factor know what is known of each.
pub fn knowing(free: Vec<Free>, known: &BTreeMap<ParameterId, Known>) -> Vec<Free> {
    let held = |id: &ParameterId| known.get(id).is_some_and(|k| k.tolerance == 0.0);
    let with = |f: Free| match &f.target {
        Target::Machine(ids) if ids.iter().any(held) => None,
        Target::Machine(ids) => {
            let priors = ids.iter().filter_map(|id| Prior::new(*id, known.get(id)?)).collect();
            Some(Free { priors, ..f })
        }
        Target::Initial { .. } => Some(f),
    };
    free.into_iter().filter_map(with).collect()
}

/// Base parameters that move by factors, and of which nothing else is known, are near the middle of their limits, which stand at four standard
/// deviations: that counts `weight` times.
pub fn expecting(mut free: Vec<Free>, weight: f64) -> Vec<Free> {
    for f in free.iter_mut().filter(|f| f.transform == Transform::Log && f.priors.is_empty()) {
        if let Some(id @ ParameterId::Base(_)) = f.id() {
            let (least, most) = f.limits;
            let std = (most / least).ln() / 8.0;
            f.priors = vec![Prior { id, value: (least * most).sqrt(), std: std / weight.sqrt() }];
        }
    }
    free
}

/// For each free parameter: what its priors add to the cost, to the gradient towards less of it, and to JᵀJ.
pub fn prior_terms(machine: &Machine<f64>, free: &[Free]) -> Vec<[f64; 3]> {
    let one = |f: &Free| {
        f.priors.iter().fold([0.0; 3], |[cost, gradient, information], prior| {
            let p = machine.get(prior.id);
            let (r, slope) = prior.residual(p);
            // dp/dv at v = 0.
            let s = slope * f.slope(p);
            [cost + r * r, gradient + s * r, information + s * s]
        })
    };
    free.iter().map(one).collect()
}

/// Sum of what the priors add to the cost.
pub fn prior_cost(machine: &Machine<f64>, free: &[Free]) -> f64 {
    prior_terms(machine, free).iter().map(|t| t[0]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::base_parameters;
    use im_model::machines::MOTULATOR_2_2_KW;

    /// At a limit a parameter is four standard deviations off; D, which may vanish, and what is known already are left as they are.
    #[test]
    fn limits_stand_at_four_standard_deviations() {
        let machine = Machine::base(MOTULATOR_2_2_KW.parameters(), MOTULATOR_2_2_KW.pole_pairs).unwrap();
        let [inertia, resistance] =
            [im_model::BaseParameter::Inertia, im_model::BaseParameter::StatorResistance].map(ParameterId::Base);
        let known = BTreeMap::from([(inertia, Known { value: machine.get(inertia), tolerance: 0.1 })]);
        let free = knowing(base_parameters(&machine), &known);
        let expected = expecting(free.clone(), 5.0);
        let untouched = |f: &&Free| f.transform != Transform::Log || f.id() == Some(inertia);
        assert!(free.iter().zip(&expected).filter(|(f, _)| untouched(f)).all(|(a, b)| a == b));
        assert_eq!(expected.iter().filter(|f| f.priors.len() == 1).count(), free.len() - 1);
        assert!(prior_cost(&machine, &expected) < 1e-20);
        let (_, most) = expected[0].limits;
        let at_limit = machine.with(&[(resistance, most)]).unwrap();
        assert!((prior_cost(&at_limit, &expected) / (5.0 * 16.0) - 1.0).abs() < 1e-12);
    }
}
