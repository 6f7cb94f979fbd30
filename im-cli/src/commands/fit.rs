//! `im fit`: the parameters of a motor from recordings, its effects as they are.

use std::io::Write;
use std::path::PathBuf;

use im_diagnose::residuals::errors;
use im_diagnose::search::Refinement;
use im_diagnose::uncertainty::{Estimate, Estimates, HALF_95, MachineQuantity};
use im_model::{BaseParameter, MotorFile, ParameterId};
use serde_json::json;

use super::inputs::{Data, by_fit, refused};
use crate::failure::Failure;
use crate::spinner::spinning;
use crate::terminal::{rounded, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im fit --motor motor.toml --train a.csv --train b.csv -o motor.fitted.toml

Fits R_s, R_r, the leakages (by one factor), L_m, J and D, and the parameters of the effects that the \
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

/// Parameters of the T circuit that depend on the ratio of the leakages.
const HELD: [BaseParameter; 4] = [
    BaseParameter::RotorResistance,
    BaseParameter::StatorLeakageInductance,
    BaseParameter::RotorLeakageInductance,
    BaseParameter::MagnetizingInductance,
];

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(path) = &args.output {
        args.data.outputs().file(path)?;
    }
    let (case, mut noticed) = args.data.case()?;
    let before = case.motor.clone();
    let fitted = spinning("fitting", || Refinement::new(case, args.data.options()));
    let (refinement, model) = fitted.map_err(|e| refused(&args.data.motor, &e))?;
    let fit = &model.fit;
    let after = MotorFile { machine: fit.machine, ..before.clone() };
    noticed.extend(by_fit(&noticed, &before, &after.machine));
    if let Some(path) = &args.output {
        after.write(path)?;
    }
    let train = errors(&fit.machine, refinement.nudged(), &fit.starts);
    let estimates = Estimates::of_fit(&before, fit, refinement.nudged());
    let weak = |e: &Estimate| e.std.is_nan() || e.std > UNDETERMINED * e.after.abs();
    let mut out = stdout();
    if args.json {
        let held = HELD.map(ParameterId::Base).map(|id| (MachineQuantity::Parameter(id), None));
        let all = estimates.list.iter().map(|e| (e.quantity, Some(e))).chain(held);
        let one = |(q, e): (MachineQuantity, Option<&Estimate>)| {
            let value = json!({
                "before": q.of(&before.machine), "after": q.of(&after.machine), "std": e.map(|e| e.std), "unit": q.unit(),
                "determined": e.map(|e| !weak(e)), "leakage_ratio_held": e.is_none(),
            });
            (q.key(), value)
        };
        let parameters: serde_json::Map<_, _> = all.map(one).collect();
        let report = json!({
            "schema": 1, "data_quality": noticed, "chi2_per_sample": train.chi2_per_sample, "rmse": train.rmse, "fit_percent": train.fit_percent,
            "parameters": parameters, "covariance": estimates.to_json(), "holdout_chi2_per_sample": model.holdout,
        });
        writeln!(out, "{report}")?;
        return Ok(());
    }
    for finding in &noticed {
        write!(out, "{}", wrapped("! ", &finding.line()))?;
    }
    writeln!(out, "{:<60} {:>11} {:>11} {:>11}", "parameter", "before", "after", "± 95 %")?;
    for e in &estimates.list {
        let note = if weak(e) { "  not determined by these recordings" } else { "" };
        let (b, a, half) = (rounded(e.before), rounded(e.after), rounded(HALF_95 * e.std));
        writeln!(out, "{:<60} {b:>11} {a:>11} {half:>11} {}{note}", e.quantity.key(), e.quantity.unit())?;
    }
    for q in HELD.map(|p| MachineQuantity::Parameter(ParameterId::Base(p))) {
        let (b, a) = (rounded(q.of(&before.machine)), rounded(q.of(&after.machine)));
        writeln!(out, "{:<60} {b:>11} {a:>11}  ratio held  {}", q.key(), q.unit())?;
    }
    for p in BaseParameter::ALL.map(ParameterId::Base).into_iter().filter(|id| !HELD.map(ParameterId::Base).contains(id)) {
        let q = MachineQuantity::Parameter(p);
        if estimates.list.iter().all(|e| e.quantity != q) {
            let value = rounded(q.of(&before.machine));
            writeln!(out, "{:<60} {value:>11} {value:>11}  held        {}", q.key(), q.unit())?;
        }
    }
    let ratio = before.machine.parameters().leakage_ratio();
    let held = format!("\"ratio held\": follows from the inverse-Γ circuit with L_ls/L_lr = {} as given.", rounded(ratio));
    write!(out, "{}", wrapped("", &held))?;
    // Of what has no variance no correlation can be said.
    for (a, b, c) in estimates.correlated(0.98).into_iter().filter(|(.., c)| c.is_finite()) {
        writeln!(out, "{} and {} are hardly distinguished by these recordings (correlation {c:.3})", a.key(), b.key())?;
    }
    writeln!(out, "\nerror: {} σ rms (1 is the noise of the sensors)", rounded(train.chi2_per_sample.sqrt()))?;
    for (name, rms) in &train.rmse {
        writeln!(out, "  {name:<16} {:>9} rms, fit {:.2} %", rounded(*rms), train.fit_percent[name])?;
    }
    if let Some(h) = model.holdout {
        writeln!(out, "held-out recording: {} σ rms", rounded(h.sqrt()))?;
    }
    if let Some(path) = &args.output {
        writeln!(out, "{}: the fitted motor", path.display())?;
    }
    Ok(())
}
