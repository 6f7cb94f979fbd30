//! How recordings begin. In motion, the fluxes and the speed at their first row are unknowns like any other; so is the angle of the shaft, at
//! rest, too, where an effect is fixed to it.

use im_model::{Machine, Rating, State};
use rayon::prelude::*;

use super::channel::{Channel, ChannelKind};
use super::experiment::{Experiment, Start};
use super::fit::{Effort, EveryRow, Point, Room, cost, descend};
use super::free::{ANGLE, Free, LOAD_CONSTANT, LOAD_FAN, SPEED, Target, Transform};
use super::load::{Load, Size};
use super::thinned::Thinned;

/// The initial states that are to be found with everything else: ψ_s, ψ_r and, where the speed is not imposed, ω_m of every experiment
/// whose start is [`Start::Estimated`]; the sizes of its load that are to be fitted; and, with effects `fixed_to_shaft`, the shaft's angle at the start of every experiment after the
/// first, from whose start angles are counted.
pub fn start_parameters(experiments: &[Experiment], rating: &Rating, fixed_to_shaft: bool) -> Vec<Free> {
    experiments.iter().enumerate().flat_map(|(k, e)| start_of(k, e, rating, fixed_to_shaft && k > 0)).collect()
}

fn start_of(index: usize, e: &Experiment, rating: &Rating, angle: bool) -> Vec<Free> {
    let motion = match (e.start, e.speed_is_imposed()) {
        (Start::Estimated(_), false) => 0..ANGLE,
        (Start::Estimated(_), true) => 0..SPEED,
        _ => 0..0,
    };
    let sizes = match e.load {
        Load::Law { constant, fan } if !e.speed_is_imposed() => [(constant, LOAD_CONSTANT), (fan, LOAD_FAN)],
        _ => [(Size::Given(0.0), LOAD_CONSTANT), (Size::Given(0.0), LOAD_FAN)],
    };
    let sizes = sizes.into_iter().filter(|(size, _)| *size == Size::Fitted).map(|(_, component)| component);
    let scale = |component| match component {
        SPEED => 0.1 * rating.electrical_frequency_hz,
        // An eighth of a turn of the field is far for a machine of eight poles.
        ANGLE => 0.1,
        LOAD_CONSTANT => rating.torque_nm,
        LOAD_FAN => rating.torque_nm / rating.electrical_frequency_hz.powi(2),
        _ => rating.rotor_flux_vs,
    };
    motion
        .chain((angle && !e.is_table()).then_some(ANGLE))
        .chain(sizes)
        .map(|component| Free {
            target: Target::Initial { experiment: index, component },
            transform: Transform::Linear(scale(component)),
            limits: (-1e9, 1e9),
            priors: Vec::new(),
        })
        .collect()
}

/// Rows that still know how the run began: a second, where the fluxes of the smallest and the largest machines have forgotten it.
const MEMORY_S: f64 = 1.0;

/// The state at the first row with which `machine` follows an experiment best: as given where it is known, fitted to the first second
/// where it is [`Start::Estimated`]; the shaft's angle, where effects are fixed to it, to the whole. Where no better state than the given
/// one is found, that one.
pub fn start_on(machine: &Machine<f64>, e: &Experiment, rating: &Rating) -> State<f64> {
    let given = e.start_state();
    let fitted = |start: State<f64>, angle: bool, fraction: f64| {
        let free = start_of(0, e, rating, angle);
        if free.is_empty() {
            return start;
        }
        let e = std::slice::from_ref(e);
        let Ok(mut room) = Room::of(machine, e, &free) else { return start };
        let mut here = Point::new(machine, vec![start]);
        let effort = Effort { iterations: 20, tolerance: 1e-6, every_row: EveryRow::Never };
        if descend(&mut here, &mut room, &Thinned::of(e), &free, fraction, &effort).is_ok() { here.starts[0] } else { start }
    };
    let moving = if matches!(e.start, Start::Estimated(_)) {
        fitted(given, false, (MEMORY_S / (e.sample_time_s * e.len() as f64)).min(1.0))
    } else {
        given
    };
    let sized = matches!(e.load, Load::Law { .. }) && !start_of(0, e, rating, false).is_empty();
    // The sizes of a load show where the speed has settled.
    let moving = if sized { fitted(moving, false, 1.0) } else { moving };
    if machine.effects().any_fixed_to_shaft() && !e.is_table() {
        return fitted(State { theta_m: angle_on(machine, e, &moving), ..moving }, true, 1.0);
    }
    moving
}

/// Angles tried over a period of the slowest effect fixed to the shaft, and over one of the fastest at least.
const ANGLES: f64 = 32.0;
const ANGLES_OF_FASTEST: f64 = 4.0;

/// Of some angles of the shaft at the first row, rad, the one with which `machine` follows an experiment best: where a descent finds the
/// best of all.
pub fn angle_on(machine: &Machine<f64>, e: &Experiment, start: &State<f64>) -> f64 {
    let orders = || machine.effects().orders_on_shaft(machine.pole_pairs()).filter(|n| *n > 0.0);
    let (slowest, fastest) = (orders().fold(f64::INFINITY, f64::min), orders().fold(0.0, f64::max));
    if fastest == 0.0 {
        return start.theta_m;
    }
    // After a period of the slowest everything is the same, or nearly: others repeat a whole number of times in it.
    let count = ANGLES.max(ANGLES_OF_FASTEST * fastest / slowest) as usize;
    let angle = |k: usize| std::f64::consts::TAU / slowest * k as f64 / count as f64;
    let thinned = Thinned::of(std::slice::from_ref(e));
    let missed = |k: usize| cost(machine, thinned.runs(), &[State { theta_m: angle(k), ..*start }]);
    let tried: Vec<f64> = (0..count).into_par_iter().map(missed).collect();
    let best = (0..count).filter(|&k| tried[k].is_finite()).min_by(|&a, &b| tried[a].total_cmp(&tried[b]));
    best.map_or(start.theta_m, angle)
}

/// A first idea of how an experiment starts: at rest where its first rows show neither speed nor a current that a voltage drives, else
/// in motion at the speed shown, with unknown fluxes ([`start_on`] finds them).
pub fn guess_start(e: &Experiment) -> Start {
    let shows = |k: usize| {
        let c = &e.channels[k];
        let (value, noise) = first_value(c);
        let largest = c.values.iter().enumerate().filter(|(k, _)| c.is_valid(*k)).map(|(_, v)| v.abs()).fold(0.0, f64::max);
        value.abs() > 0.05 * largest && value.abs() > 5.0 * noise
    };
    if e.is_table() {
        return Start::Rest;
    }
    let speed = e.channels.iter().position(|c| c.kind == ChannelKind::Speed);
    let turns = speed.is_some_and(shows) || e.imposed_speed.as_ref().is_some_and(|w| w.first().is_some_and(|w| *w != 0.0));
    // Without voltage a standing machine has no current: what a sensor shows is its offset.
    let largest = e.u_s.iter().map(|u| u.norm()).fold(0.0, f64::max);
    let driven = e.u_s.iter().take(FIRST_ROWS).any(|u| u.norm() > 0.02 * largest);
    let flows = (0..e.channels.len()).any(|k| e.channels[k].kind != ChannelKind::Speed && shows(k));
    if !(turns || driven && flows) {
        return Start::Rest;
    }
    let omega = match (&e.imposed_speed, speed) {
        (Some(w), _) => w.first().copied().unwrap_or(0.0),
        (None, Some(k)) if shows(k) => first_value(&e.channels[k]).0,
        _ => 0.0,
    };
    Start::Estimated(State::turning(omega))
}

/// Rows by which the first value of a channel is told from noise.
const FIRST_ROWS: usize = 5;

/// The first value of a channel with its standard deviation: the mean of the first rows; of a current, which a voltage changes within them, where their
/// line begins.
fn first_value(c: &Channel) -> (f64, f64) {
    let rows: Vec<(f64, f64)> =
        (0..c.values.len()).filter(|&k| c.is_valid(k)).take(FIRST_ROWS).map(|k| (k as f64, c.values[k])).collect();
    let n = rows.len().max(1) as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| rows.iter().map(of).sum::<f64>() / n;
    let (row, value) = (mean(&|r| r.0), mean(&|r| r.1));
    let spread = mean(&|r| (r.0 - row).powi(2));
    if c.kind == ChannelKind::Speed || spread == 0.0 {
        return (value, c.sigma / n.sqrt());
    }
    let back = row - rows[0].0;
    let slope = mean(&|r| (r.0 - row) * r.1) / spread;
    (value - back * slope, c.sigma * ((1.0 + back * back / spread) / n).sqrt())
}
