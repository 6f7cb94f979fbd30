//! The claims, listed.

use std::io::{self, Write};

use im_verify::{Claim, Found, Paper};
use serde_json::json;

use super::Format;
use crate::terminal::{stdout, wrapped};

/// What was found, in a word or two.
pub fn stated(found: Found) -> &'static str {
    match found {
        Found::Holds => "holds",
        Found::HoldsIf => "holds if",
        Found::Fails => "fails",
    }
}

pub fn print(claims: &[Claim], format: Format) -> io::Result<()> {
    let mut out = stdout();
    match format {
        Format::Json => {
            let all: Vec<_> = claims.iter().map(entry).collect();
            writeln!(out, "{:#}", json!({"schema": 1, "claims": all}))
        }
        Format::Markdown => claims.iter().try_for_each(|c| {
            writeln!(
                out,
                "### {}. {}\n\n*{}.* {} **Assumed:** {} **Found: {}.** {}\n\nProperty: `{}`.\n{}",
                c.number,
                c.name.replace('_', " "),
                c.place,
                c.statement,
                c.assumptions,
                stated(c.found),
                c.finding,
                c.name,
                if c.found == Found::Fails {
                    format!("\n![claim {0}](images/claims/{0:02}.svg)\n", c.number)
                } else {
                    String::new()
                }
            )
        }),
        Format::Text => {
            for paper in Paper::ALL {
                let own: Vec<&Claim> = claims.iter().filter(|c| c.paper == paper).collect();
                if own.is_empty() {
                    continue;
                }
                writeln!(out, "{} (--paper {})\n", paper.authors(), paper.name())?;
                for c in own {
                    writeln!(out, "{:>3}  {} [{}]", c.number, c.name, stated(c.found))?;
                    write!(out, "{}", wrapped("     ", &format!("{}: {}", c.place, c.statement)))?;
                }
                writeln!(out)?;
            }
            Ok(())
        }
    }
}

fn entry(c: &Claim) -> serde_json::Value {
    json!({
        "number": c.number, "name": c.name, "paper": c.paper.name(), "place": c.place, "statement": c.statement,
        "assumptions": c.assumptions, "found": stated(c.found), "finding": c.finding,
    })
}
