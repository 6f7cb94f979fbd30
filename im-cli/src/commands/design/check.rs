//! `im design check`: decides a certificate again, exactly, and says what it is about.

use std::io::Write;
use std::path::PathBuf;

use im_design::DesignModel;
use im_design::certificate::{Certificate, Design, Difference, Margin};
use im_design::gains::GainSet;
use im_design::mtpa::Circuit;
use im_model::{MotorFile, read_text};
use serde_json::json;

use super::words::{left_out, proven, without};
use super::{as_json, shown};
use crate::failure::Failure;
use crate::spinner::spinning;
use crate::terminal::{rounded, stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
pub struct Args {
    /// The file that `im design` wrote
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Say whether the certificate is about this motor; ends with status 1 when it is not
    #[arg(long, value_name = "FILE")]
    motor: Option<PathBuf>,
    /// Print the obligations with their margins as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let file = args.file.display().to_string();
    let text = read_text(&args.file)?;
    let motor = args.motor.as_deref().map(MotorFile::read).transpose()?;
    let checked = spinning("verifying", || Certificate::check_text(&text));
    let refused = |e: im_design::certificate::CheckError| Failure::Input(format!("{file}: refused: {e}"));
    let (certificate, margins) = checked.map_err(refused)?;
    let differences = motor.as_ref().map(|m| certificate.differences(&m.machine)).transpose().map_err(refused)?;
    if let (Some(motor), Some(differences)) = (&motor, differences.as_ref().filter(|d| !d.is_empty())) {
        let other = other_machine(&certificate, motor, differences);
        return Err(Failure::Input(format!("{file}: true and unaltered, but {other}")));
    }
    Ok(tell(args, &file, &certificate, &margins, motor.as_ref())?)
}

fn tell(
    args: &Args,
    file: &str,
    certificate: &Certificate,
    margins: &[Margin],
    motor: Option<&MotorFile>,
) -> std::io::Result<()> {
    let set = GainSet::from(&certificate.design);
    let kind = set.kind.as_str();
    let machine = toml::Table::try_from(certificate.plant).unwrap_or_default();
    let left_out = motor.map(|motor| left_out(motor, certificate));
    let theorem = certificate.design.theorem();
    let mut out = stdout();
    if args.json {
        let margins: Vec<_> = margins
            .iter()
            .map(|m| json!({"name": m.name, "margin": m.margin, "scale": m.scale, "tight_by_construction": m.tight}))
            .collect();
        let summary = json!({
            "schema": 1, "file": file, "valid": true, "kind": kind, "margins": margins, "machine": machine,
            "machine_digest": certificate.plant.digest(), "about_motor": motor.map(|m| m.name.clone()),
            "effects_left_out": left_out, "claim": theorem, "gains": as_json(&set),
        });
        return writeln!(out, "{summary}");
    }
    writeln!(out, "{file}: true and unaltered. {}", proven(kind, margins))?;
    let from = match certificate.plant {
        DesignModel::Machine(_) => "Machine",
        DesignModel::Constants(_) => "Machine, by its derived constants",
    };
    writeln!(out, "\n{from} (SHA-256 {}):", certificate.plant.digest())?;
    for (key, value) in machine.values().filter_map(toml::Value::as_table).flatten() {
        writeln!(out, "  {key} = {value}")?;
    }
    if let Design::Mtpa(design) = &certificate.design
        && matches!(design.circuit, Circuit::Aqdm(_))
    {
        writeln!(out, "The laws are for the q-d circuit in the file; of this machine only the pole pairs enter.")?;
    }
    if let Some(motor) = motor {
        writeln!(out, "This is {}, the motor that was asked about.", motor.name)?;
    }
    if let Some(effects) = left_out.filter(|effects| !effects.is_empty()) {
        writeln!(out, "{}", without(&effects))?;
    }
    writeln!(out, "\nWhat is claimed, and where:")?;
    write!(out, "{}", wrapped("  ", theorem))?;
    for gain in &set.gains {
        writeln!(out, "  {} = {}    {}", gain.name, shown(&gain.value), gain.meaning)?;
    }
    writeln!(out, "\nMargins:")?;
    for m in margins {
        let tight = if m.tight { ", tight by construction" } else { "" };
        let scale = m.scale.map_or("any positive number will do".into(), |s| format!("of {}", rounded(s)));
        writeln!(out, "  {:>10}  {}  ({scale}{tight})", rounded(m.margin), m.name)?;
    }
    writeln!(
        out,
        "Of a matrix: the smallest pivot of LDL' over its diagonal entry, of 1. Tight by construction: the design takes the smallest\n\
         gain or the largest claim there is, up to this. docs/background/design.md says what a certificate does not state."
    )
}

/// That a certificate is about another machine than a motor: in what, and whether its claim holds for the motor as well.
pub fn other_machine(certificate: &Certificate, motor: &MotorFile, differences: &[Difference]) -> String {
    // Six digits, and all of them where six do not show the difference.
    let six = |x: f64| format!("{x:.5e}").parse::<f64>().unwrap_or(x);
    let each = |d: &Difference| match (six(d.certified), six(d.motor)) {
        (there, here) if there != here => format!("{} = {there} there, {here} here", d.key),
        _ => format!("{} = {} there, {} here", d.key, d.certified, d.motor),
    };
    let listed: Vec<_> = differences.iter().take(3).map(each).collect();
    let more = if differences.len() > 3 { format!(" and {} more", differences.len() - 3) } else { String::new() };
    let also = match certificate.prove_for(&motor.machine) {
        Ok(()) => "The same claim holds for this motor too; design for it to have that in writing".to_owned(),
        Err(e) => format!("For this motor the claim is not proven ({e}); design for it"),
    };
    format!("about another machine than {}: {}{more}. {also}", motor.name, listed.join("; "))
}
