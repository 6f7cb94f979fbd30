//! Predicted outputs of an experiment, with or without sensitivities.

use im_model::{Machine, ParameterId, PlantInput, Scalar, SingleDual, State};
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

use super::channel::{Channel, ChannelKind};
use super::experiment::{Experiment, Start, constant};
use super::free::{Free, Target, change_component};
use super::speed::Of;
use super::steady;
use super::stop;

/// Per experiment and channel: (measured − predicted)/σ, row by row; zero at rows that do not count.
pub type Residuals = Vec<Vec<Vec<f64>>>;

/// Runs an experiment over its first `rows` rows; `sink` receives each row's channel values.
#[inline(always)]
fn run<T: Scalar>(
    machine: &Machine<T>,
    experiment: &Experiment,
    start: State<T>,
    rows: usize,
    mut sink: impl FnMut(usize, usize, T),
) {
    stop::check();
    let mut bench = experiment.bench(machine, &start);
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
    if let (Start::Estimated(_), Some((&u, &tau))) = (experiment.start, u.first().zip(tau.first())) {
        // States that follow the fluxes within microseconds (iron) or milliseconds (skin effect) are no unknowns of a start in motion.
        // Beginning at zero the iron's flux would kick the first current by tens of amperes.
        let plant = *bench.plant();
        plant.settle(bench.state_mut(), &PlantInput::new(constant(u), T::from_f64(tau)));
    }
    for k in 0..rows {
        let input = experiment.input(k, bench.plant());
        let out = bench.show_and_advance(&input);
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
    }
}

/// Simulates, or solves each steady state, over the first `rows` rows.
fn sweep(machine: &Machine<f64>, experiment: &Experiment, start: &State<f64>, rows: usize, sink: impl FnMut(usize, usize, f64)) {
    match experiment.supply_frequency_hz {
        Some(f) => steady::run(machine, experiment, f, rows, sink),
        None => run(machine, experiment, *start, rows, sink),
    }
}

/// Predicted values of each channel, in the order of `experiment.channels`; where its speed is not known or not without noise, with the likeliest up
/// to each row.
pub fn predict(machine: &Machine<f64>, experiment: &Experiment, start: &State<f64>) -> Vec<Vec<f64>> {
    outputs(machine, experiment, start).0
}

/// What [`predict`] and [`residuals`] give, by one simulation.
pub fn outputs(machine: &Machine<f64>, experiment: &Experiment, start: &State<f64>) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let mut predicted = vec![vec![0.0; experiment.len()]; experiment.channels.len()];
    sweep(machine, experiment, start, experiment.len(), |k, c, y| predicted[c][k] = y);
    let off = |(c, y): (&Channel, &Vec<f64>)| -> Vec<f64> {
        y.iter().enumerate().map(|(k, y)| if c.is_valid(k) { (c.values[k] - y) / c.sigma } else { 0.0 }).collect()
    };
    let mut left: Vec<Vec<f64>> = experiment.channels.iter().zip(&predicted).map(off).collect();
    if let Some(unsure) = experiment.load.unsure_speed() {
        // What the likeliest speed leaves of what was measured.
        let mut left = left.clone();
        unsure.whiten(&mut left, &experiment.channels, Of::Residuals);
        for ((y, r), c) in predicted.iter_mut().zip(&left).zip(&experiment.channels) {
            y.iter_mut().enumerate().filter(|(k, _)| c.is_valid(*k)).for_each(|(k, y)| *y = c.values[k] - c.sigma * r[k]);
        }
    }
    whitened(experiment, &mut left, Of::Residuals);
    (predicted, left)
}

/// Residuals (measured − predicted)/σ per channel; zero at rows that do not count. Of what the noise of the inputs does, innovations.
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
    whitened(experiment, &mut out, Of::Residuals);
    out
}

/// Where the speed is not known, or speed or voltage not without noise, only what no such inputs could explain counts.
fn whitened(experiment: &Experiment, r: &mut [Vec<f64>], of: Of) {
    if let Some(unsure) = experiment.unsure_inputs() {
        unsure.whiten(r, &experiment.channels, of);
    }
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
        let (residuals, slopes) = steady::linearize(machine, free, |m| residuals_to(m, experiment, start, rows));
        return Linearized { residuals, slopes };
    }
    let mut rest = free;
    let chunks: Vec<(usize, &[Free])> = widths(free.len())
        .into_iter()
        .map(|width| {
            let (head, tail) = rest.split_at(width.min(rest.len()));
            rest = tail;
            (width, head)
        })
        .collect();
    let parts: Vec<Linearized> = chunks
        .par_iter()
        .map(|&(width, chunk)| match width {
            4 => seeded::<4>(machine, experiment, start, index, chunk, rows),
            8 => seeded::<8>(machine, experiment, start, index, chunk, rows),
            _ => seeded::<WIDEST>(machine, experiment, start, index, chunk, rows),
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

/// Widest dual: twelve derivatives take a diagnosis a twentieth less time than eight. Wider ones were not tried: their code outgrew the
/// instruction cache in double precision.
const WIDEST: usize = 12;

/// The fewest duals of widths 4, 8 and 12 that hold `n` derivatives between them, as even as they come.
fn widths(n: usize) -> Vec<usize> {
    let fours = n.div_ceil(4);
    let count = n.div_ceil(WIDEST);
    (0..count).map(|k| 4 * (fours / count + usize::from(k < fours % count))).collect()
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
        let mut d = SingleDual::<N>::constant(x);
        for (k, f) in free.iter().enumerate() {
            if let Target::Machine(ids) = &f.target
                && ids.contains(&id)
            {
                d.eps[k] = f.slope(x) as f32;
            }
        }
        d
    });
    let mut start_n = start.map(|x| SingleDual::constant(*x));
    for (k, f) in free.iter().enumerate() {
        if let Target::Initial { experiment: e, component } = f.target
            && e == index
        {
            let slope = f.slope(0.0);
            change_component(&mut start_n, component, |q| q.eps[k] = slope as f32);
        }
    }
    let channels = experiment.channels.len();
    let mut out =
        Linearized { residuals: vec![vec![0.0; rows]; channels], slopes: vec![vec![vec![0.0; rows]; channels]; free.len()] };
    Arch::new().dispatch(Seeded { machine: &machine_n, experiment, start: start_n, rows, out: &mut out });
    whitened(experiment, &mut out.residuals, Of::Residuals);
    out.slopes.iter_mut().for_each(|s| whitened(experiment, s, Of::Changes));
    out
}

/// A run with derivatives, compiled once more for the wide vector instructions that most processors have: the same arithmetic in the same
/// order, to the last bit, in about three quarters of the time.
struct Seeded<'a, const N: usize> {
    machine: &'a Machine<SingleDual<N>>,
    experiment: &'a Experiment,
    start: State<SingleDual<N>>,
    rows: usize,
    out: &'a mut Linearized,
}

impl<const N: usize> NullaryFnOnce for Seeded<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { machine, experiment, start, rows, out } = self;
        run(machine, experiment, start, rows, |k, c, y| {
            let channel = &experiment.channels[c];
            if channel.is_valid(k) {
                let weight = 1.0 / channel.sigma;
                out.residuals[c][k] = (channel.values[k] - y.re) * weight;
                for (slope, e) in out.slopes.iter_mut().zip(y.eps) {
                    slope[c][k] = f64::from(e) * weight;
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::{Complex, EffectId, Effects, Held, Recording, machines, steady_state};

    #[test]
    fn duals_hold_all_derivatives_with_at_most_three_places_left() {
        for n in 0..40 {
            let w = widths(n);
            assert!(w.len() == n.div_ceil(WIDEST) && (n..n + 4).contains(&w.iter().sum()), "{n}: {w:?}");
            assert!(w.iter().all(|w| [4, 8, WIDEST].contains(w)), "{n}: {w:?}");
        }
    }

    /// Terminals that were measured are behind the inverter: it does nothing there, and its parameters are not seen.
    #[test]
    fn what_cannot_act_in_a_run_has_no_part_in_it() {
        let m = machines::MOTULATOR_2_2_KW;
        let mut effects = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
        effects.inverter_nonlinearity.voltage_v = 10.0;
        let machine = Machine::try_new(m.parameters(), m.pole_pairs, effects).unwrap();
        let base = Machine::base(m.parameters(), m.pole_pairs).unwrap();
        let r = Recording {
            name: String::new(),
            start_s: 0.0,
            sample_time_s: 1e-4,
            i_s: vec![Complex::new(0.0, 0.0); 200],
            omega_m: vec![0.0; 200],
            tau_load: None,
            u_s: (0..200).map(|k| Complex::from_polar(326.6, 314.159 * 1e-4 * (f64::from(k) + 0.5))).collect(),
        };
        let commanded = Experiment::from_recording(&r, [1.0; 2], 1.0);
        let measured = Experiment { inert: Some(EffectId::InverterNonlinearity), ..commanded.clone() };
        let start = State::default();
        assert_eq!(predict(&machine, &measured, &start), predict(&base, &measured, &start));
        assert_ne!(predict(&machine, &commanded, &start), predict(&base, &commanded, &start));
        let free = crate::offline::effect_parameters(EffectId::InverterNonlinearity, &machine, &m.rating);
        let seen = |e: &Experiment| linearize(&machine, e, &start, 0, &free).slopes.iter().flatten().flatten().any(|s| *s != 0.0);
        assert!(seen(&commanded) && !seen(&measured));
    }

    #[test]
    fn a_start_in_motion_lets_iron_and_bars_begin_where_they_settle() {
        let m = machines::MOTULATOR_2_2_KW;
        let mut effects = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
        effects.iron_loss.conductance_s = 2e-3;
        effects.rotor_skin_effect.resistance_rise = 1.0;
        let machine = Machine::try_new(m.parameters(), m.pole_pairs, effects).unwrap();
        let truth = steady_state(&machine, 326.6, 50.0, Held::Load(10.0)).unwrap();
        let u_s: Vec<_> = (0..50).map(|k| Complex::from_polar(326.6, 314.159 * 1e-4 * (f64::from(k) + 0.5))).collect();
        let r = Recording {
            name: String::new(),
            start_s: 0.0,
            sample_time_s: 1e-4,
            i_s: vec![Complex::new(0.0, 0.0); 50],
            omega_m: vec![0.0; 50],
            tau_load: Some(vec![10.0; 50]),
            u_s,
        };
        // What a fit knows of the start: fluxes and speed.
        let seen = State { psi_s: truth.psi_s, psi_r: truth.psi_r, ..State::turning(truth.omega_m) };
        let experiment = |start| Experiment { start, ..Experiment::from_recording(&r, [1.0; 2], 1.0) };
        let whole = predict(&machine, &experiment(Start::State(truth)), &truth);
        let fitted = predict(&machine, &experiment(Start::Estimated(seen)), &seen);
        for c in 0..2 {
            for (k, (a, b)) in whole[c].iter().zip(&fitted[c]).enumerate() {
                // Off by a few per cent of the iron's own current of 0.6 A; by 40 A in row 0 without settling.
                assert!((a - b).abs() < 0.1, "row {k}, channel {c}: {a} A, {b} A");
            }
        }
    }
}
