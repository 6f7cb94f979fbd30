//! Channels that were sampled more slowly than the recording's rows, and held or drawn in straight lines in between.
//!
//! A logger, a converter of files or `[[also]]` brings instruments of several rates to the rows of the fastest. What stands between two samples is
//! no measurement: its noise is none, and it would count for many.

/// Samples over which a clock is compared with itself.
const SPAN: usize = 20;

/// Part of such spans that are even.
const MOST: f64 = 0.9;

/// Rows from sample to sample, from which on a channel is slower than the rows.
const LEAST: f64 = 1.2;

/// Of the root mean square of the bends (or steps), what is none.
const NONE: f64 = 0.01;

/// The samples among the rows of a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// The rows that were measured.
    pub measured: Vec<bool>,
    /// Whether the others are drawn in straight lines; else they are held.
    pub drawn: bool,
}

impl Samples {
    /// What was measured of the channel with these values.
    pub fn of(&self, values: &[f64]) -> Vec<f64> {
        values.iter().zip(&self.measured).filter(|(_, m)| **m).map(|(x, _)| *x).collect()
    }

    /// Rows from one sample to the next, on average.
    pub fn distance(&self) -> f64 {
        self.measured.len() as f64 / self.measured.iter().filter(|m| **m).count().max(1) as f64
    }
}

/// The samples of a channel that has fewer than rows; `None` where every row is a measurement.
pub(super) fn samples(x: &[f64]) -> Option<Samples> {
    let n = x.len();
    // A step belongs to the row that it leads to, a bend to the row in its middle.
    let steps = (0..n).map(|k| if k == 0 { 0.0 } else { x[k] - x[k - 1] }).collect::<Vec<f64>>();
    let bends = (0..n).map(|k| if k + 1 < n { steps[k + 1] - steps[k] } else { 0.0 }).collect::<Vec<f64>>();
    let size = x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    // The steps of held values bend both rows at each, as lines between samples do.
    [(false, steps), (true, bends)]
        .into_iter()
        .find_map(|(drawn, d)| regular(&d, size).map(|measured| Samples { measured, drawn }))
}

/// The rows at which something happens, if it happens rarely and evenly.
fn regular(d: &[f64], size: f64) -> Option<Vec<bool>> {
    let rms = (d.iter().map(|d| d * d).sum::<f64>() / d.len().max(1) as f64).sqrt();
    let least = (NONE * rms).max(1e-12 * size);
    // Between two rows a sample bends both: the row that is nearer bends more.
    let mut rows: Vec<usize> = Vec::new();
    let mut k = 0;
    while k < d.len() {
        let run = d[k..].iter().take_while(|d| d.abs() > least).count();
        match run {
            0 => k += 1,
            1 | 2 => {
                rows.push(if run == 2 && d[k + 1].abs() > d[k].abs() { k + 1 } else { k });
                k += run;
            }
            _ => {
                rows.extend(k..k + run);
                k += run;
            }
        }
    }
    let spans = |rows: &[usize]| rows.windows(SPAN + 1).map(|w| w[SPAN] - w[0]).collect::<Vec<usize>>();
    let mut all = spans(&rows);
    if all.len() < SPAN {
        return None;
    }
    let middle = all.len() / 2;
    let distance = *all.select_nth_unstable(middle).1 as f64 / SPAN as f64;
    // Where two samples are alike, of a rotor at rest for example, nothing happens at the second.
    let alike = |from: usize, to: usize| {
        let count = ((to - from) as f64 / distance).round().max(1.0);
        (0..count as usize).map(move |k| from + (k as f64 * (to - from) as f64 / count).round() as usize)
    };
    let back = (rows[0] as f64 / distance) as usize;
    let first = (1..=back).rev().map(|k| rows[0] - (k as f64 * distance).round() as usize);
    let sampled: Vec<usize> =
        first.chain(rows.windows(2).flat_map(|w| alike(w[0], w[1]))).chain(alike(*rows.last()?, d.len())).collect();
    // A clock ticks evenly, to a row; a quantity that passes the steps of a converter does not.
    let even = |span: &&usize| (**span as f64 - SPAN as f64 * distance).abs() < 1.5;
    let all = spans(&sampled);
    let is_clock = distance > LEAST && all.iter().filter(even).count() as f64 >= MOST * all.len() as f64;
    is_clock.then(|| {
        let mut measured = vec![false; d.len()];
        sampled.into_iter().for_each(|k| measured[k] = true);
        measured
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            12f64.sqrt() * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
        }
    }

    /// A run-up from rest to a steady speed, at time t.
    fn speed(t: f64) -> f64 {
        150.0 * (1.0 - (-(t - 0.05).max(0.0) / 0.1).exp())
    }

    fn held(every: f64, noise: &mut impl FnMut() -> f64) -> Vec<f64> {
        let samples: Vec<f64> = (0..4000).map(|j| speed(1e-4 * every * f64::from(j)) + 0.1 * noise()).collect();
        (0..6000).map(|k| samples[(f64::from(k) / every) as usize]).collect()
    }

    fn drawn(every: f64, noise: &mut impl FnMut() -> f64) -> Vec<f64> {
        let time: Vec<f64> = (0..4000).map(|j| 1e-4 * every * f64::from(j)).collect();
        let samples: Vec<f64> = time.iter().map(|t| speed(*t) + 0.1 * noise()).collect();
        im_formats::drawn(&time, &samples, &(0..6000).map(|k| 1e-4 * f64::from(k)).collect::<Vec<f64>>())
    }

    #[test]
    fn samples_that_were_held_or_drawn_are_told_from_what_stands_between_them() {
        let mut noise = noise(5);
        for every in [2.0, 3.0, 5.0, 10.0, 50.0] {
            for (is_drawn, x) in [(false, held(every, &mut noise)), (true, drawn(every, &mut noise))] {
                let found = samples(&x).unwrap();
                assert!((1..5900).all(|k| found.measured[k] == (k as f64 % every == 0.0)), "{every}");
                assert!(found.drawn == is_drawn && (found.distance() / every - 1.0).abs() < 0.01);
            }
        }
        // Clocks of their own: a row nearest to each sample, and no other.
        for every in [2.5, 3.3, 10.4] {
            for x in [held(every, &mut noise), drawn(every, &mut noise)] {
                let found = samples(&x).unwrap();
                assert!((found.distance() / every - 1.0).abs() < 0.05, "{every}: {}", found.distance());
                let off = |k: usize| (k as f64 / every - (k as f64 / every).round()).abs() * every;
                // Where two samples are alike the second is only about known.
                let wrong = (1..5900).filter(|&k| found.measured[k] && off(k) > 1.01).count();
                assert!(wrong < 20, "{every}: {wrong}");
            }
        }
    }

    #[test]
    fn what_is_measured_at_every_row_is_left_as_it_is() {
        let mut noise = noise(9);
        let rows = |of: &mut dyn FnMut(usize) -> f64| samples(&(0..6000).map(of).collect::<Vec<f64>>());
        // With and without noise, with a coarse converter, an encoder, a standstill, and nothing.
        assert_eq!(rows(&mut |k| speed(1e-4 * k as f64) + 0.1 * noise()), None);
        assert_eq!(rows(&mut |k| speed(1e-4 * k as f64)), None);
        assert_eq!(rows(&mut |k| (speed(1e-4 * k as f64) + 0.1 * noise()).round()), None);
        assert_eq!(rows(&mut |k| (speed(1e-4 * k as f64) / 0.7).round() * 0.7), None);
        let turned = |k: usize| (0..k).map(|k| speed(1e-4 * k as f64)).sum::<f64>() * 1e-4 / std::f64::consts::TAU;
        let count: Vec<f64> = (0..6000).map(|k| (4096.0 * turned(k)).floor()).collect();
        for window in [2, 10, 50] {
            assert_eq!(rows(&mut |k| count[k] - count[k.saturating_sub(window)]), None, "counts over {window} rows");
        }
        assert_eq!(rows(&mut |k| 20.0 * (0.0314 * k as f64).sin()), None);
        assert_eq!(rows(&mut |k| (2000.0 * (0.0314 * k as f64).sin()).round() / 100.0), None);
        assert_eq!(rows(&mut |_| 7.0), None);
        assert_eq!(samples(&[]), None);
    }
}
