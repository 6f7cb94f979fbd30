//! `im commission`: a drive finds the parameters of its motor, shown on a simulated one.

use std::io::{self, Write};
use std::path::PathBuf;

use im_control::Commissioned;
use im_control::commissioning::{Comparison, Found, SimulatedCommissioning, bench, commission};
use im_model::MotorFile;
use im_model::simulation::Scenario;
use serde_json::json;

use crate::failure::Failure;
use crate::interrupt::together;
use crate::output::Outputs;
use crate::terminal::{Progress, rounded, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im commission --motor examples/motor.toml -o found.toml --record run.csv
  im diagnose --motor found.toml --train run.csv

The commissioning knows the motor's rating, rated current, pole pairs, voltage delay and switching period, and sees measured currents, \
commanded voltages and the dc link. The bench is a bridge at 10 kHz with 2 us of dead time and 1 V of drop, current \
noise of 0.4 % and a converter's step of 0.2 % of the rated current; --scenario gives another inverter, sensors, load and \
sampling time. An interval holds the truth in 95 of 100 cases for what the data show; errors of the sensors' gain are not \
in it. The recording holds the three seconds in which the shaft begins to turn, at every sample, with \
the speed of the bench's own sensor.")]
pub struct Args {
    /// The machine that is to be found: a motor.toml with its effects
    #[arg(long, value_name = "FILE")]
    motor: PathBuf,
    /// Inverter, sensors, load and sampling time: a scenario.toml; its source and its duration are not used
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Seed of the sensor noise
    #[arg(long)]
    seed: Option<u64>,
    /// Where to write the motor that was found, with intervals as tolerances
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Where to write the recording, as CSV
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut outputs = Outputs::beside([&args.motor].into_iter().chain(&args.scenario));
    outputs.file(&args.output)?;
    args.record.as_deref().map_or(Ok(()), |path| outputs.file(path))?;
    let motor = MotorFile::read(&args.motor)?;
    let mut scenario = args.scenario.as_ref().map_or_else(|| Ok(bench(&motor)), Scenario::read)?;
    scenario.record_every = 1;
    if let Some(seed) = args.seed {
        scenario.sensors.seed = seed;
    }
    let mut progress = Progress::new("commissioning");
    let mut shown = |done, all| progress.show(done, all);
    let result = commission(&motor, &scenario, &mut shown);
    progress.finish();
    let input = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", args.motor.display()));
    let done = result.map_err(|e| input(&e))?;
    if let (Err(_), Some(path)) = (&done.outcome, &args.record) {
        done.record().write_csv(path)?;
    }
    let found = done.outcome.map_err(|fault| input(&format!("the commissioning ended early: {fault}")))?;
    let file = found.motor_file(&motor.name, &done.plan).map_err(|e| input(&e))?;
    together(|| {
        file.write(&args.output)?;
        args.record.as_deref().map_or(Ok(()), |path| done.record().write_csv(path))
    })?;
    let rows = done.comparisons(&found, &motor.machine, &scenario.inverter);
    Ok(if args.json { as_json(args, &done, &found, &rows) } else { table(args, &done, &found, &rows) }?)
}

fn as_json(args: &Args, done: &SimulatedCommissioning, found: &Commissioned, rows: &[Comparison]) -> io::Result<()> {
    let one = |c: &Comparison| {
        let value = json!({"value": c.found.value, "half_width": c.found.half_width, "true": c.truth, "unit": c.unit, "error": c.error()});
        (c.symbol.to_owned(), value)
    };
    let parameters: serde_json::Map<_, _> = rows.iter().map(one).collect();
    let curve: Vec<_> = found.magnetizing.iter().map(|p| json!({"flux_vs": p.flux_vs, "current_a": p.current_a})).collect();
    let pair = |x: [Found; 2]| {
        let [alpha, beta] = x.map(|f| json!({"value": f.value, "half_width": f.half_width}));
        json!({"alpha": alpha, "beta": beta})
    };
    let summary = json!({
        "schema": 1,
        "output": args.output.display().to_string(),
        "drive_time_s": found.drive_time_s,
        "peak_current_a": done.peak_current_a,
        "current_limit_a": done.plan.current_max_a,
        "parameters": parameters,
        "magnetizing_curve": curve,
        "resistance_asymmetry_ohm": pair(found.resistance_asymmetry_ohm),
        "voltage_offset_v": pair(found.voltage_offset_v),
    });
    writeln!(stdout(), "{summary}")
}

fn table(args: &Args, done: &SimulatedCommissioning, found: &Commissioned, rows: &[Comparison]) -> io::Result<()> {
    let mut out = stdout();
    writeln!(out, "{:<18} {:>10} {:>11} {:>10} {:>9}", "parameter", "found", "interval", "true", "error")?;
    for c in rows {
        let name = if c.unit.is_empty() { c.symbol.to_owned() } else { format!("{}, {}", c.symbol, c.unit) };
        let (value, half) = (rounded(c.found.value), rounded(c.found.half_width));
        let outside = if c.found.covers(c.truth) { "" } else { "  outside" };
        writeln!(
            out,
            "{name:<18} {value:>10} {:>11} {:>10} {:>+7.2} %{outside}",
            format!("± {half}"),
            rounded(c.truth),
            100.0 * c.error()
        )?;
    }
    let curve: Vec<String> =
        found.magnetizing.iter().map(|p| format!("{} Vs at {} A", rounded(p.flux_vs), rounded(p.current_a))).collect();
    let note = format!(
        "Magnetizing curve: {}. R_R, L_sigma and L_M are of the inverse-Gamma circuit, which is what the terminals show; the file divides the leakage evenly, which \
         nothing tells. Errors of D and tau_C are shares of what takes rated torque at rated speed.",
        curve.join(", ")
    );
    write!(out, "{}", wrapped("", &note))?;
    if let Some(share) = found.unlike_phases() {
        let note = format!(
            "The phases are not alike: the stator resistance differs by up to {:.1} % with the direction of the current. The winding, a lead, the voltage or the current \
             sensor of one phase may be the cause; im diagnose with a recording under load tells which. The drive takes it into account, the file does not hold it.",
            100.0 * share
        );
        write!(out, "{}", wrapped("", &note))?;
    }
    let (time, peak, limit) = (rounded(found.drive_time_s), rounded(done.peak_current_a), rounded(done.plan.current_max_a));
    writeln!(out, "{time} s of drive time, peak current {peak} A with a limit of {limit} A")?;
    writeln!(out, "{}: the motor that was found", args.output.display())?;
    if let Some(path) = &args.record {
        writeln!(
            out,
            "{}: {} rows; im diagnose --motor {} --train {}",
            path.display(),
            done.record().len(),
            args.output.display(),
            path.display()
        )?;
    }
    Ok(())
}
