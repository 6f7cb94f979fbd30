//! `im simulate`: a machine through a scenario, to a recording.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use im_control::of_scenario;
use im_model::simulation::{Run, Scenario, Simulation, SimulationError};
use im_model::{ModelError, MotorFile, Recording, read_text, write_atomically};
use serde_json::json;

use crate::failure::Failure;
use crate::interrupt::together;
use crate::output::Outputs;
use crate::terminal::{Progress, rounded, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im simulate --motor examples/motor.toml --scenario examples/scenario_dol.toml -o run.csv

The recording has the columns t_s, u_alpha_V, u_beta_V, i_alpha_A, i_beta_A, omega_m_rad_s \
and tau_load_Nm: the voltage is the average commanded over the sample that begins at t_s. From a motor \
with [prediction], as im diagnose writes one, i_band_A and omega_band_rad_s come last: half widths of the bands \
that hold 95 % of the readings of such recordings as the motor was fitted to.")]
pub struct Args {
    /// The machine: a motor.toml
    #[arg(long, value_name = "FILE")]
    motor: PathBuf,
    /// What happens to it: a scenario.toml
    #[arg(long, value_name = "FILE")]
    scenario: PathBuf,
    /// Where to write the recording, as CSV; - for stdout
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Write torque, fluxes, speeds and temperatures inside the machine too, as CSV
    #[arg(long, value_name = "FILE")]
    internals: Option<PathBuf>,
    /// Seed of the sensor noise, instead of the scenario's
    #[arg(long)]
    seed: Option<u64>,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut outputs = Outputs::beside([&args.motor, &args.scenario].into_iter().chain(&recording_of(&args.scenario)));
    outputs.file(&args.output)?;
    args.internals.as_deref().map_or(Ok(()), |path| outputs.file(path))?;
    let motor = MotorFile::read(&args.motor)?;
    let mut scenario = Scenario::read(&args.scenario)?;
    if let Some(seed) = args.seed {
        scenario.sensors.seed = seed;
    }
    let file = args.scenario.display();
    let mut controller = of_scenario(&scenario, &motor, least_current).map_err(|e| Failure::Input(format!("{file}: {e}")))?;
    let mut progress = Progress::new("simulating");
    let mut shown = |done, all| progress.show(done, all);
    let mut simulation = Simulation::new(&motor.machine, &scenario).with_progress(&mut shown);
    if args.internals.is_some() {
        simulation = simulation.with_internals();
    }
    if let Some(controller) = &mut controller {
        simulation = simulation.controlled_by(controller.as_mut());
    }
    let result = simulation.run();
    progress.then("writing");
    let to_stdout = args.output.as_os_str() == "-";
    if to_stdout || result.is_err() {
        // Two writers on one terminal would garble each other.
        progress.finish();
    }
    let run = result.map_err(|e| refused(args, &e))?;
    let bands = motor.prediction.map_or_else(Vec::new, |p| p.columns(&run.recording));
    if to_stdout {
        let mut out = io::BufWriter::new(io::stdout().lock());
        run.recording.to_csv_with(&bands, &mut out)?;
        out.flush()?;
    } else {
        together(|| {
            write_atomically(&args.output, |out| run.recording.to_csv_with(&bands, out))?;
            args.internals.as_deref().map_or(Ok(()), |path| run.write_internals_csv(path))
        })?;
    }
    progress.finish();
    if to_stdout { Ok(()) } else { Ok(summary(args, &motor, &run, &bands)?) }
}

/// The law of `mtpa`.
#[cfg(feature = "design")]
fn least_current(motor: &MotorFile) -> Result<im_control::MtpaLaw<f64>, String> {
    let refused = |e: String| format!("no law of least current for this motor: {e}");
    let law = im_design::mtpa::laws::for_drive(motor).map_err(|e| refused(e.to_string()))?;
    im_control::MtpaLaw::series(law.torque_n_m, &law.current, &law.slip).map_err(|e| refused(e.to_string()))
}

#[cfg(not(feature = "design"))]
fn least_current(_: &MotorFile) -> Result<im_control::MtpaLaw<f64>, String> {
    Err("mtpa needs a law of least current: build this program with its feature \"design\"".to_owned())
}

/// The recording that a scenario runs again, if it is one that does.
fn recording_of(scenario: &Path) -> Option<PathBuf> {
    let table: toml::Table = read_text(scenario).ok()?.parse().ok()?;
    Some(scenario.with_file_name(table.get("recording")?.get("file")?.as_str()?))
}

fn refused(args: &Args, e: &SimulationError) -> Failure {
    let (motor, scenario) = (args.motor.display(), args.scenario.display());
    Failure::Input(match e {
        SimulationError::Model(ModelError::TooStiff { .. }) => format!("{motor} in {scenario}: {e}"),
        SimulationError::Diverged { .. } => format!("{scenario} with {motor}: {e}"),
        e => format!("{scenario}: {e}"),
    })
}

fn summary(args: &Args, motor: &MotorFile, run: &Run, bands: &[(&str, Vec<f64>)]) -> io::Result<()> {
    let r = &run.recording;
    let speed = run.state.omega_m;
    let peak = r.i_s.iter().map(|i| i.norm()).fold(0.0, f64::max);
    let file = args.output.display();
    let mut out = stdout();
    if args.json {
        let mut summary = json!({
            "schema": 1,
            "output": file.to_string(),
            "machine": motor.name,
            "effects": motor.machine.effects().active().map(|id| id.name()).collect::<Vec<_>>(),
            "rows": r.len(),
            "sample_time_s": r.sample_time_s,
            "duration_s": duration(r),
            "peak_current_a": peak,
            "final_speed_rad_s": speed,
        });
        if !bands.is_empty() {
            summary["bands"] = json!(bands.iter().map(|b| b.0).collect::<Vec<_>>());
        }
        return writeln!(out, "{summary}");
    }
    let rpm = speed * 60.0 / (2.0 * core::f64::consts::PI);
    writeln!(out, "{file}: {} rows, {} s at {} Hz", r.len(), rounded(duration(r)), rounded(1.0 / r.sample_time_s))?;
    writeln!(out, "final speed {speed:.2} rad/s ({rpm:.1} rpm), peak current {peak:.1} A")?;
    if !bands.is_empty() {
        let names = bands.iter().map(|b| b.0).collect::<Vec<_>>().join(", ");
        let held = "95 % of readings lie within plus or minus this, as far as recordings are like those of the fit";
        write!(out, "{}", wrapped("", &format!("{names}: {held}")))?;
    }
    if let Some(path) = &args.internals {
        writeln!(out, "{}: torque, fluxes, speeds, temperatures at the same rows", path.display())?;
    }
    Ok(())
}

fn duration(r: &Recording) -> f64 {
    // Free of the rounding of the product.
    (r.sample_time_s * r.len() as f64 * 1e9).round() / 1e9
}
