//! `im validate`: a motor before and after, on a recording that neither has seen.

use std::io::Write;
use std::path::PathBuf;

use im_diagnose::case::Case;
use im_diagnose::residuals::errors;
use im_diagnose::residuals::nudged;
use im_identify::offline::{residuals, start_on};
use im_model::MotorFile;
use serde_json::json;

use super::inputs::{followed, meaningful, recording};
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
    if before.machine.pole_pairs() != after.machine.pole_pairs() {
        return Err(Failure::Input(format!(
            "{} has {} pole pairs, {} has {}: these are different machines",
            args.before.display(),
            before.machine.pole_pairs(),
            args.after.display(),
            after.machine.pole_pairs()
        )));
    }
    let taken = recording(&args.data, args.mapping.as_deref(), &after)?;
    let noticed = taken.findings.clone();
    meaningful(&noticed, args.anyway)?;
    followed(&before, &args.before, &taken)?;
    followed(&after, &args.after, &taken)?;
    let mut case = Case::from_intake(after.clone(), vec![taken], None);
    let drawn = nudged(&case.train);
    let starts = |m: &MotorFile| drawn.iter().map(|e| start_on(&m.machine, e, &m.rating)).collect::<Vec<_>>();
    let (start_before, start_after) = (starts(&before), starts(&after));
    let left: Vec<_> = drawn.iter().zip(&start_after).map(|(e, x)| residuals(&after.machine, e, x)).collect();
    case.set_noise_from(&drawn, &left);
    let pair = |e: &[_]| (errors(&before.machine, e, &start_before), errors(&after.machine, e, &start_after));
    let (free, aided) = spinning("simulating", || (pair(&case.train), pair(&nudged(&case.train))));
    for (file, e) in [(&args.before, &free.0), (&args.before, &aided.0), (&args.after, &free.1), (&args.after, &aided.1)] {
        if !e.chi2_per_sample.is_finite() {
            return Err(Failure::Input(format!(
                "{}: simulated with {} it leaves the finite range; check the voltages and times of the recording, and the motor's numbers",
                file.display(),
                args.data.display()
            )));
        }
    }
    let mut out = stdout();
    if args.json {
        let pair = |p: &(im_diagnose::residuals::Errors, im_diagnose::residuals::Errors)| {
            let one = |e: &im_diagnose::residuals::Errors| json!({"chi2_per_sample": e.chi2_per_sample, "rms_in_sigma": e.rms_in_sigma(), "rmse": e.rmse});
            json!({"before": one(&p.0), "after": one(&p.1)})
        };
        writeln!(out, "{}", json!({"schema": 1, "data_quality": noticed, "unaided": pair(&free), "speed_drawn": pair(&aided)}))?;
        return Ok(());
    }
    for finding in &noticed {
        write!(out, "{}", wrapped("! ", &finding.line()))?;
    }
    writeln!(out, "{}: rms error in units of the sensor noise σ\n", args.data.display())?;
    writeln!(out, "{:<34} {:>10} {:>10}", "", "before", "after")?;
    let mut row = |name: &str, b: f64, a: f64| writeln!(out, "{name:<34} {:>10} {:>10}", rounded(b), rounded(a));
    row("simulated on its own", free.0.rms_in_sigma(), free.1.rms_in_sigma())?;
    row("speed nudged to the measured one", aided.0.rms_in_sigma(), aided.1.rms_in_sigma())?;
    for (name, rms) in &free.0.rmse {
        row(&format!("{name}, rms"), *rms, free.1.rmse[name])?;
    }
    Ok(())
}
