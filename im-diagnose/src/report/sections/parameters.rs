//! Parameters before and after, with warnings.

use im_model::{EffectId, ParameterId};

use maud::html;

use super::super::page::{Row, Section, numbers, table, term, text, words};
use super::super::story::{Story, rests_on};
use super::super::words::{change_words, is_new, quantity_name, short_effect_name};
use super::intervals;
use crate::diagnosis::{Diagnosis, ParameterChange};
use crate::format::{interval, percent_change, quantity, sentence};
use crate::knowledge::contradicted;
use crate::localise::join;
use crate::uncertainty::{HALF_95, MachineQuantity, is_open};

/// A base parameter that moved by more than this factor is suspicious: nameplates and catalogues are better than that.
const SUSPICIOUS: f64 = 1.5;

/// A parameter that the recordings leave open, with its interval.
fn open(p: &ParameterChange) -> Option<String> {
    let open = p.is_open() && p.after != 0.0 && !p.is_of_a_curve();
    open.then(|| format!("{} ({})", quantity_name(p.quantity).0, interval(p.after, HALF_95 * p.std, p.quantity.unit())))
}

/// All warnings; what the recordings leave open in one.
pub(crate) fn warnings(d: &Diagnosis) -> Vec<String> {
    let left: Vec<String> = d.parameters.iter().filter_map(open).collect();
    let first = (!left.is_empty()).then(|| {
        format!("hardly determined by these recordings: {}{}", left.join(", "), sure_without_shape(d).unwrap_or_default())
    });
    let others = d.parameters.iter().filter_map(|p| contradiction(p, d).or_else(|| warning(p, d).filter(|_| open(p).is_none())));
    first.into_iter().chain(others).map(|w| sentence(&w)).collect()
}

/// That an effect is named for sure although its parameters are open.
fn sure_without_shape(d: &Diagnosis) -> Option<String> {
    let of = |p: &ParameterChange| match p.quantity {
        MachineQuantity::Parameter(ParameterId::Effect(e, _)) if open(p).is_some() => Some(e),
        _ => None,
    };
    // One with a rival is not certain.
    let alone: Vec<EffectId> = d.named().iter().copied().filter(|e| d.rivals(*e).is_empty()).collect();
    let mut shapeless: Vec<EffectId> = d.parameters.iter().filter_map(of).filter(|e| alone.contains(e)).collect();
    shapeless.dedup();
    let names: Vec<String> = shapeless.iter().map(|e| short_effect_name(*e)).collect();
    match names.len() {
        0 => None,
        1 => Some(format!(". That {} is there is certain all the same; these numbers of its curve are not", names[0])),
        _ => Some(format!(". That {} are there is certain all the same; these numbers of their curves are not", join(&names))),
    }
}

/// That a parameter has left what was known of it.
fn contradiction(p: &ParameterChange, d: &Diagnosis) -> Option<String> {
    let MachineQuantity::Parameter(this) = p.quantity else { return None };
    let name = |id| quantity_name(MachineQuantity::Parameter(id)).0;
    let std = |id| (id == this).then_some(p.std);
    contradicted(&d.case.motor, &d.refined.machine, std, name).into_iter().find(|(id, _)| *id == this).map(|(_, said)| said)
}

/// Why a change is suspicious, if it is.
pub(crate) fn warning(p: &ParameterChange, s: &Diagnosis) -> Option<String> {
    if p.is_of_a_curve() {
        return None;
    }
    if let Some(said) = contradiction(p, s) {
        return Some(said);
    }
    if let Some(open) = open(p) {
        return Some(format!("hardly determined by these recordings: {open}"));
    }
    // What follows from one that is open is as open; its move says nothing.
    if is_open(p.after, p.std) {
        return None;
    }
    let (name, _) = quantity_name(p.quantity);
    let MachineQuantity::Parameter(id) = p.quantity else { return None };
    match id {
        ParameterId::Base(_) => {
            let ratio = p.after / p.before;
            // What was given as a guess may be off by as much as it says.
            let known = s.case.motor.known.get(&id).map_or(1.0, |k| 1.0 + k.tolerance);
            let far = ratio.is_finite() && ratio > 0.0 && ratio.ln().abs() > known.max(SUSPICIOUS).ln();
            far.then(|| {
                format!(
                    "{name} moved by {}: either the value given is wrong, or the parameter imitates something that is missing",
                    percent_change(p.before, p.after)
                )
            })
        }
        ParameterId::Effect(e, k) => {
            let info = &e.parameters()[k];
            let m = &s.refined.machine;
            let unit = s.refined.rating.unit_of(info.scale, m.parameters(), m.pole_pairs());
            let most = 2.0 * info.typical.1 * unit;
            (p.after.abs() > most)
                .then(|| format!("{name} is larger than is usual (up to {})", quantity(info.typical.1 * unit, info.unit, 2)))
        }
    }
}

/// What the intervals hold for.
pub(crate) fn note(d: &Diagnosis) -> String {
    let held = "R_r, L_ls, L_lr and L_m follow from the inverse-Γ circuit with L_ls/L_lr as given; their intervals are those of a ratio known as well as the design class in the motor file says.";
    if d.effects.is_empty() {
        return held.into();
    }
    let chosen =
        if d.alternatives.iter().any(|a| !a.is_empty()) { "; with a rival in the place of one, others follow" } else { "" };
    let learned = if d.learned.is_empty() {
        ""
    } else {
        " The coefficients of what was learned stand in motor.refined.toml; its picture shows how well they are known."
    };
    format!(
        "{held} Intervals hold for the effects named, which were chosen from the library by these recordings{chosen}.{learned}"
    )
}

pub(crate) fn section(s: &Story) -> Section {
    let d = s.d;
    let several = d.steps.len() > 1;
    let fitted = if several { "refined " } else { "refitted " };
    // The result first: a narrow screen shows two columns.
    let mut head = vec![words("parameter"), numbers(html! { (fitted) (term("interval", "± 95 % interval")) }), numbers("given")];
    if several {
        head.push(numbers(term("base", "base model refitted")));
    }
    head.push(numbers("change from given"));
    let base = &d.steps[0].machine;
    let row = |p: &ParameterChange| {
        let (name, meaning) = quantity_name(p.quantity);
        let unit = p.quantity.unit();
        let new = is_new(p, d);
        let or_none = |value: Option<f64>| text(value.map_or("–".to_owned(), |x| quantity(x, unit, 4)));
        let mut row = vec![html! {
            span title=(meaning) { (name) }
            @if p.ratio_held { ", " (term("ratio", "ratio held as given")) }
            @if warning(p, d).is_some() || is_open(p.after, p.std) { " " span.flag { "⚠" } }
        }];
        row.push(text(interval(p.after, HALF_95 * p.std, unit)));
        row.push(or_none((!new).then_some(p.before)));
        if several {
            row.push(or_none((!new).then(|| p.quantity.of(base))));
        }
        row.push(text(change_words(p, d)));
        Row::new(row)
    };
    let rows: Vec<Row> = d.parameters.iter().filter(|p| !p.is_of_a_curve()).map(row).collect();
    let body = html! {
        @for w in rests_on(s).into_iter().chain(warnings(d)) { p.warn { "⚠ " (w) } }
        @if let Some(absorbed) = absorbed(s) { p { (absorbed) } }
        p { (note(d)) }
        (intervals::picture(d))
        (table(&head, &rows))
    };
    Section { id: "parameters", short: "parameters", title: "Parameters, before and after", body }
}

/// Which parameter had moved most to imitate what was missing.
fn absorbed(s: &Story) -> Option<String> {
    let d = s.d;
    if d.steps.len() < 2 {
        return None;
    }
    let base = &d.steps[0].machine;
    let (p, moved) = d
        .parameters
        .iter()
        .filter(|p| !p.ratio_held && !matches!(p.quantity, MachineQuantity::Parameter(ParameterId::Effect(..))))
        .map(|p| (p, (p.quantity.of(base) / p.after).ln()))
        .filter(|x| x.1.is_finite())
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    (moved.abs() > 0.03).then(|| {
        format!(
            "Without the missing cause, the refit had bent {} by {} from its refined value to imitate it.",
            quantity_name(p.quantity).0,
            percent_change(1.0, moved.exp())
        )
    })
}
