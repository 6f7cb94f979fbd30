//! `im losses`: losses segregated from no-load and load tests.

use std::io::Write;
use std::path::PathBuf;

use im_diagnose::format::side_by_side;
use im_diagnose::intake::SteadyTable;
use im_diagnose::losses::{ByModel, ConstantBy, Estimate, LoadPoint, Losses, ModelPoint, Resistance, StrayBy, segregate};
use im_model::MotorFile;

use crate::failure::Failure;
use crate::spinner::spinning;
use crate::terminal::{WIDTH, rounded, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im losses --motor motor.toml --table no_load.csv --table load.csv \\
    --terminal-resistance-ohm 2.86 --resistance-at-c 23 --winding-c 78

Segregates the losses as IEC 60034-2-1 (method 2-1-1B) and IEEE 112 (method B) do: stator copper at the \
temperature of the winding, rotor, iron, friction and windage, and the additional load loss by regression \
over the square of the torque. Beside it stand the losses of a model with these losses that is fitted to all \
rows. Tables as for im fit; a column winding_C holds temperatures row by row.")]
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
    let model = spinning("fitting", || ByModel::of(&motor, &tables, resistance));
    let mut out = stdout();
    if args.json {
        let (by_model, refused) = (model.as_ref().ok(), model.as_ref().err().map(ToString::to_string));
        writeln!(out, "{}", serde_json::json!({"schema": 1, "losses": losses, "by_model": by_model, "no_model": refused}))?;
        return Ok(());
    }
    print(&mut out, &losses)?;
    match model {
        Ok(model) => print_model(&mut out, &losses, &model)?,
        Err(e) => write!(out, "{}", wrapped("! ", &format!("No model could be fitted to the tables: {e}.")))?,
    }
    for remark in &losses.remarks {
        write!(out, "{}", wrapped("! ", remark))?;
    }
    Ok(())
}

fn print(out: &mut dyn Write, l: &Losses) -> std::io::Result<()> {
    let w = |e: Estimate| plus_minus(e) + " W";
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
    if l.points.is_empty() {
        return Ok(());
    }
    let row = |name: &str, cell: &dyn Fn(&LoadPoint) -> String| (name.to_owned(), l.points.iter().map(cell).collect());
    let mut rows: Vec<Row> = vec![
        row("torque, Nm", &|p| p.torque_nm.map_or_else(|| "–".into(), rounded)),
        row("slip, %", &|p| format!("{:.2}", 100.0 * p.slip)),
        row("winding, °C", &|p| rounded(p.winding_c)),
        row("input, W", &|p| rounded(p.input_w)),
    ];
    rows.extend(PARTS.map(|(name, of, _)| row(&format!("{name}, W"), &|p| plus_minus(of(p)))));
    rows.push(row("efficiency, %", &|p| percent(p.efficiency)));
    rows.push(row("direct, %", &|p| p.direct_efficiency.map_or_else(|| "–".into(), percent)));
    writeln!(out)?;
    write!(out, "{}", side_by_side(&rows, WIDTH))
}

/// A part of the losses by its name, of the regression and of the model.
type Part = (&'static str, fn(&LoadPoint) -> Estimate, fn(&ModelPoint) -> Estimate);

const PARTS: [Part; 6] = [
    ("stator", |p| p.stator_w, |p| p.stator_w),
    ("rotor", |p| p.rotor_w, |p| p.rotor_w),
    ("iron", |p| p.iron_w, |p| p.iron_w),
    ("friction", |p| p.friction_windage_w, |p| p.friction_windage_w),
    ("stray", |p| p.stray_w, |p| p.stray_w),
    ("losses", |p| p.total_w, |p| p.total_w),
];

/// A quantity, and what it is at each load point.
type Row = (String, Vec<String>);

fn plus_minus(e: Estimate) -> String {
    if e.half_95.is_finite() { format!("{} ± {}", rounded(e.value), rounded(e.half_95)) } else { OPEN.into() }
}

fn percent(e: Estimate) -> String {
    if e.half_95.is_finite() { format!("{:.2} ± {:.2}", 100.0 * e.value, 100.0 * e.half_95) } else { OPEN.into() }
}

/// What the readings leave open.
const OPEN: &str = "–";

/// More than the noise of the instruments, in σ.
const UNEXPLAINED: f64 = 2.0;

fn print_model(out: &mut dyn Write, l: &Losses, m: &ByModel) -> std::io::Result<()> {
    if m.points.is_empty() {
        return Ok(());
    }
    writeln!(out, "\nby a model with these losses, fitted to all rows (error {} σ of the instruments):", rounded(m.error))?;
    let row = |name: &str, cell: &dyn Fn(&ModelPoint) -> String| (name.to_owned(), m.points.iter().map(cell).collect());
    let mut rows: Vec<Row> =
        vec![row("torque, Nm", &|p| rounded(p.torque_nm)), row("slip, %", &|p| format!("{:.2}", 100.0 * p.slip))];
    rows.extend(PARTS.map(|(name, _, of)| row(&format!("{name}, W"), &|p| plus_minus(of(p)))));
    rows.push(row("efficiency, %", &|p| if p.torque_nm == 0.0 { "–".into() } else { percent(p.efficiency) }));
    write!(out, "{}", side_by_side(&rows, WIDTH))?;
    if m.error > UNEXPLAINED {
        let text = "The model leaves more than the instruments' errors: a further effect, or a row or a temperature that is not right. im diagnose with the same tables looks for it.";
        write!(out, "{}", wrapped("! ", text))?;
    }
    if m.points.len() == l.points.len() {
        let apart = |(_, a, b): &Part| {
            l.points.iter().zip(&m.points).any(|(p, q)| {
                let (a, b) = (a(p), b(q));
                (a.value - b.value).abs() > a.half_95.hypot(b.half_95)
            })
        };
        let differ: Vec<&str> = PARTS.iter().filter(|p| apart(p)).map(|p| p.0).collect();
        let text = match differ.as_slice() {
            // A model that misses the rows agrees with nothing.
            [] if m.error > UNEXPLAINED => return Ok(()),
            [] => "Regression and model agree within their intervals.".to_owned(),
            _ if m.error > UNEXPLAINED => format!(
                "Regression and model differ by more than their intervals in: {}. The model misses the rows, the regression takes them as they are.",
                differ.join(", ")
            ),
            _ => format!(
                "Regression and model differ by more than their intervals in: {}. The standard takes the iron's voltage behind the resistance alone, and \
                 counts the stray load without load as iron loss.",
                differ.join(", ")
            ),
        };
        write!(out, "{}", wrapped("", &text))?;
    }
    Ok(())
}
