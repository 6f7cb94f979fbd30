//! A trial: a machine with hidden effects, its recordings, and the truth about it.

use super::chance::Chance;
use super::drive::Playback;
use super::effect::{EffectKind, Strength};
use super::machine::CatalogueMachine;
use super::manoeuvre::{Excitation, Manoeuvre, Part, Sampling};
use super::outfit::{HiddenEffect, Outfit};
use super::run::record;
use super::sensors::{Noise, NoiseSource};
use super::table::{Table, significant};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

/// What to simulate.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialCase {
    /// Index of the machine, below [`CatalogueMachine::COUNT`].
    pub machine: usize,
    /// The hidden effects; any combination.
    pub effects: Vec<(EffectKind, Strength)>,
    /// Seed of everything random: parameters, forms, manoeuvres, noise.
    pub seed: u64,
    /// Sensor noise.
    pub noise: Noise,
    /// How much the recordings excite the machine.
    pub excitation: Excitation,
    /// Sampling; `None` chooses by the effects: slow for heating, fast otherwise.
    pub sampling: Option<Sampling>,
}

/// The recordings of a case and what was hidden in them.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Nameplate-grade parameters, each up to 15 % wrong.
    pub motor_toml: String,
    /// Training recordings.
    pub train: Vec<Table>,
    /// Held-out recording.
    pub holdout: Table,
    /// The truth.
    pub truth: Truth,
}

/// What was hidden.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// The true machine without its effects.
    pub machine: CatalogueMachine,
    /// The effects.
    pub effects: Vec<HiddenEffect>,
    /// Standard deviation of the noise on each current axis, A.
    pub current_sigma_a: f64,
    /// Standard deviation of the noise on the speed, rad/s.
    pub speed_sigma_rad_s: f64,
    /// Standard deviation of the noise on the load torque, N m.
    pub load_sigma_nm: f64,
}

/// Root-mean-square change of a measurement, in standard deviations of its noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Both current axes together.
    pub current: f64,
    /// Speed.
    pub speed: f64,
}

impl Change {
    /// All measured channels together.
    pub fn total(self) -> f64 {
        ((2.0 * self.current * self.current + self.speed * self.speed) / 3.0).sqrt()
    }
}

impl TrialCase {
    /// A case with rich excitation and white noise.
    pub fn new(machine: usize, effects: &[(EffectKind, Strength)], seed: u64) -> Self {
        Self { machine, effects: effects.to_vec(), seed, noise: Noise::default(), excitation: Excitation::Rich, sampling: None }
    }

    /// Sampling of the recordings.
    pub fn sampling(&self) -> Sampling {
        let thermal = self.effects.iter().any(|(kind, _)| kind.is_thermal());
        self.sampling.unwrap_or(if thermal { Sampling::SLOW } else { Sampling::FAST })
    }

    /// The true machine without its effects.
    pub fn true_machine(&self) -> CatalogueMachine {
        CatalogueMachine::catalogue(self.machine).scattered(0.1, &mut self.chance("machine"))
    }

    /// The machine as its nameplate has it, each parameter up to 15 % wrong.
    pub fn nameplate(&self) -> CatalogueMachine {
        self.true_machine().scattered(0.15, &mut self.chance("nameplate"))
    }

    /// The true machine with its effects.
    pub fn outfit(&self) -> Outfit {
        Outfit::new(&self.true_machine(), &self.effects, self.stream())
    }

    fn stream(&self) -> u64 {
        self.seed.wrapping_mul(1009).wrapping_add(self.machine as u64)
    }

    fn chance(&self, purpose: &str) -> Chance {
        Chance::new(self.stream(), purpose)
    }

    fn manoeuvre(&self, part: Part) -> Manoeuvre {
        Manoeuvre::new(&self.nameplate(), part, self.excitation, self.sampling(), self.stream())
    }

    fn sigmas(&self) -> [f64; 3] {
        let m = self.true_machine();
        [
            self.noise.current * m.rated_current_a(),
            self.noise.speed * m.synchronous_speed_rad_s(),
            self.noise.load * m.rated_torque_nm,
        ]
    }

    /// As the machine stands when a recording begins: nobody turns its shaft back to where it was.
    pub fn outfit_for(&self, part: Part) -> Outfit {
        let start_angle_rad = self.chance(&format!("angle {part:?}")).between(0.0, TAU);
        Outfit { start_angle_rad, ..self.outfit() }
    }

    /// The noise of the sensors in a recording.
    pub fn noise_source(&self, part: Part) -> NoiseSource {
        let [current, speed, load] = self.sigmas();
        NoiseSource::new(&self.noise, current, speed, load, self.chance(&format!("noise {part:?}")))
    }

    /// Simulates one recording.
    pub fn recording(&self, part: Part) -> Table {
        let machine = self.true_machine();
        let manoeuvre = self.manoeuvre(part);
        let noise = self.noise_source(part);
        let mut drive = manoeuvre.drive();
        let sample_s = manoeuvre.sample_s;
        let mut table = record(&machine, &self.outfit_for(part), drive.as_mut(), &manoeuvre.load_nm, sample_s, Some(noise));
        table.cut_before(manoeuvre.settling_rows);
        table
    }

    /// What the machine does when a voltage and a load are played to it, whatever it answers; without noise.
    pub fn played(&self, part: Part, [alpha_v, beta_v]: [&[f64]; 2], load_nm: &[f64], sample_s: f64) -> Table {
        record(&self.true_machine(), &self.outfit_for(part), &mut Playback { alpha_v, beta_v }, load_nm, sample_s, None)
    }

    /// How much the effects change the measurements: the recording's voltage and load, played without noise to the machine with
    /// and without its effects.
    pub fn change(&self, part: Part) -> Change {
        let machine = self.true_machine();
        let manoeuvre = self.manoeuvre(part);
        let [current_sigma, speed_sigma, _] = Self { noise: Noise::default(), ..self.clone() }.sigmas();
        let (outfit, sample_s) = (self.outfit_for(part), manoeuvre.sample_s);
        let with = record(&machine, &outfit, manoeuvre.drive().as_mut(), &manoeuvre.load_nm, sample_s, None);
        let mut again = Playback { alpha_v: &with.u_alpha_v, beta_v: &with.u_beta_v };
        let without = record(&machine, &Outfit::base(&machine), &mut again, &manoeuvre.load_nm, sample_s, None);
        let square = |a: &[f64], b: &[f64]| -> f64 {
            let n = (a.len() - manoeuvre.settling_rows) as f64;
            a.iter().zip(b).skip(manoeuvre.settling_rows).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / n
        };
        let alpha = square(&with.i_alpha_a, &without.i_alpha_a);
        let beta = square(&with.i_beta_a, &without.i_beta_a);
        Change {
            current: (0.5 * (alpha + beta)).sqrt() / current_sigma,
            speed: square(&with.omega_m_rad_s, &without.omega_m_rad_s).sqrt() / speed_sigma,
        }
    }
}

/// Simulates all recordings of a case, in parallel.
pub fn simulate(case: &TrialCase) -> Trial {
    let parts = [Part::Train1, Part::Train2, Part::Holdout];
    let mut tables: Vec<Table> = parts.par_iter().map(|part| case.recording(*part)).collect();
    let holdout = tables.pop().unwrap_or_default();
    let [current_sigma_a, speed_sigma_rad_s, load_sigma_nm] = case.sigmas();
    Trial {
        motor_toml: case.nameplate().motor_toml(&format!("machine{}_seed{}", case.machine, case.seed)),
        train: tables,
        holdout,
        truth: Truth {
            machine: case.true_machine(),
            effects: case.outfit().truth,
            current_sigma_a,
            speed_sigma_rad_s,
            load_sigma_nm,
        },
    }
}

impl Truth {
    /// The truth as JSON.
    pub fn to_json(&self) -> String {
        let number = |value: f64| significant(value, 12);
        let quoted = |list: Vec<String>| list.join(", ");
        let names = quoted(self.effects.iter().map(|e| format!("\"{}\"", e.kind)).collect());
        let details = self.effects.iter().map(|e| {
            let mut text = format!("\"{}\": {{\"form\": \"{}\", \"size\": {}", e.kind, e.form, number(e.size));
            for (name, value) in &e.parameters {
                let _ = write!(text, ", \"{name}\": {}", number(*value));
            }
            text + "}"
        });
        let details = quoted(details.collect());
        let m = &self.machine;
        let base = [
            ("Rs", m.stator_resistance_ohm),
            ("Rr", m.rotor_resistance_ohm),
            ("Lls", m.stator_leakage_h),
            ("Llr", m.rotor_leakage_h),
            ("Lm", m.magnetizing_h),
            ("J", m.inertia_kg_m2),
            ("B", m.friction_nm_s),
            ("np", f64::from(m.pole_pairs)),
        ];
        let base = quoted(base.iter().map(|(name, value)| format!("\"{name}\": {}", number(*value))).collect());
        format!(
            "{{\n  \"effects\": [{names}],\n  \"true_base\": {{{base}}},\n  \"true_effect\": {{{details}}},\n  \
             \"noise\": {{\"i_A\": {}, \"w\": {}, \"tau_Nm\": {}}}\n}}\n",
            number(self.current_sigma_a),
            number(self.speed_sigma_rad_s),
            number(self.load_sigma_nm)
        )
    }
}

impl Trial {
    /// Writes `motor.toml`, `train1.csv`, `train2.csv`, `holdout.csv` and `truth.json` into a folder, made if need be.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path) -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        std::fs::write(folder.join("motor.toml"), &self.motor_toml)?;
        for (k, table) in self.train.iter().enumerate() {
            table.write(&folder.join(format!("train{}.csv", k + 1)))?;
        }
        self.holdout.write(&folder.join("holdout.csv"))?;
        std::fs::write(folder.join("truth.json"), self.truth.to_json())
    }
}
