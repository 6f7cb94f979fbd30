//! `im validate`: a motor before and after, on a recording that neither has seen.

use std::io::Write;
use std::path::PathBuf;

use im_diagnose::validation::Validation;
use im_model::MotorFile;

use super::inputs::recording;
use crate::failure::Failure;
use crate::spinner::spinning;
use crate::terminal::{rounded, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im validate --before motor.toml --after out/motor.refined.toml --data new.csv")]
pub struct Args {
    /// The motor before
    #[arg(long, value_name = "FILE")]
    before: PathBuf,
    /// The refined motor
    #[arg(long, value_name = "FILE")]
    after: PathBuf,
    /// A recording that was not used to refine it
    #[arg(long, value_name = "FILE")]
    data: PathBuf,
    /// What the columns of the recording mean, instead of the recording.toml beside it
    #[arg(long, value_name = "FILE")]
    mapping: Option<PathBuf>,
    /// Go on where what was noticed about the data makes the answer meaningless
    #[arg(long)]
    anyway: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let before = MotorFile::read(&args.before)?;
    let after = MotorFile::read(&args.after)?;
    let taken = recording(&args.data, args.mapping.as_deref(), &after)?;
    let labels = [&args.before, &args.after].map(|path| path.display().to_string());
    let pair = [(&before, labels[0].as_str()), (&after, labels[1].as_str())];
    let found = spinning("simulating", || Validation::new(pair[0], pair[1], taken, args.anyway))?;
    let mut out = stdout();
    if args.json {
        writeln!(out, "{}", found.to_json())?;
        return Ok(());
    }
    let ([before, after], nudged) = (&found.not_nudged, &found.speed_nudged);
    for finding in &found.noticed {
        write!(out, "{}", wrapped("! ", &finding.line()))?;
    }
    writeln!(out, "{}: rms error in units of the sensor noise σ\n", args.data.display())?;
    writeln!(out, "{:<34} {:>10} {:>10}", "", "before", "after")?;
    let mut row = |name: &str, b: f64, a: f64| writeln!(out, "{name:<34} {:>10} {:>10}", rounded(b), rounded(a));
    // Where no speed is compared, there is none to draw to another.
    let one = *nudged == found.not_nudged;
    row(if one { "error" } else { "simulated on its own" }, before.rms_in_sigma(), after.rms_in_sigma())?;
    if !one {
        row("speed nudged to the measured one", nudged[0].rms_in_sigma(), nudged[1].rms_in_sigma())?;
    }
    for (name, rms) in &before.rmse {
        row(&format!("{name}, rms"), *rms, after.rmse[name])?;
    }
    Ok(())
}
