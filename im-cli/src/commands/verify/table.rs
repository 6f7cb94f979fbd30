//! The summary.

use std::io::{self, Write};

use im_trials::campaign::{self, Finished};
use im_verify::page::{margin, percent, stated};
use im_verify::{Campaign, Outcome, Row};
use serde_json::json;

use super::{Args, Found};

pub fn text(out: &mut impl Write, campaign: &Campaign, rows: &[Row], found: &[Found], args: &Args) -> io::Result<()> {
    writeln!(
        out,
        "{:>3} {:<46} {:<8} {:>8} {:>8} {:>20} {:>7}",
        "", "claim", "stated", "cases", "violated", "rate (95 %)", "margin"
    )?;
    for (c, r) in campaign.claims.iter().zip(rows) {
        writeln!(
            out,
            "{:>3} {:<46} {:<8} {:>8} {:>8} {:>20} {:>7}  {}",
            c.number,
            c.name,
            stated(c.found),
            r.cases,
            r.violated,
            percent(r.interval),
            margin(r),
            r.outcome.words()
        )?;
    }
    writeln!(
        out,
        "\nrate: of violations, with its 95 % interval; margin: the smallest of 1 - (what is)/(what is allowed), below 0 violated."
    )?;
    let outside: u64 = rows.iter().map(|r| r.outside).sum();
    if outside > 0 {
        writeln!(out, "{outside} cases did not meet their claim's assumptions and are not counted.")?;
    }
    if !found.is_empty() {
        writeln!(out, "\nCounterexamples, made as simple as they come:")?;
    }
    for f in found {
        let at = args.out.as_ref().map_or_else(String::new, |d| format!(" {}", d.join("cases").join(&f.file).display()));
        writeln!(out, "{:>3} {}{}{at}", f.claim, if f.worst { "(from the worst case) " } else { "" }, f.why)?;
    }
    if !found.is_empty() && args.out.is_none() {
        writeln!(out, "With --out DIR they are written to files, which im verify --replay runs again.")?;
    }
    let count = |outcome: Outcome| rows.iter().filter(|r| r.outcome == outcome).count();
    writeln!(out, "\n{} of {} claims came out as docs/background/claims.md states them.", count(Outcome::AsStated), rows.len())?;
    let none = count(Outcome::NotOnThisMachine);
    if none > 0 {
        writeln!(out, "{none} that fail elsewhere have no counterexample on this machine.")?;
    }
    let few = count(Outcome::TooFew);
    if few > 0 { writeln!(out, "Too few cases to tell of {few}: --cases gives them more.") } else { Ok(()) }
}

/// The hidden-effect campaign.
pub fn trials(out: &mut impl Write, finished: &[Finished]) -> io::Result<()> {
    let took: f64 = finished.iter().map(|f| f.took_s).sum();
    writeln!(out, "\nHidden effects, {} trials of {took:.0} s together:\n\n{}", finished.len(), campaign::table(finished))?;
    finished
        .iter()
        .try_for_each(|f| f.outcome.as_ref().map_or_else(|e| writeln!(out, "refused: {} ({}): {e}", f.name, f.group), |_| Ok(())))
}

pub fn json_of(
    out: &mut impl Write,
    campaign: &Campaign,
    rows: &[Row],
    found: &[Found],
    finished: Option<&Vec<Finished>>,
) -> io::Result<()> {
    let claims: Vec<_> = campaign
        .claims
        .iter()
        .zip(rows)
        .map(|(c, r)| {
            let own: Vec<_> =
                found.iter().filter(|f| f.claim == c.number).map(|f| json!({"file": f.file, "why": f.why})).collect();
            json!({
                "number": c.number, "name": c.name, "found": stated(c.found), "cases": r.cases, "outside": r.outside,
                "violated": r.violated, "rate_95": r.interval, "worst_margin": r.worst.map(|w| w.0), "worst_case": r.worst.map(|w| w.1),
                "as_stated": r.outcome == Outcome::AsStated, "outcome": r.outcome.words().to_lowercase(), "extension": c.origin.is_extension(),
                "counterexamples": own,
            })
        })
        .collect();
    let all = json!({
        "schema": 1, "seed": campaign.seed, "machines": campaign.machines.label(), "claims": claims,
        "as_stated": rows.iter().all(|r| r.outcome != Outcome::Otherwise),
        "trials": finished.map(|f| json!({"number": f.len(), "table": campaign::table(f), "finished": f})),
    });
    writeln!(out, "{all:#}")
}
