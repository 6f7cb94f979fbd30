//! Loads that no column holds: what was found of them, and what is not determined without them.

use im_identify::offline::{ChannelKind, Experiment, Load, Size, load_torque, torques_balance};
use im_model::effects::Place;
use im_model::{EffectId, Machine, State};
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::shaft_lines::{Run, orders};
use crate::statistics::{means, median};

/// What is this many times less well known than usual is not.
pub(crate) const LEAST_KNOWN: f64 = 10.0;

/// What was found of loads that no column holds, and what is not determined without them.
#[derive(Clone, Debug, Default)]
pub struct Loads {
    /// Of each recording that does not know its own.
    pub found: Vec<FoundLoad>,
    /// Effects that change nothing which is compared.
    pub not_determined: Vec<EffectId>,
}

impl Loads {
    /// Of experiments that begin in `starts`.
    pub fn of(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> Self {
        Self { found: found(machine, experiments, starts), not_determined: not_determined(experiments, machine.effects().ids()) }
    }

    /// The same with the loads of the held-out recording, which settles no effect.
    pub fn with_holdout(mut self, machine: &Machine<f64>, holdout: &[Experiment], start: &[State<f64>]) -> Self {
        self.found.extend(found(machine, holdout, start));
        self
    }

    /// Whether every load is known.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty() && self.not_determined.is_empty()
    }

    /// For programs.
    pub fn to_json(&self) -> Value {
        let column = |points: &[[f64; 3]], c: usize| points.iter().map(|p| p[c]).collect::<Vec<f64>>();
        let one = |f: &FoundLoad| match &f.found {
            Found::Curve(points) => {
                let lines: Vec<Value> =
                    f.lines.iter().map(|l| json!({"per_turn": l.per_turn, "hz": l.hz, "torque_nm": l.torque_nm})).collect();
                json!({
                    "recording": f.recording, "t_s": column(points, 0), "torque_nm": column(points, 1), "std_nm": column(points, 2),
                    "lines": lines,
                })
            }
            Found::Speed(points) => json!({
                "recording": f.recording, "t_s": column(points, 0), "omega_m_rad_s": column(points, 1), "std_rad_s": column(points, 2)
            }),
            Found::Law { constant_nm, fan_nm_s2 } => {
                json!({"recording": f.recording, "constant_nm": constant_nm, "fan_nm_s2": fan_nm_s2})
            }
        };
        json!({
            "found": self.found.iter().map(one).collect::<Vec<_>>(),
            "not_determined_without": self.not_determined.iter().map(|e| e.name()).collect::<Vec<_>>(),
        })
    }
}

/// The load of one recording.
#[derive(Clone, Debug)]
pub struct FoundLoad {
    /// The recording.
    pub recording: String,
    /// What was found.
    pub found: Found,
    /// What repeats with the turning shaft in a torque that was found, largest first.
    pub lines: Vec<Line>,
}

/// A part of a load torque that repeats with the angle of the rotor.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// How often, per turn.
    pub per_turn: f64,
    /// How often in a second, at the mean speed.
    pub hz: f64,
    /// Amplitude, Nm.
    pub torque_nm: f64,
}

/// What stands in place of a load torque that was not measured.
#[derive(Clone, Debug)]
pub enum Found {
    /// Time, s, torque and its standard deviation by the noise of the speed sensor, Nm; as many rows as a picture shows.
    Curve(Vec<[f64; 3]>),
    /// The speed where it was not measured either: time, s, speed and its standard deviation by the noise of the current sensors, rad/s.
    Speed(Vec<[f64; 3]>),
    /// Of a law, whose fitted sizes are: the constant part, Nm, and that of a fan, Nm s²/rad².
    Law {
        /// `None` where it was not asked for.
        constant_nm: Option<f64>,
        /// `None` where it was not asked for.
        fan_nm_s2: Option<f64>,
    },
}

/// Rows of a curve at most.
const POINTS: usize = 600;

/// Lines of a load at most.
const LINES: usize = 3;

/// The loads of all experiments that do not know theirs; `starts` are the states at their first rows.
fn found(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> Vec<FoundLoad> {
    let one = |(e, x): (&Experiment, &State<f64>)| {
        let fitted = |size: Size, value: f64| (size == Size::Fitted).then_some(value);
        let mut repeats = Vec::new();
        let found = match e.load {
            Load::Known => return None,
            Load::Unknown(_) => {
                let found = load_torque(machine, e, x)?;
                repeats = lines(Run::new(machine, e, x, &found.torque_nm), e.len() as f64 * e.sample_time_s);
                Found::Curve(curve(e.sample_time_s, &found.torque_nm, &found.std_nm))
            }
            Load::Unseen(_) => {
                let Load::Unseen(found) = e.clone().with_speed_found_by(machine, x).load else { return None };
                Found::Speed(curve(e.sample_time_s, &found.omega_m, &found.std))
            }
            Load::Law { constant, fan } => {
                Found::Law { constant_nm: fitted(constant, x.load.constant_nm), fan_nm_s2: fitted(fan, x.load.fan_nm_s2) }
            }
        };
        Some(FoundLoad { recording: e.name.clone(), found, lines: repeats })
    };
    let all: Vec<Option<FoundLoad>> = experiments.par_iter().zip(starts).map(one).collect();
    all.into_iter().flatten().collect()
}

/// What stands out of a torque over the angle of the rotor, largest first.
fn lines(torque: Run, duration_s: f64) -> Vec<Line> {
    let runs = [torque];
    let turns_per_s = runs[0].turns() / duration_s;
    let line = |per_turn: f64| Line { per_turn, hz: per_turn * turns_per_s, torque_nm: runs[0].amplitude(per_turn) };
    let mut all: Vec<Line> = orders(&runs).into_iter().take(LINES).map(line).collect();
    all.sort_by(|a, b| b.torque_nm.total_cmp(&a.torque_nm));
    all
}

/// As many points as a picture shows, each the mean over its rows: time, value and standard deviation.
fn curve(sample_time_s: f64, values: &[f64], std: &[f64]) -> Vec<[f64; 3]> {
    let stride = values.len().div_ceil(POINTS).max(1);
    let rows = values.chunks(stride).zip(means(values, stride).into_iter().zip(means(std, stride))).enumerate();
    // The middle of the rows that a point stands for.
    let time = |k: usize, n: usize| sample_time_s * (k as f64 * stride as f64 + 0.5 * (n as f64 - 1.0));
    rows.map(|(k, (of, (value, std)))| [time(k, of.len()), value, std]).collect()
}

impl Found {
    /// The points of a curve.
    pub fn points(&self) -> &[[f64; 3]] {
        match self {
            Self::Curve(points) | Self::Speed(points) => points,
            Self::Law { .. } => &[],
        }
    }

    /// What noise usually leaves open at an instant of a curve (2 σ), in its unit.
    pub fn usual_band(&self) -> Option<f64> {
        let mut all: Vec<f64> = self.points().iter().map(|p| 2.0 * p[2]).collect();
        (!all.is_empty()).then(|| median(&mut all))
    }

    /// Least and largest value of a curve with what noise leaves open (± 2 σ), in its unit.
    pub fn range(&self) -> Option<(f64, f64)> {
        // Where nothing shows it, as before the supply is switched on, it may be anything.
        let shown = LEAST_KNOWN * median(&mut self.points().iter().map(|p| p[2]).collect::<Vec<_>>());
        let points = || self.points().iter().filter(|p| p[2] <= shown);
        let low = points().map(|p| p[1] - 2.0 * p[2]).fold(f64::INFINITY, f64::min);
        let high = points().map(|p| p[1] + 2.0 * p[2]).fold(f64::NEG_INFINITY, f64::max);
        (low <= high).then_some((low, high))
    }

    /// Mean over time.
    pub fn mean(&self) -> Option<f64> {
        let points = self.points();
        (!points.is_empty()).then(|| points.iter().map(|p| p[1]).sum::<f64>() / points.len() as f64)
    }
}

/// The effects that act on the shaft alone, where no recording balances a torque, and those of a speed sensor that there is not: they change
/// nothing that is compared.
fn not_determined(experiments: &[Experiment], library: impl Iterator<Item = EffectId>) -> Vec<EffectId> {
    if torques_balance(experiments) {
        return Vec::new();
    }
    let shown = |e: &Experiment| matches!(e.load, Load::Unknown(_)) || e.channels.iter().any(|c| c.kind == ChannelKind::Speed);
    let no_sensor = !experiments.iter().any(shown);
    let of_sensor = |e: &EffectId| no_sensor && matches!(e, EffectId::SpeedSensorLag | EffectId::SpeedSensorScale);
    library.filter(|e| e.about().place == Place::Mechanics || of_sensor(e)).collect()
}
