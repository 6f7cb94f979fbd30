//! Predicted outputs of an experiment, with or without sensitivities.

use im_model::{Bench, Complex, Drive, Dual, Machine, ParameterId, Scalar, State};
use rayon::prelude::*;

use super::experiment::{ChannelKind, Experiment};
use super::free::{Free, Target};
use super::steady;

/// Runs an experiment over its first `rows` rows; `sink` receives each row's channel values.
#[inline(always)]
fn run<T: Scalar>(
    machine: &Machine<T>,
    experiment: &Experiment,
    start: State<T>,
    rows: usize,
    mut sink: impl FnMut(usize, usize, T),
) {
    let mut bench = Bench::new(machine, start, experiment.sample_time_s);
    let directions: Vec<Option<(f64, f64)>> = experiment
        .channels
        .iter()
        .map(|c| match c.kind {
            ChannelKind::Current { direction_rad } => Some(direction_rad.sin_cos()),
            _ => None,
        })
        .collect();
    let (u, tau) = (&experiment.u_s[..rows], &experiment.tau_load[..rows]);
    if let Some(&first) = u.first() {
        let moving = start.psi_s.re.value() != 0.0 || start.psi_s.im.value() != 0.0;
        if moving {
            bench.set_past_command(constant(first));
        }
    }
    for k in 0..rows {
        let out = bench.output();
        for (c, d) in directions.iter().enumerate() {
            let y = match *d {
                // The two usual axes cost no products.
                Some((0.0, _)) => out.i_s.re,
                Some((1.0, _)) => out.i_s.im,
                Some((s, cos)) => out.i_s.re.scale(cos) + out.i_s.im.scale(s),
                None => out.omega_m,
            };
            sink(k, c, y);
        }
        let mut drive = Drive::new(constant(u[k]), T::from_f64(tau[k]));
        if let Some(w) = &experiment.imposed_speed {
            let next = w[(k + 1).min(w.len() - 1)];
            drive.imposed_speed = Some([T::from_f64(w[k]), T::from_f64(next)]);
        }
        if let Some((w, rate)) = &experiment.speed_pull {
            drive.speed_pull = Some([T::from_f64(w[k]), T::from_f64(*rate)]);
        }
        bench.advance(&drive);
    }
}

#[inline(always)]
fn constant<T: Scalar>(u: Complex<f64>) -> Complex<T> {
    Complex::new(T::from_f64(u.re), T::from_f64(u.im))
}

/// Simulates, or solves each steady state, over the first `rows` rows.
fn sweep(machine: &Machine<f64>, experiment: &Experiment, start: &State<f64>, rows: usize, sink: impl FnMut(usize, usize, f64)) {
    match experiment.supply_frequency_hz {
        Some(f) => steady::run(machine, experiment, f, rows, sink),
        None => run(machine, experiment, *start, rows, sink),
    }
}

/// Predicted values of each channel, in the order of `experiment.channels`.
pub fn predict(machine: &Machine<f64>, experiment: &Experiment, start: &State<f64>) -> Vec<Vec<f64>> {
    let mut out = vec![vec![0.0; experiment.len()]; experiment.channels.len()];
    sweep(machine, experiment, start, experiment.len(), |k, c, y| out[c][k] = y);
    out
}

/// Residuals (measured − predicted)/σ per channel; zero at rows that do not count.
pub fn residuals(machine: &Machine<f64>, experiment: &Experiment, start: &State<f64>) -> Vec<Vec<f64>> {
    residuals_to(machine, experiment, start, experiment.len())
}

/// As [`residuals`], over the first `rows` rows.
pub(super) fn residuals_to(machine: &Machine<f64>, experiment: &Experiment, start: &State<f64>, rows: usize) -> Vec<Vec<f64>> {
    let mut out = vec![vec![0.0; rows]; experiment.channels.len()];
    sweep(machine, experiment, start, rows, |k, c, y| {
        let channel = &experiment.channels[c];
        if channel.is_valid(k) {
            out[c][k] = (channel.values[k] - y) / channel.sigma;
        }
    });
    out
}

/// Residuals and their derivatives at a machine.
#[derive(Clone, Debug)]
pub struct Linearized {
    /// Per channel: (measured − predicted)/σ.
    pub residuals: Vec<Vec<f64>>,
    /// Per free parameter, per channel: d(predicted/σ)/dv, with v the search variable.
    pub slopes: Vec<Vec<Vec<f64>>>,
}

/// Residuals of `experiment` (number `index` in the fit) and their slopes with respect to the search variables of `free`.
pub fn linearize(machine: &Machine<f64>, experiment: &Experiment, start: &State<f64>, index: usize, free: &[Free]) -> Linearized {
    linearize_to(machine, experiment, start, index, free, experiment.len())
}

pub(super) fn linearize_to(
    machine: &Machine<f64>,
    experiment: &Experiment,
    start: &State<f64>,
    index: usize,
    free: &[Free],
    rows: usize,
) -> Linearized {
    if experiment.is_table() {
        return steady::linearize(machine, experiment, start, free, rows);
    }
    // Chunks of the widths that exist; a last chunk of a few parameters takes the narrowest that holds it.
    let mut chunks = Vec::new();
    let mut rest = free;
    while !rest.is_empty() {
        let n = if rest.len() > 8 && rest.len() < 12 { rest.len() } else { rest.len().min(12) };
        let (head, tail) = rest.split_at(n);
        chunks.push(head);
        rest = tail;
    }
    let parts: Vec<Linearized> = chunks
        .par_iter()
        .map(|chunk| match chunk.len() {
            0..=4 => seeded::<4>(machine, experiment, start, index, chunk, rows),
            5..=6 => seeded::<6>(machine, experiment, start, index, chunk, rows),
            7..=8 => seeded::<8>(machine, experiment, start, index, chunk, rows),
            _ => seeded::<12>(machine, experiment, start, index, chunk, rows),
        })
        .collect();
    let mut parts = parts.into_iter();
    let mut all = parts
        .next()
        .unwrap_or_else(|| Linearized { residuals: residuals_to(machine, experiment, start, rows), slopes: Vec::new() });
    for p in parts {
        all.slopes.extend(p.slopes);
    }
    all
}

fn seeded<const N: usize>(
    machine: &Machine<f64>,
    experiment: &Experiment,
    start: &State<f64>,
    index: usize,
    free: &[Free],
    rows: usize,
) -> Linearized {
    let machine_n = machine.map(|id: ParameterId, x| {
        let mut d = Dual::<N>::constant(x);
        for (k, f) in free.iter().enumerate() {
            if let Target::Machine(ids) = &f.target
                && ids.contains(&id)
            {
                d.eps[k] = f.slope(x);
            }
        }
        d
    });
    let mut start_n = cast(start);
    for (k, f) in free.iter().enumerate() {
        if let Target::Initial { experiment: e, component } = f.target
            && e == index
        {
            let slope = f.slope(0.0);
            let part = match component {
                0 => &mut start_n.psi_s.re,
                1 => &mut start_n.psi_s.im,
                2 => &mut start_n.psi_r.re,
                3 => &mut start_n.psi_r.im,
                _ => {
                    start_n.omega_load.eps[k] = slope;
                    &mut start_n.omega_m
                }
            };
            part.eps[k] = slope;
        }
    }
    let channels = experiment.channels.len();
    let mut out =
        Linearized { residuals: vec![vec![0.0; rows]; channels], slopes: vec![vec![vec![0.0; rows]; channels]; free.len()] };
    run(&machine_n, experiment, start_n, rows, |k, c, y| {
        let channel = &experiment.channels[c];
        if channel.is_valid(k) {
            let weight = 1.0 / channel.sigma;
            out.residuals[c][k] = (channel.values[k] - y.re) * weight;
            for (slope, e) in out.slopes.iter_mut().zip(y.eps) {
                slope[c][k] = e * weight;
            }
        }
    });
    out
}

fn cast<const N: usize>(x: &State<f64>) -> State<Dual<N>> {
    let c = Dual::constant;
    let z = |v: Complex<f64>| Complex::new(c(v.re), c(v.im));
    State {
        psi_s: z(x.psi_s),
        psi_r: z(x.psi_r),
        omega_m: c(x.omega_m),
        theta_m: c(x.theta_m),
        psi_fe: z(x.psi_fe),
        i_bar: z(x.i_bar),
        omega_load: c(x.omega_load),
        twist: c(x.twist),
        stator_rise_k: c(x.stator_rise_k),
        rotor_rise_k: c(x.rotor_rise_k),
        own: x.own.map(|o| o.map(c)),
    }
}
