//! How well a voltage is known: the noise of its sensor, and switches that closed between two samples of it.

use super::UnsureInputs;
use crate::offline::channel::Channel;

/// How well a voltage is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Volts {
    /// Standard deviation of its white noise, α and β, at every row, V; 0 where it is exact.
    pub sigma_v: f64,
    /// Rows in which it was switched, nobody knows when, and the standard deviation of their mean voltage, V; in order.
    pub switched: Vec<(usize, f64)>,
}

impl Volts {
    /// Of white noise with this standard deviation, V.
    pub fn white(sigma_v: f64) -> Self {
        Self { sigma_v, switched: Vec::new() }
    }

    /// On every so many rows.
    pub fn every(&self, stride: usize) -> Self {
        let mut switched: Vec<(usize, f64)> = Vec::new();
        for &(row, sigma_v) in &self.switched {
            // The same volt-seconds in a longer row.
            let (row, sigma_v) = (row / stride, sigma_v / stride as f64);
            match switched.last_mut().filter(|x| x.0 == row) {
                Some(last) => last.1 = last.1.hypot(sigma_v),
                None => switched.push((row, sigma_v)),
            }
        }
        Self { sigma_v: self.sigma_v / (stride as f64).sqrt(), switched }
    }
}

/// What is not known of a voltage, and what it does to a machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VoltageNoise {
    /// How well it is known.
    pub volts: Volts,
    pub(super) seen: Option<Seen>,
}

/// What it does in a run.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Seen {
    /// Speed of the rotor at every row, rad/s.
    pub omega_m: Vec<f64>,
    pub unsure: UnsureInputs,
}

impl VoltageNoise {
    /// Of a voltage that is known so well.
    pub fn of(volts: Volts) -> Self {
        Self { volts, seen: None }
    }

    /// Standard deviation of the noise, V, where it counts: it shows beside that of the current sensors, for the machine that said what it does.
    pub fn counted(&self) -> Option<f64> {
        self.seen.as_ref().map(|s| s.unsure.unknown.voltage.sigma_v).filter(|s| *s > 0.0)
    }

    /// With what else of the inputs is not known, once a machine says what that does.
    pub(in crate::offline) fn unsure(&self) -> Option<&UnsureInputs> {
        self.seen.as_ref().map(|s| &s.unsure)
    }

    /// For the same run on every so many rows, whose channels these are.
    pub(in crate::offline) fn every(&self, stride: usize, channels: &[Channel], sample_time_s: f64) -> Self {
        let seen = self.seen.as_ref().map(|s| {
            let omega_m: Vec<f64> = s.omega_m.iter().step_by(stride).copied().collect();
            let unsure = s.unsure.every(stride, channels, omega_m.iter().copied(), sample_time_s);
            Seen { omega_m, unsure }
        });
        Self { volts: self.volts.every(stride), seen }
    }
}
