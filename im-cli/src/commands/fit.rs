//! `im fit`: the parameters of a motor from recordings, its effects as they are.

use std::io::Write;
use std::path::PathBuf;

use im_diagnose::residuals::errors;
use im_diagnose::search::Refinement;
use im_model::MotorFile;
use serde_json::json;

use super::inputs::{Data, refused};
use crate::failure::Failure;
use crate::spinner::spinning;
use crate::terminal::{rounded, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im fit --motor motor.toml --train a.csv --train b.csv -o motor.fitted.toml

Fits R_s, R_r, the leakages (by one factor), L_m, J and D, and the parameters of the effects that the
motor file switches on, to all recordings at once.")]
pub struct Args {
    #[command(flatten)]
    data: Data,
    /// Where to write the fitted motor
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// A parameter counts as not determined when its standard deviation exceeds this fraction of it.
const UNDETERMINED: f64 = 0.3;

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(path) = &args.output {
        args.data.outputs().file(path)?;
    }
    let (case, noticed) = args.data.case()?;
    let before = case.motor.clone();
    let fitted = spinning("fitting", || Refinement::new(case, args.data.options()));
    let (refinement, model) = fitted.map_err(|e| refused(&args.data.motor, &e))?;
    let fit = &model.fit;
    let after = MotorFile { machine: fit.machine, ..before.clone() };
    if let Some(path) = &args.output {
        after.write(path)?;
    }
    let train = errors(&fit.machine, refinement.nudged(), &fit.starts);
    let std = fit.standard_deviations();
    let weak = fit.undetermined(UNDETERMINED);
    let mut out = stdout();
    if args.json {
        let parameters: serde_json::Map<_, _> = fit
            .free
            .iter()
            .enumerate()
            .filter_map(|(k, f)| {
                let id = f.id()?;
                let value = json!({
                    "before": before.machine.get(id), "after": after.machine.get(id), "std": std[k],
                    "unit": id.unit(), "determined": !weak.contains(&k),
                });
                Some((id.to_string(), value))
            })
            .collect();
        let report = json!({
            "schema": 1, "data_quality": noticed, "chi2_per_sample": train.chi2_per_sample, "rmse": train.rmse, "fit_percent": train.fit_percent,
            "parameters": parameters, "holdout_chi2_per_sample": model.holdout,
        });
        writeln!(out, "{report}")?;
        return Ok(());
    }
    for finding in &noticed {
        write!(out, "{}", wrapped("! ", &finding.line()))?;
    }
    writeln!(out, "{:<60} {:>11} {:>11} {:>11}", "parameter", "before", "after", "std")?;
    for (k, f) in fit.free.iter().enumerate() {
        if let Some(id) = f.id() {
            let note = if weak.contains(&k) { "  not determined by these recordings" } else { "" };
            let (b, a) = (rounded(before.machine.get(id)), rounded(after.machine.get(id)));
            writeln!(out, "{:<60} {b:>11} {a:>11} {:>11} {}{note}", f.name(), rounded(std[k]), id.unit())?;
        }
    }
    let pairs = (0..fit.free.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    for (a, b) in pairs.filter(|&(a, b)| fit.correlation(a, b).abs() > 0.98) {
        let c = fit.correlation(a, b);
        writeln!(out, "{} and {} can hardly be told apart (correlation {c:.3})", fit.free[a].name(), fit.free[b].name())?;
    }
    writeln!(
        out,
        "\nerror: {} noise floors (mean squared residual; 1 is the noise of the sensors)",
        rounded(train.chi2_per_sample)
    )?;
    for (name, rms) in &train.rmse {
        writeln!(out, "  {name:<16} {:>9} rms, fit {:.2} %", rounded(*rms), train.fit_percent[name])?;
    }
    if let Some(h) = model.holdout {
        writeln!(out, "held-out recording: {} noise floors", rounded(h))?;
    }
    if let Some(path) = &args.output {
        writeln!(out, "{}: the fitted motor", path.display())?;
    }
    Ok(())
}
