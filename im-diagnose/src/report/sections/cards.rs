//! Cards of the effects found, with their curves; and of those that the recordings cannot show, with the test that would.

use std::fmt::Write as _;

use im_model::EffectId;

use super::super::curves::curve;
use super::super::page::{Section, figure, table};
use super::super::story::Story;
use super::super::svg::{Axis, Chart};
use super::super::words::{escape, short_effect_name};
use crate::format::{quantity, sentence};

/// Nothing where no effect was found.
pub(crate) fn section(s: &Story) -> Option<Section> {
    if s.d.effects.is_empty() {
        return None;
    }
    let mut body = String::new();
    for (k, &e) in s.d.effects.iter().enumerate() {
        body += &card(s, e, "");
        for &a in &s.d.alternatives[k] {
            body += &card(s, a, "could be this instead");
        }
    }
    Some(Section { id: "cards", short: "the cause", title: "The cause".into(), body })
}

fn card(s: &Story, e: EffectId, note: &str) -> String {
    let c = e.card();
    let note = if note.is_empty() { String::new() } else { format!(" <span class=\"flag\">({note})</span>") };
    let mut rivals = String::new();
    for (name, how) in c.rivals {
        let title = EffectId::from_name(name).map_or((*name).to_owned(), short_effect_name);
        let _ = write!(rivals, "<dt>Not {}</dt><dd>{}</dd>", escape(&title), escape(&sentence(how)));
    }
    let picture = picture(s, e);
    format!(
        r#"<div class="card"><h3>{}{note}</h3><div class="grid2"><dl><dt>What</dt><dd>{}</dd><dt>Shows as</dt><dd>{}</dd>{rivals}<dt>Test</dt><dd>{}</dd><dt>Acts on</dt><dd>{}</dd><dt>Source</dt><dd>{}</dd></dl>{picture}</div></div>"#,
        escape(c.title),
        escape(c.what),
        escape(c.shows),
        escape(c.test),
        escape(c.place),
        escape(c.source)
    )
}

/// The curve of an effect that the refined model holds.
fn picture(s: &Story, e: EffectId) -> String {
    let last = &s.d.course.models[s.d.course.models.len() - 1];
    let machine = &s.d.refined.machine;
    if !machine.effects().is_on(e) {
        return String::new();
    }
    let Some(c) = curve(e, machine, &last.fit, &s.d.refined.rating) else { return String::new() };
    let ys = || c.points.iter().chain(&c.without).map(|p| p[1]).chain(c.band.iter().flat_map(|b| [b[1], b[2]]));
    let (x, y) = if c.log {
        let all: Vec<f64> = ys().filter(|v| *v > 0.0).collect();
        let (lo, hi) = all.iter().fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(*v), b.max(*v)));
        (Axis::log(c.points[0][0], c.points[c.points.len() - 1][0], c.x_label), Axis::log(lo, hi, format!("{} (log)", c.y_label)))
    } else {
        (Axis::new(c.points[0][0], c.points[c.points.len() - 1][0], c.x_label), Axis::around(ys(), c.y_label))
    };
    let mut chart = Chart::new(c.caption, x, y);
    chart.band(&c.band, "fill-refined");
    chart.line(&c.without, "base");
    chart.line(&c.points, "refined");
    let widest = c.band.iter().map(|b| 0.5 * (b[2] - b[1])).fold(0.0, f64::max);
    let span = ys().fold(f64::NEG_INFINITY, f64::max) - ys().fold(f64::INFINITY, f64::min);
    let thin = if widest < 0.01 * span { " It is narrower than the line is thick." } else { "" };
    let unit = c.y_label.rsplit(", ").next().filter(|_| c.y_label.contains(", ")).unwrap_or("");
    figure(
        &chart.finish(),
        &format!(
            "{} The shaded band is the 95 % interval from sensor noise, at most ±{}.{thin}",
            escape(c.caption),
            escape(&quantity(widest, unit, 2))
        ),
    )
}

/// What was not excited, and which test would excite it.
pub(crate) fn unexcited(s: &Story) -> Option<Section> {
    let hidden = s.unexcited();
    if hidden.is_empty() {
        return None;
    }
    let head = ["effect", "#smallest that would show", "#usual at most", "test that would show it"].map(str::to_owned);
    let rows = hidden
        .iter()
        .map(|c| {
            (
                false,
                vec![
                    escape(&short_effect_name(c.effect)),
                    escape(&quantity(c.detectable_size, c.unit, 2)),
                    escape(&quantity(c.usual_size, c.unit, 2)),
                    escape(c.effect.card().test),
                ],
            )
        })
        .collect::<Vec<_>>();
    Some(Section {
        id: "hidden",
        short: "not excited",
        title: "What these recordings cannot show".into(),
        body: format!(
            "<p>{} of {} effects could be there at a usual size without leaving a trace above the noise. Nothing is said about them.</p>{}",
            hidden.len(),
            s.d.ranking.len(),
            table(&head, &rows)
        ),
    })
}
