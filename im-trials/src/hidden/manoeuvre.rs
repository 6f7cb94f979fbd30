//! Manoeuvres: what a recording asks of the drive and of the load.

use super::chance::Chance;
use super::drive::{VectorControl, VoltageSource, VoltsPerHertz};
use super::machine::CatalogueMachine;
use super::plane::Vector;

/// How much a recording excites the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Excitation {
    /// Ramps, load steps, flux steps, reversals and a two-level noise on the voltage.
    Rich,
    /// From rest along a slow ramp to one constant speed at one constant load; nothing else.
    Ramp,
    /// As [`Excitation::Ramp`], but the recording starts when all has settled: it holds nothing but the steady state.
    Steady,
}

/// Sampling of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Sampling time, s.
    pub sample_s: f64,
    /// Length, s.
    pub duration_s: f64,
}

impl Sampling {
    /// 2 s at 10 kHz.
    pub const FAST: Self = Self { sample_s: 1e-4, duration_s: 2.0 };
    /// 24 s at 2 kHz, for what heats up.
    pub const SLOW: Self = Self { sample_s: 5e-4, duration_s: 24.0 };

    /// Number of rows.
    pub fn rows(self) -> usize {
        (self.duration_s / self.sample_s).round() as usize
    }
}

/// Which of a trial's recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// First training recording: voltage over frequency.
    Train1,
    /// Second training recording: vector control where sampling allows.
    Train2,
    /// Held-out recording, with a profile of its own.
    Holdout,
}

#[derive(Clone, Debug)]
enum Wish {
    VoltsPerHertz { frequency_hz: Vec<f64>, factor: Vec<f64> },
    Vector { speed_ref: Vec<f64>, flux_ref: Vec<f64> },
}

/// A manoeuvre, sample by sample.
#[derive(Clone, Debug)]
pub struct Manoeuvre {
    /// Load torque on the shaft, N m.
    pub load_nm: Vec<f64>,
    /// Rows to drop at the start.
    pub settling_rows: usize,
    /// Sampling time, s.
    pub sample_s: f64,
    excitation: Vec<Vector>,
    wish: Wish,
    believed: CatalogueMachine,
}

/// A step function: times in parts of the whole, and values.
struct Steps(Vec<(f64, f64)>);

impl Steps {
    /// Random steps about `every` apart (in parts of the whole) from `start` on; before that, `first`.
    fn random(chance: &mut Chance, start: f64, every: f64, first: f64, mut value: impl FnMut(&mut Chance) -> f64) -> Self {
        let mut list = vec![(0.0, first)];
        let mut t = start + every * chance.between(0.0, 0.3);
        while t < 0.97 {
            let v = value(chance);
            list.push((t, v));
            t += every * chance.between(0.5, 1.5);
        }
        Self(list)
    }

    fn at(&self, part: f64) -> f64 {
        self.0.iter().rev().find(|(t, _)| *t <= part).map_or(0.0, |(_, v)| *v)
    }

    fn sampled(&self, rows: usize) -> Vec<f64> {
        (0..rows).map(|k| self.at(k as f64 / rows as f64)).collect()
    }
}

/// Follows the wish with at most `per_sample` change from row to row.
fn ramped(wish: Vec<f64>, first: f64, per_sample: f64) -> Vec<f64> {
    let mut value = first;
    wish.into_iter()
        .map(|target| {
            value += (target - value).clamp(-per_sample, per_sample);
            value
        })
        .collect()
}

impl Manoeuvre {
    /// The manoeuvre of one recording. The machine is the one the drive believes in.
    pub fn new(believed: &CatalogueMachine, part: Part, excitation: Excitation, sampling: Sampling, seed: u64) -> Self {
        let name = match part {
            Part::Train1 => "train1",
            Part::Train2 => "train2",
            Part::Holdout => "holdout",
        };
        let mut chance = Chance::new(seed, name);
        if excitation != Excitation::Rich {
            return Self::constant(believed, excitation, sampling, seed);
        }
        let slow = sampling.sample_s > 2e-4;
        let vector = !slow && (part == Part::Train2 || (part == Part::Holdout && chance.one_of(2) == 1));
        let mut made = if vector {
            Self::vector(believed, sampling, &mut chance)
        } else {
            Self::volts_per_hertz(believed, part, sampling, slow, &mut chance)
        };
        let level = believed.rated_voltage_v * if vector { 0.02 } else { 0.01 };
        for e in &mut made.excitation {
            *e = Vector::new(level * chance.sign(), level * chance.sign());
        }
        made
    }

    fn volts_per_hertz(m: &CatalogueMachine, part: Part, sampling: Sampling, slow: bool, chance: &mut Chance) -> Self {
        let rows = sampling.rows();
        let rated_hz = m.rated_frequency_hz;
        // The ramp takes at most 60 % of rated torque.
        let steepest = 0.6 * m.rated_torque_nm / (m.inertia_kg_m2 * std::f64::consts::TAU) * f64::from(m.pole_pairs);
        // Open-loop passage through standstill is safe with a soft slip only: others fall out of step.
        let slip = m.rated_torque_nm * m.rotor_resistance_ohm
            / (1.5 * f64::from(m.pole_pairs) * m.rated_rotor_flux_vs.powi(2) * m.rated_electrical_rad_s());
        let reversing = part == Part::Holdout && slip > 0.035 && chance.one_of(2) == 1;
        let gentle = if reversing { 0.5 } else { 1.0 };
        let hz_per_s = gentle * steepest.min(rated_hz / if slow { 2.0 } else { 0.6 }) * chance.between(0.7, 1.0);
        let every = if slow { 0.12 } else { 0.25 };
        let first = rated_hz * chance.between(0.35, 1.0);
        let wish = Steps::random(chance, 1.5 * every, every, first, |chance| {
            let sign = if reversing && chance.between(0.0, 1.0) < 0.3 { -1.0 } else { 1.0 };
            sign * rated_hz * chance.between(0.2, 1.05)
        });
        let frequency_hz = ramped(wish.sampled(rows), rated_hz * chance.between(0.02, 0.1), hz_per_s * sampling.sample_s);
        let first = chance.between(0.95, 1.05);
        let flux = Steps::random(chance, 0.2, if slow { 0.15 } else { 0.25 }, first, |chance| chance.between(0.78, 1.1));
        let factor = ramped(flux.sampled(rows), first, sampling.sample_s / 0.15);
        let load = Steps::random(chance, 0.12, if slow { 0.15 } else { 0.2 }, 0.0, |chance| {
            match chance.one_of(if slow { 6 } else { 4 }) {
                0 => 0.0,
                // What heats up needs current for long.
                1..4 if slow => chance.between(0.6, 1.0),
                _ => chance.between(-0.3, 0.85),
            }
        })
        .sampled(rows);
        let load_nm = (0..rows)
            .map(|k| {
                // What the flux can carry; the boost falls short at low frequency.
                let carry = (factor[k] * factor[k]).min(1.0) * (0.1 + 0.9 * (4.0 * frequency_hz[k].abs() / rated_hz).min(1.0));
                load[k] * carry * m.rated_torque_nm
            })
            .collect();
        Self {
            load_nm,
            settling_rows: 0,
            sample_s: sampling.sample_s,
            excitation: vec![Vector::ZERO; rows],
            wish: Wish::VoltsPerHertz { frequency_hz, factor },
            believed: m.clone(),
        }
    }

    fn vector(m: &CatalogueMachine, sampling: Sampling, chance: &mut Chance) -> Self {
        let rows = sampling.rows();
        let top = m.synchronous_speed_rad_s();
        let first = top * chance.between(-0.2, 0.5);
        let wish = Steps::random(chance, 0.22, 0.2, first, |chance| match chance.one_of(6) {
            0 => top * chance.between(-0.8, -0.2),
            1 => top * chance.between(-0.1, 0.1),
            _ => top * chance.between(0.2, 0.97),
        });
        let build_up = chance.between(0.02, 0.04);
        let mut speed_ref = wish.sampled(rows);
        for (k, speed) in speed_ref.iter_mut().enumerate() {
            if (k as f64) < build_up * rows as f64 {
                *speed = 0.0;
            }
        }
        let nominal = m.rated_rotor_flux_vs;
        let flux_first = nominal * chance.between(0.8, 1.0);
        let flux = Steps::random(chance, 0.3, 0.25, flux_first, |chance| nominal * chance.between(0.55, 1.08));
        let load_nm = Steps::random(chance, 0.12, 0.17, 0.0, |chance| {
            if chance.between(0.0, 1.0) < 0.2 { 0.0 } else { m.rated_torque_nm * chance.between(-0.4, 0.95) }
        })
        .sampled(rows);
        // Less flux at high speed, more where the load asks for it.
        let flux_ref = (0..rows)
            .map(|k| {
                let highest = 0.92 * m.rated_voltage_v / (f64::from(m.pole_pairs) * speed_ref[k].abs()).max(1.0);
                let lowest = nominal * 0.95 * (load_nm[k].abs() / m.rated_torque_nm).sqrt();
                flux.at(k as f64 / rows as f64).max(lowest).min(highest)
            })
            .collect();
        Self {
            load_nm,
            settling_rows: 0,
            sample_s: sampling.sample_s,
            excitation: vec![Vector::ZERO; rows],
            wish: Wish::Vector { speed_ref, flux_ref },
            believed: m.clone(),
        }
    }

    /// One frequency, one load: the same in all recordings of a trial.
    fn constant(m: &CatalogueMachine, excitation: Excitation, sampling: Sampling, seed: u64) -> Self {
        let mut chance = Chance::new(seed, "constant");
        let settling_s = if excitation == Excitation::Steady { 2.0 } else { 0.0 };
        let settling_rows = (settling_s / sampling.sample_s).round() as usize;
        let rows = sampling.rows() + settling_rows;
        let target = m.rated_frequency_hz * chance.between(0.6, 0.9);
        let steepest = 0.4 * m.rated_torque_nm / (m.inertia_kg_m2 * std::f64::consts::TAU) * f64::from(m.pole_pairs);
        let hz_per_s = steepest.min(target / 0.6);
        let frequency_hz = ramped(vec![target; rows], 0.0, hz_per_s * sampling.sample_s);
        let load = m.rated_torque_nm * chance.between(0.2, 0.5);
        let load_nm = frequency_hz.iter().map(|f| load * f / target).collect();
        Self {
            load_nm,
            settling_rows,
            sample_s: sampling.sample_s,
            excitation: vec![Vector::ZERO; rows],
            wish: Wish::VoltsPerHertz { frequency_hz, factor: vec![1.0; rows] },
            believed: m.clone(),
        }
    }

    /// Number of samples, settling included.
    pub fn rows(&self) -> usize {
        self.load_nm.len()
    }

    /// The drive that carries the manoeuvre out.
    pub fn drive(&self) -> Box<dyn VoltageSource + '_> {
        let m = &self.believed;
        match &self.wish {
            Wish::VoltsPerHertz { frequency_hz, factor } => Box::new(VoltsPerHertz {
                frequency_hz,
                factor,
                excitation: &self.excitation,
                rated_v: m.rated_voltage_v,
                rated_hz: m.rated_frequency_hz,
                boost_v: 0.85 * m.stator_resistance_ohm * m.rated_current_a(),
                sample_s: self.sample_s,
                angle_rad: 0.0,
            }),
            Wish::Vector { speed_ref, flux_ref } => {
                Box::new(VectorControl::new(m, speed_ref, flux_ref, &self.excitation, self.sample_s))
            }
        }
    }
}
