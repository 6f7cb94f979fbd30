//! Where a model fails: its error over time, over speed and torque, over flux, around current zero crossings, over frequency, and in
//! step with other signals. Every result carries numbers with units and one sentence.

use std::fmt::Write as _;

use serde::Serialize;
use serde_json::{Value, json};

mod correlate;
mod crossings;
mod inputs;
mod plane;
mod profile;
mod signals;
mod spectrum;
mod time;

pub use correlate::{Correlations, Memory};
pub use crossings::Crossings;
pub use inputs::InputCorrelation;
pub use plane::Plane;
pub use profile::{Bin, Profile, ProfileOver};
pub(crate) use signals::slip_hz;
pub use signals::{Row, Run, Signals};
pub use spectrum::{Line, Spectrum};
pub use time::{TimeTrace, Window};

/// Which error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// The stator current: root mean square of one axis.
    Current,
    /// The mechanical speed.
    Speed,
}

impl Quantity {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Current, Self::Speed];

    /// Name in sentences.
    pub fn name(self) -> &'static str {
        match self {
            Self::Current => "current",
            Self::Speed => "speed",
        }
    }

    /// Unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Current => "A",
            Self::Speed => "rad/s",
        }
    }

    /// The squared error of a row, per axis.
    pub(crate) fn squared(self, row: &Row) -> Option<f64> {
        match self {
            Self::Current => row.current_error.map(|e| 0.5 * e.norm_sqr()),
            Self::Speed => row.speed_error.map(|e| e * e),
        }
    }

    /// The noise of it.
    pub(crate) fn noise(self, s: &Signals) -> f64 {
        match self {
            Self::Current => s.current_noise_a,
            Self::Speed => s.speed_noise_rad_s,
        }
    }
}

/// Where a model fails.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Localisation {
    /// Root mean square over time, run by run.
    pub time: Vec<TimeTrace>,
    /// The worst second (or the whole of a shorter run).
    pub worst: Option<Window>,
    /// Over speed and torque.
    pub planes: Vec<Plane>,
    /// Over one quantity: flux first.
    pub profiles: Vec<Profile>,
    /// Around the zero crossings of the phase currents.
    pub crossings: Option<Crossings>,
    /// Over frequency.
    pub spectra: Vec<Spectrum>,
    /// How long errors last.
    pub memory: Vec<Memory>,
    /// What of the inputs they still hold.
    pub inputs: Vec<InputCorrelation>,
    /// In step with what.
    pub correlations: Correlations,
    /// Root mean square error in noise levels, current then speed.
    pub level: [f64; 2],
}

/// Takes the errors apart.
pub fn localise(s: &Signals) -> Localisation {
    let level = |q: Quantity| {
        let (n, sum) = s.rows().filter_map(|r| q.squared(r)).fold((0.0, 0.0), |(n, t), x| (n + 1.0, t + x));
        let noise = q.noise(s);
        if n > 0.0 && noise > 0.0 { (sum / f64::max(n, 1.0)).sqrt() / noise } else { 0.0 }
    };
    let time = time::traces(s);
    let own = Quantity::ALL.map(|q| s.at_samples_of(q));
    let own = own.each_ref().map(|s| &**s);
    Localisation {
        worst: time::worst(s),
        time,
        planes: Quantity::ALL.into_iter().filter_map(|q| plane::plane(s, q)).collect(),
        profiles: profile::profiles(s),
        crossings: crossings::crossings(s),
        spectra: spectrum::spectra(own),
        memory: correlate::memory(own),
        inputs: inputs::inputs(own),
        correlations: correlate::correlations(s),
        level: [level(Quantity::Current), level(Quantity::Speed)],
    }
}

impl Localisation {
    /// For programs: where the model of this name fails, every curve with its units in the names of [`Localisation`].
    pub fn to_json(&self, model: &str) -> Value {
        let mut all = json!(self);
        all["model"] = json!(model);
        all["findings"] = json!(self.findings());
        all
    }

    /// The sentences that say something: those about errors above the noise, most telling first.
    pub fn findings(&self) -> Vec<String> {
        // What makes up the larger part of the squared error speaks first.
        let total: f64 = self.level.iter().map(|l| l * l).sum::<f64>().max(1e-300);
        let share = |q: Quantity| (self.level[usize::from(q == Quantity::Speed)].powi(2) / total).sqrt();
        let mut all: Vec<(f64, &str)> = Vec::new();
        all.extend(self.profiles.iter().map(|p| (p.strength * share(p.quantity), p.conclusion.as_str())));
        all.extend(self.crossings.iter().map(|c| (c.strength * share(Quantity::Current), c.conclusion.as_str())));
        all.extend(self.spectra.iter().map(|c| (c.strength * share(c.quantity), c.conclusion.as_str())));
        all.extend(self.planes.iter().map(|p| (p.strength * share(p.quantity), p.conclusion.as_str())));
        all.retain(|(s, _)| *s > 0.0);
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        // What goes along with a signal says something where nothing else does.
        if all.is_empty() && self.correlations.strong {
            return vec![self.correlations.conclusion.clone()];
        }
        all.into_iter().map(|(_, t)| t.to_owned()).collect()
    }
}

/// What varies by less than a hundredth stays where it is: over it nothing is to be seen.
fn stays(low: f64, high: f64) -> bool {
    high - low < 0.01 * low.abs().max(high.abs())
}

/// A number for sentences: three significant digits.
pub(crate) fn say(x: f64) -> String {
    crate::format::number(x, 3)
}

/// Joins words as in speech.
pub(crate) fn join(words: &[String]) -> String {
    let mut out = String::new();
    for (k, w) in words.iter().enumerate() {
        let gap = match k {
            0 => "",
            _ if k + 1 == words.len() => " and ",
            _ => ", ",
        };
        let _ = write!(out, "{gap}{w}");
    }
    out
}

#[cfg(test)]
mod tests;
