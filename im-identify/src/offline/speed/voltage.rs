//! How well a voltage is known: the noise of its sensor, switches that closed between two samples of it, and mains that were found behind noise.

use im_model::Complex;

use super::UnsureInputs;
use crate::offline::channel::Channel;

/// How well a voltage is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Volts {
    /// Standard deviation of its white noise, α and β, at every row, V; 0 where it is exact.
    pub sigma_v: f64,
    /// Rows in which it was switched, nobody knows when, and the standard deviation of their mean voltage, V; in order.
    pub switched: Vec<(usize, f64)>,
    /// Standard deviation of the noise behind which mains were found, V; 0 where none was taken off.
    pub taken_v: f64,
    /// Rows beside such mains that are as they were measured, and the standard deviation of the noise in them, V; in order.
    pub as_measured: Vec<(usize, f64)>,
    /// What such mains may be off by; in order.
    pub mains: Vec<Stretch>,
}

/// Mains that are found on their own, up to the next such stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// The row that it begins with.
    pub from: usize,
    /// What the mains may be off by from there on.
    pub off: [Wander; HARMONICS],
}

/// Harmonics at which mains may be off: a constant, and the fundamental in both directions. A machine passes little of the others.
pub const HARMONICS: usize = 3;

/// An error of one harmonic, a vector that turns with it: z_{k+1} = f z_k + noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wander {
    /// Its variance in the first row, α and β each, V².
    pub first_v2: f64,
    /// f: how it turns, and how much of it is left, from row to row.
    pub onward: Complex<f64>,
    /// Variance that each row adds, α and β each, V².
    pub added_v2: f64,
}

impl Wander {
    /// From one row of so many to the next.
    fn every(&self, stride: usize) -> Self {
        let left = self.onward.norm_sqr();
        let added_v2 = (0..stride).fold(0.0, |sum, _| sum * left + self.added_v2);
        Self { added_v2, onward: self.onward.powu(stride as u32), ..*self }
    }
}

impl Volts {
    /// Of white noise with this standard deviation, V.
    pub fn white(sigma_v: f64) -> Self {
        Self { sigma_v, ..Self::default() }
    }

    /// On every so many rows.
    pub fn every(&self, stride: usize) -> Self {
        let of_rows = |all: &[(usize, f64)]| {
            let mut longer: Vec<(usize, f64)> = Vec::new();
            for &(row, sigma_v) in all {
                // The same volt-seconds in a longer row.
                let (row, sigma_v) = (row / stride, sigma_v / stride as f64);
                match longer.last_mut().filter(|x| x.0 == row) {
                    Some(last) => last.1 = last.1.hypot(sigma_v),
                    None => longer.push((row, sigma_v)),
                }
            }
            longer
        };
        Self {
            sigma_v: self.sigma_v / (stride as f64).sqrt(),
            switched: of_rows(&self.switched),
            taken_v: self.taken_v,
            as_measured: of_rows(&self.as_measured),
            mains: self.mains.iter().map(|s| Stretch { from: s.from / stride, off: s.off.map(|z| z.every(stride)) }).collect(),
        }
    }

    /// On the first so many rows.
    pub(in crate::offline) fn up_to(&self, rows: usize) -> Self {
        let [switched, as_measured] =
            [&self.switched, &self.as_measured].map(|all| all.iter().copied().filter(|x| x.0 < rows).collect());
        Self { switched, as_measured, mains: self.mains.iter().copied().filter(|s| s.from < rows).collect(), ..*self }
    }

    /// Standard deviation of the noise of each row, one after the other, V.
    pub(super) fn row_by_row(&self) -> impl Iterator<Item = f64> {
        let [mut switched, mut as_measured] = [&self.switched, &self.as_measured].map(|all| all.iter().peekable());
        (0..).map(move |k| {
            let here = [&mut switched, &mut as_measured].map(|all| all.next_if(|x| x.0 == k).map_or(0.0, |x| x.1));
            self.sigma_v.hypot(here[0]).hypot(here[1])
        })
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
