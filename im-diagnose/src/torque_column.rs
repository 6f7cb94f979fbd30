//! A torque column held against the torque that currents and speed ask for.
//!
//! J dω/dt = τ_e − D ω − τ_L:   where the measured speed drives the machine, this leaves τ_L without the column ([`load_torque`]), with J and D as
//! given. A sensor that lags by T, with a wrong scale and zero, of a shaft whose J and D are others, reads
//!
//!   τ = o + g F_T[τ_L − δJ dω/dt − δD ω],   F_T: a first-order lag,
//!
//! linear in all but T. Of o, g ≠ 1 and T > 0 as few are taken as leave no more than twice the mean square of all three, at the shaft (over g²: a
//! column that does not move explains nothing): what is left is no noise, but what the electrical side may err by. Where they leave more than a tenth of
//! what there was, the sensor is not blamed: a load that no column holds (a cam, cogging) looks a little like a lag.

use im_identify::offline::{Experiment, Load, load_torque};
use im_model::{Machine, State};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::loads::LEAST_KNOWN;
use crate::noise::white_sigma;
use crate::search::UNEXPLAINED;
use crate::statistics::{means, median};

/// What is wrong with a torque column, as far as three faults of a sensor go.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TorqueColumn {
    /// What it reads where there is no torque, Nm.
    pub offset_nm: Option<f64>,
    /// By what factor it reads too much.
    pub scale: Option<f64>,
    /// By how much it is late, s.
    pub lag_s: Option<f64>,
    /// Root mean square of what it is off by: as it is, and without these faults; Nm.
    pub off_nm: [f64; 2],
}

/// A column without noise is taken to be off by this part of its largest value, and of 1 Nm.
const ROUNDING: f64 = 1e-6;
/// Rows of a recording at most: of more, means are taken.
const MOST_ROWS: usize = 20_000;
/// Faults that leave no more than so many times the mean square that all leave do without the others.
const AS_GOOD: f64 = 2.0;
/// Lags that are tried, s.
const LAGS: (f64, f64) = (5e-4, 0.5);

/// A recording: what the shaft asks for, its acceleration and speed, and what the column reads.
struct Run {
    sample_time_s: f64,
    asked: [Vec<f64>; 3],
    read: Vec<f64>,
    /// Inverse variance of each row, 0 where nothing is known.
    weight: Vec<f64>,
}

impl Run {
    fn new(machine: &Machine<f64>, e: &Experiment, start: &State<f64>) -> Option<Self> {
        let Load::Unknown(shown) = &e.load else { return None };
        let found = load_torque(machine, e, start)?;
        let read = e.tau_load.clone();
        let known = LEAST_KNOWN * median(&mut found.std_nm.clone());
        let largest = read.iter().fold(0.0, |most: f64, t| most.max(t.abs()));
        let sigma = white_sigma(&read).max(ROUNDING * largest.max(1.0));
        let is_known = |k: usize| found.torque_nm[k].is_finite() && found.std_nm[k] <= known;
        let weight =
            (0..e.len()).map(|k| if is_known(k) { (sigma.powi(2) + found.std_nm[k].powi(2)).recip() } else { 0.0 }).collect();
        let torque = (0..e.len()).map(|k| if is_known(k) { found.torque_nm[k] } else { read[k] }).collect();
        let [speed, acceleration] = [0, 1].map(|d| shown.smooth.iter().map(|w| w[d]).collect());
        let stride = e.len().div_ceil(MOST_ROWS).max(1);
        let [torque, acceleration, speed, read, weight] =
            [torque, acceleration, speed, read, weight].map(|x: Vec<f64>| means(&x, stride));
        Some(Self { sample_time_s: e.sample_time_s * stride as f64, asked: [torque, acceleration, speed], read, weight })
    }

    /// What a sensor that lags makes of what is asked for.
    fn late(&self, lag_s: f64) -> [Vec<f64>; 3] {
        let part = 1.0 - (-self.sample_time_s / lag_s).exp();
        let filtered = |x: &Vec<f64>| {
            let mut y = x.first().copied().unwrap_or_default();
            let mut step = |x: &f64| {
                y += part * (x - y);
                y
            };
            x.iter().map(&mut step).collect()
        };
        if lag_s > 0.0 { self.asked.each_ref().map(filtered) } else { self.asked.clone() }
    }
}

/// Least squares of what is read, with or without an offset and a scale of its own.
struct Fitted {
    /// Of acceleration and speed, then of what has a size of its own.
    sizes: DVector<f64>,
    /// Sum of weighted squares of what is left, over the square of the scale: at the shaft.
    left: f64,
    /// Sum of weights.
    weights: f64,
}

impl Fitted {
    fn new(runs: &[Run], lag_s: f64, with_offset: bool, with_scale: bool) -> Option<Self> {
        let late: Vec<[Vec<f64>; 3]> = runs.iter().map(|r| r.late(lag_s)).collect();
        let columns = 2 + usize::from(with_offset) + usize::from(with_scale);
        let row = |x: &[Vec<f64>; 3], k: usize| {
            let own = [with_offset.then_some(1.0), with_scale.then_some(x[0][k])];
            DVector::from_iterator(columns, [x[1][k], x[2][k]].into_iter().chain(own.into_iter().flatten()))
        };
        let wanted = |r: &Run, x: &[Vec<f64>; 3], k: usize| r.read[k] - if with_scale { 0.0 } else { x[0][k] };
        let counts = |r: &Run| (0..r.read.len()).filter(|k| r.weight[*k] > 0.0).collect::<Vec<_>>();
        let (mut gram, mut b) = (DMatrix::zeros(columns, columns), DVector::zeros(columns));
        for (r, x) in runs.iter().zip(&late) {
            for k in counts(r) {
                let a = row(x, k);
                gram.ger(r.weight[k], &a, &a, 1.0);
                b.axpy(r.weight[k] * wanted(r, x, k), &a, 1.0);
            }
        }
        let sizes = gram.cholesky()?.solve(&b);
        let scale = if with_scale { sizes[columns - 1] } else { 1.0 };
        let off = |(r, x): (&Run, &[Vec<f64>; 3])| -> f64 {
            let square = |k: usize| r.weight[k] * (wanted(r, x, k) - row(x, k).dot(&sizes)).powi(2);
            counts(r).into_iter().map(square).sum()
        };
        let left = runs.iter().zip(&late).map(off).sum::<f64>() / (scale * scale);
        let weights = runs.iter().flat_map(|r| &r.weight).sum();
        left.is_finite().then_some(Self { sizes, left, weights })
    }

    /// Nm.
    fn rms(&self) -> f64 {
        (self.left / self.weights).sqrt()
    }
}

impl TorqueColumn {
    /// Of experiments that the measured speed drives, each with what its column reads as its load; `None` where no column reads anything.
    pub(crate) fn of(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> Option<Self> {
        if experiments.iter().flat_map(|e| &e.tau_load).all(|t| *t == 0.0) {
            return None;
        }
        let runs: Vec<Run> = experiments.iter().zip(starts).map(|(e, x)| Run::new(machine, e, x)).collect::<Option<_>>()?;
        let as_it_is = Fitted::new(&runs, 0.0, false, false)?;
        let lag = likeliest_lag(&runs)?;
        let all = Fitted::new(&runs, lag, true, true)?.left;
        let each = (0..8).filter_map(|k| {
            let (offset, scale, late) = (k & 1 > 0, k & 2 > 0, k & 4 > 0);
            let lag_s = late.then_some(lag);
            let fitted = Fitted::new(&runs, lag_s.unwrap_or(0.0), offset, scale)?;
            let faults = u8::from(offset) + u8::from(scale) + u8::from(late);
            let off_nm = [as_it_is.rms(), fitted.rms()];
            let offset_nm = offset.then(|| fitted.sizes[2]);
            let found = Self { offset_nm, scale: scale.then(|| fitted.sizes[2 + usize::from(offset)]), lag_s, off_nm };
            (fitted.left <= AS_GOOD * all).then_some((faults, fitted.left, found))
        });
        let best = each.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))?.2;
        let [before, after] = best.off_nm;
        let none = Self { offset_nm: None, scale: None, lag_s: None, off_nm: [before; 2] };
        let is_noise = as_it_is.left <= runs.iter().map(|r| r.read.len()).sum::<usize>() as f64;
        Some(if !is_noise && after * after < UNEXPLAINED * before * before { best } else { none })
    }
}

/// The lag that leaves least with offset and scale free: on a grid, then by golden section.
fn likeliest_lag(runs: &[Run]) -> Option<f64> {
    let left = |ln: f64| Fitted::new(runs, ln.exp(), true, true).map_or(f64::INFINITY, |f| f.left);
    let (low, high) = (LAGS.0.ln(), LAGS.1.ln());
    let step = (high - low) / 14.0;
    let grid = (0..15).map(|k| low + step * f64::from(k));
    let start = grid.map(|x| (x, left(x))).min_by(|a, b| a.1.total_cmp(&b.1))?.0;
    let (mut a, mut b) = (start - step, start + step);
    for _ in 0..20 {
        let (c, d) = (b - 0.618 * (b - a), a + 0.618 * (b - a));
        if left(c) < left(d) { b = d } else { a = c }
    }
    Some((0.5 * (a + b)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::machines::MOTULATOR_2_2_KW as M;
    use im_model::{Bench, Complex, PlantInput, Recording};

    /// A start with steps of the load, as it is recorded; `read` is what the torque column makes of the load.
    fn of(read: impl Fn(f64) -> f64, locked: bool) -> Option<TorqueColumn> {
        let machine = Machine::base(M.parameters(), M.pole_pairs).unwrap();
        let (n, h) = (8000, 2e-4);
        let mut bench = Bench::new(&machine, State::default(), h);
        let mut r = Recording {
            name: "start".into(),
            start_s: 0.0,
            sample_time_s: h,
            u_s: Vec::new(),
            i_s: Vec::new(),
            omega_m: Vec::new(),
            tau_load: Some(Vec::new()),
        };
        for k in 0..n {
            let u = Complex::from_polar(300.0, 314.0 * h * k as f64);
            let load = if k > n / 2 { 8.0 } else { 2.0 };
            let mut input = PlantInput::new(u, load);
            input.imposed_speed = locked.then_some([0.0; 2]);
            let jitter = 0.01 * (k as f64 * 1.7).sin();
            r.u_s.push(u);
            r.i_s.push(bench.output().i_s);
            r.omega_m.push(if locked { 0.0 } else { bench.output().omega_m + jitter });
            r.tau_load.as_mut().unwrap().push(read(load));
            bench.advance(&input);
        }
        let e = Experiment::from_recording(&r, [1.0, 1.0], 0.01).driven_by_speed();
        TorqueColumn::of(&machine, &[e], &[State::default()])
    }

    #[test]
    fn a_scale_is_found_and_a_right_column_has_no_fault() {
        let found = of(|x| 1.08 * x, false).unwrap();
        assert!((found.scale.unwrap() - 1.08).abs() < 0.01 && found.lag_s.is_none(), "{found:?}");
        let right = of(|x| x, false).unwrap();
        assert!(right.offset_nm.is_none() && right.scale.is_none() && right.lag_s.is_none(), "{right:?}");
        assert!(right.off_nm[1] < 0.2, "{right:?}");
    }

    /// A locked rotor balances no torque, and a column of zeros is none.
    #[test]
    fn what_says_nothing_of_the_torque_gives_nothing() {
        assert_eq!(of(|x| x, true), None);
        assert_eq!(of(|_| 0.0, false), None);
        let constant = of(|_| 5.0, false);
        assert!(constant.is_none_or(|c| c.scale.is_none() && c.off_nm.iter().all(|x| x.is_finite())), "{constant:?}");
    }
}
