//! What `im diagnose` says in the terminal, in short, readable in a pipe.

use std::fmt::Write;

use im_diagnose::diagnosis::{Diagnosis, Verdict};

use crate::terminal::{rounded, wrapped};

/// The story of a diagnosis.
pub fn story(d: &Diagnosis) -> String {
    let mut s = String::new();
    s += &wrapped("", &sentence(d));
    s.push('\n');
    s += "Error in noise floors (mean squared residual; 1 is the noise of the sensors)\n";
    let _ = writeln!(s, "  {:<42} {:>9} {:>9}", "", "train", "held out");
    for (k, step) in d.steps.iter().enumerate() {
        let name = match step.effects.last() {
            None => "base model, refitted".to_string(),
            Some(e) => format!("{}{e}", "  ".repeat(k - 1) + "+ "),
        };
        let held = step.holdout.as_ref().map_or_else(|| "-".into(), |h| rounded(h.chi2_per_sample));
        let bar = bar(step.train.chi2_per_sample, d.steps[0].train.chi2_per_sample);
        let _ = writeln!(s, "  {name:<42} {:>9} {held:>9}  {bar}", rounded(step.train.chi2_per_sample));
    }
    let last = &d.steps[d.steps.len() - 1];
    let shown = last.holdout.as_ref().unwrap_or(&last.train);
    let first = d.steps[0].holdout.as_ref().unwrap_or(&d.steps[0].train);
    let which = if last.holdout.is_some() { "held-out recording" } else { "training recordings" };
    let _ = writeln!(s, "\nError per channel, rms, on the {which}");
    for (name, rms) in &shown.rmse {
        let noise = d.noise.get(name).copied().unwrap_or(f64::NAN);
        let _ = writeln!(s, "  {name:<16} {:>9} -> {:<9} noise {}", rounded(first.rmse[name]), rounded(*rms), rounded(noise));
    }
    s += "\nCandidates, first round (score against threshold; size found at least)\n";
    for c in d.ranking.iter().take(6) {
        let _ = writeln!(
            s,
            "  {:<26} {:>9} /{:<5} {:>9} {:<10} {}",
            c.effect.name(),
            rounded(c.score),
            rounded(c.threshold),
            rounded(c.detectable_size),
            c.unit,
            c.conclusion
        );
    }
    if d.verdict == Verdict::Unexplained {
        s += "\nWhat the leftover depends on\n";
        for l in d.leftover.iter().take(4) {
            let text = format!("{} varies with {}, by {} rms", l.part.label(), l.variable.label(), rounded(l.size));
            s += &wrapped("  ", &text);
        }
    }
    s += "\nParameters\n";
    for p in &d.parameters {
        let name = p.id.to_string();
        let _ = writeln!(s, "  {name:<50} {:>9} -> {:>9} ± {}", rounded(p.before), rounded(p.after), rounded(p.std));
    }
    s
}

/// The answer in a sentence or two.
fn sentence(d: &Diagnosis) -> String {
    let title = |k: usize| d.effects[k].card().title.to_string();
    let names = (0..d.effects.len()).map(title).collect::<Vec<_>>().join("; ");
    match d.verdict {
        Verdict::Adequate => {
            "ADEQUATE. The refitted base model explains the recordings to their noise: no effect of the library is missing."
                .into()
        }
        Verdict::MissingEffects => format!("MISSING: {names}. Added and refitted, and confirmed on the held-out recording."),
        Verdict::Confounded => {
            let pairs: Vec<String> = d
                .effects
                .iter()
                .zip(&d.alternatives)
                .filter(|(_, a)| !a.is_empty())
                .map(|(e, a)| format!("{e} or {}", a.iter().map(|x| x.name()).collect::<Vec<_>>().join(" or ")))
                .collect();
            format!("CONFOUNDED: these recordings cannot tell {}. im next-test proposes one that can.", pairs.join("; "))
        }
        Verdict::Inconclusive => {
            let unseen: Vec<&str> =
                d.ranking.iter().filter(|c| c.detectable_size > c.usual_size).map(|c| c.effect.name()).collect();
            format!("INCONCLUSIVE: these recordings do not excite {}. im next-test proposes one that does.", unseen.join(", "))
        }
        Verdict::Unexplained => {
            let found = if d.effects.is_empty() { String::new() } else { format!(" Part of it looks like {names}.") };
            format!("UNEXPLAINED: something is missing that no effect of the library explains.{found}")
        }
    }
}

/// A logarithmic bar from the noise floor up.
fn bar(x: f64, largest: f64) -> String {
    let full = largest.max(2.0).ln();
    let n = (12.0 * x.max(1.0).ln() / full).round().clamp(0.0, 12.0) as usize;
    "#".repeat(n)
}
