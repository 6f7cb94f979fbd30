//! Cards of the effects found, with their curves; and of those that the recordings cannot show, with the test that would.

use im_chart::{Axis, Chart};
use im_model::EffectId;
use maud::{Markup, html};

use super::super::curves::curve;
use super::super::page::{Row, Section, drawn, figure, numbers, table, words};
use super::super::story::Story;
use super::super::words::short_effect_name;
use crate::format::{number, quantity, sentence};

/// A formula that leaves half of a learned curve is not like it.
const UNLIKE: f64 = 0.5;

/// Nothing where no effect was found.
pub(crate) fn section(s: &Story) -> Option<Section> {
    if s.d.effects.is_empty() {
        return None;
    }
    let body = html! {
        @for (e, alternatives) in s.d.effects.iter().zip(&s.d.alternatives) {
            (card(s, *e, ""))
            @for a in alternatives { (card(s, *a, "could be this instead")) }
        }
    };
    Some(Section { id: "cards", short: "the cause", title: "The cause", body })
}

fn card(s: &Story, e: EffectId, note: &str) -> Markup {
    let c = e.card();
    let title = |name: &str| EffectId::from_name(name).map_or_else(|| name.to_owned(), short_effect_name);
    html! {
        div.card {
            h3 { (c.title) @if !note.is_empty() { " " span.flag { "(" (note) ")" } } }
            div.grid2 {
                dl {
                    dt { "What" } dd { (c.what) }
                    dt { "Shows as" } dd { (c.shows) }
                    @for (name, how) in c.rivals { dt { "Not " (title(name)) } dd { (sentence(how)) } }
                    dt { "Test" } dd { (c.test) }
                    @for learned in s.d.learned.iter().filter(|l| l.effect == e) {
                        dt { "Learned" } dd { (sentence(&learned.extent())) }
                        dt { "May be" } dd { @for t in learned.meaning() { (sentence(&t)) " " } }
                        @for f in learned.formulas.iter().skip(1).take(3).filter(|f| f.off < UNLIKE) {
                            dt { "Next best" } dd { (f.name) ": " (f.text) ", off by " (number(100.0 * f.off, 2)) " %" }
                        }
                    }
                    dt { "Acts on" } dd { (c.place) }
                    dt { "Source" } dd { (c.source) }
                }
                @if let Some(picture) = picture(s, e) { (picture) }
            }
        }
    }
}

/// The curve of an effect that the refined model holds.
fn picture(s: &Story, e: EffectId) -> Option<Markup> {
    let last = &s.d.course.last().model;
    let machine = &s.d.refined.machine;
    if !machine.effects().is_on(e) {
        return None;
    }
    let c = curve(e, machine, &last.fit, &s.d.refined.rating)?;
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
    let widest = quantity(widest, unit, 2);
    let caption = format!(
        "{} The shaded band is the 95 % interval from sensor noise alone, at most ±{widest}.{thin} The intervals of the parameters are wider: errors of form are in them.",
        c.caption
    );
    Some(figure(drawn(chart), caption))
}

/// So many times its largest usual size no machine has an effect.
const NO_SIZE: f64 = 10.0;

/// What was not excited, and which test would excite it.
pub(crate) fn unexcited(s: &Story) -> Option<Section> {
    let hidden = s.unexcited();
    if hidden.is_empty() {
        return None;
    }
    let head = [words("effect"), words("test that would show it"), numbers("smallest that would show"), numbers("usual at most")];
    let row = |c: &&crate::diagnosis::Candidate| {
        let size = |x: f64| quantity(x, c.unit, 2);
        let seen = if c.detectable_size > NO_SIZE * c.usual_size {
            "none that a machine has".to_owned()
        } else {
            size(c.detectable_size)
        };
        Row::of([short_effect_name(c.effect), c.effect.card().test.to_owned(), seen, size(c.usual_size)])
    };
    let rows: Vec<Row> = hidden.iter().map(row).collect();
    Some(Section {
        id: "hidden",
        short: "not excited",
        title: "What these recordings cannot show",
        body: html! {
            p {
                (hidden.len()) " of " (s.d.ranking.len())
                " effects could be there at a usual size without leaving a trace above the noise. Nothing is said about "
                (if hidden.len() == 1 { "it" } else { "them" }) "."
            }
            (table(&head, &rows))
        },
    })
}
