//! `im losses`: losses segregated from no-load and load tests.

use std::io::Write;
use std::path::PathBuf;

use im_diagnose::intake::SteadyTable;
use im_diagnose::losses::{ConstantBy, Estimate, Losses, Resistance, StrayBy, segregate};
use im_model::MotorFile;

use crate::failure::Failure;
use crate::terminal::{rounded, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im losses --motor motor.toml --table no_load.csv --table load.csv \\
    --terminal-resistance-ohm 2.86 --resistance-at-c 23 --winding-c 78

Segregates the losses as IEC 60034-2-1 (method 2-1-1B) and IEEE 112 (method B) do: stator copper at the \
temperature of the winding, rotor, iron, friction and windage, and the additional load loss by regression \
over the square of the torque. Tables as for im fit; a column winding_C holds temperatures row by row.")]
pub struct Args {
    /// The motor: pole pairs, frequency and voltage are its own
    #[arg(long, value_name = "FILE")]
    motor: PathBuf,
    /// A no-load test over voltage, a load test with torque and speed; give both
    #[arg(long, value_name = "FILE", required = true)]
    table: Vec<PathBuf>,
    /// What the columns of the tables mean, where they are foreign
    #[arg(long, value_name = "FILE")]
    mapping: Option<PathBuf>,
    /// Resistance between two terminals, measured with direct current; that of the motor file without
    #[arg(long, value_name = "OHM")]
    terminal_resistance_ohm: Option<f64>,
    /// Temperature of the winding at that measurement
    #[arg(long, value_name = "CELSIUS", default_value_t = 25.0, requires = "terminal_resistance_ohm")]
    resistance_at_c: f64,
    /// Temperature of the winding in the tests, where no column says it; that of the resistance without
    #[arg(long, value_name = "CELSIUS", requires = "terminal_resistance_ohm")]
    winding_c: Option<f64>,
    /// What the resistance may be off by, per cent
    #[arg(long, value_name = "PERCENT", default_value_t = 0.5)]
    resistance_class: f64,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

impl Args {
    fn resistance(&self) -> Result<Option<Resistance>, Failure> {
        let Some(terminal_ohm) = self.terminal_resistance_ohm else { return Ok(None) };
        let within = |name: &str, x: f64, low: f64, high: f64| match x > low && x <= high {
            true => Ok(x),
            false => Err(Failure::Input(format!("{name} {x}: expected more than {low}, at most {high}"))),
        };
        let at_c = within("--resistance-at-c", self.resistance_at_c, -100.0, 300.0)?;
        Ok(Some(Resistance {
            terminal_ohm: within("--terminal-resistance-ohm", terminal_ohm, 0.0, 1e6)?,
            at_c,
            warm_c: within("--winding-c", self.winding_c.unwrap_or(at_c), -100.0, 300.0)?,
            class_percent: within("--resistance-class", self.resistance_class, 0.0, 100.0)?,
        }))
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let motor = MotorFile::read(&args.motor)?;
    let resistance = args.resistance()?;
    let read = |path: &PathBuf| SteadyTable::read(path, args.mapping.as_deref());
    let tables = args.table.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let losses = segregate(&motor, &tables, resistance).map_err(|e| {
        Failure::Input(format!("{}: {e}", args.table.iter().map(|t| t.display().to_string()).collect::<Vec<_>>().join(", ")))
    })?;
    let mut out = stdout();
    if args.json {
        writeln!(out, "{}", serde_json::json!({"schema": 1, "losses": losses}))?;
        return Ok(());
    }
    print(&mut out, &losses)?;
    Ok(())
}

fn print(out: &mut dyn Write, l: &Losses) -> std::io::Result<()> {
    let w = |e: Estimate| format!("{} ± {} W", rounded(e.value), rounded(e.half_95));
    writeln!(out, "without load, at rated voltage (± 95 %):")?;
    match l.constant_by {
        ConstantBy::Voltages => {
            writeln!(out, "  iron                    {}", w(l.iron_w))?;
            writeln!(out, "  friction and windage    {}", w(l.friction_windage_w))?;
        }
        ConstantBy::OneVoltage | ConstantBy::LoadPoints => {
            writeln!(out, "  iron, friction, windage {}", w(l.constant_w))?;
        }
    }
    if l.stray_by == StrayBy::Regression {
        let a = l.stray_w_per_nm2;
        writeln!(out, "additional load loss      ({} ± {}) W/(Nm)² · T²", rounded(a.value), rounded(a.half_95))?;
        writeln!(out, "  what T = 0 leaves       {}; correlation {:.3}", w(l.intercept_w), l.correlation.unwrap_or(f64::NAN))?;
    }
    if !l.points.is_empty() {
        let head = [
            "torque",
            "slip",
            "winding",
            "input",
            "stator",
            "rotor",
            "iron",
            "friction",
            "stray",
            "losses",
            "efficiency",
            "direct",
        ];
        let units = ["Nm", "%", "°C", "W", "W", "W", "W", "W", "W", "W", "%", "%"];
        writeln!(out)?;
        for line in [head, units] {
            writeln!(out, "{}", line.map(|x| format!("{x:>15}")).concat().trim_end())?;
        }
    }
    for p in &l.points {
        let e = |e: Estimate| format!("{} ± {}", rounded(e.value), rounded(e.half_95));
        let percent = |e: Estimate| format!("{:.2} ± {:.2}", 100.0 * e.value, 100.0 * e.half_95);
        let cells = [
            p.torque_nm.map_or_else(|| "–".into(), rounded),
            format!("{:.2}", 100.0 * p.slip),
            rounded(p.winding_c),
            rounded(p.input_w),
            e(p.stator_w),
            e(p.rotor_w),
            e(p.iron_w),
            e(p.friction_windage_w),
            e(p.stray_w),
            e(p.total_w),
            percent(p.efficiency),
            p.direct_efficiency.map_or_else(|| "–".into(), percent),
        ];
        writeln!(out, "{}", cells.map(|x| format!("{x:>15}")).concat().trim_end())?;
    }
    for remark in &l.remarks {
        write!(out, "{}", wrapped("! ", remark))?;
    }
    Ok(())
}
