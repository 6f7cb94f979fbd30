//! By how much one record of a signal lags another.
//!
//! The normalized cross-correlation over the rows that both have, for every lag at which they share half of the shorter, by fast Fourier
//! transforms: ρ(l) = Σ x_{k+l} y_k / √(Σ x² Σ y²), of signals less their means over what they share.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

/// The lag of two records.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lag {
    /// y_k is x_{k+l}; rows, with a fraction.
    Of(f64),
    /// They are not the same signal: the largest correlation.
    Unlike(f64),
    /// They are alike at more than one lag, as periodic signals are: two of them.
    Several(f64, f64),
}

/// Least correlation of one signal seen by two instruments.
const ALIKE: f64 = 0.9;

/// The lag of `y` behind `x`.
pub fn lag(x: &[f64], y: &[f64]) -> Lag {
    let (n, m) = (x.len(), y.len());
    let least = n.min(m).div_ceil(2).max(2);
    if n.min(m) < 4 {
        return Lag::Unlike(0.0);
    }
    // Lags from −(m − least) to n − least.
    let lags: Vec<isize> = (least as isize - m as isize..=n as isize - least as isize).collect();
    let products = products(x, y);
    let (sx, sy) = (sums(x), sums(y));
    let correlation = |l: isize| {
        // Rows of y from a to b meet those of x from a + l.
        let (a, b) = ((-l).max(0) as usize, (n as isize - l).min(m as isize) as usize);
        let (from, to) = ((a as isize + l) as usize, (b as isize + l) as usize);
        let count = (b - a) as f64;
        let [mean_x, square_x] = [0, 1].map(|p| (sx[to][p] - sx[from][p]) / count);
        let [mean_y, square_y] = [0, 1].map(|p| (sy[b][p] - sy[a][p]) / count);
        let together = products[l.rem_euclid(products.len() as isize) as usize] / count - mean_x * mean_y;
        let size = ((square_x - mean_x * mean_x) * (square_y - mean_y * mean_y)).max(0.0).sqrt();
        if size > 0.0 { together / size } else { 0.0 }
    };
    let rho: Vec<f64> = lags.iter().map(|&l| correlation(l)).collect();
    let best = (0..rho.len()).max_by(|&a, &b| rho[a].total_cmp(&rho[b])).unwrap_or(0);
    if rho[best] < ALIKE {
        return Lag::Unlike(rho[best]);
    }
    // What is not alike; of a lag between two rows, half a row off, a quarter of what its neighbours leave. Another lag is as good where, beyond
    // lags with four times as much, it is not half as much again.
    let left = |k: usize| 1.0 - rho[k] * rho[k];
    let beside = [best.saturating_sub(1), (best + 1).min(rho.len() - 1)].map(left);
    let scale = left(best) + 0.25 * beside[0].max(beside[1]) + 1e-12;
    let other = |mut ks: Box<dyn Iterator<Item = usize>>| {
        ks.find(|&k| left(k) > 4.0 * scale).and_then(|_| ks.find(|&k| rho[k] > 0.0 && left(k) < 1.5 * scale))
    };
    if let Some(k) = other(Box::new((0..best).rev())).or_else(|| other(Box::new(best + 1..rho.len()))) {
        return Lag::Several(lags[best] as f64, lags[k] as f64);
    }
    // The vertex of the parabola through three lags.
    let fraction = match (best.checked_sub(1).map(|k| rho[k]), rho.get(best + 1)) {
        (Some(a), Some(&c)) => {
            let bend = a - 2.0 * rho[best] + c;
            if bend < 0.0 { (0.5 * (a - c) / bend).clamp(-0.5, 0.5) } else { 0.0 }
        }
        _ => 0.0,
    };
    Lag::Of(lags[best] as f64 + fraction)
}

/// Σ x_{k+l} y_k over all rows, l modulo the length.
fn products(x: &[f64], y: &[f64]) -> Vec<f64> {
    let length = (x.len() + y.len()).next_power_of_two();
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, back) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
    let spectrum = |values: &[f64]| {
        let mut padded = vec![0.0; length];
        padded[..values.len()].copy_from_slice(values);
        let mut out = forward.make_output_vec();
        // Lengths fit by construction.
        let _ = forward.process(&mut padded, &mut out);
        out
    };
    let (a, b) = (spectrum(x), spectrum(y));
    let mut product: Vec<Complex<f64>> = a.iter().zip(&b).map(|(a, b)| a * b.conj()).collect();
    let mut out = back.make_output_vec();
    let _ = back.process(&mut product, &mut out);
    out.iter_mut().for_each(|v| *v /= length as f64);
    out
}

/// Sums of the first k values, and of their squares.
fn sums(x: &[f64]) -> Vec<[f64; 2]> {
    let mut sum = [0.0; 2];
    let next = |v: &f64| {
        sum = [sum[0] + v, sum[1] + v * v];
        sum
    };
    std::iter::once([0.0; 2]).chain(x.iter().map(next).collect::<Vec<_>>()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run-up that ends at different times, with a swing of the speed.
    fn run_up(t: f64) -> f64 {
        150.0 * (1.0 - (-t.max(0.0) / 0.2).exp()) + 2.0 * (40.0 * t.max(0.0)).sin()
    }

    #[test]
    fn a_lag_is_found_to_a_fraction_of_a_row() {
        let x: Vec<f64> = (0..2000).map(|k| run_up(1e-3 * f64::from(k) - 0.3)).collect();
        for rows in [-250.0, -0.4, 0.0, 100.3, 700.25] {
            let y: Vec<f64> = (0..1500).map(|k| run_up(1e-3 * (f64::from(k) + rows) - 0.3)).collect();
            match lag(&x, &y) {
                Lag::Of(l) => assert!((l - rows).abs() < 0.05, "{l} {rows}"),
                other => panic!("{other:?}"),
            }
        }
    }

    #[test]
    fn a_sine_is_alike_every_period_and_noise_never() {
        let sine = |k: u32| (f64::from(k) * 0.05).sin();
        let (x, y): (Vec<f64>, Vec<f64>) = ((0..2000).map(sine).collect(), (30..1500).map(sine).collect());
        assert!(matches!(lag(&x, &y), Lag::Several(..)), "{:?}", lag(&x, &y));
        let other: Vec<f64> = (0..1500).map(|k| f64::from(k * k % 97)).collect();
        assert!(matches!(lag(&x, &other), Lag::Unlike(_)), "{:?}", lag(&x, &other));
        assert!(matches!(lag(&[1.0; 9], &[1.0; 9]), Lag::Unlike(_)));
    }
}
