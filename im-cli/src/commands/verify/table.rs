//! The summary.

use std::io::{self, Write};

use im_trials::campaign::{self, Finished};
use im_verify::{Campaign, Row};
use serde_json::json;

use super::list::stated;
use super::{Args, Found};

fn percent([low, high]: [f64; 2]) -> String {
    let p = |x: f64| match 100.0 * x {
        0.0 => "0".to_owned(),
        x if x < 0.1 => format!("{x:.1e}"),
        x => format!("{x:.1}"),
    };
    format!("{} to {} %", p(low), p(high))
}

fn margin(row: &Row) -> String {
    // Beyond 1 a quantity has the sign that the claim wants: how much so says nothing.
    row.worst.map_or("none".into(), |(m, _)| if m > -10.0 { format!("{:.2}", m.min(1.0)) } else { format!("{m:.0e}") })
}

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
            if r.as_stated { "as stated" } else { "NOT AS STATED" }
        )?;
    }
    let outside: u64 = rows.iter().map(|r| r.outside).sum();
    if outside > 0 {
        writeln!(out, "\n{outside} cases did not meet their claim's assumptions and are not counted.")?;
    }
    if !found.is_empty() {
        writeln!(out, "\nCounterexamples, made as simple as they come:")?;
    }
    for f in found {
        let at = args.out.as_ref().map_or_else(String::new, |d| format!(" {}", d.join("cases").join(&f.file).display()));
        writeln!(out, "{:>3} {}{at}", f.claim, f.why)?;
    }
    if !found.is_empty() && args.out.is_none() {
        writeln!(out, "With --out DIR they are written to files, which im verify --replay runs again.")?;
    }
    let right = rows.iter().filter(|r| r.as_stated).count();
    writeln!(out, "\n{right} of {} claims came out as docs/claims.md states them.", rows.len())
}

pub fn markdown(out: &mut impl Write, campaign: &Campaign, rows: &[Row]) -> io::Result<()> {
    writeln!(
        out,
        "| | claim | found | cases | violated | failure rate (95 %) | smallest margin |\n|---|---|---|---|---|---|---|"
    )?;
    for (c, r) in campaign.claims.iter().zip(rows) {
        writeln!(
            out,
            "| {} | `{}` | {}{} | {} | {} | {} | {} |",
            c.number,
            c.name,
            stated(c.found),
            if r.as_stated { "" } else { ", NOT AS STATED" },
            r.cases,
            r.violated,
            percent(r.interval),
            margin(r)
        )?;
    }
    Ok(())
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
                "as_stated": r.as_stated, "counterexamples": own,
            })
        })
        .collect();
    let all = json!({
        "schema": 1, "seed": campaign.seed, "machines": campaign.machines.label(), "claims": claims,
        "as_stated": rows.iter().all(|r| r.as_stated),
        "trials": finished.map(|f| json!({"number": f.len(), "table": campaign::table(f), "finished": f})),
    });
    writeln!(out, "{all:#}")
}
