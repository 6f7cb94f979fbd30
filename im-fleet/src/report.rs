//! The fleet as one page: tables that sort, and links to the report of each motor.

use im_diagnose::format::number;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::row::{JobStatus, Row};
use crate::summary::Summary;

const STYLE: &str = include_str!("assets/fleet.css");
const SCRIPT: &str = include_str!("assets/fleet.js");

/// A cell: what is shown, and by what number it sorts.
enum Cell {
    Words(Markup),
    Number(Option<f64>),
}

fn words(text: &str) -> Cell {
    Cell::Words(html! { (text) })
}

/// The page: a string of HTML that needs nothing else but the reports that it links to.
pub fn html(title: &str, rows: &[Row], s: &Summary) -> String {
    let failed = rows.iter().filter(|r| r.status == JobStatus::Failed).count();
    let flagged = rows.iter().filter(|r| r.is_flagged()).count();
    let odd: std::collections::BTreeSet<usize> = s.odd.iter().map(|o| s.values[o.value].unit).collect();
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head { meta charset="utf-8"; meta name="viewport" content="width=device-width"; title { (title) } style { (PreEscaped(STYLE)) } }
            body {
                h1 { (title) }
                p.say {
                    (rows.len()) " recordings of motors: " (flagged) " with something that the model of their type lacks, " (odd.len())
                    " with a parameter that is odd among their type, " (failed) " that could not be judged."
                }
                h2 { "Motors to look at" }
                (attention(rows, s))
                h2 { "What motors of a type have in common" }
                (types(s))
                h2 { "Changed over time" }
                (changed(rows, s))
                h2 { "All" }
                (all(rows))
                h2 { "Could not be judged" }
                (broken(rows))
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    page.into_string()
}

/// A table whose columns sort; `None` for the class of a row that does not stand out.
fn table(headings: &[(&str, bool)], rows: Vec<(bool, Vec<Cell>)>) -> Markup {
    if rows.is_empty() {
        return html! { p.empty { "None." } };
    }
    html! {
        table {
            thead { tr { @for (name, is_number) in headings { th class=[is_number.then_some("n")] { (name) } } } }
            tbody {
                @for (flagged, cells) in rows {
                    tr class=[flagged.then_some("flagged")] {
                        @for cell in cells {
                            @match cell {
                                Cell::Words(text) => td { (text) },
                                Cell::Number(Some(x)) => td.n data-v=(x) { (number(x, 4)) },
                                Cell::Number(None) => td.n data-v="" {},
                            }
                        }
                    }
                }
            }
        }
    }
}

fn unit(row: &Row) -> Cell {
    let name = &row.unit;
    Cell::Words(if row.report.is_empty() {
        html! { (name) }
    } else {
        html! { a href=(row.report) { (name) } }
    })
}

fn effects(row: &Row) -> String {
    let one = |(k, e): (usize, &String)| match row.rivals.get(k).filter(|r| !r.is_empty()) {
        Some(rivals) => format!("{} (or {})", e.replace('_', " "), rivals.join(", ").replace('_', " ")),
        None => e.replace('_', " "),
    };
    row.effects.iter().enumerate().map(one).collect::<Vec<_>>().join(", ")
}

fn attention(rows: &[Row], s: &Summary) -> Markup {
    let shown = rows.iter().enumerate().filter_map(|(k, row)| {
        let said = s.of_row(k);
        let shown = row.is_flagged() || !said.is_empty();
        shown.then(|| {
            let cells = vec![
                unit(row),
                words(&row.kind),
                words(&row.date),
                words(&row.verdict.replace('_', " ")),
                words(&effects(row)),
                words(&said.join("; ")),
                Cell::Number(row.base_rms_in_sigma),
            ];
            (row.is_flagged(), cells)
        })
    });
    let headings = [
        ("unit", false),
        ("type", false),
        ("date", false),
        ("verdict", false),
        ("effects", false),
        ("odd or changed", false),
        ("base model, rms in σ", true),
    ];
    table(&headings, shown.collect())
}

fn types(s: &Summary) -> Markup {
    let row = |((kind, key), p): (&(String, String), &crate::population::Population)| {
        let cells = vec![
            words(kind),
            words(key),
            Cell::Number(Some(p.mean.exp())),
            Cell::Number(Some(100.0 * p.spread)),
            Cell::Number(Some(p.count as f64)),
        ];
        (false, cells)
    };
    let headings = [("type", false), ("parameter", false), ("middle", true), ("units differ by, %", true), ("units", true)];
    table(&headings, s.types.iter().map(row).collect())
}

fn changed(rows: &[Row], s: &Summary) -> Markup {
    let numbers = s.changes.iter().map(|c| {
        let r = &rows[c.row];
        (true, vec![unit(r), words(&r.date), words(&c.key), Cell::Number(Some(c.ratio)), Cell::Number(Some(c.distance))])
    });
    let new = s.appeared.iter().map(|a| {
        let r = &rows[a.row];
        let what = format!("{} since {}", a.effect.replace('_', " "), a.since);
        (true, vec![unit(r), words(&r.date), words(&what), Cell::Number(None), Cell::Number(None)])
    });
    let headings = [("unit", false), ("date", false), ("what", false), ("times what it was", true), ("σ", true)];
    table(&headings, numbers.chain(new).collect())
}

fn all(rows: &[Row]) -> Markup {
    let row = |r: &Row| {
        let cells = vec![
            unit(r),
            words(&r.kind),
            words(&r.date),
            words(r.status.name()),
            words(&r.verdict.replace('_', " ")),
            words(&effects(r)),
            Cell::Number(r.base_rms_in_sigma),
            Cell::Number(r.rms_in_sigma),
            Cell::Number(r.holdout_rms_in_sigma),
        ];
        (r.is_flagged(), cells)
    };
    let headings = [
        ("unit", false),
        ("type", false),
        ("date", false),
        ("status", false),
        ("verdict", false),
        ("effects", false),
        ("base model, rms in σ", true),
        ("last model", true),
        ("held out", true),
    ];
    table(&headings, rows.iter().filter(|r| r.status != JobStatus::Failed).map(row).collect())
}

fn broken(rows: &[Row]) -> Markup {
    let shown = rows.iter().filter(|r| r.status == JobStatus::Failed);
    table(
        &[("unit", false), ("date", false), ("why", false)],
        shown.map(|r| (false, vec![words(&r.unit), words(&r.date), words(&r.error)])).collect(),
    )
}
