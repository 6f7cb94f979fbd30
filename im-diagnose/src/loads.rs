//! Loads that no column holds: what was found of them, and what is not determined without them.

use im_identify::offline::{Experiment, Load, Size, load_torque, torques_balance};
use im_model::effects::Place;
use im_model::{EffectId, Machine, State};
use rayon::prelude::*;
use serde_json::{Value, json};

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
        let one = |f: &FoundLoad| match &f.torque {
            FoundTorque::Curve(points) => {
                let column = |c: usize| points.iter().map(|p| p[c]).collect::<Vec<f64>>();
                json!({"recording": f.recording, "t_s": column(0), "torque_nm": column(1), "std_nm": column(2)})
            }
            FoundTorque::Law { constant_nm, fan_nm_s2 } => {
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
    pub torque: FoundTorque,
}

/// A load torque that was found.
#[derive(Clone, Debug)]
pub enum FoundTorque {
    /// Time, s, torque and its standard deviation by the noise of the speed sensor, Nm; as many rows as a picture shows.
    Curve(Vec<[f64; 3]>),
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

/// The loads of all experiments that do not know theirs; `starts` are the states at their first rows.
fn found(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> Vec<FoundLoad> {
    let one = |(e, x): (&Experiment, &State<f64>)| {
        let fitted = |size: Size, value: f64| (size == Size::Fitted).then_some(value);
        let torque = match e.load {
            Load::Known => return None,
            Load::Unknown(_) => FoundTorque::Curve(curve(machine, e, x)?),
            Load::Law { constant, fan } => {
                FoundTorque::Law { constant_nm: fitted(constant, x.load.constant_nm), fan_nm_s2: fitted(fan, x.load.fan_nm_s2) }
            }
        };
        Some(FoundLoad { recording: e.name.clone(), torque })
    };
    let all: Vec<Option<FoundLoad>> = experiments.par_iter().zip(starts).map(one).collect();
    all.into_iter().flatten().collect()
}

fn curve(machine: &Machine<f64>, e: &Experiment, start: &State<f64>) -> Option<Vec<[f64; 3]>> {
    let found = load_torque(machine, e, start)?;
    let stride = e.len().div_ceil(POINTS).max(1);
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let rows = found.torque_nm.chunks(stride).zip(found.std_nm.chunks(stride)).enumerate();
    // The middle of the rows that a point stands for.
    let time = |k: usize, n: usize| e.sample_time_s * (k as f64 * stride as f64 + 0.5 * (n as f64 - 1.0));
    Some(rows.map(|(k, (torque, std))| [time(k, torque.len()), mean(torque), mean(std)]).collect())
}

impl FoundTorque {
    /// Least and largest torque of a curve with what the sensor's noise leaves open (± 2 σ), Nm.
    pub fn range(&self) -> Option<(f64, f64)> {
        let Self::Curve(points) = self else { return None };
        let low = points.iter().map(|p| p[1] - 2.0 * p[2]).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(|p| p[1] + 2.0 * p[2]).fold(f64::NEG_INFINITY, f64::max);
        (low <= high).then_some((low, high))
    }

    /// Mean over time, Nm.
    pub fn mean(&self) -> Option<f64> {
        let Self::Curve(points) = self else { return None };
        (!points.is_empty()).then(|| points.iter().map(|p| p[1]).sum::<f64>() / points.len() as f64)
    }
}

/// The effects that act on the shaft alone, where no recording balances a torque: they change nothing that is compared.
fn not_determined(experiments: &[Experiment], library: impl Iterator<Item = EffectId>) -> Vec<EffectId> {
    if torques_balance(experiments) {
        return Vec::new();
    }
    library.filter(|e| e.about().place == Place::Mechanics).collect()
}
