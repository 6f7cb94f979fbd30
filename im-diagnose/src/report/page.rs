//! The page around the sections: head, style, script, glossary; and the small pieces of HTML that sections are made of. Every page of
//! this workspace is made of it, that of a fleet too.

use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

use crate::format::quantity;

const STYLE: &str = include_str!("assets/page.css");
const SCRIPT: &str = include_str!("assets/page.js");

/// Words that need explaining: key, word, explanation.
const GLOSSARY: &[(&str, &str, &str)] = &[
    (
        "floor",
        "rms in σ",
        "Root mean square error in units of the sensor noise σ, over all signals. 1 σ is as good as the sensors can tell; 2 σ means errors twice as large as the noise. Its square is χ²/N.",
    ),
    (
        "noise",
        "sensor noise (σ)",
        "Standard deviation of the random part of a sensor's reading, estimated from the recordings. The noise band in the pictures is ±2σ: 95 of 100 readings of a perfect model lie in it.",
    ),
    (
        "band",
        "band of prediction",
        "Where 95 of 100 readings lie: the noise of the sensor, what the uncertainty of the fitted parameters makes of the signal, and what the model left of its recordings, which grows with the current as it did there. [prediction] of the motor file has the last with the noise, and im simulate writes it.",
    ),
    ("train", "training", "The recordings that the parameters were fitted to and the causes were sought in."),
    ("holdout", "held out", "A recording that no fit has seen. A cause that is real lowers the error there too."),
    ("rmse", "rms error", "Root mean square of measured minus modelled, in the unit of the signal."),
    (
        "fit",
        "fit percent",
        "100 (1 − ‖error‖/‖signal − its mean‖). Close to 100 for any decent model, so that it hides small causes; the error in units of σ does not.",
    ),
    (
        "score",
        "score",
        "How much of the error an effect could explain that no refit of the present parameters can, in squared standard deviations. By chance alone it stays below the threshold in 99 of 100 analyses.",
    ),
    (
        "keep",
        "explained share",
        "The part of an effect's trace in the data that a refit of the other parameters cannot imitate, 0 to 100 %. Near zero the effect hides behind the parameters.",
    ),
    ("size", "predicted size", "How large the score says the effect would have to be; before any refit with it."),
    ("detectable", "detectable size", "The smallest size that would have been noticed in these recordings."),
    (
        "alike",
        "look alike",
        "Cosine between the traces that two effects leave in these recordings after a refit: 1.00 means that these recordings do not distinguish them, 0 that they have nothing in common.",
    ),
    (
        "ratio",
        "ratio held as given",
        "A linear machine shows its inverse-Γ circuit at its terminals, not how the leakage is shared between stator and rotor. This value follows from the inverse-Γ circuit with the ratio L_ls/L_lr of the motor file; its interval is that of a ratio known as well as the motor file's design class says, over all classes without one.",
    ),
    (
        "interval",
        "± interval",
        "95 % interval: sensor noise, coloured as the residual shows it; the curves of the effects, which may differ from the machine's by 5 % of what they explain; and the ratio of the leakages, known as well as the design class in the motor file says, over all classes without one. It holds if the effects in the model are the right ones.",
    ),
    ("base", "base model", "The linear machine with its parameters refitted, before any effect is added."),
    ("refined", "refined model", "The machine with the effects found, everything refitted."),
    (
        "nudged_speed",
        "nudged speed",
        "A recording that the simulation cannot follow by itself (voltage replayed without the drive that made it) is judged with the simulated speed nudged towards the measured one, for all models alike.",
    ),
    ("slip", "slip frequency", "By how much the rotor flux turns faster than the rotor, electrical."),
    ("flux", "flux", "Magnitude of the magnetizing flux linkage (peak, star-equivalent), as the model has it."),
    (
        "fluxframe",
        "seen from the flux",
        "Along the flux lies the magnetizing part of the current, across it the part that makes torque. In this view the supply frequency itself stands still: a sensor offset appears at once, an unbalance at twice and dead time at six times the supply frequency.",
    ),
    (
        "chanceband",
        "band of chance",
        "Correlations of signals that have nothing to do with each other lie within it in 95 of 100 cases. It is wider where both last (Bartlett's formula).",
    ),
    (
        "correlation",
        "correlation",
        "1: the two signals rise and fall together; −1: one rises as the other falls; 0: no relation along a straight line.",
    ),
];

/// A word with its explanation: a tooltip, and a link to the glossary at the end for paper and touch.
pub(crate) fn term(key: &str, shown: &str) -> Markup {
    let text = GLOSSARY.iter().find(|g| g.0 == key).map_or("", |g| g.2);
    html! { a class="term" href={ "#g-" (key) } title=(text) { (shown) } }
}

/// Text that stands for itself.
pub fn text(text: impl Render) -> Markup {
    html! { (text) }
}

/// A section with a heading.
pub struct Section {
    /// Where links go.
    pub id: &'static str,
    /// In the list of contents.
    pub short: &'static str,
    /// The heading.
    pub title: &'static str,
    /// What stands under it.
    pub body: Markup,
}

/// A caption under a picture.
pub(crate) fn figure(picture: impl Render, caption: impl Render) -> Markup {
    html! { figure { (picture) figcaption { (caption) } } }
}

/// A finished picture.
pub(crate) fn drawn(chart: im_chart::Chart) -> Markup {
    PreEscaped(chart.finish())
}

/// The heading of a column, of numbers or of words.
pub struct Column {
    heading: Markup,
    number: bool,
}

/// A column of words.
pub fn words(heading: impl Render) -> Column {
    Column { heading: text(heading), number: false }
}

/// A column of numbers.
pub fn numbers(heading: impl Render) -> Column {
    Column { heading: text(heading), number: true }
}

/// A row of a table.
pub struct Row {
    /// Whether it stands out.
    pub hit: bool,
    /// One for each column, or a single one as a heading within the table.
    pub cells: Vec<Markup>,
}

impl Row {
    /// One that does not stand out.
    pub fn new(cells: impl IntoIterator<Item = Markup>) -> Self {
        Self { hit: false, cells: cells.into_iter().collect() }
    }

    /// Of cells of text.
    pub fn of(cells: impl IntoIterator<Item = impl Render>) -> Self {
        Self::new(cells.into_iter().map(text))
    }
}

/// A table.
pub fn table(head: &[Column], rows: &[Row]) -> Markup {
    let class = |k: usize, cell: &Markup| match head.get(k) {
        Some(c) if c.number => Some("n"),
        _ => match shown(&cell.0) {
            0..4 => Some("k s"),
            4..30 => Some("k"),
            _ => None,
        },
    };
    html! {
        div.scroll { table {
            thead { tr { @for h in head { th class=[h.number.then_some("n")] { (h.heading) } } } }
            tbody { @for row in rows {
                // A single cell is a heading within the table.
                @if let [heading] = &row.cells[..] {
                    tr { th.sub colspan=(head.len()) { (heading) } }
                } @else {
                    tr class=[row.hit.then_some("hit")] {
                        @for (k, cell) in row.cells.iter().enumerate() { td class=[class(k, cell)] { (cell) } }
                    }
                }
            } }
        } }
    }
}

/// A table whose rows a click on a heading sorts by that column: columns of numbers by their [`value`]s, words by letter.
pub fn sorting(head: &[Column], rows: &[Row]) -> Markup {
    html! { div.sorts { (table(head, rows)) } }
}

/// A number in a table that sorts, to four digits with its unit; an empty cell where there is none.
pub fn value(x: Option<f64>, unit: &str) -> Markup {
    html! { @if let Some(x) = x { data value=(x) { (quantity(x, unit, 4)) } } }
}

/// How many characters of a cell are seen: those outside tags.
fn shown(cell: &str) -> usize {
    cell.split('<').map(|part| part.rsplit('>').next().unwrap_or(part).chars().count()).sum()
}

/// The legend of lines.
pub(crate) fn legend(entries: &[(&str, Markup)]) -> Markup {
    html! {
        div.legend { @for (class, word) in entries {
            span {
                svg viewBox="0 0 30 12" aria-hidden="true" {
                    @if *class == "band" {
                        rect.fill-band width="30" height="12" {}
                    } @else if class.starts_with("bar") || *class == "gone" {
                        rect class=(class) x="1" y="1" width="28" height="10" {}
                    } @else if let Some(class) = class.strip_prefix("dots ") {
                        @for x in [5, 15, 25] { circle class=(class) cx=(x) cy="6" r="2.6" {} }
                    } @else {
                        path class={ "line " (class) } d="M0 6L30 6" {}
                    }
                }
                (word)
            }
        } }
    }
}

/// The scale of cells from light to dark.
pub(crate) fn scale(from: &str, to: &str) -> Markup {
    html! {
        div.scale {
            span { (from) }
            svg viewBox="0 0 120 12" aria-hidden="true" {
                @for k in 0..9 { rect class={ "h" (k) } x=(f64::from(k) * 13.33) width="13.4" height="12" {} }
            }
            span { (to) }
        }
    }
}

/// Which of nine shades for a value from 0 to 1.
pub(crate) fn shade(x: f64) -> usize {
    if x.is_finite() { (x.clamp(0.0, 1.0) * 8.999) as usize } else { 0 }
}

/// A list.
pub(crate) fn list(items: &[impl Render]) -> Markup {
    html! { @if !items.is_empty() { ul { @for item in items { li { (item) } } } } }
}

/// JSON for a script element: nothing in it may end the element or open a comment, and `<` stands in texts alone.
fn within_script(json: &str) -> Markup {
    PreEscaped(json.replace('<', "\\u003c"))
}

/// The line above everything: what the page is about, and the switch between light and dark.
pub fn head(title: &str, badge: Option<&str>) -> Markup {
    html! {
        header.top {
            b { (title) }
            @if let Some(badge) = badge { span.badge { (badge) } }
            span style="flex:1" {}
            button #theme .no-print { "light / dark" }
        }
    }
}

/// The whole page. It may load nothing: the policy in its head forbids every request.
pub fn page(title: &str, top: &Markup, sections: &[Section], data: Option<&str>) -> String {
    let body = html! {
        @for s in sections { section id=(s.id) { h2 { (s.title) } (s.body) } }
    };
    let linked = |key: &str| {
        let link = format!("\"#g-{key}\"");
        body.0.contains(&link) || top.0.contains(&link)
    };
    let used: Vec<_> = GLOSSARY.iter().filter(|g| linked(g.0)).collect();
    let page = html! {
        (DOCTYPE)
        html lang="en" data-theme="light" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width,initial-scale=1";
                meta http-equiv="Content-Security-Policy"
                    content="default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    (top)
                    nav.no-print aria-label="Contents" { @for s in sections { a href={ "#" (s.id) } { (s.short) } } }
                    (body)
                    @if !used.is_empty() {
                        section #glossary { h2 { "Words" } dl.gloss {
                            @for (key, word, text) in used { dt id={ "g-" (key) } { (word) } dd { (text) } }
                        } }
                    }
                }
                @if let Some(data) = data { script #recordings type="application/json" { (within_script(data)) } }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    page.into_string() + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_within_the_page_cannot_leave_its_element() {
        let name = "<!--<script></script>";
        let page = page(name, &text(name), &[], Some(&serde_json::json!({"name": name}).to_string()));
        assert!(!page.contains(name) && page.contains("&lt;!--&lt;script&gt;"), "{page}");
        let data = page.split("application/json\">").nth(1).unwrap().split("</script>").next().unwrap();
        assert_eq!(serde_json::from_str::<serde_json::Value>(data).unwrap()["name"], name);
    }
}
