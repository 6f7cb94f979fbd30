//! `im add`: an effect into a motor file, at a usual size or fitted.

use std::io::{self, Write};
use std::path::PathBuf;

use im_diagnose::case::Case;
use im_diagnose::refine::{Options, Refinement};
use im_model::effects::Role;
use im_model::{EffectId, MotorFile, ParameterId};

use super::inputs::{recording, recordings, refused};
use crate::failure::Failure;
use crate::terminal::rounded;

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  im add --motor motor.toml --effect iron_loss -o with_iron.toml
  im add --motor motor.toml --effect iron_loss --train a.csv --train b.csv -o with_iron.toml

Without recordings the effect gets a usual size for the machine's rating, to edit. With recordings it is
fitted together with everything else.")]
pub struct Args {
    /// The motor: a motor.toml
    #[arg(long, value_name = "FILE")]
    motor: PathBuf,
    /// The effect to add (see im effects)
    #[arg(long, value_name = "NAME", value_parser = super::effects::effect_parser())]
    effect: EffectId,
    /// Recordings to fit it to
    #[arg(long, value_name = "FILE")]
    train: Vec<PathBuf>,
    /// A recording that no fit sees
    #[arg(long, value_name = "FILE")]
    holdout: Option<PathBuf>,
    /// Where to write the motor
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let effect = args.effect;
    let motor = MotorFile::read(&args.motor)?;
    if motor.machine.effects().is_on(effect) {
        let file = args.motor.display();
        return Err(Failure::Input(format!("{file}: {effect} is on already; edit [effects.{effect}] or fit it with im fit")));
    }
    let sized = at_usual_size(&motor, effect)?;
    let mut out = io::stdout().lock();
    if args.train.is_empty() {
        sized.write(&args.output)?;
        writeln!(out, "{}: {effect} added at a usual size; edit it, or give --train to fit it", args.output.display())?;
        return Ok(());
    }
    let train = recordings(&args.train, None, &motor)?;
    let holdout = args.holdout.as_deref().map(|p| recording(p, None, &motor)).transpose()?;
    let fitted = |m: MotorFile| {
        let case = Case::from_intake(m, train.clone(), holdout.clone());
        Refinement::new(case, Options::default()).map_err(|e| refused(&args.motor, &e))
    };
    let (_, before) = fitted(motor.clone())?;
    let (_, after) = fitted(MotorFile { machine: with_base(&sized, &before.fit.machine)?, ..sized })?;
    MotorFile { machine: after.fit.machine, ..motor }.write(&args.output)?;
    writeln!(out, "error on the training recordings: {} -> {} noise floors", rounded(before.train()), rounded(after.train()))?;
    if let (Some(b), Some(a)) = (before.holdout, after.holdout) {
        writeln!(out, "error on the held-out recording:  {} -> {} noise floors", rounded(b), rounded(a))?;
    }
    for (k, info) in effect.parameters().iter().enumerate().filter(|(_, p)| p.role != Role::Fixed) {
        let x = after.fit.machine.get(ParameterId::Effect(effect, k));
        writeln!(out, "  {} = {} {}", info.key, rounded(x), info.unit)?;
    }
    writeln!(out, "{}: the motor with {effect}", args.output.display())?;
    Ok(())
}

/// The effect at the geometric middle of its usual sizes.
fn at_usual_size(motor: &MotorFile, effect: EffectId) -> Result<MotorFile, Failure> {
    let mut machine = motor.machine;
    for (k, info) in effect.parameters().iter().enumerate().filter(|(_, p)| p.role == Role::Strength) {
        let unit = motor.rating.unit_of(info.scale, machine.parameters(), machine.pole_pairs());
        let middle = (info.typical.0 * info.typical.1).sqrt() * unit;
        machine = machine.with(&[(ParameterId::Effect(effect, k), middle)]).map_err(|e| Failure::Input(e.to_string()))?;
    }
    Ok(MotorFile { machine, ..motor.clone() })
}

/// The sized effect on the fitted base parameters.
fn with_base(sized: &MotorFile, fitted: &im_model::Machine<f64>) -> Result<im_model::Machine<f64>, Failure> {
    sized.machine.with_parameters(*fitted.parameters()).map_err(|e| Failure::Input(e.to_string()))
}
