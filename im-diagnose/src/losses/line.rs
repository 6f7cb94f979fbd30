//! A straight line by least squares.

/// y = intercept + slope · x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    pub intercept: f64,
    pub slope: f64,
    /// Of x and y.
    pub correlation: f64,
}

impl Line {
    /// Through points (x, y); `None` where all stand at one x.
    pub fn through(points: &[(f64, f64)]) -> Option<Self> {
        let n = points.len() as f64;
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
        let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
        let (xx, xy, yy) = (mean(&|p| (p.0 - x).powi(2)), mean(&|p| (p.0 - x) * (p.1 - y)), mean(&|p| (p.1 - y).powi(2)));
        let slope = xy / xx;
        (xx > 1e-12 * x * x && slope.is_finite()).then(|| {
            let correlation = if yy > 0.0 { xy / (xx * yy).sqrt() } else { 1.0 };
            Self { intercept: y - slope * x, slope, correlation }
        })
    }
}
