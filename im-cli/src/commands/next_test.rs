//! `im next-test`: the manoeuvre that best settles what is open.

use std::io::Write;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use im_diagnose::next_test::{Limits, Proposal, Sensing, Supply, WHY, open_after, propose, rivals, to_json};
use im_diagnose::worst_case::machines_after;
use im_model::{EffectId, FileKind, MotorFile, read_text, write_atomically};
use serde_json::Value;

use super::inputs::refused;
use crate::failure::Failure;
use crate::output::Outputs;
use crate::spinner::spinning;
use crate::terminal::{rounded, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  im next-test --motor out/motor.refined.toml --diagnosis out/diagnosis.json -o next.toml
  im next-test --motor motor.toml --effect iron_loss --effect windage -o next.toml

Simulates safe manoeuvres with the motor and chooses the one in which the open effects are seen best and \
lie farthest apart.")]
#[command(group(clap::ArgGroup::new("open").args(["diagnosis", "effect"]).required(true).multiple(true)))]
pub struct Args {
    /// The motor: a motor.toml, best the refined one
    #[arg(long, value_name = "FILE")]
    motor: PathBuf,
    /// What im diagnose found: its rivals, or what it could not see, are what is open
    #[arg(long, value_name = "FILE")]
    diagnosis: Option<PathBuf>,
    /// An effect in question; give it several times
    #[arg(long, value_name = "NAME", value_parser = super::effects::effect_parser())]
    effect: Vec<EffectId>,
    /// What feeds the machine: a drive, or the mains, through a transformer too; without it, what fed it in the recordings of the diagnosis,
    /// else a drive
    #[arg(long, value_parser = PossibleValuesParser::new(["drive", "mains"]).map(|word| supply_of(&word)))]
    supply: Option<Supply>,
    /// Largest phase current over the rated one [default: 2.5 on a drive, 12 on the mains]
    #[arg(long, value_name = "X")]
    max_current: Option<f64>,
    /// Largest speed over the synchronous one
    #[arg(long, default_value_t = 1.1, value_name = "X")]
    max_speed: f64,
    /// Largest load torque over the rated one
    #[arg(long, default_value_t = 0.8, value_name = "X")]
    max_torque: f64,
    /// Where to write the scenario
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

fn supply_of(word: &str) -> Supply {
    if word == "mains" { Supply::Mains } else { Supply::Drive }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut outputs = Outputs::beside([&args.motor].into_iter().chain(&args.diagnosis));
    args.output.as_deref().map_or(Ok(()), |path| outputs.file(path))?;
    let motor = MotorFile::read(&args.motor)?;
    let rated = motor.rating.current_peak_a(motor.machine.parameters(), motor.machine.pole_pairs());
    let mut open = args.effect.clone();
    let diagnosis = args.diagnosis.as_deref().map(read).transpose()?;
    open.extend(diagnosis.iter().flat_map(open_after));
    let are_rivals = !args.effect.is_empty() || diagnosis.as_ref().is_some_and(|d| !rivals(d).is_empty());
    let sensing = Sensing::after(&motor, diagnosis.as_ref());
    open.sort_unstable();
    open.dedup();
    let mut out = stdout();
    if open.is_empty() {
        if args.json {
            return Ok(writeln!(out, "{}", to_json(&[], &[]))?);
        }
        let said = if diagnosis.as_ref().is_some_and(|d| d["verdict"] == "unexplained") {
            "No manoeuvre settles what the library does not hold. What is left, and on what it depends, stands in the report of the diagnosis; im learn draws it as a curve. A recording over more of what it depends on shows more of the curve. To plan one for effects of the library, name them with --effect."
        } else {
            "Nothing is open: the diagnosis left no rivals and no suspect, and saw every effect. Name some with --effect to go on."
        };
        write!(out, "{}", wrapped("", said))?;
        return Ok(());
    }
    let supply = Supply::of(args.supply, diagnosis.as_ref());
    let current = args.max_current.unwrap_or(Limits::on(supply).current);
    let limits = Limits { supply, current, speed: args.max_speed, torque: args.max_torque };
    let safe_for = machines_after(&motor, diagnosis.as_ref(), &open);
    let found = spinning("simulating manoeuvres", || propose(&motor, &open, sensing, &limits, &safe_for))
        .map_err(|e| refused(&args.motor, &e))?;
    let Some(best) = found.first() else {
        let synchronous = motor.rating.synchronous_speed_rad_s(motor.machine.pole_pairs());
        let unlimited = Limits { current: f64::INFINITY, speed: f64::INFINITY, ..limits };
        let all = propose(&motor, &open, sensing, &unlimited, &safe_for).unwrap_or_default();
        if all.is_empty() {
            let names: Vec<&str> = open.iter().map(|e| e.name()).collect();
            return Err(Failure::Input(format!(
                "no manoeuvre shows {}: with the sensors that there are, other values of the parameters imitate it",
                names.join(", ")
            )));
        }
        // The one that goes least beyond.
        let needs = |p: &Proposal| [p.reaches.0 / rated, p.reaches.1 / synchronous];
        let beyond = |p: &Proposal| (needs(p)[0] / limits.current).max(needs(p)[1] / limits.speed);
        let nearest = all.iter().min_by(|a, b| beyond(a).total_cmp(&beyond(b)));
        let nearest = nearest.map_or_else(String::new, |p| {
            let up = |x: f64| (10.0 * x).ceil() / 10.0;
            let [current, speed] = needs(p);
            let allow = [("--max-current", current, limits.current), ("--max-speed", speed, limits.speed)];
            let allow: Vec<String> =
                allow.iter().filter(|a| a.1 > a.2).map(|a| format!("{} {}", a.0, rounded(up(a.1)))).collect();
            let (amperes, turns) = p.reaches;
            format!("; the nearest ({}) reaches {} A and {} rad/s: {}", p.name, rounded(amperes), rounded(turns), allow.join(" "))
        });
        return Err(Failure::Input(format!(
            "no manoeuvre stays within {} A and {} rad/s on every machine that this motor may be{nearest}. Or ask for less load with --max-torque",
            rounded(limits.current * rated),
            rounded(limits.speed * synchronous)
        )));
    };
    if let Some(path) = &args.output {
        write_atomically(path, |w| w.write_all(best.scenario_toml.as_bytes()))?;
    }
    if args.json {
        return Ok(writeln!(out, "{}", to_json(&open, &found))?);
    }
    write!(out, "{}", wrapped("In question: ", &open.iter().map(|e| e.name()).collect::<Vec<_>>().join(", ")))?;
    write!(out, "{}", wrapped("Next test:   ", &best.what))?;
    write!(out, "{}", wrapped("             ", WHY))?;
    let margin =
        |reached: f64, limit: f64| format!("{:.0} % below the limit of {}", 100.0 * (1.0 - reached / limit), rounded(limit));
    let ((current, speed), most) = (best.reaches, best.limits);
    let worst = format!(
        "reaches at most {} A ({} A) and {} rad/s ({} rad/s): the worst of the motor as given, as refined, at two standard deviations, and \
         with each effect in question at its largest usual size",
        rounded(current),
        margin(current, most.0),
        rounded(speed),
        margin(speed, most.1)
    );
    write!(out, "{}", wrapped("             ", &worst))?;
    for (e, x) in &best.detectable {
        let says = if *x < 1.0 { "will be seen" } else { "will not be seen" };
        let why = if x.is_finite() {
            format!("smallest size found is {} of its largest usual one", rounded(*x))
        } else {
            "other values of the parameters imitate it".to_owned()
        };
        writeln!(out, "  {:<26} {says}: {why}", e.name())?;
    }
    if let Some(why) = best.why_so_short() {
        write!(out, "{}", wrapped("  ", &why))?;
    }
    if open.len() > 1 && are_rivals {
        write!(out, "{}", wrapped("  ", &best.tells_apart()))?;
    }
    if found.len() > 1 {
        writeln!(out, "\nOthers, by what they are worth:")?;
    }
    for p in found.iter().skip(1) {
        writeln!(out, "  {:<16} {:>9}   {}", p.name, rounded(p.merit / best.merit), p.what)?;
    }
    if let Some(path) = &args.output {
        writeln!(out, "\n{}: the scenario; im simulate runs it on the model", path.display())?;
    }
    Ok(())
}

fn read(path: &std::path::Path) -> Result<Value, Failure> {
    let file = path.display();
    let text = read_text(path)?;
    let not = |e| FileKind::Diagnosis.mistaken(&text).unwrap_or_else(|| format!("not a diagnosis.json: {e}"));
    let d: Value = serde_json::from_str(&text).map_err(|e| Failure::Input(format!("{file}: {}", not(e))))?;
    if d["schema"] == 1 && d["ranking"].is_array() {
        Ok(d)
    } else {
        Err(Failure::Input(format!("{file}: not a diagnosis.json of im diagnose (schema 1 with a ranking)")))
    }
}
