//! The claims, listed.

use std::io::{self, Write};

use im_verify::page::{self, stated};
use im_verify::{Claim, Paper};
use serde_json::json;

use super::Format;
use crate::terminal::{stdout, wrapped};

pub fn print(claims: &[Claim], format: Format) -> io::Result<()> {
    let mut out = stdout();
    match format {
        Format::Json => {
            let all: Vec<_> = claims.iter().map(entry).collect();
            writeln!(out, "{:#}", json!({"schema": 1, "claims": all}))
        }
        Format::Markdown => write!(out, "{}", page::list(claims)),
        Format::Text => {
            let words = "[holds]: no case violates it. [holds if]: none violates it under an assumption that the paper does not make. [fails]: it has \
                         counterexamples. An extension goes beyond what a paper says: that one fails says nothing against the paper.";
            writeln!(out, "{}", wrapped("", words))?;
            for paper in Paper::ALL {
                let mut own: Vec<&Claim> = claims.iter().filter(|c| c.paper == paper).collect();
                own.sort_by_key(|c| c.number);
                if own.is_empty() {
                    continue;
                }
                writeln!(out, "{} (--paper {})\n", paper.authors(), paper.name())?;
                for c in own {
                    writeln!(out, "{:>3}  {} [{}{}]", c.number, c.name, kind(c), stated(c.found))?;
                    write!(
                        out,
                        "{}",
                        wrapped("     ", &format!("{}: \"{}\" Tried: {}", c.place, c.origin.words(), c.statement))
                    )?;
                    write!(out, "{}", wrapped("     ", &format!("Found: {}", c.finding)))?;
                }
                writeln!(out)?;
            }
            let derived = "Ranges: docs/background/claims.md. Derivations of what is found against a paper: docs/background/errata.md, and once more \
                           in scripts/second-derivations.";
            write!(out, "{}", wrapped("", derived))
        }
    }
}

/// What stands before the finding of an extension.
fn kind(c: &Claim) -> &'static str {
    if c.origin.is_extension() { "extension, " } else { "" }
}

fn entry(c: &Claim) -> serde_json::Value {
    json!({
        "number": c.number, "name": c.name, "paper": c.paper.name(), "place": c.place, "extension": c.origin.is_extension(),
        "words": c.origin.words(), "statement": c.statement,
        "assumptions": c.assumptions, "found": stated(c.found), "finding": c.finding,
    })
}
