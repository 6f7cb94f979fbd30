//! A fleet to try fleets on: motors of three types from the simulator of [`hidden`](crate::hidden), some with a defect, some with a broken file.
//!
//! Motors of a type differ by up to ±10 % in every parameter; all are given the type's parameters. What is wrong with whom stands in
//! `truth.csv`, which no program under test reads.

use std::fs;
use std::io;
use std::path::Path;

use rayon::prelude::*;

use crate::hidden::chance::Chance;
use crate::hidden::{CatalogueMachine, EffectKind, Part, Sampling, Strength, TrialCase};

/// Machines of the catalogue that are types here: 3 kW with four poles, 7.5 kW with two, 11 kW with six.
const TYPES: [usize; 3] = [3, 5, 6];
/// Defects, as they befall motors and their sensors.
const DEFECTS: [EffectKind; 6] = [
    EffectKind::RotorAsymmetry,
    EffectKind::StatorAsymmetry,
    EffectKind::CoulombFriction,
    EffectKind::LoadTorqueRipple,
    EffectKind::CurrentSensorGain,
    EffectKind::CurrentSensorOffset,
];
/// Part of the motors with a defect, and with a broken file.
const WITH_DEFECT: f64 = 0.06;
const WITH_BROKEN_FILE: f64 = 0.02;

/// What is wrong with a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Broken {
    /// Cut in the middle of a row.
    CutShort,
    /// Empty.
    Empty,
    /// A field that is no number.
    Word,
    /// A column that is not there.
    ColumnMissing,
    /// A motor file without one of its parameters.
    Motor,
    /// No text at all.
    Bytes,
}

const BROKEN: [Broken; 6] = [Broken::CutShort, Broken::Empty, Broken::Word, Broken::ColumnMissing, Broken::Motor, Broken::Bytes];

/// A motor of the fleet.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// Its name.
    pub name: String,
    /// Its machine and recordings.
    pub case: TrialCase,
    /// What is wrong with its file.
    pub broken: Option<Broken>,
}

/// The units of a fleet: the same for the same seed.
pub fn units(count: usize, seed: u64) -> Vec<Unit> {
    let mut order: Vec<usize> = (0..count).collect();
    let mut chance = Chance::new(seed, "who");
    for k in (1..count).rev() {
        order.swap(k, chance.one_of(k + 1));
    }
    let part = |of: f64| (of * count as f64).round() as usize;
    let (defects, broken) = (part(WITH_DEFECT), part(WITH_BROKEN_FILE));
    let rank = |k: usize| order.iter().position(|o| *o == k).unwrap_or(count);
    let unit = |k: usize| {
        let rank = rank(k);
        let effects = if rank < defects { vec![(DEFECTS[rank % DEFECTS.len()], Strength::Medium)] } else { Vec::new() };
        let wrong = (defects..defects + broken).contains(&rank).then(|| BROKEN[(rank - defects) % BROKEN.len()]);
        let mut case = TrialCase::new(TYPES[k % TYPES.len()], &effects, seed.wrapping_mul(1_000_003).wrapping_add(k as u64));
        case.sampling = Some(Sampling { sample_s: 2e-4, duration_s: 2.0 });
        Unit { name: format!("motor-{k:04}"), case, broken: wrong }
    };
    (0..count).map(unit).collect()
}

/// Simulates a fleet and writes it: a folder for each motor with `motor.toml`, `run.csv` and `holdout.csv`; and `truth.csv`.
///
/// # Errors
/// A file cannot be written.
pub fn write(folder: &Path, units: &[Unit]) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    units.par_iter().try_for_each(|u| write_unit(folder, u))?;
    let mut truth = String::from("unit,type,defect,broken\n");
    for u in units {
        let defect = u.case.effects.first().map_or("", |(kind, _)| kind.name());
        let broken = u.broken.map_or_else(String::new, |b| format!("{b:?}"));
        truth += &format!("{},{},{defect},{broken}\n", u.name, CatalogueMachine::catalogue(u.case.machine).name);
    }
    fs::write(folder.join("truth.csv"), truth)
}

fn write_unit(folder: &Path, u: &Unit) -> io::Result<()> {
    let folder = folder.join(&u.name);
    fs::create_dir_all(&folder)?;
    let kind = CatalogueMachine::catalogue(u.case.machine);
    let mut motor = kind.motor_toml(&kind.name);
    if u.broken == Some(Broken::Motor) {
        motor = motor.lines().filter(|l| !l.starts_with("rotor_resistance")).map(|l| format!("{l}\n")).collect();
    }
    fs::write(folder.join("motor.toml"), motor)?;
    let run = folder.join("run.csv");
    u.case.recording(Part::Train1).write(&run)?;
    u.case.recording(Part::Holdout).write(&folder.join("holdout.csv"))?;
    let Some(broken) = u.broken else { return Ok(()) };
    let text = fs::read_to_string(&run)?;
    let changed: Vec<u8> = match broken {
        Broken::CutShort => text.as_bytes()[..text.len() * 2 / 3 - 7].to_vec(),
        Broken::Empty => Vec::new(),
        Broken::Word => {
            let line = |(k, l): (usize, &str)| if k == 4321 { l.replacen(',', ",oops", 1) + "\n" } else { format!("{l}\n") };
            text.lines().enumerate().map(line).collect::<String>().into_bytes()
        }
        Broken::ColumnMissing => {
            let without =
                |l: &str| l.split(',').enumerate().filter(|(k, _)| *k != 4).map(|(_, f)| f).collect::<Vec<_>>().join(",");
            text.lines().map(|l| without(l) + "\n").collect::<String>().into_bytes()
        }
        Broken::Motor => return Ok(()),
        Broken::Bytes => (0..100_000u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8).collect(),
    };
    fs::write(run, changed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fleet_has_the_shares_it_says() {
        let all = units(300, 1);
        assert_eq!(all.iter().filter(|u| !u.case.effects.is_empty()).count(), 18);
        assert_eq!(all.iter().filter(|u| u.broken.is_some()).count(), 6);
        assert!(all.iter().all(|u| u.broken.is_none() || u.case.effects.is_empty()));
        for machine in TYPES {
            assert_eq!(all.iter().filter(|u| u.case.machine == machine).count(), 100);
        }
        assert_eq!(units(300, 1), all);
        assert_ne!(units(300, 2), all);
    }
}
