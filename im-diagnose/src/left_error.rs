//! What a model leaves of recordings, as a band that holds 95 % of readings, for simulations to come.
//!
//! w(|i|) = k √(σ² + a² + b²|i|²)
//!
//! σ is the noise of the sensor, |i| the current as modelled. a and b are those with which the squared errors of all rows are nearest to
//! σ² + a² + b²|i|², neither below zero; k is the least with which 95 % lie inside in the recording that is covered worst: a model may miss one
//! manoeuvre more than another, and the next may be like the worst. A fit bends to its recordings, so each training recording counts as the others'
//! fit leaves it ([`Estimates::without`]). Tables of steady states have no part in it.

use im_identify::offline::{Channel, ChannelKind, Experiment, HALF_95, predict};
use im_model::{ErrorBand, Machine, Prediction};
use rayon::prelude::*;

use crate::residuals::{UNSTABLE, judged, nudged};
use crate::search::{Model, Refinement};
use crate::uncertainty::Estimates;

/// Part of the readings that a band holds.
const HELD: f64 = 0.95;

/// A row of a channel: |i| as modelled, the error, and the noise of the sensor.
#[derive(Clone, Copy, Debug)]
struct Row {
    current: f64,
    error: f64,
    sigma: f64,
}

/// What a model leaves of one recording.
#[derive(Clone, Debug, Default)]
pub struct Left {
    /// Of all axes of the current together.
    current: Vec<Row>,
    speed: Vec<Row>,
}

impl Left {
    /// By a prediction of each channel.
    pub fn of(e: &Experiment, predicted: &[Vec<f64>]) -> Self {
        let mut left = Self::default();
        if e.is_table() {
            return left;
        }
        let currents = currents(e, predicted);
        for (c, modelled) in e.channels.iter().zip(predicted) {
            let to = if c.kind == ChannelKind::Speed { &mut left.speed } else { &mut left.current };
            let rows = (0..e.len()).filter(|&k| c.is_valid(k) && modelled[k].is_finite());
            to.extend(rows.map(|k| Row { current: currents[k], error: c.values[k] - modelled[k], sigma: c.sigma }));
        }
        left
    }

    /// The factor on a band with which it holds 95 % of the readings: of the current, of the speed.
    pub fn widening(&self, band: &Prediction) -> [Option<f64>; 2] {
        let factor = |rows: &[Row], band: ErrorBand| (!rows.is_empty()).then(|| widest_of_held(rows, band));
        [factor(&self.current, band.current), band.speed.and_then(|band| factor(&self.speed, band))]
    }

    /// How many readings lie within a band, and how many there are: of the current, of the speed.
    pub fn inside(&self, band: &Prediction) -> [(usize, usize); 2] {
        let count = |rows: &[Row], band: ErrorBand| {
            (rows.iter().filter(|r| r.error.abs() <= band.half_width(r.current)).count(), rows.len())
        };
        [count(&self.current, band.current), band.speed.map_or((0, 0), |band| count(&self.speed, band))]
    }
}

/// What a model leaves of the training recordings where it has not seen them: a fit bends to its recordings, so each is predicted by the machine
/// that the others give.
pub(crate) fn unseen(loop_: &Refinement, machine: &Machine<f64>, estimates: &Estimates) -> Vec<Left> {
    let train = loop_.case().train.par_iter().enumerate().filter(|(_, e)| !e.is_table());
    train.map(|(k, e)| as_held_out(loop_, &estimates.without(machine, k), e)).collect()
}

/// What a machine leaves of a recording that it has not been fitted to.
fn as_held_out(loop_: &Refinement, machine: &Machine<f64>, e: &Experiment) -> Left {
    let start = loop_.starts(machine, &nudged(std::slice::from_ref(e)))[0];
    let e = judged(e, machine, &start, UNSTABLE);
    Left::of(&e, &predict(machine, &e, &start))
}

/// Of a model that is fitted, with what its training recordings determine.
pub(crate) fn of_model(loop_: &Refinement, model: &Model, estimates: &Estimates) -> Option<Prediction> {
    let machine = &model.fit.machine;
    let mut left = unseen(loop_, machine, estimates);
    left.extend(loop_.case().holdout.iter().map(|e| as_held_out(loop_, machine, e)));
    prediction(&left)
}

/// Half the width of the band of each channel in every row, in its unit: by `prediction`, where there is one; else of the sensor's noise alone.
pub(crate) fn half_widths(e: &Experiment, predicted: &[Vec<f64>], prediction: Option<&Prediction>) -> Vec<Vec<f64>> {
    let currents = currents(e, predicted);
    let of = |c: &Channel| {
        let band = if c.kind == ChannelKind::Speed { prediction.and_then(|p| p.speed) } else { prediction.map(|p| p.current) };
        let band = band.unwrap_or(ErrorBand { fixed: HALF_95 * c.sigma, per_ampere: 0.0 });
        currents.iter().map(|i| band.half_width(*i)).collect()
    };
    e.channels.iter().map(of).collect()
}

/// |i| as modelled in every row. Where a single axis was measured its own value is all that there is.
pub(crate) fn currents(e: &Experiment, predicted: &[Vec<f64>]) -> Vec<f64> {
    let axes = || e.channels.iter().zip(predicted).filter(|(c, _)| matches!(c.kind, ChannelKind::Current { .. }));
    let largest = |k: usize| axes().map(|(_, p)| p[k].abs()).fold(0.0, f64::max);
    (0..e.len()).map(|k| e.current_vector(k, |c| predicted[c][k]).map_or_else(|| largest(k), |i| i.norm())).collect()
}

/// The band of what a model leaves; none without a recording of a current.
pub fn prediction(left: &[Left]) -> Option<Prediction> {
    let of = |rows: fn(&Left) -> &[Row]| band(&left.iter().map(rows).filter(|r| !r.is_empty()).collect::<Vec<_>>());
    Some(Prediction { current: of(|l| &l.current)?, speed: of(|l| &l.speed) })
}

/// The band of one quantity over recordings.
fn band(recordings: &[&[Row]]) -> Option<ErrorBand> {
    let all = || recordings.iter().copied().flatten();
    let count = all().count() as f64;
    if count == 0.0 {
        return None;
    }
    let noise = all().map(|r| r.sigma * r.sigma).sum::<f64>() / count;
    let [fixed, slope] = not_negative_line(all().map(|r| [r.current * r.current, r.error * r.error - noise]));
    let shape = ErrorBand { fixed: (noise + fixed).sqrt(), per_ampere: slope.sqrt() };
    let k = recordings.iter().map(|rows| widest_of_held(rows, shape)).fold(0.0, f64::max);
    Some(ErrorBand { fixed: k * shape.fixed, per_ampere: k * shape.per_ampere })
}

/// The least factor on a band with which it holds 95 % of the rows.
fn widest_of_held(rows: &[Row], shape: ErrorBand) -> f64 {
    let mut sizes: Vec<f64> = rows.iter().map(|r| r.error.abs() / shape.half_width(r.current).max(f64::MIN_POSITIVE)).collect();
    let last = ((HELD * sizes.len() as f64).ceil() as usize).clamp(1, sizes.len()) - 1;
    // A hair more, so that the row on the edge is inside whatever the rounding.
    *sizes.select_nth_unstable_by(last, f64::total_cmp).1 * (1.0 + 1e-12)
}

/// y = p + q x with the least squares of errors, neither p nor q below zero.
fn not_negative_line(points: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    let (mut n, mut x1, mut x2, mut y1, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for [x, y] in points {
        n += 1.0;
        x1 += x;
        x2 += x * x;
        y1 += y;
        xy += x * y;
    }
    let det = n * x2 - x1 * x1;
    let line = [(x2 * y1 - x1 * xy) / det, (n * xy - x1 * y1) / det];
    if det > 1e-12 * n * x2 && line[0] >= 0.0 && line[1] >= 0.0 {
        return line;
    }
    // The least is on an edge: whichever of both takes off more.
    let (flat, steep) = ((y1 / n).max(0.0), if x2 > 0.0 { (xy / x2).max(0.0) } else { 0.0 });
    let gain = |p: f64, q: f64| 2.0 * (p * y1 + q * xy) - p * p * n - q * q * x2;
    if gain(flat, 0.0) >= gain(0.0, steep) { [flat, 0.0] } else { [0.0, steep] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use statrs::distribution::{ContinuousCDF, Normal};

    /// A recording of errors as a normal distribution of this size at every current has them, up and down its quantiles.
    fn normal(size: impl Fn(f64) -> f64, sigma: f64) -> Left {
        let law = Normal::standard();
        let rows =
            (0..20).flat_map(|ampere| (0..500).map(move |k| (f64::from(ampere), law.inverse_cdf((f64::from(k) + 0.5) / 500.0))));
        let current = rows.map(|(current, z)| Row { current, error: z * size(current), sigma }).collect();
        Left { current, speed: Vec::new() }
    }

    #[test]
    fn noise_alone_makes_a_band_of_its_own_width() {
        let band = prediction(&[normal(|_| 0.2, 0.2), normal(|_| 0.2, 0.2)]).unwrap();
        assert!((band.current.fixed / (HALF_95 * 0.2) - 1.0).abs() < 0.01, "{band:?}");
        // Errors below the noise as it was estimated, and by chance a hair more at large currents.
        assert!(band.current.per_ampere < 1e-3 && band.speed.is_none(), "{band:?}");
    }

    #[test]
    fn what_grows_with_the_current_is_told_from_what_does_not() {
        let band = prediction(&[normal(|i| 0.3f64.hypot(0.1 * i), 0.05)]).unwrap().current;
        assert!(
            (band.fixed / (HALF_95 * 0.3) - 1.0).abs() < 0.02 && (band.per_ampere / (HALF_95 * 0.1) - 1.0).abs() < 0.02,
            "{band:?}"
        );
    }

    #[test]
    fn the_recording_that_is_covered_worst_decides() {
        let (good, bad) = (normal(|_| 0.2, 0.1), normal(|_| 0.6, 0.1));
        let band = prediction(&[good.clone(), good.clone(), bad.clone()]).unwrap();
        let [inside, _] = bad.inside(&band);
        assert!((inside.0 as f64 / inside.1 as f64 - 0.95).abs() < 0.005, "{inside:?}");
        assert!(good.inside(&band)[0].0 == good.current.len());
        assert!(prediction(&[]).is_none() && prediction(&[Left::default()]).is_none());
    }

    prop_compose! {
        fn rows()(rows in prop::collection::vec((0.0..50.0f64, -5.0..5.0f64), 1..60), sigma in 1e-3..1.0f64) -> Left {
            let row = |(current, error)| Row { current, error, sigma };
            Left { current: rows.iter().copied().map(row).collect(), speed: rows.iter().rev().copied().map(row).collect() }
        }
    }

    proptest! {
        /// Whatever a model leaves: no recording has less than 95 % inside, and a hair less would be too little for one.
        #[test]
        fn every_recording_is_covered_and_none_for_nothing(left in prop::collection::vec(rows(), 1..5)) {
            let band = prediction(&left).unwrap();
            let held = |band: &Prediction, q: usize| left.iter().all(|l| l.inside(band)[q].0 as f64 >= HELD * l.inside(band)[q].1 as f64);
            let less = |b: ErrorBand| ErrorBand { fixed: b.fixed * (1.0 - 1e-9), per_ampere: b.per_ampere * (1.0 - 1e-9) };
            let smaller = Prediction { current: less(band.current), speed: band.speed.map(less) };
            for quantity in [0, 1] {
                prop_assert!(held(&band, quantity) && !held(&smaller, quantity), "{:?}", band);
            }
        }

        /// Of all lines that do not fall, from zero or above: none is nearer.
        #[test]
        fn the_line_is_the_nearest_of_those_allowed(
            points in prop::collection::vec(prop::array::uniform2(-3.0..3.0f64).prop_map(|[x, y]| [x * x, y]), 2..30),
            p in 0.0..3.0f64,
            q in 0.0..3.0f64,
        ) {
            let off = |[p, q]: [f64; 2]| points.iter().map(|[x, y]| (y - p - q * x).powi(2)).sum::<f64>();
            let line = not_negative_line(points.iter().copied());
            prop_assert!(line[0] >= 0.0 && line[1] >= 0.0 && off(line) <= off([p, q]) + 1e-9, "{:?}", line);
        }
    }
}
