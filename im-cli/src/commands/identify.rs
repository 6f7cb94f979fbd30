//! `im identify`: what the on-line identifiers make of a recording, and where a machine's parameters show.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use im_identify::online::{RegulationParameters, ReplayRow, ReplayScheme, SensitivityMap, replay};
use im_model::{MotorFile, Recording, write_atomically};

use crate::failure::Failure;
use crate::terminal::rounded;

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  im identify --motor motor.toml --sensitivity-map --out out
  im identify --motor motor.toml --online --data run.csv --out out

The map shows over speed and load which of R_req, L, R_s, L_f an adaptation can learn. --online runs a
recording through the identifiers of Kenné et al. (R_r; R_r and R_s) and Jadot et al., beginning with the
values of the motor file, and writes estimates.csv.")]
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
    /// The recording, in the canonical columns
    #[arg(long, value_name = "CSV")]
    data: Option<PathBuf>,
    /// The adaptation of Jadot et al. to use
    #[arg(long, value_enum, default_value_t = Scheme::TimeScale)]
    scheme: Scheme,
    /// Folder for sensitivity.svg and estimates.csv
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
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
    let motor = MotorFile::read(&args.motor)?;
    if let Some(dir) = &args.out {
        std::fs::create_dir_all(dir).map_err(|e| Failure::Input(format!("{}: cannot make the folder: {e}", dir.display())))?;
    }
    if args.sensitivity_map {
        map(&motor, args.out.as_deref())?;
    }
    if let (true, Some(data)) = (args.online, &args.data) {
        online(&motor, &Recording::read_csv(data)?, args)?;
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

fn map(motor: &MotorFile, out: Option<&Path>) -> Result<(), Failure> {
    let (p, rating, pole_pairs) = (motor.machine.parameters(), motor.rating, motor.machine.pole_pairs());
    let map = SensitivityMap {
        parameters: p.inverse_gamma().into(),
        pole_pairs,
        flux_vs: rating.rotor_flux_vs * p.magnetizing_inductance_h / p.rotor_inductance_h(),
        speed_max_rad_s: rating.synchronous_speed_rad_s(pole_pairs),
        torque_max_nm: rating.torque_nm,
    };
    let mut text = io::stdout().lock();
    writeln!(text, "Share of each parameter in what an adaptation sees (0.1 and less: hardly; 0.75 and more: it dominates)\n")?;
    writeln!(text, "{:<34} {}", "", RegulationParameters::<f64>::SYMBOLS.map(|s| format!("{s:>6}")).join(" "))?;
    for (name, speed, load) in POINTS {
        let shares = map.at(speed * map.speed_max_rad_s, load * map.torque_max_nm);
        writeln!(text, "{name:<34} {}", shares.map(|x| format!("{x:>6.2}")).join(" "))?;
    }
    if let Some(dir) = out {
        let path = dir.join("sensitivity.svg");
        let svg = map.svg(&format!("Where the parameters of {} show", motor.name));
        write_atomically(&path, |w| w.write_all(svg.as_bytes()))?;
        writeln!(text, "\n{}: the map", path.display())?;
    }
    Ok(())
}

/// Rows printed.
const SHOWN: usize = 8;

fn online(motor: &MotorFile, recording: &Recording, args: &Args) -> Result<(), Failure> {
    let rows = replay(motor, recording, args.scheme.into(), |_| true)
        .map_err(|e| Failure::Input(format!("{}: {e}; the identifiers need it", recording.name)))?;
    let p = motor.machine.parameters();
    let start = RegulationParameters::from(p.inverse_gamma());
    // R_req to R_r: (L_r/L_m)².
    let to_rotor = p.rotor_resistance_ohm / start.rotor_resistance_ohm;
    let mut text = io::stdout().lock();
    writeln!(text, "{}: {} rows of {} s", recording.name, recording.len(), rounded(recording.sample_time_s))?;
    writeln!(
        text,
        "\n{:>8} | {:>8} | {:>8} {:>8} | {:>8} {:>8} {:>8} {:>8} {:>8}",
        "t", "R_r", "R_r", "R_s", "R_r", "L", "R_s", "L_f", "known"
    )?;
    writeln!(text, "{:>8} | {:>8} | {:>17} | {:>44}", "s", "Kenné", "Kenné, both", "Jadot")?;
    let share =
        |n: usize, adapting: &dyn Fn(&ReplayRow) -> bool| 100.0 * rows.iter().filter(|r| adapting(r)).count() as f64 / n as f64;
    for k in 0..=SHOWN {
        let Some(row) = rows.get((rows.len() - 1) * k / SHOWN) else { continue };
        let [r_req, l, r_s, l_f] = row.regulation.values;
        let mark = |x: f64, moves: bool| format!("{}{}", rounded(x), if moves { ' ' } else { '*' });
        writeln!(
            text,
            "{:>8} | {:>8} | {:>8} {:>8} | {:>8} {:>8} {:>8} {:>8} {:>8}",
            rounded(row.time_s),
            mark(row.rotor.values[0], row.rotor.adapting[0]),
            mark(row.both.values[0], row.both.adapting[0]),
            mark(row.both.values[1], row.both.adapting[1]),
            mark(r_req * to_rotor, row.regulation.adapting[0]),
            mark(l, row.regulation.adapting[1]),
            mark(r_s, row.regulation.adapting[2]),
            mark(l_f, row.regulation.adapting[3]),
            rounded(row.regulation.excitation.smallest),
        )?;
    }
    let n = rows.len().max(1);
    writeln!(
        text,
        "\n* held: too little excitation, or not in the scheme. known: smallest eigenvalue of the last second's information"
    )?;
    writeln!(
        text,
        "adapting: R_r {:.0} %, R_s {:.0} %, the four {:.0} % of the time",
        share(n, &|r| r.rotor.adapting[0]),
        share(n, &|r| r.both.adapting[1]),
        share(n, &|r| !r.regulation.status.is_frozen()),
    )?;
    if let Some(dir) = &args.out {
        let path = dir.join("estimates.csv");
        write_atomically(&path, |w| csv(w, &rows, to_rotor))?;
        writeln!(text, "{}: every row", path.display())?;
    }
    Ok(())
}

fn csv(w: &mut dyn Write, rows: &[ReplayRow], to_rotor: f64) -> io::Result<()> {
    writeln!(
        w,
        "t_s,kenne_rotor_resistance_ohm,kenne_adapting,kenne_both_rotor_resistance_ohm,kenne_both_stator_resistance_ohm,\
         kenne_both_rotor_adapting,kenne_both_stator_adapting,kenne_both_smallest_eigenvalue,jadot_rotor_resistance_ohm,\
         jadot_magnetizing_inductance_h,jadot_stator_resistance_ohm,jadot_leakage_inductance_h,jadot_adapting,\
         jadot_smallest_eigenvalue,jadot_information_rotor_resistance,jadot_information_magnetizing_inductance,\
         jadot_information_stator_resistance,jadot_information_leakage_inductance"
    )?;
    for r in rows {
        let [r_req, l, r_s, l_f] = r.regulation.values;
        let [a, b, c, d] = r.regulation.excitation.of_each;
        let one = |x: bool| u8::from(x);
        writeln!(
            w,
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
            r.time_s,
            r.rotor.values[0],
            one(r.rotor.adapting[0]),
            r.both.values[0],
            r.both.values[1],
            one(r.both.adapting[0]),
            one(r.both.adapting[1]),
            r.both.excitation.smallest,
            r_req * to_rotor,
            l,
            r_s,
            l_f,
            one(!r.regulation.status.is_frozen()),
            r.regulation.excitation.smallest,
            a,
            b,
            c,
            d
        )?;
    }
    Ok(())
}
