//! What is known of a free-form curve before any data: it is smooth.
//!
//! Its coefficients c are normal with the precision Q/s²: −2 ln p(c) = cᵀQc/s², Q from [`FreeForm::precision`], s the effect's own
//! [spread](FreeForm::SPREAD). The likeliest s given a fit, whose coefficients have γ effective parameters, is s² = cᵀQc/γ (MacKay's
//! evidence; Neural Computation 4, 1992).

use im_model::effects::{COEFFICIENTS, FreeForm};
use im_model::{EffectId, Machine, ParameterId};
use nalgebra::{DMatrix, DVector};

use super::free::Free;

/// In the search variables of a fit, from where they are.
pub struct Smoothness {
    /// cᵀQc/s² over all curves.
    pub cost: f64,
    /// Minus half its gradient.
    pub downhill: DVector<f64>,
    /// Half its second derivative, as JᵀJ is that of a sum of squares.
    pub information: DMatrix<f64>,
}

/// A curve among the free parameters.
struct Learned {
    effect: EffectId,
    precision: [[f64; COEFFICIENTS]; COEFFICIENTS],
    /// For each coefficient its place among the free parameters.
    places: [usize; COEFFICIENTS],
}

impl Learned {
    /// Those whose coefficients are all free.
    fn all(free: &[Free]) -> Vec<Self> {
        let place = |e: EffectId, k: usize| free.iter().position(|f| f.id() == Some(ParameterId::Effect(e, k)));
        let learned = |f: &Free| {
            let Some(ParameterId::Effect(effect, 0)) = f.id() else { return None };
            let mut places = [0; COEFFICIENTS];
            for (k, p) in places.iter_mut().enumerate() {
                *p = place(effect, k)?;
            }
            Some(Self { effect, precision: effect.free_form()?.precision(), places })
        };
        free.iter().filter_map(learned).collect()
    }

    fn spread(&self, machine: &Machine<f64>) -> f64 {
        machine.get(ParameterId::Effect(self.effect, FreeForm::SPREAD))
    }

    fn coefficient(&self, machine: &Machine<f64>, k: usize) -> f64 {
        machine.get(ParameterId::Effect(self.effect, k))
    }

    /// (a, b, Q_ab).
    fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.precision.iter().enumerate().flat_map(|(a, row)| row.iter().enumerate().map(move |(b, q)| (a, b, *q)))
    }

    /// cᵀQc.
    fn roughness(&self, machine: &Machine<f64>) -> f64 {
        self.entries().map(|(a, b, q)| q * self.coefficient(machine, a) * self.coefficient(machine, b)).sum()
    }

    /// γ: how many of the coefficients the data determine rather than the smoothness.
    fn effective(&self, machine: &Machine<f64>, free: &[Free], covariance: &DMatrix<f64>) -> f64 {
        let s = self.spread(machine);
        let scale = |k: usize| free[self.places[k]].slope(self.coefficient(machine, k));
        let held = self.entries().map(|(a, b, q)| q * scale(a) * scale(b) * covariance[(self.places[a], self.places[b])]);
        (COEFFICIENTS as f64 - held.sum::<f64>() / (s * s)).clamp(1.0, COEFFICIENTS as f64)
    }
}

/// The smoothness of all curves among `free`; `None` where there is none.
pub fn smoothness(machine: &Machine<f64>, free: &[Free]) -> Option<Smoothness> {
    let curves = Learned::all(free);
    if curves.is_empty() {
        return None;
    }
    let n = free.len();
    let mut all = Smoothness { cost: 0.0, downhill: DVector::zeros(n), information: DMatrix::zeros(n, n) };
    for c in &curves {
        let weight = 1.0 / c.spread(machine).powi(2);
        all.cost += weight * c.roughness(machine);
        for (a, b, q) in c.entries() {
            let (pa, pb) = (c.places[a], c.places[b]);
            let scale = |p: usize, k: usize| free[p].slope(c.coefficient(machine, k));
            all.downhill[pa] -= weight * q * scale(pa, a) * c.coefficient(machine, b);
            all.information[(pa, pb)] += weight * q * scale(pa, a) * scale(pb, b);
        }
    }
    Some(all)
}

/// How many of some free parameters, fitted with such a covariance, the data determine: of a curve γ for eight.
pub(super) fn effective_parameters(machine: &Machine<f64>, free: &[Free], covariance: &DMatrix<f64>) -> f64 {
    let curves = Learned::all(free);
    let spared: f64 = curves.iter().map(|c| COEFFICIENTS as f64 - c.effective(machine, free, covariance)).sum();
    free.len() as f64 - spared
}

/// The likeliest spread of each curve, at least that of `least`.
pub(super) fn likely_spreads(
    machine: &Machine<f64>,
    free: &[Free],
    covariance: &DMatrix<f64>,
    least: impl Fn(EffectId) -> f64,
) -> Vec<(ParameterId, f64)> {
    let spread = |c: &Learned| {
        let s = (c.roughness(machine) / c.effective(machine, free, covariance)).sqrt();
        (ParameterId::Effect(c.effect, FreeForm::SPREAD), s.max(least(c.effect)))
    };
    Learned::all(free).iter().map(spread).collect()
}
