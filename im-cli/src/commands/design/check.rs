//! `im design check`: decides a certificate again, exactly.

use std::io::Write;
use std::path::PathBuf;

use im_design::certificate::{Certificate, Margin};
use im_design::gains::GainSet;
use im_model::read_text;
use serde_json::json;

use crate::failure::Failure;
use crate::spinner::spinning;
use crate::terminal::{rounded, stdout};

/// Arguments.
#[derive(clap::Args)]
pub struct Args {
    /// The file that `im design` wrote
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Print the obligations with their margins as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let file = args.file.display().to_string();
    let text = read_text(&args.file)?;
    let checked = spinning("verifying", || Certificate::check_text(&text));
    let (certificate, margins) = checked.map_err(|e| Failure::Input(format!("{file}: refused: {e}")))?;
    let kind = GainSet::from(&certificate.design).kind;
    let mut out = stdout();
    if args.json {
        let margins: Vec<_> = margins.iter().map(|m| json!({"name": m.name, "margin": m.margin})).collect();
        writeln!(out, "{}", json!({"schema": 1, "file": file, "valid": true, "kind": kind, "margins": margins}))?;
        return Ok(());
    }
    writeln!(out, "{file}: true and unaltered. {}", proven(&kind, &margins))?;
    for m in &margins {
        writeln!(out, "  {:>10}  {}", rounded(m.margin), m.name)?;
    }
    writeln!(out, "Margins: a number that must be positive, or the smallest pivot of LDL' over its diagonal entry.")?;
    Ok(())
}

/// What was proven, in a sentence.
pub fn proven(kind: &str, margins: &[Margin]) -> String {
    let n = margins.len();
    format!("{kind}: {n} {} decided in exact arithmetic.", if n == 1 { "obligation" } else { "obligations" })
}
