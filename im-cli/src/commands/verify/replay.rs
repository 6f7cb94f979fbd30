//! One case, alone.

use std::io::Write;
use std::path::Path;

use im_model::read_text;
use im_verify::page::stated;
use im_verify::{Subject, Verdict, case_file, claims};
use serde_json::json;

use crate::failure::Failure;
use crate::terminal::stdout;

/// Exit status 3 means that the case violates a claim that is stated to hold; a counterexample of one that is stated to fail is what was to be seen.
pub fn run(path: &Path, given: Option<Subject>, as_json: bool) -> Result<(), Failure> {
    let text = read_text(path)?;
    let read = case_file::from_text(&text, &claims::all(), given);
    let (claim, point, machines) = read.map_err(|e| Failure::Input(format!("{}: {e}", path.display())))?;
    let verdict = claim.verdict(&point, &machines);
    let (word, why) = match &verdict {
        Verdict::Holds { .. } => ("holds", String::new()),
        Verdict::Violated { why, .. } => ("violated", why.clone()),
        Verdict::Outside => ("outside", "an assumption of the claim is not met".to_owned()),
    };
    let found = stated(claim.found);
    let mut out = stdout();
    if as_json {
        let answer = json!({"schema": 1, "claim": claim.number, "name": claim.name, "verdict": word, "found": found, "margin": verdict.margin(), "why": why});
        writeln!(out, "{answer}")?;
    } else {
        writeln!(out, "Claim {}, {} ({}): {}", claim.number, claim.name, claim.place, claim.statement)?;
        let margin = verdict.margin().map_or(String::new(), |m| format!(", margin {m:.3e}"));
        let says = match (&verdict, claim.found.fails()) {
            (Verdict::Violated { .. }, true) => ": the counterexample is reproduced",
            (_, true) => ", which it does in other cases",
            _ => "",
        };
        writeln!(
            out,
            "This case: {word}{margin}{}{why}. The claim is stated as: {found}{says}.",
            if why.is_empty() { "" } else { "; " }
        )?;
    }
    let surprise = verdict.is_violated() && !claim.found.fails();
    if surprise { Err(Failure::Violated(format!("{} by {}", claim.name, path.display()))) } else { Ok(()) }
}
