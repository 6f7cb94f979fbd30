//! The generated parts of `docs/background/claims.md`: the table of results and the two lists, in Markdown.

use std::fmt::Write as _;

use crate::campaign::Campaign;
use crate::claim::{Claim, Found};
use crate::summary::{Outcome, Row};

/// What was found, in a word or two.
pub const fn stated(found: Found) -> &'static str {
    match found {
        Found::Holds => "holds",
        Found::HoldsIf => "holds if",
        Found::Fails { .. } => "fails",
    }
}

/// An interval of rates, in percent.
pub fn percent([low, high]: [f64; 2]) -> String {
    let p = |x: f64| match 100.0 * x {
        0.0 => "0".to_owned(),
        x if x < 0.1 => format!("{x:.1e}"),
        x => format!("{x:.1}"),
    };
    format!("{} to {} %", p(low), p(high))
}

/// The smallest margin of a row.
pub fn margin(row: &Row) -> String {
    // Beyond 1 a quantity has the sign that the claim wants: how much so says nothing.
    row.worst.map_or("none".into(), |(m, _)| if m > -10.0 { format!("{:.2}", m.min(1.0)) } else { format!("{m:.0e}") })
}

/// The claims of the papers, or the extensions.
const KINDS: [(bool, &str); 2] = [(false, "Claims of the papers"), (true, "Extensions")];

/// The results: a table of the papers' claims and one of the extensions.
pub fn results(campaign: &Campaign, rows: &[Row]) -> String {
    let mut out = String::new();
    for (extension, title) in KINDS {
        let own: Vec<_> = campaign.claims.iter().zip(rows).filter(|(c, _)| c.origin.is_extension() == extension).collect();
        if own.is_empty() {
            continue;
        }
        let head = "| | claim | in the paper | found | cases | violated | failure rate (95 %) | smallest margin |\n|---|---|---|---|---|---|---|---|";
        let _ = writeln!(out, "{title} ({}):\n\n{head}", own.len());
        for (c, r) in own {
            let outcome = if r.outcome == Outcome::AsStated { String::new() } else { format!(", {}", r.outcome.words()) };
            let (found, rate, margin) = (stated(c.found), percent(r.interval), margin(r));
            let _ = writeln!(
                out,
                "| {} | `{}` | {} | {found}{outcome} | {} | {} | {rate} | {margin} |",
                c.number, c.name, c.place, r.cases, r.violated
            );
        }
        out.push('\n');
    }
    out
}

/// The lists: each claim with the paper's words, its place, what is tried in which range, and what was found.
pub fn list(claims: &[Claim]) -> String {
    let mut out = String::new();
    for (extension, title) in KINDS {
        let own: Vec<&Claim> = claims.iter().filter(|c| c.origin.is_extension() == extension).collect();
        if own.is_empty() {
            continue;
        }
        let _ = writeln!(out, "## {title} ({})\n", own.len());
        for c in own {
            let (authors, found, name) = (c.paper.authors(), stated(c.found), c.name.replace('_', " "));
            let _ = writeln!(
                out,
                "### {}. {name}\n\n*{authors}, {}:* \"{}\"\n",
                c.number,
                c.place,
                c.origin.words().replace("][", "] [")
            );
            let _ = writeln!(
                out,
                "**Tried:** {} **Range:** {} **Found: {found}.** {}\n\nProperty: `{}`.\n",
                c.statement, c.assumptions, c.finding, c.name
            );
            if c.found.fails() {
                let _ = writeln!(out, "![claim {0}](../images/claims/{0:02}.svg)\n", c.number);
            }
        }
    }
    out
}
