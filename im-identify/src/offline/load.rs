//! What is known of the load torque of a run; where it is nothing, the speed that drives the machine in its place.
//!
//! A speed sensor's noise would be noise of the slip: the speed is smoothed as far as its own record asks for ([`trend`](super::trend)).

use im_model::{Plant, Scalar};

use super::channel::Channel;
use super::speed::{FoundSpeed, UnsureInputs, Wandering};
use super::trend::Trend;

/// What is known of the load torque beside the column.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Load {
    /// The column is all of it; zeros where nothing drives or brakes the shaft.
    #[default]
    Known,
    /// A law adds to it: a constant torque and a fan's.
    Law {
        /// The torque that is the same at every speed.
        constant: Size,
        /// The torque that goes with the square of the speed.
        fan: Size,
    },
    /// Nothing: the rotor turns as its sensor shows.
    Unknown(ShownSpeed),
    /// Nothing, nor is the speed: the rotor turns as voltages and currents ask for.
    Unseen(FoundSpeed),
}

impl Load {
    /// What is not known of the speed, where that drives the machine.
    pub(super) fn unsure_speed(&self) -> Option<&UnsureInputs> {
        match self {
            Self::Unknown(shown) => shown.unsure.as_ref(),
            Self::Unseen(found) => Some(&found.unsure),
            Self::Known | Self::Law { .. } => None,
        }
    }
}

/// How large a part of a load is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Size {
    /// Known; Nm, or Nm s²/rad².
    Given(f64),
    /// A fit finds it, for each recording.
    Fitted,
}

impl Size {
    /// The size where a fit begins.
    pub(super) fn start(self) -> f64 {
        match self {
            Self::Given(x) => x,
            Self::Fitted => 0.0,
        }
    }
}

/// The speed as its sensor shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct ShownSpeed {
    /// As measured.
    pub channel: Channel,
    /// Smoothed, with first and second derivative, rad/s and per s; one per row.
    pub smooth: Vec<[f64; 3]>,
    /// −2 log L of what was measured, but for a constant.
    cost: f64,
    /// What the noise of the sensor leaves of the speed.
    pub(super) noise: Wandering,
    /// What that does to the currents; once a machine is known.
    pub(super) unsure: Option<UnsureInputs>,
}

impl ShownSpeed {
    /// Smooths a measured speed, whose rate wanders.
    pub fn new(channel: Channel, sample_time_s: f64) -> Self {
        Self::smoothed(channel, sample_time_s, 1.0, &|_| 0.0)
    }

    /// The same with known changes, rad/s over the sample that begins at each row, of a rotor of this inertia, whose load wanders: where that
    /// makes the measured speed likelier.
    pub(super) fn with_known_changes(&self, changes: &[f64], inertia_kg_m2: f64, sample_time_s: f64) -> Option<Self> {
        let other = Self::smoothed(self.channel.clone(), sample_time_s, -1.0 / inertia_kg_m2, &|k| changes[k]);
        (other.cost < self.cost).then_some(other)
    }

    fn smoothed(mut channel: Channel, sample_time_s: f64, coupling: f64, known: &dyn Fn(usize) -> f64) -> Self {
        let s = {
            let valid = |k: usize| channel.is_valid(k);
            Trend { values: &channel.values, valid: &valid, known, coupling, sample_time_s }.smooth()
        };
        channel.sigma = s.sigma.max(f64::MIN_POSITIVE);
        let n = s.x.len();
        let slope = |x: &[f64], k: usize| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
            (x[b] - x[a]) / ((b - a).max(1) as f64 * sample_time_s)
        };
        let rate: Vec<f64> = (0..n).map(|k| slope(&s.x, k)).collect();
        let smooth = (0..n).map(|k| [s.x[k], rate[k], slope(&rate, k)]).collect();
        let noise = Wandering::behind(s.intensity, channel.sigma, sample_time_s, n, |k| channel.is_valid(k));
        Self { channel, smooth, cost: s.cost, noise, unsure: None }
    }

    /// For the same run on every so many rows, whose channels these are.
    pub(super) fn every(&self, stride: usize, channels: &[Channel], sample_time_s: f64) -> Self {
        let channel = Channel {
            values: self.channel.values.iter().step_by(stride).copied().collect(),
            valid: self.channel.valid.as_ref().map(|v| v.iter().step_by(stride).copied().collect()),
            ..self.channel.clone()
        };
        let smooth: Vec<[f64; 3]> = self.smooth.iter().step_by(stride).copied().collect();
        let unsure = self.unsure.as_ref().map(|u| u.every(stride, channels, smooth.iter().map(|w| w[0]), sample_time_s));
        Self { channel, smooth, cost: self.cost, noise: self.noise.every(stride), unsure }
    }

    /// The rotor's own speed at row `k`, when its sensor shows this.
    #[inline(always)]
    pub(super) fn behind<T: Scalar>(&self, plant: &Plant<T>, k: usize) -> T {
        plant.speed_behind(self.smooth[k.min(self.smooth.len() - 1)].map(T::from_f64))
    }
}
