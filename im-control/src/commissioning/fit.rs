//! Least squares for a handful of parameters: linear, and by Levenberg and Marquardt. Dense, fixed size, f64: computed in the background, not in a sample.

use im_model::Scalar;

/// 95 % of a Student distribution with six degrees of freedom or more.
const COVERAGE: f64 = 2.5;

/// A value that was found, and how far to either side the truth may be, in 95 of 100 cases, for what the residuals show: noise, and how well the model of the
/// stage describes its data. Errors that the data do not show (gain of current sensors and dc voltage) are not in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Found {
    /// The value.
    pub value: f64,
    /// Half of the interval's width.
    pub half_width: f64,
}

impl Found {
    /// Of a value known to a share of itself.
    pub(super) fn relative(value: f64, share: f64) -> Self {
        Self { value, half_width: share * value.abs() }
    }

    /// Half of the interval over the value.
    pub fn tolerance(&self) -> f64 {
        self.half_width / self.value.abs()
    }

    /// Whether it is more than its uncertainty.
    pub fn is_seen(&self) -> bool {
        self.value.abs() > 1.2 * self.half_width
    }

    /// Whether the truth is where the interval says.
    pub fn covers(&self, truth: f64) -> bool {
        (self.value - truth).abs() <= self.half_width
    }
}

/// Solves A x = b for symmetric positive A by Cholesky's factors, and gives the diagonal of A⁻¹.
fn solve<const P: usize>(a: &[[f64; P]; P], b: &[f64; P]) -> Option<([f64; P], [f64; P])> {
    let mut l = [[0.0; P]; P];
    for i in 0..P {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            if i == j {
                let d = a[i][i] - sum;
                // A parameter that the data do not determine; not so where it is no number.
                let is_determined = d > 1e-12 * a[i][i];
                if !is_determined {
                    return None;
                }
                l[i][i] = Scalar::sqrt(d);
            } else {
                l[i][j] = (a[i][j] - sum) / l[j][j];
            }
        }
    }
    let back = |b: &[f64; P]| {
        let mut x = *b;
        for i in 0..P {
            let sum: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
            x[i] = (x[i] - sum) / l[i][i];
        }
        for i in (0..P).rev() {
            let sum: f64 = (i + 1..P).map(|k| l[k][i] * x[k]).sum();
            x[i] = (x[i] - sum) / l[i][i];
        }
        x
    };
    let mut inverse = [0.0; P];
    for (i, x) in inverse.iter_mut().enumerate() {
        let mut unit = [0.0; P];
        unit[i] = 1.0;
        *x = back(&unit)[i];
    }
    let x = back(b);
    x.iter().chain(&inverse).all(|x| x.is_finite()).then_some((x, inverse))
}

/// Normal equations of y = x·c, added up row by row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Linear<const P: usize> {
    a: [[f64; P]; P],
    b: [f64; P],
    y2: f64,
    rows: u32,
}

impl<const P: usize> Linear<P> {
    pub const fn new() -> Self {
        Self { a: [[0.0; P]; P], b: [0.0; P], y2: 0.0, rows: 0 }
    }

    pub fn add(&mut self, x: [f64; P], y: f64) {
        for (row, xi) in self.a.iter_mut().zip(x) {
            for (a, xj) in row.iter_mut().zip(x) {
                *a += xi * xj;
            }
        }
        for (b, xi) in self.b.iter_mut().zip(x) {
            *b += xi * y;
        }
        self.y2 += y * y;
        self.rows += 1;
    }

    /// The same rows with the means of `x` and `y` taken off: whatever constant y has beside is fitted.
    pub fn about_the_mean(&self, x: [f64; P], y: f64) -> Self {
        let mut left = *self;
        let n = f64::from(self.rows.max(1));
        for (i, (row, b)) in left.a.iter_mut().zip(&mut left.b).enumerate() {
            for (a, xj) in row.iter_mut().zip(x) {
                *a -= n * x[i] * xj;
            }
            *b -= n * x[i] * y;
        }
        left.y2 -= n * y * y;
        left.rows = self.rows.saturating_sub(1);
        left
    }

    /// Adds the rows of another.
    pub fn join(&mut self, other: &Self) {
        for (row, more) in self.a.iter_mut().zip(&other.a) {
            for (a, m) in row.iter_mut().zip(more) {
                *a += m;
            }
        }
        for (b, m) in self.b.iter_mut().zip(&other.b) {
            *b += m;
        }
        self.y2 += other.y2;
        self.rows += other.rows;
    }

    /// The coefficients with their intervals.
    pub fn solve(&self) -> Option<[Found; P]> {
        let (x, inverse) = solve(&self.a, &self.b)?;
        let freedom = f64::from(self.rows) - P as f64;
        let left = (self.y2 - x.iter().zip(self.b).map(|(x, b)| x * b).sum::<f64>()).max(0.0);
        let variance = if freedom > 0.0 { left / freedom } else { return None };
        let mut found = [Found::default(); P];
        for ((f, x), v) in found.iter_mut().zip(x).zip(inverse) {
            *f = Found { value: x, half_width: COVERAGE * Scalar::sqrt(v * variance) };
        }
        Some(found)
    }
}

impl<const P: usize> Linear<P> {
    /// The same rows with the last coefficient known, Q = P − 1.
    pub fn knowing_the_last<const Q: usize>(&self, c: f64) -> Linear<Q> {
        const { assert!(P == Q + 1) };
        let mut left = Linear { y2: self.y2 - 2.0 * c * self.b[Q] + c * c * self.a[Q][Q], rows: self.rows, ..Linear::new() };
        for i in 0..Q {
            left.a[i].copy_from_slice(&self.a[i][..Q]);
            left.b[i] = self.b[i] - c * self.a[i][Q];
        }
        left
    }
}

/// Positive parameters that minimise Σr².
#[derive(Clone, Copy, Debug)]
pub(super) struct Fitted<const P: usize> {
    pub parameters: [Found; P],
    /// Σr² over the degrees of freedom.
    pub chi2: f64,
    /// Σr².
    pub cost: f64,
}

/// Minimises Σ r(x, k)², k < rows, over positive x, from a start; residuals in standard deviations. Intervals are widened where the residuals are larger than
/// that.
pub(super) fn fit<const P: usize>(start: [f64; P], rows: usize, residual: impl Fn(&[f64; P], usize) -> f64) -> Option<Fitted<P>> {
    const STEP: f64 = 1e-5;
    let cost_of = |x: &[f64; P]| (0..rows).map(|k| residual(x, k)).map(|r| r * r).sum::<f64>();
    let (mut x, mut damping) = (start, 1e-3);
    let mut cost = cost_of(&x);
    let normal = |x: &[f64; P]| {
        let (mut a, mut b) = ([[0.0; P]; P], [0.0; P]);
        for k in 0..rows {
            let r = residual(x, k);
            let mut slope = [0.0; P];
            for (i, s) in slope.iter_mut().enumerate() {
                let at = |h: f64| {
                    let mut y = *x;
                    y[i] *= 1.0 + h;
                    residual(&y, k)
                };
                *s = (at(STEP) - at(-STEP)) / (2.0 * STEP);
            }
            for i in 0..P {
                b[i] -= slope[i] * r;
                for j in 0..P {
                    a[i][j] += slope[i] * slope[j];
                }
            }
        }
        (a, b)
    };
    for _ in 0..100 {
        let (a, b) = normal(&x);
        let mut damped = a;
        for (i, row) in damped.iter_mut().enumerate() {
            row[i] = row[i] * (1.0 + damping) + 1e-300;
        }
        let Some((d, _)) = solve(&damped, &b) else {
            damping *= 10.0;
            continue;
        };
        let mut next = x;
        for (x, d) in next.iter_mut().zip(d) {
            *x *= Scalar::exp(d.clamp(-1.0, 1.0));
        }
        let reached = cost_of(&next);
        if reached <= cost {
            let settled = d.iter().all(|d| d.abs() < 1e-7);
            (x, cost, damping) = (next, reached, (damping * 0.2).max(1e-9));
            if settled {
                break;
            }
        } else {
            damping *= 5.0;
            if damping > 1e9 {
                break;
            }
        }
    }
    let (a, b) = normal(&x);
    let (_, inverse) = solve(&a, &b)?;
    let chi2 = cost / (rows as f64 - P as f64).max(1.0);
    let mut parameters = [Found::default(); P];
    for ((f, x), v) in parameters.iter_mut().zip(x).zip(inverse) {
        *f = Found::relative(x, COVERAGE * Scalar::sqrt(v * chi2.max(1.0)));
    }
    parameters.iter().all(|f| f.value.is_finite() && f.half_width.is_finite()).then_some(Fitted { parameters, chi2, cost })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that look random and are the same each time.
    fn noise(k: usize) -> f64 {
        let x = (k as f64 * 12.9898 + 4.1).sin() * 43_758.545_3;
        2.0 * (x - x.floor()) - 1.0
    }

    #[test]
    fn a_line_and_its_interval() {
        let mut covered = 0;
        for run in 0..200 {
            let mut l = Linear::<2>::new();
            for k in 0..30 {
                let x = 0.1 * k as f64;
                l.add([x, 1.0], 2.0 * x - 3.0 + 0.1 * noise(30 * run + k));
            }
            let [a, b] = l.solve().unwrap();
            assert!((a.value - 2.0).abs() < 0.1 && (b.value + 3.0).abs() < 0.1, "{a:?} {b:?}");
            covered += usize::from(a.covers(2.0));
        }
        assert!(covered >= 185, "{covered} of 200");
    }

    /// Two runs with constants of their own, of which neither alone tells both coefficients.
    #[test]
    fn runs_are_joined_whatever_constant_each_has() {
        let mut all = Linear::<2>::new();
        for (run, constant) in [(0, 7.0), (1, -40.0)] {
            let (mut rows, mut sum, mut sum_y) = (Linear::<2>::new(), [0.0; 2], 0.0);
            for k in 0..40 {
                let t = 0.1 * f64::from(k);
                let x = if run == 0 { [3.0 * t, t] } else { [-2.0 * t, t] };
                let y = 1.5 * x[0] + 0.4 * x[1] + constant + 1e-3 * noise(k as usize);
                rows.add(x, y);
                (sum, sum_y) = ([sum[0] + x[0], sum[1] + x[1]], sum_y + y);
            }
            let one = rows.about_the_mean(sum.map(|x| x / 40.0), sum_y / 40.0);
            assert!(one.solve().is_none(), "{run}");
            all.join(&one);
        }
        let [a, b] = all.solve().unwrap();
        assert!(a.covers(1.5) && b.covers(0.4) && a.half_width < 1e-3 && b.half_width < 2e-3, "{a:?} {b:?}");
    }

    #[test]
    fn a_decay_is_found_from_afar() {
        let truth = [3.0, 0.2];
        let model = |x: &[f64; 2], t: f64| x[0] * (-t / x[1]).exp();
        let f = fit([1.0, 1.0], 40, |x, k| {
            let t = 0.02 * k as f64;
            (model(x, t) - model(&truth, t) - 0.01 * noise(k)) / 0.006
        })
        .unwrap();
        for (found, truth) in f.parameters.iter().zip(truth) {
            assert!(found.covers(truth) && found.tolerance() < 0.02, "{f:?}");
        }
    }

    #[test]
    fn what_the_data_do_not_determine_is_no_result() {
        assert!(fit([1.0, 1.0], 10, |x, k| x[0] * x[1] - k as f64).is_none());
        let mut l = Linear::<2>::new();
        (0..5).for_each(|k| l.add([f64::from(k), 2.0 * f64::from(k)], 1.0));
        assert!(l.solve().is_none());
    }
}
