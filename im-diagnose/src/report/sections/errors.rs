//! The error before and after, as a falling waterfall and as a table.

use std::fmt::Write as _;

use super::super::overlay::channel_words;
use super::super::page::{Section, figure, legend, table, term};
use super::super::story::Story;
use super::super::svg::short;
use super::super::words::{escape, floors, short_effect_name};
use crate::format::{number, sentence};
use crate::residuals::Errors;

/// One row of the waterfall.
pub(crate) struct Fall {
    /// What was done.
    pub name: String,
    /// Error in noise floors: training, held out.
    pub train: f64,
    pub holdout: Option<f64>,
}

/// Steps with their errors: as given, refitted, one per effect.
pub(crate) fn rows(s: &Story) -> Vec<(String, Errors, Option<Errors>)> {
    let mut out = Vec::new();
    if let Some((train, holdout)) = &s.given {
        out.push(("as given".to_owned(), train.clone(), holdout.clone()));
    }
    for step in &s.d.steps {
        let name = step.effects.last().map_or("parameters refitted".into(), |e| format!("+ {}", short_effect_name(*e)));
        out.push((name, step.train.clone(), step.holdout.clone()));
    }
    out
}

pub(crate) fn section(s: &Story) -> Section {
    let rows = rows(s);
    let falls: Vec<Fall> = rows
        .iter()
        .map(|(name, t, h)| Fall { name: name.clone(), train: t.chi2_per_sample, holdout: h.as_ref().map(|h| h.chi2_per_sample) })
        .collect();
    let picture = figure(
        &waterfall(&falls),
        &format!("Error in {}, on a logarithmic scale: what each step removes is dashed.", term("floor", "noise floors")),
    );
    let key = legend(&[
        ("bar-train", term("train", "training")),
        ("bar-hold", term("holdout", "held out")),
        ("gone", "removed by this step".into()),
    ]);
    let (before, after, which) = s.fall();
    let said = if s.d.steps.len() > 1 {
        format!(
            "The {which} error falls from {} to {} noise floors; 1.0 is as good as the sensors can tell.",
            floors(before),
            floors(after)
        )
    } else {
        format!(
            "With its parameters refitted the model leaves a {which} error of {} noise floors; 1.0 is as good as the sensors can tell.",
            floors(after)
        )
    };
    Section {
        id: "errors",
        short: "error",
        title: "The error, before and after".into(),
        body: format!("<p>{said}</p>{key}<div class=\"split\">{picture}<div>{}</div></div>", error_table(&rows, s)),
    }
}

/// Errors in units, per channel.
fn error_table(rows: &[(String, Errors, Option<Errors>)], s: &Story) -> String {
    let mut head = vec!["step".to_owned()];
    head.push(format!("#{}, training", term("rmse", "rms error")));
    head.push("#held out".into());
    head.push(format!("#{}, held out", term("fit", "fit")));
    let mut body = Vec::new();
    for c in s.channels() {
        let (name, unit) = channel_words(&c.name, c.kind);
        body.push((false, vec![escape(&sentence(&name)).trim_end_matches('.').to_owned()]));
        for (k, (step, train, hold)) in rows.iter().enumerate() {
            let value = |e: Option<&Errors>| {
                e.and_then(|e| e.rmse.get(&c.name)).map_or("–".into(), |x| format!("{}\u{a0}{unit}", number(*x, 3)))
            };
            let fit = hold
                .as_ref()
                .or(Some(train))
                .and_then(|e| e.fit_percent.get(&c.name))
                .map_or("–".into(), |x| format!("{}\u{a0}%", number(*x, 4)));
            body.push((k + 1 == rows.len() && rows.len() > 1, vec![escape(step), value(Some(train)), value(hold.as_ref()), fit]));
        }
        body.push((
            false,
            vec![term("noise", "sensor noise (σ)"), format!("{}\u{a0}{unit}", number(c.sigma, 3)), String::new(), String::new()],
        ));
    }
    table(&head, &body)
}

/// Bars of errors on a logarithmic scale.
pub(crate) fn waterfall(rows: &[Fall]) -> String {
    let most = rows.iter().flat_map(|r| [Some(r.train), r.holdout]).flatten().filter(|x| x.is_finite()).fold(2.0, f64::max);
    let (left, width, line) = (6.0, 348.0, 62.0);
    let height = rows.len() as f64 * line + 26.0;
    let (lo, hi) = (0.5f64, most * 1.6);
    let x = |v: f64| left + (v.clamp(lo, hi) / lo).ln() / (hi / lo).ln() * (width - left - 58.0);
    let mut out = format!(
        r#"<svg class="chart" viewBox="0 0 360 {}" role="img" aria-label="error in noise floors, step by step">"#,
        short(height)
    );
    let floor = x(1.0);
    let _ = write!(
        out,
        r#"<path class="line floor" d="M{f} 18L{f} {b}"/><text class="tick" x="{t}" y="{y}">1: as good as the sensors can tell</text>"#,
        f = short(floor),
        b = short(height - 8.0),
        t = short(floor + 4.0),
        y = short(height - 6.0)
    );
    for (k, r) in rows.iter().enumerate() {
        let y = k as f64 * line;
        let _ = write!(out, r#"<text class="strong over" x="{left}" y="{}">{}</text>"#, short(y + 15.0), escape(&r.name));
        let before = k.checked_sub(1).map(|j| &rows[j]);
        let bars =
            [("bar-train", Some(r.train), before.map(|b| b.train)), ("bar-hold", r.holdout, before.and_then(|b| b.holdout))];
        for (n, (class, value, previous)) in bars.into_iter().enumerate() {
            let Some(v) = value else { continue };
            let top = y + 21.0 + 18.0 * n as f64;
            let end = x(v);
            let _ = write!(
                out,
                r#"<rect class="{class}" x="{left}" y="{}" width="{}" height="14"/>"#,
                short(top),
                short((end - left).max(1.0))
            );
            let mut word_at = end;
            if let Some(p) = previous.filter(|p| *p > v) {
                let _ = write!(
                    out,
                    r#"<rect class="gone" x="{}" y="{}" width="{}" height="13"/>"#,
                    short(end),
                    short(top + 0.5),
                    short(x(p) - end)
                );
                word_at = x(p);
            }
            let _ = write!(out, r#"<text x="{}" y="{}">{}</text>"#, short(word_at + 5.0), short(top + 11.5), floors(v));
        }
    }
    out.push_str("</svg>");
    out
}
