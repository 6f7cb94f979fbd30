//! `im add`: an effect into a motor file, at a usual size or fitted.

use std::io::Write;
use std::path::PathBuf;

use im_diagnose::case::Case;
use im_diagnose::fitted::Fitted;
use im_diagnose::intake::Finding;
use im_diagnose::search::{Model, Refinement};
use im_model::effects::Role;
use im_model::{EffectId, Machine, MotorFile, ParameterId};
use serde_json::{Map, json};

use super::inputs::{Data, refused};
use crate::failure::Failure;
use crate::spinner::spinning;
use crate::terminal::{rounded, stdout};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  im add --motor motor.toml --effect iron_loss -o with_iron.toml
  im add --motor motor.toml --effect iron_loss --train a.csv --train b.csv -o with_iron.toml

Without recordings the effect gets a usual size for the machine's rating, to edit. With recordings it is \
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
    #[arg(long, value_name = "FILE", requires = "train")]
    holdout: Option<PathBuf>,
    /// What the columns of the recordings mean, instead of the recording.toml beside them
    #[arg(long, value_name = "FILE", requires = "train")]
    mapping: Option<PathBuf>,
    /// Go on where what was noticed about the data makes the answer meaningless
    #[arg(long, requires = "train")]
    anyway: bool,
    /// Where to write the motor
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let effect = args.effect;
    let (train, holdout, mapping) = (args.train.clone(), args.holdout.clone(), args.mapping.clone());
    let data =
        Data { motor: args.motor.clone(), train, table: Vec::new(), holdout, mapping, fix: Vec::new(), anyway: args.anyway };
    data.outputs().file(&args.output)?;
    let motor = MotorFile::read(&args.motor)?;
    if motor.machine.effects().is_on(effect) {
        let file = args.motor.display();
        return Err(Failure::Input(format!("{file}: {effect} is on already; edit [effects.{effect}] or fit it with im fit")));
    }
    let sized = motor.with_usual(effect).map_err(|e| Failure::Input(e.to_string()))?;
    if args.train.is_empty() {
        sized.write(&args.output)?;
        return print(args, &sized.machine, None, &[]);
    }
    let (case, noticed, options) = data.case()?;
    let fitted = |motor: MotorFile| {
        let case = Case { motor, ..case.clone() };
        spinning("fitting", || Refinement::new(case, options.clone())).map_err(|e| refused(&args.motor, &e))
    };
    let (_, before) = fitted(motor.clone())?;
    let (refinement, after) = fitted(MotorFile { machine: with_base(&sized, &before.fit.machine)?, ..sized })?;
    let prediction = Fitted::with_prediction(&refinement, &after).after.prediction;
    MotorFile { machine: after.fit.machine, prediction, ..motor }.write(&args.output)?;
    print(args, &after.fit.machine, Some((&before, &after)), &noticed)
}

/// What was added, and how the error changed where it was fitted.
fn print(args: &Args, machine: &Machine<f64>, fitted: Option<(&Model, &Model)>, noticed: &[Finding]) -> Result<(), Failure> {
    let effect = args.effect;
    let shown = effect.parameters().iter().enumerate().filter(|(_, p)| p.role != Role::Fixed);
    let parameters = shown.map(|(k, info)| (info, machine.get(ParameterId::Effect(effect, k))));
    let mut out = stdout();
    if args.json {
        let values: Map<_, _> = parameters.map(|(p, x)| (p.key.to_owned(), json!({"value": x, "unit": p.unit}))).collect();
        let errors = |of: &dyn Fn(&Model) -> Option<f64>| fitted.map(|(b, a)| json!({"before": of(b), "after": of(a)}));
        let report = json!({
            "schema": 1, "effect": effect.name(), "motor": args.output.display().to_string(), "parameters": values,
            "train_chi2_per_sample": errors(&|m| Some(m.train())), "holdout_chi2_per_sample": errors(&|m| m.holdout),
            "data_quality": noticed,
        });
        return Ok(writeln!(out, "{report}")?);
    }
    if let Some((before, after)) = fitted {
        let fall = |b: f64, a: f64| format!("{} -> {} σ rms", rounded(b.sqrt()), rounded(a.sqrt()));
        writeln!(out, "error on the training recordings: {}", fall(before.train(), after.train()))?;
        if let (Some(b), Some(a)) = (before.holdout, after.holdout) {
            writeln!(out, "error on the held-out recording:  {}", fall(b, a))?;
        }
    }
    for (info, x) in parameters {
        writeln!(out, "  {} = {} {}", info.key, rounded(x), info.unit)?;
    }
    let how = if fitted.is_some() { "" } else { " at a usual size; edit it, or give --train to fit it" };
    writeln!(out, "{}: the motor with {effect}{how}", args.output.display())?;
    Ok(())
}

/// The sized effect on the fitted base parameters.
fn with_base(sized: &MotorFile, fitted: &Machine<f64>) -> Result<Machine<f64>, Failure> {
    sized.machine.with_parameters(*fitted.parameters()).map_err(|e| Failure::Input(e.to_string()))
}
