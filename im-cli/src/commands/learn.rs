//! `im learn`: the loop with curves that nobody wrote among the candidates.

use std::path::PathBuf;

use im_diagnose::diagnosis::{Diagnosis, diagnose};
use im_diagnose::learn::own_effect;
use im_diagnose::search::{Learning, Options};

use super::diagnose::{FILES, finish, noticed_by};
use super::inputs::{Data, refused};
use crate::failure::Failure;
use crate::spinner::spinning;

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im learn --motor motor.toml --train a.csv --train b.csv --holdout c.csv --out out --rust my_effect.rs

Every curve is a quantity of the equations over a variable: a torque over speed, a resistance over time. It \
stands in out/motor.refined.toml, which every command takes as --motor, and in the report with its band and \
the formulas that it looks like. An effect of the library that explains as much wins.")]
pub struct Args {
    #[command(flatten)]
    data: Data,
    /// Folder for report.html, motor.refined.toml and diagnosis.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Chance of a false alarm over the whole library
    #[arg(long, default_value_t = 0.01, value_name = "P")]
    significance: f64,
    /// Only where the library leaves something unexplained
    #[arg(long)]
    unexplained: bool,
    /// Write the learned curve's nearest formula as an effect of one's own into this file
    #[arg(long, value_name = "FILE")]
    rust: Option<PathBuf>,
    /// Print diagnosis.json instead of the story
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if !(args.significance > 0.0 && args.significance < 0.5) {
        return Err(Failure::Input(format!("--significance {} must lie between 0 and 0.5", args.significance)));
    }
    let mut outputs = args.data.outputs();
    if let Some(dir) = &args.out {
        outputs.folder(dir, &FILES)?;
    }
    if let Some(file) = &args.rust {
        outputs.file(file)?;
    }
    let (case, mut noticed, options) = args.data.case()?;
    let learning = if args.unexplained { Learning::Unexplained } else { Learning::Always };
    let options = Options { significance: args.significance, learning, ..options };
    let found =
        spinning("fitting, scoring and learning", || diagnose(case, options)).map_err(|e| refused(&args.data.motor, &e))?;
    let meta = noticed_by(&found, &mut noticed);
    let source = args.rust.as_ref().map(|file| Ok::<_, Failure>((file, source(&found)?))).transpose();
    finish(&found, &meta, &noticed, args.out.as_deref(), None, args.json)?;
    if let Some((file, source)) = source? {
        std::fs::write(file, source)?;
    }
    Ok(())
}

/// The first learned curve as an effect of one's own.
fn source(found: &Diagnosis) -> Result<String, Failure> {
    let Some(curve) = found.learned.first() else {
        return Err(Failure::Input("--rust: no curve was learned, the library explains what there is to explain".into()));
    };
    let name = curve.effect.name().replacen("learned", "own", 1);
    own_effect(curve, &name)
        .ok_or_else(|| Failure::Input(format!("--rust: {} has no formula that can be written", curve.effect.card().title)))
}
