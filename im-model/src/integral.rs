//! Quadrature.

use crate::scalar::Scalar;

/// ∫ f(q) dq from 0 to `end`, by five-point Gauss-Legendre on eight intervals: exact to rounding for what saturation curves are.
pub(crate) fn integral<T: Scalar>(end: T, f: impl Fn(T) -> T) -> T {
    const NODES: [(f64, f64); 5] = [
        (0.0, 0.568_888_888_888_888_9),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let mut sum = T::zero();
    for k in 0..8 {
        for (x, weight) in NODES {
            sum += f(end.scale((f64::from(k) + 0.5 + 0.5 * x) / 8.0)).scale(weight / 16.0);
        }
    }
    sum * end
}
