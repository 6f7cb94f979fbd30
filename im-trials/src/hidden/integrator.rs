//! Adaptive Runge-Kutta pair of Dormand and Prince, orders 5 and 4, for autonomous systems.

/// Integrator with a step size it remembers from call to call.
#[derive(Clone, Debug)]
pub struct DormandPrince<const N: usize> {
    /// Tolerated local error of each state.
    pub tolerance: [f64; N],
    step_s: f64,
}

const A: [[f64; 6]; 6] = [
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];

/// Fifth-order weights minus fourth-order weights.
const E: [f64; 7] = [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];

impl<const N: usize> DormandPrince<N> {
    /// An integrator with the given tolerances and first step.
    pub fn new(tolerance: [f64; N], step_s: f64) -> Self {
        Self { tolerance, step_s }
    }

    /// Carries the state over the time `span_s`; the inputs of `f` are constant meanwhile.
    pub fn advance(&mut self, x: &mut [f64; N], span_s: f64, f: impl Fn(&[f64; N]) -> [f64; N]) {
        let mut left = span_s;
        let mut k = [[0.0; N]; 7];
        k[0] = f(x);
        while left > 0.0 {
            // Equal steps to the end, rather than a last one that is tiny.
            let parts = (left / self.step_s - 1e-9).ceil().max(1.0);
            let h = left / parts;
            let mut y = *x;
            for stage in 0..6 {
                y = *x;
                for (weight, slope) in A[stage].iter().zip(&k).take(stage + 1) {
                    let weight = h * weight;
                    for i in 0..N {
                        y[i] += weight * slope[i];
                    }
                }
                k[stage + 1] = f(&y);
            }
            let mut error = 0.0_f64;
            for i in 0..N {
                let e: f64 = E.iter().zip(&k).map(|(weight, slope)| weight * slope[i]).sum();
                error = error.max((h * e / self.tolerance[i]).abs());
            }
            // A step that is no longer finite is tried again much smaller, down to where nothing can help.
            let factor = if error.is_finite() { 0.9 * error.max(1e-9).powf(-0.2) } else { 0.1 };
            if error <= 1.0 || h < 1e-12 {
                *x = y;
                k[0] = k[6];
                left = if parts > 1.0 { left - h } else { 0.0 };
                // A step cut short by the end of the span says nothing against a longer one.
                self.step_s = (h * factor.clamp(0.2, 4.0)).max(if factor > 0.9 { self.step_s } else { 0.0 });
            } else {
                self.step_s = h * factor.clamp(0.1, 0.9);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oscillator_returns_after_one_turn() {
        let mut integrator = DormandPrince::new([1e-10; 2], 1e-3);
        let mut x = [1.0, 0.0];
        for _ in 0..10 {
            integrator.advance(&mut x, std::f64::consts::TAU / 10.0, |x| [x[1], -x[0]]);
        }
        // About a hundred steps, each within 1e-10.
        assert!((x[0] - 1.0).abs() < 1e-7 && x[1].abs() < 1e-7, "{x:?}");
    }

    #[test]
    fn a_stiff_decay_stays_stable() {
        let mut integrator = DormandPrince::new([1e-8], 1e-3);
        let mut x = [1.0];
        integrator.advance(&mut x, 1e-2, |x| [-1e5 * (x[0] - 2.0)]);
        assert!((x[0] - 2.0).abs() < 1e-6, "{x:?}");
    }
}
