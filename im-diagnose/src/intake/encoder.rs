//! Speed from the counts of an encoder.

use super::trace::Trace;

/// Over which the speed is the mean, to either side, s: a count is then some tenths of a radian per second.
const HALF_WINDOW_S: f64 = 2.5e-3;

/// The speed, rad/s: the turn over a window around each row. A counter that begins anew is one that jumps by more than half its range.
pub(super) fn speed(counts: Trace, per_turn: f64, wraps_at: Option<f64>, sample_time_s: f64) -> Trace {
    let x = &counts.values;
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    // Counters have 8, 16, 24 or 32 bits, or begin anew at each turn.
    let range = wraps_at.unwrap_or_else(|| {
        let bits = [8, 16, 24, 32].map(|b| f64::from(b).exp2());
        let all = [per_turn].into_iter().chain(bits);
        all.filter(|r| *r >= high - low).min_by(f64::total_cmp).unwrap_or(f64::INFINITY)
    });
    let mut turns = 0.0;
    let mut before = x.first().copied().unwrap_or(0.0);
    let unwrapped: Vec<f64> = x
        .iter()
        .map(|&now| {
            let step = now - before;
            turns += if step > 0.5 * range {
                -range
            } else if step < -0.5 * range {
                range
            } else {
                0.0
            };
            before = now;
            now + turns
        })
        .collect();
    let n = unwrapped.len();
    let half = ((HALF_WINDOW_S / sample_time_s).round() as usize).max(1);
    let rate = |k: usize| {
        let (a, b) = (k.saturating_sub(half), (k + half).min(n.saturating_sub(1)));
        (unwrapped[b] - unwrapped[a]) / ((b - a).max(1) as f64 * sample_time_s) * std::f64::consts::TAU / per_turn
    };
    Trace { values: (0..n).map(rate).collect(), ..counts }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_that_begins_anew_shows_an_even_speed() {
        for (range, wraps_at) in [(65536.0, None), (4096.0, None), (10_000.0, Some(10_000.0))] {
            let count = |k: i32| (150.0 * 1e-4 * f64::from(k) / std::f64::consts::TAU * 4096.0).floor().rem_euclid(range);
            let counts = Trace { column: "count".into(), values: (0..20_000).map(count).collect(), gain: 1.0, offset: 0.0 };
            let w = speed(counts, 4096.0, wraps_at, 1e-4).values;
            // A count over the window.
            let step = std::f64::consts::TAU / 4096.0 / 5e-3;
            assert!(w[100..19_900].iter().all(|w| (w - 150.0).abs() <= 1.01 * step), "{range}");
        }
    }
}
