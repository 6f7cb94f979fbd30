//! A learned curve, with its band.

use im_model::effects::{Acts, COEFFICIENTS, FreeForm, Over};
use im_model::{EffectId, Machine, ParameterId};
use nalgebra::{DMatrix, DVector};

use super::forms::{Formula, formulas};
use crate::uncertainty::{Estimates, HALF_95, MachineQuantity};

/// A learned curve.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The effect.
    pub effect: EffectId,
    /// The variable, value and half of the 95-% band, over the range of the recordings; an angle over one turn, in rad.
    pub points: Vec<[f64; 3]>,
    /// Effects that explain the data as well in its place.
    pub rivals: Vec<EffectId>,
    /// Values of its parameters.
    pub values: Vec<f64>,
    /// Covariance of its coefficients.
    pub covariance: DMatrix<f64>,
    /// Formulas that it looks like, the best first.
    pub formulas: Vec<Formula>,
}

/// Points of a curve.
const POINTS: usize = 81;

impl Curve {
    /// The curve of an effect of a machine; `None` where it is none. `price` is what a number in a formula must save of D.
    pub fn new(
        effect: EffectId,
        machine: &Machine<f64>,
        estimates: &Estimates,
        rivals: Vec<EffectId>,
        price: f64,
    ) -> Option<Self> {
        let form = effect.free_form()?;
        let values: Vec<f64> = (0..effect.parameters().len()).map(|k| machine.get(ParameterId::Effect(effect, k))).collect();
        let place = |k: usize| {
            let quantity = MachineQuantity::Parameter(ParameterId::Effect(effect, k));
            estimates.list.iter().position(|e| e.quantity == quantity)
        };
        let places: Vec<Option<usize>> = (0..COEFFICIENTS).map(place).collect();
        let entry = |a: usize, b: usize| places[a].zip(places[b]).map_or(0.0, |(a, b)| estimates.covariance[(a, b)]);
        let covariance = DMatrix::from_fn(COEFFICIENTS, COEFFICIENTS, entry);
        let (low, high) = form.range(&values, std::f64::consts::TAU);
        let point = |n: usize| {
            let x = low + (high - low) * n as f64 / (POINTS - 1) as f64;
            let w = DVector::from_row_slice(&form.weights(&values, x));
            [x, form.value(&values, x), HALF_95 * w.dot(&(&covariance * &w)).max(0.0).sqrt()]
        };
        let points: Vec<[f64; 3]> = (0..POINTS).map(point).collect();
        let grid: Vec<f64> = points.iter().map(|p| p[0]).collect();
        let mut curve = Self { effect, points, rivals, values, covariance, formulas: Vec::new() };
        curve.formulas = formulas(form, &curve.values, &curve.covariance, &grid, price);
        Some(curve)
    }

    /// The curve nearest to a function, with every coefficient known to a `part` of the largest: to try on what is known.
    ///
    /// # Panics
    /// The pair is not one of [`FreeForm::all`](im_model::effects::FreeForm::all).
    pub fn of_function((acts, over): (Acts, Over), range: (f64, f64), order: f64, part: f64, f: impl Fn(f64) -> f64) -> Self {
        let effect = EffectId::Custom(FreeForm::define(acts, over, range, order));
        let mut values: Vec<f64> = effect.parameters().iter().map(|p| p.default).collect();
        let form = effect.free_form().expect("a free form is one");
        let (low, high) = form.range(&values, std::f64::consts::TAU);
        let grid: Vec<f64> = (0..POINTS).map(|n| low + (high - low) * n as f64 / (POINTS - 1) as f64).collect();
        let w = DMatrix::from_fn(POINTS, COEFFICIENTS, |n, k| form.weights(&values, grid[n])[k]);
        let y = DVector::from_iterator(POINTS, grid.iter().map(|x| f(*x)));
        let c = w.tr_mul(&w).cholesky().map_or_else(|| DVector::zeros(COEFFICIENTS), |l| l.solve(&w.tr_mul(&y)));
        values[..COEFFICIENTS].copy_from_slice(c.as_slice());
        let size = part * c.amax();
        let covariance = DMatrix::identity(COEFFICIENTS, COEFFICIENTS) * (size * size);
        let points = grid.iter().map(|x| [*x, form.value(&values, *x), HALF_95 * size]).collect();
        let mut curve = Self { effect, points, rivals: Vec::new(), values, covariance, formulas: Vec::new() };
        curve.formulas = formulas(form, &curve.values, &curve.covariance, &grid, 10.0);
        curve
    }

    /// Order per turn and amplitude of each harmonic of a curve over an angle.
    pub fn harmonics(&self) -> Vec<(f64, f64)> {
        let order = self.values[FreeForm::SPREAD + 1];
        let pairs = self.values[..COEFFICIENTS].chunks_exact(2).enumerate();
        pairs.map(|(k, p)| (order * (k + 1) as f64, p[0].hypot(p[1]))).collect()
    }

    /// The largest magnitude of the curve.
    pub fn size(&self) -> f64 {
        self.points.iter().map(|p| p[1].abs()).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A curve known to a hundredth of its size.
    fn curve_of(acts: Acts, over: Over, range: (f64, f64), order: f64, f: impl Fn(f64) -> f64) -> Curve {
        Curve::of_function((acts, over), range, order, 0.01, f)
    }

    fn first(curve: &Curve) -> Formula {
        curve.formulas[0].clone()
    }

    #[test]
    fn each_form_is_recognized_by_its_curve() {
        let speed = |f: fn(f64) -> f64| first(&curve_of(Acts::Torque, Over::Speed, (-150.0, 150.0), 1.0, f));
        assert_eq!(speed(|x| 0.02 * x).name, "in proportion");
        assert_eq!(speed(|x| 1e-4 * x * x.abs()).name, "a square");
        let brake = speed(|x| 3.0 * 2.0 * (x / 40.0) / (1.0 + (x / 40.0).powi(2)));
        assert!(brake.name.starts_with("largest at a critical value"), "{brake:?}");
        assert!((brake.shape[0] / 40.0 - 1.0).abs() < 0.15 && (brake.factors[0] / 3.0 - 1.0).abs() < 0.1, "{brake:?}");
        let time = |f: fn(f64) -> f64| first(&curve_of(Acts::StatorResistance, Over::Time, (0.0, 2.0), 1.0, f));
        assert!(time(|t| 0.4 * (-t / 0.4).exp()).name.starts_with("an exponential decay"));
        let step = time(|t| 0.3 / (1.0 + (-(t - 1.1) / 0.1).exp()));
        assert!(step.name.starts_with("a step") && (step.shape[0] - 1.1).abs() < 0.1, "{step:?}");
    }

    #[test]
    fn harmonics_are_read_off_a_curve_over_the_angle() {
        let c = curve_of(Acts::Torque, Over::ShaftAngle, (0.0, 1.0), 28.0, |x| 0.7 * (28.0 * x + 0.3).cos());
        assert_eq!(first(&c).name, "one harmonic");
        let h = c.harmonics();
        assert_eq!(h[0].0, 28.0);
        assert!((h[0].1 - 0.7).abs() < 1e-6 && h[1].1 < 1e-6, "{h:?}");
    }
}
