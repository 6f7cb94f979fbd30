//! `im effects`: the library of physical effects, and the card of each.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use im_model::effects::{ParameterInfo, Role, ScaleOf};
use im_model::{EffectId, MotorFile};
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::terminal::{rounded, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
pub struct Args {
    /// Print as JSON
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    what: Option<What>,
}

#[derive(clap::Subcommand)]
enum What {
    /// List them, as `im effects` alone does
    List,
    /// Show the card of an effect: what it is, how it shows, its rivals, its parameters
    Show {
        /// The effect's identifier, as listed by `im effects`
        #[arg(value_name = "EFFECT", hide_possible_values = true, value_parser = effect_parser())]
        effect: EffectId,
        /// Give typical sizes in this machine's units
        #[arg(long, value_name = "FILE")]
        motor: Option<PathBuf>,
    },
}

pub fn effect_parser() -> impl TypedValueParser<Value = EffectId> {
    PossibleValuesParser::new(EffectId::ALL.iter().map(|id| id.name()))
        .try_map(|name| EffectId::from_name(&name).ok_or("unknown effect"))
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let text = match &args.what {
        None | Some(What::List) if args.json => {
            let all: Vec<Value> = EffectId::ALL.iter().map(|&id| as_json(id, None)).collect();
            format!("{}\n", json!({"schema": 1, "effects": all}))
        }
        None | Some(What::List) => list(),
        Some(What::Show { effect, motor }) => {
            let motor = motor.as_ref().map(MotorFile::read).transpose()?;
            if args.json {
                let mut one = as_json(*effect, motor.as_ref());
                one["schema"] = json!(1);
                format!("{one}\n")
            } else {
                card(*effect, motor.as_ref())
            }
        }
    };
    Ok(stdout().write_all(text.as_bytes())?)
}

fn list() -> String {
    let width = EffectId::ALL.iter().map(|id| id.name().len()).max().unwrap_or(0);
    let mut out = String::new();
    for id in EffectId::ALL {
        out += &wrapped(&format!("{:width$}  ", id.name()), id.card().title);
    }
    out += "\nim effects show EFFECT says how one shows, what it is mistaken for, and which\ntest excites it.\n";
    out
}

fn card(id: EffectId, motor: Option<&MotorFile>) -> String {
    let c = id.card();
    let mut out = format!("{}  [{id}]\n\n", c.title);
    for (label, text) in
        [("What    ", c.what), ("Shows   ", c.shows), ("Test    ", c.test), ("Place   ", c.place), ("Source  ", c.source)]
    {
        out += &wrapped(&format!("  {label}"), text);
    }
    out += "\n  Mistaken for\n";
    for (rival, difference) in c.rivals {
        out += &wrapped("    ", &format!("{rival}: {difference}."));
    }
    let _ = writeln!(out, "\n  Parameters, in motor.toml under [effects.{id}]");
    for p in id.parameters() {
        let role = match p.role {
            Role::Strength => "strength, 0 is off",
            Role::Shape => "shape",
            Role::Order => "order",
            Role::Fixed => "fixed",
        };
        let unit = if p.unit.is_empty() { "pure number" } else { p.unit };
        let _ = writeln!(out, "    {} ({unit}; {role})", p.key);
        out += &wrapped("      ", p.meaning.trim());
        out += &wrapped("      ", &sizes(p, motor));
    }
    out
}

/// The typical range, in the machine's units if one is given.
fn sizes(p: &ParameterInfo, motor: Option<&MotorFile>) -> String {
    let unit = motor.map_or(1.0, |m| m.rating.unit_of(p.scale, m.machine.parameters(), m.machine.pole_pairs()));
    let (lo, hi) = (p.typical.0 * unit, p.typical.1 * unit);
    let of = match (motor, measure(p.scale)) {
        (None, Some(measure)) => format!(" of {measure}"),
        (Some(m), _) => format!("{}{} for \"{}\"", if p.unit.is_empty() { "" } else { " " }, p.unit, m.name),
        (None, None) if p.unit.is_empty() => String::new(),
        (None, None) => format!(" {}", p.unit),
    };
    format!("Typically {} to {}{of}; must be {}.", rounded(lo), rounded(hi), p.bound)
}

/// The quantity that typical sizes are fractions of.
fn measure(scale: ScaleOf) -> Option<&'static str> {
    Some(match scale {
        ScaleOf::One => return None,
        ScaleOf::Voltage => "the rated phase voltage (peak)",
        ScaleOf::Current => "the rated phase current (peak)",
        ScaleOf::Flux => "the rated rotor flux",
        ScaleOf::Torque => "the rated torque",
        ScaleOf::PerTorque => "one over the rated torque",
        ScaleOf::TorquePerSpeedSquared => "rated torque over squared synchronous speed",
        ScaleOf::Conductance => "rated current over rated voltage",
        ScaleOf::Speed => "the synchronous speed",
        ScaleOf::StatorHeating => "1 K/s at rated stator copper loss",
        ScaleOf::RotorHeating => "1 K/s at rated rotor copper loss",
    })
}

fn as_json(id: EffectId, motor: Option<&MotorFile>) -> Value {
    let c = id.card();
    let parameters = id.parameters().iter().map(|p| {
        let unit = motor.map(|m| m.rating.unit_of(p.scale, m.machine.parameters(), m.machine.pole_pairs()));
        json!({
            "key": p.key,
            "unit": p.unit,
            "meaning": p.meaning.trim(),
            "role": format!("{:?}", p.role).to_lowercase(),
            "bound": p.bound.to_string(),
            "typical_relative": [p.typical.0, p.typical.1],
            "relative_to": measure(p.scale),
            "typical": unit.map(|u| [p.typical.0 * u, p.typical.1 * u]),
        })
    });
    json!({
        "effect": id.name(),
        "title": c.title,
        "what": c.what,
        "shows": c.shows,
        "rivals": c.rivals.iter().map(|(name, how)| json!({"effect": name, "distinguished_by": how})).collect::<Vec<_>>(),
        "test": c.test,
        "place": c.place,
        "source": c.source,
        "parameters": Value::from_iter(parameters),
    })
}
