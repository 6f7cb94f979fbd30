//! A quantity that moves slowly behind a noisy measurement: the forward and backward Kalman filter of a line whose slope wanders.
//!
//! x_{k+1} = x_k + u_k + c T s_k + …,   s a random walk of intensity q,   y_k = x_k + e_k,   Var e = σ².
//!
//! With c = 1 and u = 0, x is the speed and s its rate. With u what the known torques do and c = −1/J, s is the load torque. σ and q are
//! those under which the measurement is likeliest; only their ratio is searched for, σ follows from the innovations.
//! Source: H. E. Rauch, F. Tung, C. T. Striebel, Maximum likelihood estimates of linear dynamic systems, AIAA J. 3 (1965) 1445.

/// What is measured, and how it moves.
pub(super) struct Trend<'a> {
    /// One value per row.
    pub values: &'a [f64],
    /// Whether row `k` counts.
    pub valid: &'a dyn Fn(usize) -> bool,
    /// u_k: the known change over the sample that begins at the row.
    pub known: &'a dyn Fn(usize) -> f64,
    /// c.
    pub coupling: f64,
    /// T, s.
    pub sample_time_s: f64,
}

/// x and s after all measurements, each with its standard deviation.
pub(super) struct Smoothed {
    pub x: Vec<f64>,
    pub s: Vec<f64>,
    pub s_std: Vec<f64>,
    /// σ: standard deviation of the measurement's noise.
    pub sigma: f64,
    /// Intensity q c² of the wandering of the slope c s, per s³ times the square of what is measured.
    pub intensity: f64,
    /// −2 log L of what was measured, but for a constant.
    pub cost: f64,
}

/// Mean and covariance (xx, xs, ss) in units of σ².
#[derive(Clone, Copy)]
struct Belief {
    x: f64,
    s: f64,
    p: [f64; 3],
}

/// Range of the logarithm of q c² T³/σ², from a slope that hardly moves to one that follows every sample.
const RATIOS: (f64, f64) = (-36.0, 4.0);

impl Trend<'_> {
    /// The smoothed quantity at the likeliest q and σ.
    pub fn smooth(&self) -> Smoothed {
        let q = self.likeliest();
        let mut after = Vec::with_capacity(self.values.len());
        let (variance, cost) = self.filter(q, |b| after.push(b));
        let intensity = q * variance * self.coupling * self.coupling;
        Smoothed { cost, intensity, ..self.backwards(q, &after, variance.sqrt()) }
    }

    /// q in units of σ², by golden section over its logarithm.
    fn likeliest(&self) -> f64 {
        let unit = 1.0 / (self.coupling * self.coupling * self.sample_time_s.powi(3));
        let cost = |ln: f64| self.filter(unit * ln.exp(), |_| ()).1;
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        // A coarse look first: the likelihood of a step has more than one minimum.
        let grid: Vec<f64> = (0..=10).map(|k| RATIOS.0 + (RATIOS.1 - RATIOS.0) * f64::from(k) / 10.0).collect();
        let best = grid.iter().copied().min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or(0.0);
        let (mut a, mut b) = (best - 4.0, best + 4.0);
        let (mut c, mut d) = (b - GOLDEN * (b - a), a + GOLDEN * (b - a));
        let (mut at_c, mut at_d) = (cost(c), cost(d));
        for _ in 0..12 {
            if at_c < at_d {
                (b, d, at_d) = (d, c, at_c);
                c = b - GOLDEN * (b - a);
                at_c = cost(c);
            } else {
                (a, c, at_c) = (c, d, at_d);
                d = a + GOLDEN * (b - a);
                at_d = cost(d);
            }
        }
        unit * (0.5 * (a + b)).exp()
    }

    /// The step to the next row.
    fn next(&self, b: &Belief, q: f64, k: usize) -> Belief {
        let (h, c) = (self.coupling * self.sample_time_s, self.coupling);
        let [xx, xs, ss] = b.p;
        let t = self.sample_time_s;
        Belief {
            x: b.x + (self.known)(k) + h * b.s,
            s: b.s,
            p: [xx + 2.0 * h * xs + h * h * ss + q * c * c * t * t * t / 3.0, xs + h * ss + q * c * t * t / 2.0, ss + q * t],
        }
    }

    /// Runs forward; gives σ² and −2 log L but for a constant. `keep` sees what is known at each row.
    fn filter(&self, q: f64, mut keep: impl FnMut(Belief)) -> (f64, f64) {
        let first = (0..self.values.len()).find(|&k| (self.valid)(k)).map_or(0.0, |k| self.values[k]);
        // Nothing is known of the slope: a variance that lets x go anywhere within a few samples.
        let wide = 1e6 / (self.coupling * self.sample_time_s).powi(2);
        let mut b = Belief { x: first, s: 0.0, p: [1e6, 0.0, wide] };
        let (mut sum, mut log, mut n) = (0.0, 0.0, 0.0);
        for (k, &y) in self.values.iter().enumerate() {
            if k > 0 {
                b = self.next(&b, q, k - 1);
            }
            if (self.valid)(k) {
                let [xx, xs, ss] = b.p;
                let variance = xx + 1.0;
                let (gain_x, gain_s) = (xx / variance, xs / variance);
                let innovation = y - b.x;
                b.x += gain_x * innovation;
                b.s += gain_s * innovation;
                b.p = [xx / variance, xs / variance, ss - gain_s * xs];
                // The first two rows find where it begins.
                if k > 1 {
                    sum += innovation * innovation / variance;
                    log += variance.ln();
                    n += 1.0;
                }
            }
            keep(b);
        }
        let variance = (sum / f64::max(n, 1.0)).max(f64::MIN_POSITIVE);
        (variance, n * variance.ln() + log)
    }

    fn backwards(&self, q: f64, after: &[Belief], sigma: f64) -> Smoothed {
        let n = after.len();
        let mut out = Smoothed { x: vec![0.0; n], s: vec![0.0; n], s_std: vec![0.0; n], sigma, intensity: 0.0, cost: 0.0 };
        let mut later: Option<Belief> = None;
        for k in (0..n).rev() {
            let here = after[k];
            let smoothed = match later {
                None => here,
                Some(later) => {
                    let ahead = self.next(&here, q, k);
                    let h = self.coupling * self.sample_time_s;
                    let [xx, xs, ss] = here.p;
                    // P Aᵀ (A P Aᵀ + Q)⁻¹ with A = [1 h; 0 1].
                    let to = [[xx + h * xs, xs], [xs + h * ss, ss]];
                    let [a, b, d] = ahead.p;
                    let det = (a * d - b * b).max(f64::MIN_POSITIVE);
                    let inverse = [[d / det, -b / det], [-b / det, a / det]];
                    let mut g = [[0.0; 2]; 2];
                    for (row, to) in g.iter_mut().zip(&to) {
                        for (c, x) in row.iter_mut().enumerate() {
                            *x = to[0] * inverse[0][c] + to[1] * inverse[1][c];
                        }
                    }
                    let (dx, ds) = (later.x - ahead.x, later.s - ahead.s);
                    let dp = [later.p[0] - a, later.p[1] - b, later.p[2] - d];
                    // G ΔP Gᵀ.
                    let form =
                        |u: [f64; 2], v: [f64; 2]| u[0] * (dp[0] * v[0] + dp[1] * v[1]) + u[1] * (dp[1] * v[0] + dp[2] * v[1]);
                    Belief {
                        x: here.x + g[0][0] * dx + g[0][1] * ds,
                        s: here.s + g[1][0] * dx + g[1][1] * ds,
                        p: [xx + form(g[0], g[0]), xs + form(g[0], g[1]), ss + form(g[1], g[1])],
                    }
                }
            };
            out.x[k] = smoothed.x;
            out.s[k] = smoothed.s;
            out.s_std[k] = sigma * smoothed.p[2].max(0.0).sqrt();
            later = Some(smoothed);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(n: usize) -> Vec<f64> {
        let mut s = 7u64;
        let mut u = || {
            s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (s >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..n).map(|_| (0..12).map(|_| u()).sum::<f64>() - 6.0).collect()
    }

    #[test]
    fn a_noisy_swing_is_smoothed_and_its_noise_is_known() {
        let truth = |k: usize| 10.0 * (6.0 * k as f64 * 1e-3).sin();
        let y: Vec<f64> = noise(4000).iter().enumerate().map(|(k, e)| truth(k) + 0.2 * e).collect();
        let trend = Trend { values: &y, valid: &|k| k % 50 != 7, known: &|_| 0.0, coupling: 1.0, sample_time_s: 1e-3 };
        let s = trend.smooth();
        let off: f64 = (s.x.iter().enumerate().map(|(k, x)| (x - truth(k)).powi(2)).sum::<f64>() / 4000.0).sqrt();
        assert!((s.sigma / 0.2 - 1.0).abs() < 0.05 && off < 0.05, "{} {off}", s.sigma);
    }

    #[test]
    fn a_torque_is_found_within_its_band() {
        // J = 0.02 under a known torque of 3 Nm and a load that steps from 1 to 4 Nm and swings.
        let (dt, inertia, n) = (1e-3, 0.02, 4000);
        let load = |k: usize| if k < 2000 { 1.0 } else { 4.0 } + 0.5 * (0.003 * k as f64).sin();
        let mut w = 5.0;
        let y: Vec<f64> = noise(n)
            .iter()
            .enumerate()
            .map(|(k, e)| {
                let shown = w + 0.05 * e;
                w += dt / inertia * (3.0 - load(k));
                shown
            })
            .collect();
        let known = |_| dt / inertia * 3.0;
        let s = Trend { values: &y, valid: &|_| true, known: &known, coupling: -1.0 / inertia, sample_time_s: dt }.smooth();
        let inside = (0..n).filter(|&k| (s.s[k] - load(k)).abs() < 2.0 * s.s_std[k]).count();
        assert!(inside as f64 > 0.9 * n as f64, "{inside}");
        assert!(s.s_std.iter().all(|x| *x < 0.8), "{:?}", s.s_std.iter().fold(0.0f64, |a, b| a.max(*b)));
    }
}
