//! The fleet as one page: tables that sort, and links to the report of each motor.

use std::collections::BTreeSet;

use im_diagnose::report::page::{Column, Row as Line, Section, head, numbers, page, sorting, text, value, words};
use im_diagnose::report::{Meta, key_words, run_on_files, short_effect_name};
use im_diagnose::uncertainty::MachineQuantity;
use im_model::EffectId;
use maud::{Markup, html};

use crate::population::FEWEST;
use crate::row::{JobStatus, Row};
use crate::summary::Summary;

/// The page: a string of HTML that needs nothing else but the reports that it links to.
pub fn html(title: &str, rows: &[Row], s: &Summary, how: &Meta) -> String {
    let failed = rows.iter().filter(|r| r.status == JobStatus::Failed).count();
    let flagged = rows.iter().filter(|r| r.is_flagged()).count();
    let odd: BTreeSet<usize> = s.odd.iter().map(|o| s.values[o.value].unit).collect();
    let motors = rows.iter().map(|r| (&r.kind, &r.unit)).collect::<BTreeSet<_>>().len();
    let top = html! {
        (head(title, Some("fleet")))
        h1 {
            (motors) @if motors == 1 { " motor" } @else { " motors" } @if rows.len() > motors { ", judged " (rows.len()) " times" } ": " (flagged) " with something that the model of their type lacks, " (odd.len())
            " with a parameter that is odd among their type, " (failed) " that could not be judged."
        }
        p { "A click on a heading sorts by it. A unit's name leads to its report, where it has one." }
    };
    let sections = [
        Section { id: "attention", short: "to look at", title: "Motors to look at", body: attention(rows, s) },
        Section { id: "types", short: "types", title: "What motors of a type have in common", body: types(s) },
        Section { id: "changed", short: "changes", title: "Changed over time", body: changed(rows, s) },
        Section { id: "all", short: "all", title: "All", body: all(rows) },
        Section { id: "broken", short: "not judged", title: "Could not be judged", body: broken(rows) },
        run_on_files(how),
    ];
    page(title, &top, &sections, None)
}

/// A table without the columns in which no row has anything; `none` where there is no row.
fn table(head: Vec<Column>, rows: impl Iterator<Item = Line>, none: &str) -> Markup {
    let rows: Vec<Line> = rows.collect();
    if rows.is_empty() {
        return html! { p { (none) } };
    }
    let used: Vec<bool> = (0..head.len()).map(|c| rows.iter().any(|r| r.cells.get(c).is_some_and(|x| !x.0.is_empty()))).collect();
    let head: Vec<Column> = head.into_iter().zip(&used).filter_map(|(column, used)| used.then_some(column)).collect();
    let rows: Vec<Line> = rows
        .into_iter()
        .map(|r| Line { cells: r.cells.into_iter().zip(&used).filter_map(|(cell, used)| used.then_some(cell)).collect(), ..r })
        .collect();
    sorting(&head, &rows)
}

/// An effect as the reports call it.
fn effect(name: &str) -> String {
    EffectId::from_name(name).map_or_else(|| name.replace('_', " "), short_effect_name)
}

fn unit(row: &Row) -> Markup {
    let name = &row.unit;
    html! { @if row.report.is_empty() { (name) } @else { a href=(row.report) { (name) } } }
}

fn effects(row: &Row) -> String {
    let listed = |names: &[String]| names.iter().map(|e| effect(e)).collect::<Vec<_>>().join(", ");
    let one = |(k, e): (usize, &String)| match row.rivals.get(k).filter(|r| !r.is_empty()) {
        Some(rivals) => format!("{} (or {})", effect(e), listed(rivals)),
        None => effect(e),
    };
    row.effects.iter().enumerate().map(one).collect::<Vec<_>>().join(", ")
}

fn attention(rows: &[Row], s: &Summary) -> Markup {
    let shown = rows.iter().enumerate().filter_map(|(k, row)| {
        let said = s.of_row(k);
        let cells = [
            unit(row),
            text(&row.kind),
            text(&row.date),
            text(row.verdict.replace('_', " ")),
            text(effects(row)),
            text(said.join("; ")),
            value(row.base_rms_in_sigma, "σ"),
        ];
        (row.is_flagged() || !said.is_empty()).then(|| Line::new(cells))
    });
    let head = vec![
        words("unit"),
        words("type"),
        words("date"),
        words("verdict"),
        words("effects"),
        words("odd or changed"),
        numbers("base model, rms"),
    ];
    table(head, shown, "None.")
}

fn types(s: &Summary) -> Markup {
    let row = |((kind, key), p): (&(String, String), &crate::population::Population)| {
        let unit = MachineQuantity::from_key(key).map_or("", MachineQuantity::unit);
        let cells = [(p.mean.exp(), unit), (100.0 * p.spread, "%"), (p.count as f64, "")].map(|(x, unit)| value(Some(x), unit));
        Line::new([text(kind), text(key_words(key))].into_iter().chain(cells))
    };
    let head = vec![words("type"), words("parameter"), numbers("middle"), numbers("units differ by"), numbers("units")];
    let none = format!(
        "No type has {FEWEST} units that were diagnosed: what they have in common, and which of them is odd, is not told."
    );
    table(head, s.types.iter().map(row), &none)
}

fn changed(rows: &[Row], s: &Summary) -> Markup {
    let line = |row: usize, what: &str, ratio: Option<f64>, distance: Option<f64>| {
        let r = &rows[row];
        Line::new([unit(r), text(&r.date), text(what), value(ratio, ""), value(distance, "σ")])
    };
    let numeric = s.changes.iter().map(|c| line(c.row, &key_words(&c.key), Some(c.ratio), Some(c.distance)));
    let new = s.appeared.iter().map(|a| line(a.row, &format!("{} since {}", effect(&a.effect), a.since), None, None));
    let head = vec![words("unit"), words("date"), words("what"), numbers("times what it was"), numbers("by")];
    table(head, numeric.chain(new), "None: nothing changed, or no unit was judged at two dates.")
}

fn all(rows: &[Row]) -> Markup {
    let row = |r: &Row| Line {
        hit: r.is_flagged(),
        cells: vec![
            unit(r),
            text(&r.kind),
            text(&r.date),
            text(r.status.name()),
            text(r.verdict.replace('_', " ")),
            text(effects(r)),
            value(r.base_rms_in_sigma, "σ"),
            value(r.rms_in_sigma, "σ"),
            value(r.holdout_rms_in_sigma, "σ"),
        ],
    };
    let head = vec![
        words("unit"),
        words("type"),
        words("date"),
        words("status"),
        words("verdict"),
        words("effects"),
        numbers("base model, rms"),
        numbers("last model"),
        numbers("held out"),
    ];
    table(head, rows.iter().filter(|r| r.status != JobStatus::Failed).map(row), "None.")
}

fn broken(rows: &[Row]) -> Markup {
    let shown = rows.iter().filter(|r| r.status == JobStatus::Failed);
    let row = |r: &Row| Line::new([unit(r), text(&r.date), text(&r.error)]);
    table(vec![words("unit"), words("date"), words("why")], shown.map(row), "None.")
}
