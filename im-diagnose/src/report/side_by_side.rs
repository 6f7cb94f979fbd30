//! Several diagnoses side by side, from their `diagnosis.json`: before, after, another machine.

use std::collections::BTreeSet;

use im_model::{EffectId, FileKind};
use maud::html;
use serde_json::Value;

use super::Meta;
use super::page::{Column, Row, Section, figure, head, numbers, page, table, term, words};
use super::sections::{Fall, fall_key, largest, run_on_files, waterfall};
use super::terminal::Text;
use super::words::{channel_name, in_sigma, key_words, short_effect_name};
use crate::format::{interval, number, percent_change, quantity, sentence};
use crate::uncertainty::{HALF_95, MachineQuantity};

/// A diagnosis as read from its file.
#[derive(Clone, Debug, PartialEq)]
pub struct SideBySide {
    /// What to call it.
    pub label: String,
    /// The content of `diagnosis.json`.
    pub diagnosis: Value,
}

impl SideBySide {
    /// From the text of a `diagnosis.json`.
    pub fn parse(label: &str, text: &str) -> Result<Self, String> {
        let not = |e| FileKind::Diagnosis.mistaken(text).unwrap_or_else(|| format!("not JSON: {e}"));
        let diagnosis: Value = serde_json::from_str(text).map_err(|e| format!("{label}: {}", not(e)))?;
        match diagnosis["schema"].as_u64() {
            Some(1) => Ok(Self { label: label.into(), diagnosis }),
            Some(n) => Err(format!("{label}: diagnosis of schema {n}; this version reads schema 1")),
            None => Err(format!("{label}: no `schema`: is this a diagnosis.json?")),
        }
    }

    /// The effects added, each with its rivals.
    fn effects(&self) -> String {
        let names = |list: &Value| -> Vec<String> {
            list.as_array().into_iter().flatten().filter_map(Value::as_str).map(str::to_owned).collect()
        };
        let of = |name: &String| {
            let rivals: Vec<String> = names(&self.diagnosis["alternatives"][name]).iter().map(|r| effect(r)).collect();
            let rivals = if rivals.is_empty() { String::new() } else { format!(" (or {})", rivals.join(", ")) };
            format!("{}{rivals}", effect(name))
        };
        let all: Vec<String> = names(&self.diagnosis["effects"]).iter().map(of).collect();
        if all.is_empty() { "none".into() } else { all.join(", ") }
    }

    /// Whether it names what is missing.
    fn names_a_cause(&self) -> bool {
        matches!(self.diagnosis["verdict"].as_str(), Some("missing_effects" | "confounded"))
    }

    fn verdict(&self) -> String {
        self.diagnosis["verdict"].as_str().unwrap_or("–").replace('_', " ")
    }

    fn falls(&self) -> Vec<Fall> {
        let steps = self.diagnosis["steps"].as_array().map(Vec::as_slice).unwrap_or_default();
        steps
            .iter()
            .map(|s| {
                let last = s["effects"].as_array().and_then(|e| e.last()).and_then(Value::as_str);
                Fall {
                    name: last.map_or("parameters refitted".into(), |e| format!("+ {}", effect(e))),
                    train: s["train"]["chi2_per_sample"].as_f64().unwrap_or(f64::NAN),
                    holdout: s["holdout"]["chi2_per_sample"].as_f64(),
                }
            })
            .collect()
    }

    fn last(&self) -> (&'static str, &Value) {
        let last = self.diagnosis["steps"].as_array().and_then(|s| s.last()).unwrap_or(&Value::Null);
        if last["holdout"].is_object() { ("held out", &last["holdout"]) } else { ("training", &last["train"]) }
    }

    fn parameter(&self, key: &str) -> Option<(f64, f64, f64, &str)> {
        let p = &self.diagnosis["parameters"][key];
        Some((
            p["before"].as_f64()?,
            p["after"].as_f64()?,
            p["std"].as_f64().unwrap_or(f64::NAN),
            p["unit"].as_str().unwrap_or(""),
        ))
    }
}

fn effect(name: &str) -> String {
    EffectId::from_name(name).map_or_else(|| name.replace('_', " "), short_effect_name)
}

/// One sentence on what differs.
fn said(all: &[SideBySide]) -> String {
    let causes: BTreeSet<String> = all.iter().map(SideBySide::effects).collect();
    let verdicts: BTreeSet<String> = all.iter().map(SideBySide::verdict).collect();
    let every_one = all.iter().all(SideBySide::names_a_cause);
    let errors: Vec<String> = all
        .iter()
        .map(|x| {
            let (which, e) = x.last();
            format!("{}: {} rms {which}", x.label, e["chi2_per_sample"].as_f64().map_or("–".into(), in_sigma))
        })
        .collect();
    let agree = if all.len() < 2 {
        String::new()
    } else if every_one && causes.len() == 1 {
        format!("All name the same cause ({}). ", causes.iter().next().map_or("", |s| s))
    } else if every_one {
        "They name different causes. ".into()
    } else if verdicts.len() == 1 {
        format!("All are {}. ", verdicts.iter().next().map_or("", |s| s))
    } else {
        "The verdicts differ. ".into()
    };
    format!("{agree}Error that is left: {}.", errors.join("; "))
}

fn keys(all: &[SideBySide], of: impl Fn(&SideBySide) -> &Value) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for x in all {
        for k in of(x).as_object().into_iter().flat_map(|o| o.keys()) {
            if !out.contains(k) {
                out.push(k.clone());
            }
        }
    }
    out
}

fn verdict_rows(all: &[SideBySide]) -> Vec<Vec<String>> {
    let line = |name: &str, f: &dyn Fn(&SideBySide) -> String| {
        std::iter::once(name.to_owned()).chain(all.iter().map(f)).collect::<Vec<_>>()
    };
    let mut rows = vec![
        line("verdict", &|x| x.verdict()),
        line("effects added", &|x| x.effects()),
        line("error left, rms", &|x| {
            let (which, e) = x.last();
            e["chi2_per_sample"].as_f64().map_or("–".into(), |v| format!("{} {which}", in_sigma(v)))
        }),
    ];
    for key in keys(all, |x| &x.last().1["rmse"]) {
        let (name, unit) = channel_name(&key);
        rows.push(line(&format!("rms error, {name}"), &|x| {
            x.last().1["rmse"][&key].as_f64().map_or("–".into(), |v| format!("{} {unit}", number(v, 3)))
        }));
    }
    rows
}

fn parameter_rows(all: &[SideBySide], compare: bool) -> Vec<Vec<String>> {
    // The base parameters first, in their usual order; JSON does not keep it.
    let order = |key: &String| im_model::BaseParameter::ALL.iter().position(|p| p.key() == key).unwrap_or(usize::MAX);
    let mut keys = keys(all, |x| &x.diagnosis["parameters"]);
    // Coefficients of a learned curve say nothing by themselves.
    keys.retain(|key| !MachineQuantity::from_key(key).is_some_and(MachineQuantity::is_of_a_curve));
    keys.sort_by(|a, b| order(a).cmp(&order(b)).then(a.cmp(b)));
    keys.iter()
        .map(|key| {
            let mut row = vec![key_words(key)];
            let values: Vec<_> = all.iter().map(|x| x.parameter(key)).collect();
            row.extend(values.iter().map(|v| v.map_or("–".into(), |(_, after, std, unit)| interval(after, HALF_95 * std, unit))));
            if compare {
                let change = match (values.first().copied().flatten(), values.last().copied().flatten()) {
                    (Some(a), Some(b)) => percent_change(a.1, b.1),
                    _ => "–".into(),
                };
                row.push(change);
            }
            row
        })
        .collect()
}

fn score_rows(all: &[SideBySide]) -> Vec<Vec<String>> {
    let mut effects: Vec<(String, f64)> = Vec::new();
    for x in all {
        for r in x.diagnosis["ranking"].as_array().into_iter().flatten() {
            let (Some(e), Some(s)) = (r["effect"].as_str(), r["score"].as_f64()) else { continue };
            match effects.iter_mut().find(|k| k.0 == e) {
                Some(k) => k.1 = k.1.max(s),
                None => effects.push((e.to_owned(), s)),
            }
        }
    }
    effects.sort_by(|a, b| b.1.total_cmp(&a.1));
    effects
        .iter()
        .take(10)
        .map(|(e, _)| {
            std::iter::once(effect(e))
                .chain(all.iter().map(|x| {
                    let r = x.diagnosis["ranking"].as_array().into_iter().flatten().find(|r| r["effect"] == e.as_str());
                    r.map_or("–".into(), |r| {
                        let size =
                            quantity(r["predicted_size"].as_f64().unwrap_or(f64::NAN), r["unit"].as_str().unwrap_or(""), 2);
                        format!("{} ({size})", number(r["score"].as_f64().unwrap_or(f64::NAN), 3))
                    })
                }))
                .collect()
        })
        .collect()
}

/// Rows with their first cell as the beginning of a sentence.
fn headed(rows: Vec<Vec<String>>) -> Vec<Row> {
    let first = |mut row: Vec<String>| {
        row[0] = sentence(&row[0]).trim_end_matches('.').to_owned();
        Row::of(row)
    };
    rows.into_iter().map(first).collect()
}

/// Labels without the folders that all of them share, nor the file name where all have the same: what is left tells them apart.
fn relabelled(all: &[SideBySide]) -> Vec<SideBySide> {
    let parts: Vec<Vec<&str>> = all.iter().map(|x| x.label.split('/').collect()).collect();
    let most = parts.iter().map(|p| p.len() - 1).min().unwrap_or(0);
    let first = (0..most).take_while(|&k| parts.iter().all(|p| p[k] == parts[0][k])).count();
    let last = usize::from(first < most && parts.iter().all(|p| p.last() == parts[0].last()));
    let label = |p: &[&str]| p[first..p.len() - last].join("/");
    all.iter().zip(&parts).map(|(x, p)| SideBySide { label: label(p), diagnosis: x.diagnosis.clone() }).collect()
}

/// The page; `how`: program, command and files.
pub fn side_by_side(all: &[SideBySide], how: &Meta) -> String {
    let all = &relabelled(all)[..];
    let top = html! { (head("Diagnoses side by side", None)) h1 { (said(all)) } };
    let of_each = |column: fn(&String) -> Column| all.iter().map(move |x| column(&x.label));
    let names = |first: &str, last: Option<&str>| -> Vec<Column> {
        [words(first)].into_iter().chain(of_each(|label| numbers(label))).chain(last.map(numbers)).collect()
    };
    let two = (all.len() > 1).then_some("last against first");
    let each: Vec<Vec<Fall>> = all.iter().map(SideBySide::falls).collect();
    // One scale for all, so that bars compare.
    let most = each.iter().map(|falls| largest(falls)).fold(0.0, f64::max);
    let falls = html! {
        p { "Rms in units of the " (term("noise", "sensor noise σ")) ", on a logarithmic scale." }
        (fall_key(each.iter().flatten().any(|f| f.holdout.is_some())))
        div.grid2 {
            @for (x, falls) in all.iter().zip(&each).filter(|(_, falls)| !falls.is_empty()) {
                (figure(waterfall(falls, most), html! { b { (x.label) } ": " (x.verdict()) }))
            }
        }
    };
    let sections = [
        Section {
            id: "verdicts",
            short: "verdicts",
            title: "Verdicts and errors",
            body: table(
                &[words("")].into_iter().chain(of_each(|label| words(label))).collect::<Vec<_>>(),
                &headed(verdict_rows(all)),
            ),
        },
        Section { id: "errors", short: "error", title: "How the error fell", body: falls },
        Section {
            id: "parameters",
            short: "parameters",
            title: "Parameters as refined, ± 95 %",
            body: table(&names("parameter", two), &headed(parameter_rows(all, two.is_some()))),
        },
        Section {
            id: "candidates",
            short: "candidates",
            title: "The ten largest scores of candidates, with predicted size",
            body: table(&names("effect", None), &headed(score_rows(all))),
        },
        run_on_files(how),
    ];
    page("Diagnoses side by side", &top, &sections, None)
}

/// The same for a terminal.
pub fn side_by_side_terminal(all: &[SideBySide], width: usize) -> String {
    let all = &relabelled(all)[..];
    let mut out = Text { width: width.clamp(40, 100), lines: Vec::new() };
    out.paragraph("", &said(all));
    let head = |first: &str| std::iter::once(first.to_owned()).chain(all.iter().map(|x| x.label.clone())).collect::<Vec<_>>();
    for (title, rows) in [
        ("Verdicts", verdict_rows(all)),
        ("Parameters, ± 95 %", parameter_rows(all, false)),
        ("Candidates: score (size)", score_rows(all)),
    ] {
        out.heading(title);
        in_parts(&mut out, &std::iter::once(head("")).chain(rows).collect::<Vec<_>>());
    }
    out.finish()
}

/// What the names before a table's columns may take of a line; longer ones are wrapped.
const NAMES: usize = 26;

/// A table in parts of as many columns as a line holds, each with the names before it.
fn in_parts(out: &mut Text, rows: &[Vec<String>]) {
    let width = |k: usize| rows.iter().filter_map(|r| r.get(k)).map(|c| c.chars().count()).max().unwrap_or(0);
    let columns = rows.first().map_or(0, Vec::len);
    let room = out.width.saturating_sub(2 + width(0).min(NAMES));
    let mut from = 1;
    while from < columns {
        let fits = |to: usize| (from..to).map(|k| 2 + width(k)).sum::<usize>() <= room;
        let to = (from + 2..=columns).take_while(|to| fits(*to)).last().unwrap_or(from + 1);
        let part: Vec<Vec<String>> =
            rows.iter().map(|r| r.iter().take(1).chain(r.iter().take(to).skip(from)).cloned().collect()).collect();
        if from > 1 {
            out.gap();
        }
        out.table(&part, &std::iter::once(false).chain((from..to).map(|_| true)).collect::<Vec<_>>());
        from = to;
    }
}
