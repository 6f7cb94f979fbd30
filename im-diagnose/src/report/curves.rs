//! The law of an effect as a curve, with the uncertainty of the fit.

use im_identify::offline::{Fit, Target};
use im_model::effects::Rated;
use im_model::{EffectId, Machine, Rating};

use crate::uncertainty::HALF_95;

/// A law drawn.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Curve {
    pub x_label: &'static str,
    pub y_label: &'static str,
    /// Both axes logarithmic.
    pub log: bool,
    /// With the effect.
    pub points: Vec<[f64; 2]>,
    /// 95 % band: x, lower, upper.
    pub band: Vec<[f64; 3]>,
    /// The same machine without it.
    pub without: Vec<[f64; 2]>,
    /// What it shows.
    pub caption: &'static str,
}

const POINTS: usize = 81;

/// The curve of an effect at a machine, with the uncertainty of the fit that made it.
pub(crate) fn curve(e: EffectId, machine: &Machine<f64>, fit: &Fit, rating: &Rating) -> Option<Curve> {
    let f = machine.effects().frame(e, &Rated::new(machine.parameters(), machine.pole_pairs(), rating))?;
    let (lo, hi) = f.range;
    let at: Vec<f64> = (0..POINTS)
        .map(|k| {
            let t = k as f64 / (POINTS - 1) as f64;
            if f.log { lo * (hi / lo).powf(t) } else { lo + (hi - lo) * t }
        })
        .collect();
    let drawn = |m: &Machine<f64>| {
        let on = Rated::new(m.parameters(), m.pole_pairs(), rating);
        at.iter().map(|&x| m.effects().law(e, &on, x)).collect::<Vec<_>>()
    };
    let values = drawn(machine);
    let without = machine.without([e]).and_then(|m| m.rescaled(rating)).map(|m| drawn(&m)).unwrap_or_default();
    // First order: Var y = gᵀ C g over the fit's search variables, inflated where the residual is above the noise.
    let inflation = fit.chi2_per_sample().max(1.0);
    let slopes: Vec<Option<Vec<f64>>> = fit
        .free
        .iter()
        .enumerate()
        .map(|(k, free)| {
            let Target::Machine(ids) = &free.target else { return None };
            let h = (0.1 * fit.covariance[(k, k)].max(0.0).sqrt()).clamp(1e-7, 1e-3);
            let set: Vec<_> = ids.iter().map(|&id| (id, free.value(machine.get(id), h))).collect();
            let moved = drawn(&machine.with(&set).ok()?);
            Some(moved.iter().zip(&values).map(|(a, b)| (a - b) / h).collect())
        })
        .collect();
    let half = |x: usize| {
        let mut variance = 0.0;
        for (a, ga) in slopes.iter().enumerate() {
            for (b, gb) in slopes.iter().enumerate() {
                if let (Some(ga), Some(gb)) = (ga, gb) {
                    variance += ga[x] * fit.covariance[(a, b)] * gb[x];
                }
            }
        }
        HALF_95 * (variance.max(0.0) * inflation).sqrt()
    };
    let band = (0..POINTS).map(|k| [at[k], values[k] - half(k), values[k] + half(k)]).collect();
    let paired = |y: Vec<f64>| at.iter().zip(y).map(|(x, y)| [*x, y]).collect::<Vec<_>>();
    Some(Curve {
        x_label: f.x_label,
        y_label: f.y_label,
        log: f.log,
        points: paired(values),
        band,
        without: paired(without),
        caption: f.caption,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::machines;

    #[test]
    fn every_effect_of_the_library_has_a_finite_curve_that_is_the_base_law_when_off() {
        let motor = im_model::Machine::base(machines::MOTULATOR_2_2_KW.parameters(), 2).unwrap();
        for &e in EffectId::ALL {
            let rating = Rating::guess(motor.parameters(), motor.pole_pairs());
            let off = motor.rescaled(&rating).unwrap();
            let effects = *off.effects();
            let f = effects.frame(e, &Rated::new(off.parameters(), 2, &rating)).unwrap();
            let mut on = effects;
            for (k, info) in e.parameters().iter().enumerate() {
                if info.role == im_model::effects::Role::Strength {
                    on.set(e, k, info.typical.0 * rating.unit_of(info.scale, off.parameters(), off.pole_pairs()));
                }
            }
            let on = off.with_effects(on).unwrap();
            let differs = (0..=20).any(|k| {
                let x = f.range.0 + (f.range.1 - f.range.0) * f64::from(k) / 20.0;
                let law = |m: &Machine<f64>| m.effects().law(e, &Rated::new(m.parameters(), 2, &rating), x);
                let (a, b) = (law(&off), law(&on));
                assert!(a.is_finite() && b.is_finite(), "{e} at {x}: {a}, {b}");
                (a - b).abs() > 1e-12
            });
            assert!(differs, "{e}: the curve does not show the effect");
        }
    }
}
