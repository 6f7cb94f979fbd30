//! Where something may be missing that nobody wrote: every free-form effect, on the range that the recordings pass through.

use im_identify::offline::{Experiment, residuals};
use im_model::effects::{Acts, FreeForm, Over};
use im_model::{Complex, EffectId, Machine, State};

use crate::residual_tests::{Dependence, Part, Variable};

/// What a run passes through.
struct Reach {
    speed: (f64, f64),
    slip: (f64, f64),
    time: (f64, f64),
    current: f64,
    flux: f64,
    /// As log10 of s.
    lag: (f64, f64),
}

/// Filters of sensors and voltage paths are quicker, s: a period of the mains.
const SLOWEST_LAG_S: f64 = 0.02;

/// Below this part of the largest rotor flux, its direction and with it the slip frequency says nothing.
const MAGNETIZED: f64 = 0.2;

impl Reach {
    /// Of a machine that follows recordings.
    fn of(machine: &Machine<f64>, starts: &[State<f64>], experiments: &[Experiment]) -> Option<Self> {
        let runs = || experiments.iter().zip(starts).filter(|(e, _)| !e.is_table());
        let mut rows: Vec<[f64; 5]> = Vec::new();
        for (e, start) in runs() {
            let mut bench = e.bench(machine, start);
            for k in 0..e.len() {
                let x = *bench.state();
                let c = bench.plant().currents(&x);
                let across = (c.i_r * (x.psi_r * Complex::i()).conj()).re;
                let slip = -across * machine.parameters().rotor_resistance_ohm / x.psi_r.norm_sqr().max(1e-9);
                rows.push([x.omega_m, slip, c.i_s.norm(), c.psi_m.norm(), x.psi_r.norm()]);
                bench.advance(&e.input(k, bench.plant()));
            }
        }
        let sample_s = runs().map(|(e, _)| e.sample_time_s).fold(SLOWEST_LAG_S, f64::min);
        let ends = |of: &dyn Fn(&[f64; 5]) -> Option<f64>| {
            let all = rows.iter().filter_map(of).filter(|x| x.is_finite());
            all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
        };
        let most = |k: usize| ends(&|r| Some(r[k])).1;
        let magnetized = MAGNETIZED * most(4);
        let reach = Self {
            speed: ends(&|r| Some(r[0])),
            slip: ends(&|r| (r[4] > magnetized).then_some(r[1])),
            time: when(machine, starts, experiments),
            current: most(2),
            flux: most(3),
            lag: (sample_s.log10(), SLOWEST_LAG_S.log10()),
        };
        (reach.time.1 > 0.0 && reach.current > 0.0 && reach.flux > 0.0).then_some(reach)
    }

    /// `None` where the variable hardly moves.
    fn range(&self, acts: Acts, over: Over) -> Option<(f64, f64)> {
        let (low, high) = match over {
            Over::Speed => self.speed,
            Over::Slip => self.slip,
            Over::Time => self.time,
            Over::Current => (0.0, self.current),
            Over::Flux => (0.0, self.flux),
            Over::ShaftAngle | Over::FluxDirection => (0.0, 1.0),
            Over::Lag => self.lag,
        };
        let (low, high) = if acts.is_over_magnitude(over) { magnitudes(low, high) } else { (low, high) };
        (high - low > 1e-3 * high.abs().max(low.abs()).max(1e-6)).then_some((low, high))
    }
}

/// Parts of the longest run in which it is asked whether something is left.
const PARTS: usize = 40;

/// Part of what is left that may lie before or after.
const ASIDE: f64 = 0.025;

/// When what is left happens: a supply that dips for a moment is seen in that moment alone, and a curve over the whole run would pass it by.
fn when(machine: &Machine<f64>, starts: &[State<f64>], experiments: &[Experiment]) -> (f64, f64) {
    let runs = || experiments.iter().zip(starts).filter(|(e, _)| !e.is_table());
    let end = runs().map(|(e, _)| e.len() as f64 * e.sample_time_s).fold(0.0, f64::max);
    let mut left = [0.0; PARTS];
    for (e, start) in runs() {
        for r in &residuals(machine, e, start) {
            for (k, r) in r.iter().enumerate() {
                let part = (k as f64 * e.sample_time_s / end * PARTS as f64) as usize;
                left[part.min(PARTS - 1)] += r * r - 1.0;
            }
        }
    }
    let all: f64 = left.iter().map(|x| x.max(0.0)).sum();
    let parts_aside = |parts: &mut dyn Iterator<Item = &f64>| {
        let mut sum = 0.0;
        parts
            .take_while(|x| {
                sum += x.max(0.0);
                sum < ASIDE * all
            })
            .count()
    };
    // One part more on either side: there the curve is what it is without a cause.
    let before = parts_aside(&mut left.iter()).saturating_sub(1);
    let after = parts_aside(&mut left.iter().rev()).saturating_sub(1);
    let at = |part: usize| part as f64 / PARTS as f64 * end;
    if before + after < PARTS { (at(before), at(PARTS - after)) } else { (0.0, end) }
}

/// The magnitudes of what lies between two ends.
fn magnitudes(low: f64, high: f64) -> (f64, f64) {
    (low.max(-high).max(0.0), high.max(-low))
}

/// Up to this order the ripples of a turn are harmonics of one curve over the turn.
const HARMONICS: i32 = 4;

/// How often per turn of the shaft the fundamental of what is missing repeats, from the strongest ripple that the dependences shows.
fn order(acts: Acts, dependences: &[Dependence], pole_pairs: u32) -> Option<f64> {
    let shown = |d: &&Dependence| match acts {
        Acts::Torque | Acts::Friction | Acts::SpeedSensor => d.part == Part::Speed,
        _ => d.part != Part::Speed,
    };
    let of = |d: &Dependence| if let Variable::RotorAngle(n) = d.variable { Some(n) } else { None };
    let strongest = dependences.iter().filter(shown).find_map(of).or_else(|| dependences.iter().find_map(of))?;
    if acts == Acts::ShaftFlux {
        // Seen along and across the main flux, which turns n_p times.
        return Some(f64::from(strongest) + f64::from(pole_pairs));
    }
    Some(f64::from(if strongest <= HARMONICS { 1 } else { strongest }))
}

/// The free-form effects that recordings may show; `dependences` is what the residual of the base model depends on.
pub fn places(
    machine: &Machine<f64>,
    starts: &[State<f64>],
    experiments: &[Experiment],
    dependences: &[Dependence],
) -> Vec<EffectId> {
    let Some(reach) = Reach::of(machine, starts, experiments) else { return Vec::new() };
    let imposed = experiments.iter().all(Experiment::speed_is_imposed);
    let place = |(acts, over): (Acts, Over)| {
        let order = match over {
            Over::ShaftAngle => order(acts, dependences, machine.pole_pairs())?,
            // The field of the stator is the same after half a turn.
            Over::FluxDirection => 2.0,
            _ => 1.0,
        };
        let shown = !(imposed && matches!(acts, Acts::Torque | Acts::Friction | Acts::SpeedSensor));
        let range = reach.range(acts, over).filter(|_| shown)?;
        Some(EffectId::Custom(FreeForm::define(acts, over, range, order)))
    };
    FreeForm::all().filter_map(place).collect()
}
