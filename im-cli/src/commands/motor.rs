//! `im motor`: a first motor file from what stands on a nameplate.

use std::io::Write;
use std::path::PathBuf;

use im_model::{BaseParameter, DesignClass, ModelError, MotorFile, Nameplate, NameplateGuess, ParameterId, TerminalResistance};
use serde_json::json;

use crate::failure::Failure;
use crate::output::Outputs;
use crate::terminal::{rounded, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im motor --power-w 4000 --voltage-v 400 --current-a 8.1 --speed-rpm 1440 \\
           --power-factor 0.83 -o motor.toml

Voltage and current are line-to-line and line values, rms, of the connection in use, star or delta. Every \
parameter gets the tolerance of such a guess, which fits then respect; a measured stator resistance replaces \
its guess.")]
pub struct Args {
    /// Rated shaft power, W
    #[arg(long, value_name = "W")]
    power_w: f64,
    /// Rated line-to-line voltage, V rms
    #[arg(long, value_name = "V")]
    voltage_v: f64,
    /// Rated line current, A rms
    #[arg(long, value_name = "A")]
    current_a: f64,
    /// Rated speed, rpm
    #[arg(long, value_name = "RPM")]
    speed_rpm: f64,
    /// Power factor at the rated point
    #[arg(long, value_name = "COS")]
    power_factor: f64,
    /// Supply frequency, Hz
    #[arg(long, value_name = "HZ", default_value_t = 50.0)]
    frequency_hz: f64,
    /// Locked-rotor current over rated current, where the data sheet gives it
    #[arg(long, value_name = "RATIO")]
    locked_current: Option<f64>,
    /// Locked-rotor torque over rated torque, where the data sheet gives it
    #[arg(long, value_name = "RATIO", requires = "locked_current")]
    locked_torque: Option<f64>,
    /// Breakdown torque over rated torque, where the data sheet gives it
    #[arg(long, value_name = "RATIO")]
    breakdown_torque: Option<f64>,
    /// Design of the rotor: A, B, C or D (NEMA), N or H (IEC), or wound; shares the leakage between stator and rotor, alike without
    #[arg(long, value_name = "CLASS", value_parser = design)]
    design: Option<DesignClass>,
    /// Resistance between two terminals, measured with direct current, ohm
    #[arg(long, value_name = "OHM")]
    terminal_resistance_ohm: Option<f64>,
    /// Temperature of the winding at that measurement; R_s and R_r of the motor file are then those at it
    #[arg(long, value_name = "CELSIUS", requires = "terminal_resistance_ohm", allow_negative_numbers = true)]
    resistance_at_c: Option<f64>,
    /// What the machine is called
    #[arg(long, value_name = "NAME", default_value = "motor")]
    name: String,
    /// Where to write the motor; standard output without
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

fn design(name: &str) -> Result<DesignClass, String> {
    DesignClass::from_name(name).ok_or_else(|| format!("expected {}", DesignClass::NAMES))
}

impl Args {
    fn plate(&self) -> Nameplate {
        Nameplate {
            power_w: self.power_w,
            line_voltage_rms_v: self.voltage_v,
            line_current_rms_a: self.current_a,
            speed_rpm: self.speed_rpm,
            frequency_hz: self.frequency_hz,
            power_factor: self.power_factor,
            locked_rotor_current_ratio: self.locked_current,
            locked_rotor_torque_ratio: self.locked_torque,
            breakdown_torque_ratio: self.breakdown_torque,
            design: self.design,
        }
    }

    /// The motor file, and the guess that it was made from.
    fn motor(&self) -> Result<(MotorFile, NameplateGuess), Failure> {
        let resistance = self.terminal_resistance_ohm.map(|ohm| TerminalResistance { ohm, at_c: self.resistance_at_c });
        MotorFile::from_nameplate(&self.name, &self.plate(), resistance).map_err(|e| refused(&e))
    }
}

/// The options that the guess's quantities come from, and what to look at where one is not possible.
const OPTIONS: [(&str, &str, &str); 13] = [
    ("power_w", "--power-w", "the shaft power in W"),
    ("line_voltage_rms_v", "--voltage-v", "line to line, V rms"),
    ("line_current_rms_a", "--current-a", "of the line, A rms"),
    ("speed_rpm", "--speed-rpm", "the rated speed in rpm"),
    ("frequency_hz", "--frequency-hz", "of the supply"),
    ("power_factor", "--power-factor", "cos φ at the rated point, 0.83 for 83 %"),
    ("locked_rotor_current_ratio", "--locked-current", "over the rated current, as data sheets give it (I_A/I_N)"),
    (
        "locked_rotor_torque_ratio",
        "--locked-torque",
        "over the rated torque (T_A/T_N), and no more than the breakdown torque where that is given",
    ),
    (
        "breakdown_torque_ratio",
        "--breakdown-torque",
        "over the rated torque (T_K/T_N); the range is that of leakages a fifth to five times as usual",
    ),
    (
        "terminal_resistance_ohm",
        "--terminal-resistance-ohm",
        "in ohm, between two terminals; its heat at the rated current is a part of the losses that the nameplate leaves",
    ),
    ("temperature", "--resistance-at-c", "of the winding when its resistance was measured"),
    (
        "pole pairs",
        "--speed-rpm and --frequency-hz",
        "no machine turns faster than 60 times the frequency: is the speed in rpm, and the frequency right?",
    ),
    (
        "slip",
        "--speed-rpm and --frequency-hz",
        "give the rated speed, a little under the synchronous one, and the frequency that belongs to it",
    ),
];
const EFFICIENCY: &str = "--power-w, --voltage-v, --current-a and --power-factor contradict each other: power is the shaft's, \
                          in W (4 kW is 4000), voltage and current are the line's, of one connection (400 V, not 230 V, of a star on 400 V)";

/// A nameplate that is not possible: which option, and what to look at.
fn refused(e: &ModelError) -> Failure {
    let said = e.to_string();
    let place = OPTIONS.iter().find(|(quantity, ..)| said.starts_with(quantity));
    Failure::Input(match place {
        Some((_, option, what)) => format!("{option}: {said}; {what}"),
        None if said.starts_with("efficiency") => format!("{said}; {EFFICIENCY}"),
        None => format!("the nameplate: {said}"),
    })
}

/// Beyond what the guess may be off.
const DEEP_BARS: f64 = 1.5;

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(path) = &args.output {
        Outputs::default().file(path)?;
    }
    let (motor, guess) = args.motor()?;
    if let Some(path) = &args.output {
        motor.write(path)?;
    }
    let mut out = stdout();
    let values = BaseParameter::ALL.into_iter().zip(motor.machine.parameters().values());
    if args.json {
        let one = |(p, value): (BaseParameter, f64)| {
            let tolerance = motor.known.get(&ParameterId::Base(p)).map(|k| k.tolerance);
            (p.key().to_owned(), json!({"value": value, "tolerance": tolerance, "unit": p.unit()}))
        };
        let parameters: serde_json::Map<_, _> = values.map(one).collect();
        let report = json!({
            "schema": 1, "pole_pairs": motor.machine.pole_pairs(), "parameters": parameters, "winding_c": motor.winding_c,
            "design": motor.design.map(DesignClass::name), "locked_rotor_resistance_ratio": guess.locked_rotor_resistance_ratio,
        });
        writeln!(out, "{report}")?;
        return Ok(());
    }
    let Some(path) = &args.output else {
        write!(out, "{}", motor.to_toml())?;
        return Ok(());
    };
    writeln!(out, "{:<36} {:>11}", "parameter", "guess")?;
    for (p, value) in values {
        let tolerance = motor
            .known
            .get(&ParameterId::Base(p))
            .map_or(String::new(), |k| format!("  within a factor {} in 95 of 100", rounded(1.0 + k.tolerance)));
        writeln!(out, "{:<36} {:>11} {}{tolerance}", p.key(), rounded(value), p.unit())?;
    }
    let note = format!(
        "{}: {} pole pairs. Fits respect the tolerances; --fix NAME holds a value.",
        path.display(),
        motor.machine.pole_pairs()
    );
    write!(out, "{}", wrapped("", &note))?;
    if let Some(ratio) = guess.locked_rotor_resistance_ratio {
        let means = if ratio > DEEP_BARS { ": deep bars. Expect rotor_skin_effect where a start is recorded" } else { "" };
        let bars = format!("Locked, the rotor has {} times its resistance at the rated point{means}.", rounded(ratio));
        write!(out, "{}", wrapped("", &bars))?;
    }
    Ok(())
}
