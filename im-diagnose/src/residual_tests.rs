//! What the residual of a model still depends on: flux, current, speed, slip, angles and time, without naming a cause.
//!
//! The tests run on whitened residuals, so that a slow drift of coloured noise is no finding; the curves shown are of the raw ones.

use std::collections::BTreeMap;
use std::mem::discriminant;
use std::ops::Range;

use im_identify::offline::{Channel, ChannelKind, Experiment, residuals};
use im_model::space_vector::unit;
use im_model::{Complex, Machine, State};
use rayon::prelude::*;

use crate::localise::slip_hz;
use crate::noise::{Whitener, sensor_whiteners};
use crate::residuals::all_residuals;
use crate::statistics::log_p;

/// What a residual may depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variable {
    /// Magnitude of the magnetizing flux, Vs.
    Flux,
    /// Magnitude of the stator current, A.
    Current,
    /// Mechanical speed, rad/s.
    Speed,
    /// Slip frequency, Hz.
    Slip,
    /// Time, s.
    Time,
    /// Rotor angle: a ripple of this order per revolution.
    RotorAngle(i32),
    /// Angle of the stator current: a ripple of this order per electrical period, as with switching and sensor faults.
    CurrentAngle(i32),
}

impl Variable {
    /// Name with unit.
    pub fn label(self) -> String {
        match self {
            Self::Flux => "magnetizing flux, Vs".into(),
            Self::Current => "stator current, A".into(),
            Self::Speed => "speed, rad/s".into(),
            Self::Slip => "slip frequency, Hz".into(),
            Self::Time => "time, s".into(),
            Self::RotorAngle(n) => format!("rotor angle, {n} per revolution"),
            Self::CurrentAngle(n) => format!("current angle, {n} per period"),
        }
    }
}

/// What part of the residual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Current along the magnetizing flux.
    FluxCurrent,
    /// Current across the flux: the torque-producing one.
    TorqueCurrent,
    /// Speed.
    Speed,
}

impl Part {
    /// Name with unit.
    pub fn label(self) -> &'static str {
        match self {
            Self::FluxCurrent => "current along the flux, A",
            Self::TorqueCurrent => "current across the flux, A",
            Self::Speed => "speed, rad/s",
        }
    }
}

/// A dependence found.
#[derive(Clone, Debug)]
pub struct Dependence {
    /// On what.
    pub variable: Variable,
    /// Of what.
    pub part: Part,
    /// −log₁₀ of its p-value, corrected for all that was tried.
    pub log_p: f64,
    /// The shape: value of the variable, mean residual there, its standard error. For angles: over one ripple, in rad.
    pub curve: Vec<[f64; 3]>,
    /// Root mean square of the curve, in the part's unit.
    pub size: f64,
}

const BINS: usize = 12;
/// Highest ripple order looked for, per revolution of the rotor, and of the current.
const ORDERS: i32 = 60;
const CURRENT_ORDERS: i32 = 12;

const PARTS: [Part; 3] = [Part::FluxCurrent, Part::TorqueCurrent, Part::Speed];
const NAMED: [Variable; 5] = [Variable::Flux, Variable::Current, Variable::Speed, Variable::Slip, Variable::Time];

/// The dependences that stand out, strongest first.
pub fn dependences(machine: &Machine<f64>, starts: &[State<f64>], experiments: &[Experiment]) -> Vec<Dependence> {
    let raw = all_residuals(machine, starts, experiments);
    let noise = sensor_whiteners(experiments, &raw, 1);
    let of_run = |k: usize| {
        let white: Vec<Vec<f64>> = raw[k].iter().zip(&noise[k]).map(|(r, w)| w.apply(r)).collect();
        Series::of(machine, &experiments[k], &starts[k], &raw[k], &white)
    };
    let sampled = (0..experiments.len()).into_par_iter().filter(|&k| !experiments[k].is_table());
    let runs: Vec<Series> = sampled.map(of_run).collect();
    runs.into_iter().fold(Series::default(), Series::followed_by).find()
}

/// −log₁₀ of the probability that the noise which sampled training recordings show leaves so much of a held-out one; each with where it starts.
pub fn held_out_log_p(
    machine: &Machine<f64>,
    (experiments, starts): (&[Experiment], &[State<f64>]),
    (held_out, its_start): (&Experiment, &State<f64>),
) -> f64 {
    let noise = sensor_whiteners(experiments, &all_residuals(machine, starts, experiments), 1);
    // Channels of one name share their noise model.
    let mut known: BTreeMap<&str, (&Channel, &Whitener, usize)> = BTreeMap::new();
    for (e, whiteners) in experiments.iter().zip(&noise).filter(|(e, _)| !e.is_table()) {
        for (c, w) in e.channels.iter().zip(whiteners) {
            known.entry(&c.name).or_insert((c, w, 0)).2 += c.count();
        }
    }
    // Phases, where single ones are left out, are currents as the axes are.
    let alike = |c: &Channel| {
        let same_kind = known.values().filter(|(k, ..)| discriminant(&k.kind) == discriminant(&c.kind));
        known.get(c.name.as_str()).or_else(|| same_kind.max_by_key(|(.., seen)| *seen))
    };
    let left = residuals(machine, held_out, its_start);
    let of = |(c, r): (&Channel, &Vec<f64>)| {
        let &(_, whitener, seen) = alike(c)?;
        let chi2: f64 = whitener.apply(r).iter().map(|w| w * w).sum();
        let count = c.count() as f64;
        // The variance of the noise is known to 2/N of the training rows only.
        let excess = (chi2 - count) / (1.0 + count / seen.max(1) as f64).sqrt();
        Some(log_p(count + excess, c.count()))
    };
    held_out.channels.iter().zip(&left).filter_map(of).fold(0.0, f64::max)
}

/// Fourier sums of raw and whitened residuals over an angle, by order.
struct Ripples {
    rows: f64,
    white: Vec<Complex<f64>>,
    raw: Vec<Complex<f64>>,
}

/// Signals of all runs, row by row.
#[derive(Default)]
struct Series {
    /// Rows of each run.
    runs: Vec<Range<usize>>,
    variables: Vec<[f64; 5]>,
    /// e^{jθ_m}, e^{jθ_i}.
    angles: Vec<[Complex<f64>; 2]>,
    /// Raw and whitened residuals per part.
    raw: Vec<[f64; 3]>,
    white: Vec<[f64; 3]>,
}

impl Series {
    /// Of one run.
    fn of(machine: &Machine<f64>, e: &Experiment, start: &State<f64>, raw: &[Vec<f64>], white: &[Vec<f64>]) -> Self {
        let speed = e.channels.iter().position(|c| c.kind == ChannelKind::Speed);
        let mut bench = e.bench(machine, start);
        let mut me = Self { runs: std::iter::once(0..e.len()).collect(), ..Self::default() };
        for k in 0..e.len() {
            let x = *bench.state();
            let currents = bench.plant().currents(&x);
            let psi = currents.psi_m;
            let direction = if psi.norm() > 1e-6 { psi.conj() / psi.norm() } else { Complex::new(1.0, 0.0) };
            let turned = |r: &[Vec<f64>], weigh: bool| {
                let value = |c: usize| r[c][k] * if weigh { e.channels[c].sigma } else { 1.0 };
                let i = e.current_vector(k, value).unwrap_or_default() * direction;
                [i.re, i.im, speed.filter(|&c| e.channels[c].is_valid(k)).map_or(0.0, value)]
            };
            me.variables.push([
                psi.norm(),
                currents.i_s.norm(),
                x.omega_m,
                slip_hz(machine, &x, currents.i_r),
                e.sample_time_s * k as f64,
            ]);
            let i = currents.i_s;
            me.angles.push([unit(x.theta_m), if i.norm() > 1e-9 { i / i.norm() } else { Complex::new(1.0, 0.0) }]);
            me.raw.push(turned(raw, true));
            me.white.push(turned(white, false));
            bench.advance(&e.input(k, bench.plant()));
        }
        me
    }

    /// With more runs.
    fn followed_by(mut self, next: Self) -> Self {
        let before = self.raw.len();
        self.runs.extend(next.runs.into_iter().map(|r| before + r.start..before + r.end));
        self.variables.extend(next.variables);
        self.angles.extend(next.angles);
        self.raw.extend(next.raw);
        self.white.extend(next.white);
        self
    }

    fn find(&self) -> Vec<Dependence> {
        if self.raw.len() < 50 * BINS {
            return Vec::new();
        }
        let edges_of = |v: usize| inner_edges(self.variables.iter().map(|x| x[v]).collect());
        let edges: Vec<Vec<f64>> = (0..NAMED.len()).into_par_iter().map(edges_of).collect();
        let of_part = |p: usize| -> Vec<Dependence> {
            let variance = self.white.iter().map(|w| w[p] * w[p]).sum::<f64>() / self.white.len() as f64;
            if variance <= 0.0 {
                return Vec::new();
            }
            let over = edges.iter().enumerate().filter_map(|(v, edges)| self.over_variable(v, edges, p, variance));
            over.chain([0, 1].map(|angle| self.over_angle(angle, p, variance))).collect()
        };
        let mut found: Vec<Dependence> = (0..PARTS.len()).into_par_iter().flat_map_iter(of_part).collect();
        found.retain(|d| d.log_p > 3.0);
        found.sort_by(|a, b| b.log_p.total_cmp(&a.log_p));
        found
    }

    /// How a part depends on a variable, in bins between such edges.
    fn over_variable(&self, v: usize, edges: &[f64], p: usize, variance: f64) -> Option<Dependence> {
        let bin = |x: f64| edges.iter().take_while(|e| x > **e).count();
        let mut sums = [[0.0; 5]; BINS];
        for (x, (w, r)) in self.variables.iter().zip(self.white.iter().zip(&self.raw)) {
            let s = &mut sums[bin(x[v])];
            s[0] += 1.0;
            s[1] += w[p];
            s[2] += r[p];
            s[3] += r[p] * r[p];
            s[4] += x[v];
        }
        let used: Vec<&[f64; 5]> = sums.iter().filter(|s| s[0] > 20.0).collect();
        if used.len() < 3 {
            return None;
        }
        let chi2: f64 = used.iter().map(|s| s[1] * s[1] / (s[0] * variance)).sum();
        let point = |s: &&[f64; 5]| {
            let mean = s[2] / s[0];
            [s[4] / s[0], mean, ((s[3] / s[0] - mean * mean).max(0.0) / s[0]).sqrt()]
        };
        Some(self.dependence(NAMED[v], p, log_p(chi2, used.len()), used.iter().map(point).collect()))
    }

    /// The ripple of a part over an angle, of the order that stands out most.
    fn over_angle(&self, angle: usize, p: usize, variance: f64) -> Dependence {
        let orders = if angle == 0 { ORDERS } else { CURRENT_ORDERS };
        // The rotor stands at another angle at the start of each run, the current does not.
        let whole = 0..self.raw.len();
        let runs = if angle == 0 { self.runs.as_slice() } else { std::slice::from_ref(&whole) };
        let found_in: Vec<Ripples> = runs.par_iter().map(|run| self.ripples(run, angle, p, orders as usize)).collect();
        let power = |m: usize| found_in.iter().map(|r| r.white[m].norm_sqr() / r.rows).sum::<f64>();
        let best = (0..orders as usize).max_by(|&i, &j| power(i).total_cmp(&power(j))).unwrap_or(0);
        // As large as in all runs, as it lies in the run that shows it best.
        let part_of = |r: &Ripples| r.raw[best].norm_sqr() / r.rows;
        let clearest = found_in.iter().max_by(|a, b| part_of(a).total_cmp(&part_of(b)));
        let size = 2.0 * (found_in.iter().map(part_of).sum::<f64>() / self.raw.len() as f64).sqrt();
        let amplitude = clearest.map_or(Complex::default(), |r| r.raw[best] / r.raw[best].norm().max(f64::MIN_POSITIVE)) * size;
        let point = |k: i32| {
            let at = std::f64::consts::TAU * f64::from(k) / 24.0;
            [at, (amplitude * unit(at)).re, 0.0]
        };
        let order = best as i32 + 1;
        let variable = if angle == 0 { Variable::RotorAngle(order) } else { Variable::CurrentAngle(order) };
        let chi2 = 2.0 * power(best) / variance;
        self.dependence(variable, p, log_p(chi2, 2 * runs.len()), (0..24).map(point).collect())
    }

    /// Fourier sums of a part's residual over an angle, for orders from 1.
    fn ripples(&self, run: &Range<usize>, angle: usize, part: usize, orders: usize) -> Ripples {
        let mut sums =
            Ripples { rows: run.len() as f64, white: vec![Complex::default(); orders], raw: vec![Complex::default(); orders] };
        for k in run.clone() {
            let step = self.angles[k][angle].conj();
            let mut turn = step;
            for (w, r) in sums.white.iter_mut().zip(&mut sums.raw) {
                *w += turn * self.white[k][part];
                *r += turn * self.raw[k][part];
                turn *= step;
            }
        }
        sums
    }

    fn dependence(&self, variable: Variable, p: usize, log_p: f64, curve: Vec<[f64; 3]>) -> Dependence {
        let size = (curve.iter().map(|c| c[1] * c[1]).sum::<f64>() / curve.len().max(1) as f64).sqrt();
        let tried = (NAMED.len() * PARTS.len()) as f64 + 3.0 * f64::from(ORDERS) * 2.0;
        Dependence { variable, part: PARTS[p], log_p: log_p - tried.log10(), curve, size }
    }
}

/// Inner edges of bins that hold equally many rows.
fn inner_edges(mut x: Vec<f64>) -> Vec<f64> {
    x.sort_unstable_by(f64::total_cmp);
    (1..BINS).map(|k| x[k * x.len() / BINS]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::{Recording, machines};

    /// A machine whose stator resistance is another in the held-out recording misses it, whatever its channels are called.
    #[test]
    fn a_held_out_recording_of_phases_is_asked_with_the_noise_of_axes() {
        let m = machines::MOTULATOR_2_2_KW;
        let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
        let mut state = 5_u64;
        let mut noise = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            12f64.sqrt() * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
        };
        let n = 2000;
        let u_s = (0..n).map(|k| Complex::from_polar(100.0, 0.03 * f64::from(k))).collect();
        let zero = vec![Complex::new(0.0, 0.0); n as usize];
        let r = Recording {
            name: String::new(),
            start_s: 0.0,
            sample_time_s: 1e-4,
            i_s: zero,
            omega_m: vec![0.0; n as usize],
            tau_load: None,
            u_s,
        };
        let e = Experiment::from_recording(&r, [0.02; 2], 0.1);
        let mut recorded = |of: &Machine<f64>, mut e: Experiment| {
            let shown = im_identify::offline::predict(of, &e, &State::default());
            for (c, y) in e.channels.iter_mut().zip(shown) {
                c.values = y.iter().map(|y| y + c.sigma * noise()).collect();
            }
            e
        };
        let phases = Experiment {
            channels: e
                .channels
                .iter()
                .zip(["i_a_A", "i_b_A"])
                .map(|(c, name)| Channel { name: name.into(), ..c.clone() })
                .collect(),
            ..e.clone()
        };
        let train = [recorded(&machine, e)];
        let log_p = |held: &Experiment| held_out_log_p(&machine, (&train, &[State::default()]), (held, &State::default()));
        let warm = im_model::ParameterId::Base(im_model::BaseParameter::StatorResistance);
        let warm = machine.with(&[(warm, 1.2 * machine.get(warm))]).unwrap();
        let alike = recorded(&machine, phases.clone());
        let other = recorded(&warm, phases);
        assert!(log_p(&alike) < 3.0 && log_p(&other) > 10.0, "{} {}", log_p(&alike), log_p(&other));
    }
}
