//! `im fit`: the parameters of a motor from recordings, its effects as they are.

use std::io::Write;
use std::path::PathBuf;

use im_diagnose::fitted::Fitted;
use im_diagnose::held_ratio::{HELD, held_std, is_held};
use im_diagnose::knowledge::contradicted;
use im_diagnose::sources::by_fit;
use im_diagnose::uncertainty::{HALF_95, MachineQuantity};
use im_model::{BaseParameter, ParameterId};
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

/// An error from here on, in σ, is more than the noise of sensors that is known to a factor.
const MISSED: f64 = 2.0;

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(path) = &args.output {
        args.data.outputs().file(path)?;
    }
    let (case, mut noticed, options) = args.data.case()?;
    let fitted = spinning("fitting", || Fitted::new(case, options)).map_err(|e| refused(&args.data.motor, &e))?;
    let Fitted { before, after, train, estimates, supply, .. } = &fitted;
    noticed.extend(by_fit(&noticed, before, &after.machine, *supply));
    if let Some(path) = &args.output {
        after.write(path)?;
    }
    let mut out = stdout();
    if args.json {
        let mut report = fitted.to_json();
        report["data_quality"] = json!(noticed);
        writeln!(out, "{report}")?;
        return Ok(());
    }
    for finding in &noticed {
        write!(out, "{}", wrapped("! ", &finding.line()))?;
    }
    writeln!(out, "{:<60} {:>11} {:>11} {:>11}", "parameter", "before", "after", "± 95 %")?;
    for e in &estimates.list {
        let note = if e.is_open() { "  not determined by these recordings" } else { "" };
        let (b, a, half) = (rounded(e.before), rounded(e.after), rounded(HALF_95 * e.std));
        writeln!(out, "{:<60} {b:>11} {a:>11} {half:>11} {}{note}", e.quantity.key(), e.quantity.unit())?;
    }
    let held = held_std(estimates, after);
    for (p, std) in HELD.into_iter().zip(held) {
        let q = MachineQuantity::Parameter(ParameterId::Base(p));
        let (b, a, half) = (rounded(q.of(&before.machine)), rounded(q.of(&after.machine)), rounded(HALF_95 * std));
        writeln!(out, "{:<60} {b:>11} {a:>11} {half:>11} {}  ratio held", q.key(), q.unit())?;
    }
    for p in BaseParameter::ALL.map(ParameterId::Base).into_iter().filter(|&id| !is_held(id)) {
        let q = MachineQuantity::Parameter(p);
        if estimates.list.iter().all(|e| e.quantity != q) {
            let value = rounded(q.of(&before.machine));
            writeln!(out, "{:<60} {value:>11} {value:>11}  held        {}", q.key(), q.unit())?;
        }
    }
    let std = |id: ParameterId| {
        let of_held = HELD.into_iter().zip(held).find(|(p, _)| ParameterId::Base(*p) == id).map(|(_, std)| std);
        of_held.or_else(|| estimates.list.iter().find(|e| e.quantity == MachineQuantity::Parameter(id)).map(|e| e.std))
    };
    for (_, said) in contradicted(before, &after.machine, std, |id| MachineQuantity::Parameter(id).key()) {
        write!(out, "{}", wrapped("! ", &(said + ".")))?;
    }
    let ratio = before.machine.parameters().leakage_ratio();
    let half = (HALF_95 * before.leakage_ratio_std()).exp();
    let known = match after.design {
        Some(class) => format!("as well as design {} says", class.name()),
        None => "over all design classes; design = \"B\" in [machine] narrows it".to_owned(),
    };
    let said = format!(
        "\"ratio held\": follows from the inverse-Γ circuit with L_ls/L_lr = {} as given; the interval is that of a ratio from {} to {}, {known}.",
        rounded(ratio),
        rounded(ratio / half),
        rounded(ratio * half)
    );
    write!(out, "{}", wrapped("", &said))?;
    for (a, b, c) in estimates.correlated(0.98) {
        writeln!(out, "{} and {} are hardly distinguished by these recordings (correlation {c:.3})", a.key(), b.key())?;
    }
    writeln!(out, "\nerror: {} σ rms (1 is the noise of the sensors)", rounded(train.chi2_per_sample.sqrt()))?;
    if !train.chi2_per_sample.is_finite() {
        writeln!(out, "  The simulation of the fitted motor diverges: check units, pole pairs and the sampling time.")?;
    }
    for (name, rms) in &train.rmse {
        let fit = train.fit_percent.get(name).map(|fit| if fit.is_finite() { format!("{fit:.2}") } else { rounded(*fit) });
        // A signal that stays where it is has none.
        let fit = fit.map_or_else(String::new, |fit| format!(", fit {fit} %"));
        writeln!(out, "  {name:<16} {:>9} rms{fit}", rounded(*rms))?;
    }
    if let Some(h) = fitted.holdout {
        writeln!(out, "held-out recording: {} σ rms", rounded(h.sqrt()))?;
    }
    let worst = fitted.holdout.into_iter().fold(train.chi2_per_sample, f64::max);
    if worst > MISSED * MISSED {
        let said = "The model leaves more than the noise: intervals and parameters rest on effects that it lacks. im diagnose with the same files looks for them.";
        write!(out, "{}", wrapped("! ", said))?;
    }
    if let Some(path) = &args.output {
        writeln!(out, "{}: the fitted motor", path.display())?;
    }
    Ok(())
}
