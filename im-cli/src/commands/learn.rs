//! `im learn`: the loop with curves that nobody wrote among the candidates.

use std::io::Write as _;
use std::path::PathBuf;

use im_diagnose::learn::own_source;
use im_diagnose::search::Learning;
use im_diagnose::sources::Refused;
use im_model::write_atomically;

use super::diagnose::Asked;
use crate::failure::Failure;
use crate::terminal::stdout;

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im learn --motor motor.toml --train a.csv --train b.csv --holdout c.csv --out out \\
           --rust my_effect.rs

Every curve is a quantity of the equations over a variable: a torque over speed, a resistance over time. It \
stands in out/motor.refined.toml, which every command takes as --motor, and in the report with its band and \
the formulas that it looks like. An effect of the library that explains as much wins.")]
pub struct Args {
    #[command(flatten)]
    asked: Asked,
    /// Only where the library leaves something unexplained
    #[arg(long)]
    unexplained: bool,
    /// Write the learned curve's nearest formula as an effect of one's own into this file
    #[arg(long, value_name = "FILE")]
    rust: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut outputs = args.asked.outputs()?;
    args.rust.as_ref().map_or(Ok(()), |file| outputs.file(file))?;
    let (found, meta) = args.asked.answer(if args.unexplained { Learning::Unexplained } else { Learning::Always }, &outputs)?;
    let source = args.rust.as_ref().map(|file| Ok::<_, Refused>((file, own_source(&found.learned)?))).transpose();
    args.asked.finish(&found, &meta)?;
    if found.learned.is_empty() && !args.asked.as_json() {
        writeln!(stdout(), "\nNothing was learned: no curve explains more than the effects of the library do.")?;
    }
    if let Some((file, source)) = source? {
        write_atomically(file, |w| w.write_all(source.as_bytes()))?;
    }
    Ok(())
}
