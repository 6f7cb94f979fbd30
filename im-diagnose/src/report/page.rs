//! The page around the sections: head, style, script, glossary; and the small pieces of HTML that sections are made of.

use std::fmt::Write as _;

use super::words::escape;

const STYLE: &str = include_str!("assets/page.css");
const SCRIPT: &str = include_str!("assets/page.js");

/// Words that need explaining: key, word, explanation.
const GLOSSARY: &[(&str, &str, &str)] = &[
    (
        "floor",
        "noise floor",
        "Mean squared error divided by the squared sensor noise. 1.0 is as good as the sensors can tell; 4.0 means errors twice as large as the noise.",
    ),
    (
        "noise",
        "sensor noise (σ)",
        "Standard deviation of the random part of a sensor's reading, estimated from the recordings. The noise band in the pictures is ±2σ: 95 of 100 readings of a perfect model lie in it.",
    ),
    ("train", "training", "The recordings that the parameters were fitted to and the causes were sought in."),
    ("holdout", "held out", "A recording that no fit has seen. A cause that is real lowers the error there too."),
    ("rmse", "rms error", "Root mean square of measured minus modelled, in the unit of the signal."),
    (
        "fit",
        "fit percent",
        "100 (1 − ‖error‖/‖signal − its mean‖). Close to 100 for any decent model, so that it hides small causes; the noise floor does not.",
    ),
    (
        "score",
        "score",
        "How much of the error an effect could explain that no refit of the present parameters can, in squared standard deviations. By chance alone it stays below the threshold in 99 of 100 analyses.",
    ),
    (
        "keep",
        "keep",
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
        "A linear machine shows its inverse-Γ circuit at its terminals, not how the leakage is shared between stator and rotor. This value follows from the inverse-Γ circuit with the ratio L_ls/L_lr of the motor file, and has no interval of its own.",
    ),
    (
        "interval",
        "± interval",
        "95 % interval: sensor noise, coloured as the residual shows it; the curves of the effects, which may differ from the machine's by 5 % of what they explain; and the ratio of the leakages, which may be off by 20 %. It holds if the effects in the model are the right ones.",
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
        "correlation",
        "correlation",
        "1: the two signals rise and fall together; −1: one rises as the other falls; 0: no relation along a straight line.",
    ),
];

/// A word with its explanation: a tooltip, and a link to the glossary at the end for paper and touch.
pub(crate) fn term(key: &str, shown: &str) -> String {
    let text = GLOSSARY.iter().find(|g| g.0 == key).map_or("", |g| g.2);
    format!(r##"<a class="term" href="#g-{key}" title="{}">{}</a>"##, escape(text), escape(shown))
}

/// A section with a heading.
pub(crate) struct Section {
    pub id: &'static str,
    /// In the list of contents.
    pub short: &'static str,
    pub title: String,
    pub body: String,
}

/// A caption under a picture.
pub(crate) fn figure(picture: &str, caption: &str) -> String {
    format!("<figure>{picture}<figcaption>{caption}</figcaption></figure>")
}

/// A table; columns whose heading starts with `#` hold numbers.
pub(crate) fn table(head: &[String], rows: &[(bool, Vec<String>)]) -> String {
    let number: Vec<bool> = head.iter().map(|h| h.starts_with('#')).collect();
    let mut out = String::from(r#"<div class="scroll"><table><thead><tr>"#);
    for h in head {
        let class = if h.starts_with('#') { r#" class="n""# } else { "" };
        let _ = write!(out, "<th{class}>{}</th>", h.trim_start_matches('#'));
    }
    out.push_str("</tr></thead><tbody>");
    for (hit, row) in rows {
        // A single cell is a heading within the table.
        if let [heading] = &row[..] {
            let _ = write!(out, r#"<tr><th class="sub" colspan="{}">{heading}</th></tr>"#, head.len());
            continue;
        }
        out.push_str(if *hit { r#"<tr class="hit">"# } else { "<tr>" });
        for (k, cell) in row.iter().enumerate() {
            let class = match number.get(k) {
                Some(true) => r#" class="n""#,
                _ if shown(cell) < 30 => r#" class="k""#,
                _ => "",
            };
            let _ = write!(out, "<td{class}>{cell}</td>");
        }
        out.push_str("</tr>");
    }
    out.push_str("</tbody></table></div>");
    out
}

/// How many characters of a cell are seen: those outside tags.
fn shown(cell: &str) -> usize {
    let mut inside = false;
    cell.chars()
        .filter(|c| {
            inside |= *c == '<';
            let seen = !inside;
            inside &= *c != '>';
            seen
        })
        .count()
}

/// The legend of lines.
pub(crate) fn legend(entries: &[(&str, String)]) -> String {
    let mut out = String::from(r#"<div class="legend">"#);
    for (class, word) in entries {
        let picture = match *class {
            "noise" => r#"<rect class="fill-noise" width="30" height="12"/>"#.to_owned(),
            c if c.starts_with("bar") || c == "gone" => format!(r#"<rect class="{c}" x="1" y="1" width="28" height="10"/>"#),
            c => format!(r#"<path class="line {c}" d="M0 6L30 6"/>"#),
        };
        let _ = write!(out, r#"<span><svg viewBox="0 0 30 12" aria-hidden="true">{picture}</svg>{word}</span>"#);
    }
    out.push_str("</div>");
    out
}

/// The scale of cells from light to dark.
pub(crate) fn scale(from: &str, to: &str) -> String {
    let cells: String =
        (0..9).map(|k| format!(r#"<rect class="h{k}" x="{}" width="13.4" height="12"/>"#, f64::from(k) * 13.33)).collect();
    format!(
        r#"<div class="scale"><span>{from}</span><svg viewBox="0 0 120 12" aria-hidden="true">{cells}</svg><span>{to}</span></div>"#
    )
}

/// Which of nine shades for a value from 0 to 1.
pub(crate) fn shade(x: f64) -> usize {
    if x.is_finite() { (x.clamp(0.0, 1.0) * 8.999) as usize } else { 0 }
}

/// A list.
pub(crate) fn list(items: &[String]) -> String {
    if items.is_empty() {
        return String::new();
    }
    format!("<ul>{}</ul>", items.iter().map(|i| format!("<li>{i}</li>")).collect::<String>())
}

/// The whole page. It may load nothing: the policy in its head forbids every request.
pub(crate) fn page(title: &str, top: &str, sections: &[Section], data: Option<&str>) -> String {
    let contents: String = sections.iter().map(|s| format!(r##"<a href="#{}">{}</a>"##, s.id, s.short)).collect();
    let body: String =
        sections.iter().map(|s| format!(r#"<section id="{}"><h2>{}</h2>{}</section>"#, s.id, s.title, s.body)).collect();
    let used: String = GLOSSARY
        .iter()
        .filter(|g| {
            let link = format!("\"#g-{}\"", g.0);
            body.contains(&link) || top.contains(&link)
        })
        .map(|(key, word, text)| format!(r#"<dt id="g-{key}">{}</dt><dd>{}</dd>"#, escape(word), escape(text)))
        .collect();
    let data = data.map_or(String::new(), |d| {
        format!(r#"<script type="application/json" id="recordings">{}</script>"#, d.replace("</", "<\\/"))
    });
    let words = if used.is_empty() {
        String::new()
    } else {
        format!(r#"<section id="glossary"><h2>Words</h2><dl class="gloss">{used}</dl></section>"#)
    };
    format!(
        r#"<!DOCTYPE html>
<html lang="en" data-theme="light"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<title>{}</title><style>{STYLE}</style></head>
<body><main>{top}<nav class="no-print" aria-label="Contents">{contents}</nav>{body}
{words}</main>{data}<script>{SCRIPT}</script></body></html>
"#,
        escape(title)
    )
}
