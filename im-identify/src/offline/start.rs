//! Recordings that begin in motion: the fluxes and the speed at their first row are unknowns like any other.

use im_model::{Machine, Rating, State};

use super::experiment::{ChannelKind, Experiment, Start};
use super::fit::{Point, descend};
use super::free::{Free, Target, Transform};

/// The initial states that are to be found with everything else: ψ_s, ψ_r and, where the speed is not imposed, ω_m of every experiment
/// whose start is [`Start::Estimated`].
pub fn start_parameters(experiments: &[Experiment], rating: &Rating) -> Vec<Free> {
    experiments.iter().enumerate().flat_map(|(k, e)| start_of(k, e, rating)).collect()
}

fn start_of(index: usize, e: &Experiment, rating: &Rating) -> Vec<Free> {
    let components = match (e.start, &e.imposed_speed) {
        (Start::Estimated(_), None) => 5,
        (Start::Estimated(_), Some(_)) => 4,
        _ => 0,
    };
    let scale = |component| if component == 4 { 0.1 * rating.electrical_frequency_hz } else { rating.rotor_flux_vs };
    (0..components)
        .map(|component| Free {
            target: Target::Initial { experiment: index, component },
            transform: Transform::Linear(scale(component)),
            limits: (-1e9, 1e9),
        })
        .collect()
}

/// Rows that still know how the run began: a second, where the fluxes of the smallest and the largest machines have forgotten it.
const MEMORY_S: f64 = 1.0;

/// The state at the first row with which `machine` follows an experiment best: as given where it is known, fitted to the first second
/// where it is [`Start::Estimated`]. Where no better state than the given one is found, that one.
pub fn start_on(machine: &Machine<f64>, e: &Experiment, rating: &Rating) -> State<f64> {
    let free = start_of(0, e, rating);
    let given = e.start.state();
    if free.is_empty() {
        return given;
    }
    let mut here = Point::new(machine, vec![given]);
    let fraction = (MEMORY_S / (e.sample_time_s * e.len() as f64)).min(1.0);
    match descend(&mut here, std::slice::from_ref(e), &free, fraction, 20, 1e-6) {
        Ok(_) => here.starts[0],
        Err(_) => given,
    }
}

/// A first idea of how an experiment starts: at rest where its first rows show neither speed nor a current that a voltage drives, else
/// in motion at the speed shown, with unknown fluxes ([`start_on`] finds them).
pub fn guess_start(e: &Experiment) -> Start {
    let first = |k: usize| {
        let c = &e.channels[k];
        let rows: Vec<f64> = (0..c.values.len()).filter(|&k| c.is_valid(k)).take(FIRST_ROWS).map(|k| c.values[k]).collect();
        let largest = c.values.iter().enumerate().filter(|(k, _)| c.is_valid(*k)).map(|(_, v)| v.abs()).fold(0.0, f64::max);
        (rows.iter().sum::<f64>() / rows.len().max(1) as f64, largest)
    };
    let shows = |k: usize| {
        let (value, largest) = first(k);
        value.abs() > 0.05 * largest && value.abs() > 5.0 * e.channels[k].sigma / (FIRST_ROWS as f64).sqrt()
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
        (None, Some(c)) if shows(c) => first(c).0,
        _ => 0.0,
    };
    Start::Estimated(State { omega_m: omega, omega_load: omega, ..State::default() })
}

/// Rows over which the first values are averaged.
const FIRST_ROWS: usize = 5;
