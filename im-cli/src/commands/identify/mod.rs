//! `im identify`: what the on-line identifiers make of a recording, and where a machine's parameters show.

mod online;

use std::io::Write;
use std::path::{Path, PathBuf};

use im_identify::online::{RegulationParameters, ReplayScheme, SensitivityMap};
use im_model::{MotorFile, write_atomically};
use serde_json::json;

use crate::failure::Failure;
use crate::output::Outputs;
use crate::terminal::stdout;

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  im identify --motor motor.toml --sensitivity-map --out out
  im identify --motor motor.toml --online --data run.csv --out out

The map shows over speed and load which of R_req, L, R_s, L_f an adaptation can learn. --online runs a \
recording through the identifiers of Kenné et al. (R_r; R_r and R_s) and Jadot et al., beginning with the \
values of the motor file, and writes estimates.csv and estimates.svg. Files in other columns are \
described by a recording.toml, as for im compare; rows that its checks leave out are lost samples.")]
#[command(group(clap::ArgGroup::new("what").required(true).args(["sensitivity_map", "online"])))]
pub struct Args {
    /// The motor: a motor.toml
    #[arg(long, value_name = "FILE")]
    motor: PathBuf,
    /// Draw where in the plane of speed and load each parameter shows
    #[arg(long)]
    sensitivity_map: bool,
    /// Replay a recording through the on-line identifiers
    #[arg(long, requires = "data")]
    online: bool,
    /// The recording, or its recording.toml
    #[arg(long, value_name = "FILE")]
    data: Option<PathBuf>,
    /// What the columns of the recording mean, instead of the recording.toml beside it
    #[arg(long, value_name = "FILE")]
    mapping: Option<PathBuf>,
    /// The adaptation of Jadot et al. to use
    #[arg(long, value_enum, default_value_t = Scheme::TimeScale)]
    scheme: Scheme,
    /// Folder for sensitivity.svg, estimates.csv and estimates.svg
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Scheme {
    /// Slow, all four parameters
    TimeScale,
    /// Fast, all four parameters
    TimeVarying,
    /// R_req and L only, with a dead zone
    Reduced,
}

impl From<Scheme> for ReplayScheme {
    fn from(s: Scheme) -> Self {
        match s {
            Scheme::TimeScale => Self::TimeScale,
            Scheme::TimeVarying => Self::TimeVarying,
            Scheme::Reduced => Self::Reduced,
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(dir) = &args.out {
        let read = Outputs::beside([&args.motor].into_iter().chain(&args.mapping));
        let names = ["sensitivity.svg", "estimates.csv", "estimates.svg"];
        let (map, online) = names.split_at(1);
        let written = if args.sensitivity_map { map } else { online };
        read.and_recordings(&args.data, args.mapping.as_deref()).folder(dir, written)?;
    }
    let motor = MotorFile::read(&args.motor)?;
    if args.sensitivity_map {
        map(&motor, args.out.as_deref(), args.json)?;
    }
    if let (true, Some(data)) = (args.online, &args.data) {
        online::run(&motor, data, args)?;
    }
    Ok(())
}

/// The operating points that the terminal shows: shares of rated speed and torque.
const POINTS: [(&str, f64, f64); 6] = [
    ("rated speed, rated load", 1.0, 1.0),
    ("rated speed, a tenth of the load", 1.0, 0.1),
    ("half speed, half load", 0.5, 0.5),
    ("a tenth of the speed, rated load", 0.1, 1.0),
    ("1 % of the speed, rated load", 0.01, 1.0),
    ("1 % of the speed, no load", 0.01, 0.0),
];

fn map(motor: &MotorFile, out: Option<&Path>, json: bool) -> Result<(), Failure> {
    let (p, rating, pole_pairs) = (motor.machine.parameters(), motor.rating, motor.machine.pole_pairs());
    let map = SensitivityMap {
        parameters: p.inverse_gamma().into(),
        pole_pairs,
        flux_vs: rating.rotor_flux_vs * p.magnetizing_inductance_h / p.rotor_inductance_h(),
        speed_max_rad_s: rating.synchronous_speed_rad_s(pole_pairs),
        torque_max_nm: rating.torque_nm,
    };
    let at = |speed: f64, load: f64| map.at(speed * map.speed_max_rad_s, load * map.torque_max_nm);
    let picture = out.map(|dir| dir.join("sensitivity.svg"));
    if let Some(path) = &picture {
        let svg = map.svg(&format!("Where the parameters of {} show", motor.name));
        write_atomically(path, |w| w.write_all(svg.as_bytes()))?;
    }
    let mut text = stdout();
    if json {
        let point = |&(name, speed, load): &(&str, f64, f64)| json!({"name": name, "speed_over_rated": speed, "torque_over_rated": load, "share": at(speed, load)});
        let points: Vec<_> = POINTS.iter().map(point).collect();
        let symbols = RegulationParameters::<f64>::SYMBOLS;
        return Ok(writeln!(text, "{}", json!({"schema": 1, "machine": motor.name, "parameters": symbols, "points": points}))?);
    }
    writeln!(text, "Share of each parameter in what an adaptation sees (0.1 and less: hardly; 0.75 and more: it dominates)\n")?;
    writeln!(text, "{:<34} {}", "", RegulationParameters::<f64>::SYMBOLS.map(|s| format!("{s:>6}")).join(" "))?;
    for (name, speed, load) in POINTS {
        let shares = at(speed, load);
        writeln!(text, "{name:<34} {}", shares.map(|x| format!("{x:>6.2}")).join(" "))?;
    }
    if let Some(path) = picture {
        writeln!(text, "\n{}: the map", path.display())?;
    }
    Ok(())
}
