//! Writes a trial with hidden effects to a folder.
//!
//! `make_trial EFFECTS STRENGTH MACHINE SEED FOLDER [ramp|steady] [5khz] [colour]`
//!
//! EFFECTS: identifiers joined by commas, or `none`, or `list` alone to print them. STRENGTH: weak, medium, strong or a multiple of strong.

use im_tests::hidden::{CatalogueMachine, EffectKind, Excitation, Noise, Sampling, Strength, TrialCase, simulate};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.first().is_some_and(|a| a == "list") {
        for (index, kind) in EffectKind::ALL.iter().enumerate() {
            println!("{index:2} {kind}{}", if kind.in_library() { "" } else { " (outside the library)" });
        }
        for index in 0..CatalogueMachine::COUNT {
            println!("machine {index:2}: {}", CatalogueMachine::catalogue(index).name);
        }
        return Ok(());
    }
    let [effects, strength, machine, seed, folder, more @ ..] = arguments.as_slice() else {
        return Err("usage: make_trial EFFECTS STRENGTH MACHINE SEED FOLDER [ramp|steady] [5khz] [colour]".into());
    };
    let strength: Strength = strength.parse()?;
    let kinds = effects.split(',').filter(|name| *name != "none").map(str::parse::<EffectKind>);
    let effects = kinds.map(|kind| Ok((kind?, strength))).collect::<Result<Vec<_>, Box<dyn Error>>>()?;
    let machine: usize = machine.parse()?;
    if machine >= CatalogueMachine::COUNT {
        return Err(format!("machine {machine}: there are {}, from 0", CatalogueMachine::COUNT).into());
    }
    let mut case = TrialCase::new(machine, &effects, seed.parse()?);
    for word in more {
        match word.as_str() {
            "ramp" => case.excitation = Excitation::Ramp,
            "steady" => case.excitation = Excitation::Steady,
            "5khz" => case.sampling = Some(Sampling { sample_s: 2e-4, duration_s: 2.0 }),
            colour => case.noise = Noise::coloured(colour.parse()?),
        }
    }
    let trial = simulate(&case);
    trial.write(Path::new(folder))?;
    print!("{}", trial.truth.to_json());
    Ok(())
}
