//! The error before and after, as a falling waterfall and as a table.

use im_chart::short;
use maud::{Markup, html};

use super::super::overlay::{channel_words, nudged};
use super::super::page::{Row, Section, figure, legend, numbers, table, term, text, words};
use super::super::story::Story;
use super::super::words::{in_sigma, short_effect_name, voltage_noise};
use crate::format::{number, sentence};
use crate::residuals::Errors;

/// One row of the waterfall.
pub(crate) struct Fall {
    /// What was done.
    pub name: String,
    /// Mean squared error in σ²: training, held out.
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
    let caption = html! { "Error, rms in units of the " (term("noise", "sensor noise σ")) ", on a logarithmic scale: what each step removes is dashed."
    @if s.views.iter().any(|v| v.nudged) { " Judged with the " (term("nudged_speed", "speed nudged")) " towards the measured one: " (nudged(&s.views)) "." } };
    let (before, after, which) = s.fall();
    let (from, to) = (in_sigma(before), in_sigma(after));
    let said = if s.d.steps.len() > 1 && from == to {
        format!("The {which} error stays at {to} rms; 1 σ is as good as the sensors can tell.")
    } else if s.d.steps.len() > 1 {
        format!(
            "The {which} error {} from {from} to {to} rms; 1 σ is as good as the sensors can tell.",
            if after < before { "falls" } else { "rises" }
        )
    } else {
        format!(
            "With its parameters refitted the model leaves a {which} error of {to} rms; 1 σ is as good as the sensors can tell."
        )
    };
    Section {
        id: "errors",
        short: "error",
        title: "The error, before and after",
        body: html! {
            p { (said) }
            (key(rows.iter().any(|r| r.2.is_some())))
            @if let Some(said) = voltage_noise(s.d.case.all()) { p { (said) } }
            div.split { (figure(waterfall(&falls, largest(&falls)), caption)) div { (error_table(&rows, s)) } }
        },
    }
}

/// What the bars of a waterfall mean.
pub(crate) fn key(held_out: bool) -> Markup {
    let mut entries = vec![("bar-train", term("train", "training"))];
    entries.extend(held_out.then(|| ("bar-hold", term("holdout", "held out"))));
    entries.push(("gone", text("removed by this step")));
    legend(&entries)
}

/// Errors in units, per channel.
fn error_table(rows: &[(String, Errors, Option<Errors>)], s: &Story) -> Markup {
    let held_out = rows.iter().any(|r| r.2.is_some());
    let mut head = vec![words("step"), numbers(html! { (term("rmse", "rms error")) ", training" })];
    if held_out {
        head.push(numbers("held out"));
    }
    head.push(numbers(html! { (term("fit", "fit")) @if held_out { ", held out" } @else { ", training" } }));
    let mut body = Vec::new();
    for c in s.channels() {
        let (name, unit) = channel_words(&c.name, c.kind);
        body.push(Row::of([sentence(&name).trim_end_matches('.')]));
        for (k, (step, train, hold)) in rows.iter().enumerate() {
            let value = |e: Option<&Errors>| {
                e.and_then(|e| e.rmse.get(&c.name)).map_or("–".into(), |x| format!("{}\u{a0}{unit}", number(*x, 3)))
            };
            let percent = hold.as_ref().unwrap_or(train).fit_percent.get(&c.name);
            let fit = percent.map_or("–".into(), |x| format!("{x:.2}\u{a0}%").replace('-', "−"));
            let mut cells = vec![step.clone(), value(Some(train))];
            cells.extend(held_out.then(|| value(hold.as_ref())));
            cells.push(fit);
            let row = Row::of(cells);
            body.push(Row { hit: k + 1 == rows.len() && rows.len() > 1, ..row });
        }
        let noise = text(format!("{}\u{a0}{unit}", number(s.noise_of(c), 3)));
        let rest = (2..head.len()).map(|_| text(""));
        body.push(Row::new([term("noise", "sensor noise (σ)"), noise].into_iter().chain(rest)));
    }
    table(&head, &body)
}

/// The largest error of a waterfall, σ².
pub(crate) fn largest(rows: &[Fall]) -> f64 {
    rows.iter().flat_map(|r| [Some(r.train), r.holdout]).flatten().filter(|x| x.is_finite()).fold(2.0, f64::max)
}

/// Bars of errors on a logarithmic scale that ends beyond `most`.
pub(crate) fn waterfall(rows: &[Fall], most: f64) -> Markup {
    let (left, width, line) = (6.0, 348.0, 62.0);
    let height = rows.len() as f64 * line + 26.0;
    let (lo, hi) = (0.5f64, most * 1.6);
    let x = |v: f64| left + (v.clamp(lo, hi) / lo).ln() / (hi / lo).ln() * (width - left - 58.0);
    let floor = x(1.0);
    // Before and after a step, one below the other.
    let bar = |class: &str, top: f64, v: f64, previous: Option<f64>| {
        let end = x(v);
        let gone = previous.filter(|p| *p > v).map(x);
        html! {
            rect class=(class) x=(left) y=(short(top)) width=(short((end - left).max(1.0))) height="14" {}
            @if let Some(before) = gone {
                rect.gone x=(short(end)) y=(short(top + 0.5)) width=(short(before - end)) height="13" {}
            }
            text x=(short(gone.unwrap_or(end) + 5.0)) y=(short(top + 11.5)) { (in_sigma(v)) }
        }
    };
    html! {
        svg.chart viewBox={ "0 0 360 " (short(height)) } role="img" aria-label="rms error in units of the sensor noise, step by step" {
            @for k in 0..=rows.len() {
                // Beside the bars alone, so that it strikes no name through; after the last row down to its own word.
                @let (from, to) = if k < rows.len() { (k as f64 * line + 20.0, (k + 1) as f64 * line) } else { (height - 26.0, height - 8.0) };
                path class="line floor" d={ "M" (short(floor)) " " (short(from)) "L" (short(floor)) " " (short(to)) } {}
            }
            text.tick x=(short(floor + 4.0)) y=(short(height - 6.0)) { "1 σ: as good as the sensors can tell" }
            @for (k, r) in rows.iter().enumerate() {
                @let y = k as f64 * line;
                @let before = k.checked_sub(1).map(|j| &rows[j]);
                text.strong.over x=(left) y=(short(y + 15.0)) { (r.name) }
                (bar("bar-train", y + 21.0, r.train, before.map(|b| b.train)))
                @if let Some(v) = r.holdout { (bar("bar-hold", y + 39.0, v, before.and_then(|b| b.holdout))) }
            }
        }
    }
}
