//! Columns as sensors would have shown them at the row, and without spikes.

/// Values at their rows of a channel that is sampled `late` rows after each: the cubic through four samples, straight lines at the ends.
pub(super) fn earlier(x: &[f64], late: f64) -> Vec<f64> {
    let n = x.len();
    let at = |k: usize| {
        // The row lies between the samples `whole` and `whole + 1`.
        let place = k as f64 - late;
        let whole = (place.floor().max(0.0) as usize).min(n.saturating_sub(2));
        let s = place - whole as f64;
        if n < 2 {
            return x[k];
        }
        let (b, c) = (x[whole], x[whole + 1]);
        if whole == 0 || whole + 2 >= n || !(0.0..=1.0).contains(&s) {
            return b + s * (c - b);
        }
        let (a, d) = (x[whole - 1], x[whole + 2]);
        // Lagrange.
        a * (-s * (s - 1.0) * (s - 2.0) / 6.0)
            + b * ((s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0)
            + c * (-(s + 1.0) * s * (s - 2.0) / 2.0)
            + d * ((s + 1.0) * s * (s - 1.0) / 6.0)
    };
    (0..n).map(at).collect()
}

/// So many times the usual distance of a sample from the middle of its neighbours is a spike.
const SPIKE: f64 = 12.0;

/// Puts the median of five in the place of single samples that are far off it.
pub(super) fn remove_spikes(x: &mut [f64]) {
    if x.len() < 5 {
        return;
    }
    let median = |w: &[f64]| {
        let mut w = [w[0], w[1], w[2], w[3], w[4]];
        w.sort_by(f64::total_cmp);
        w[2]
    };
    let middles: Vec<f64> = x.windows(5).map(median).collect();
    let mut off: Vec<f64> = x[2..].iter().zip(&middles).map(|(x, m)| (x - m).abs()).collect();
    let at = (off.len() * 9) / 10;
    // Nine in ten are usual: on a smooth signal most samples are the median themselves.
    let usual = *off.clone().select_nth_unstable_by(at, f64::total_cmp).1;
    for (k, (off, middle)) in off.drain(..).zip(middles).enumerate() {
        if off > SPIKE * usual {
            x[k + 2] = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_sample_is_brought_back_to_its_row() {
        let wave = |k: f64| 10.0 * (0.06 * k).sin();
        let late: Vec<f64> = (0..500).map(|k| wave(f64::from(k) + 0.35)).collect();
        let back = earlier(&late, 0.35);
        let off = (2..498).map(|k| (back[k] - wave(k as f64)).abs()).fold(0.0, f64::max);
        assert!(off < 1e-4, "{off}");
        assert_eq!(earlier(&late, 0.0), late);
    }

    #[test]
    fn single_spikes_go_and_the_wave_stays() {
        let wave: Vec<f64> = (0..500).map(|k| 10.0 * (0.06 * f64::from(k)).sin() + 0.01 * f64::from(k % 3)).collect();
        let mut spiked = wave.clone();
        for k in [20, 133, 400] {
            spiked[k] += 80.0;
        }
        remove_spikes(&mut spiked);
        let off = spiked.iter().zip(&wave).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1.5, "{off}");
    }
}
