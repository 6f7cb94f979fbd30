//! Where the power of tables goes, by the refined model.

use maud::html;

use super::super::page::{Row, Section, numbers, table, words};
use super::super::story::Story;
use crate::format::{interval, number};
use crate::losses::{Estimate, ModelPoint};

/// Above the columns.
pub(crate) const HEAD: [&str; 10] = [
    "table",
    "torque, Nm",
    "slip, %",
    "input, W",
    "stator, W",
    "rotor, W",
    "iron, W",
    "friction, W",
    "stray, W",
    "efficiency, %",
];

/// The cells of a row.
pub(crate) fn cells(p: &ModelPoint) -> [String; 10] {
    let watts = |e: Estimate| interval(e.value, e.half_95, "");
    [
        p.table.clone(),
        number(p.torque_nm, 3),
        number(100.0 * p.slip, 3),
        number(p.input_w, 4),
        watts(p.stator_w),
        watts(p.rotor_w),
        watts(p.iron_w),
        watts(p.friction_windage_w),
        watts(p.stray_w),
        if p.torque_nm == 0.0 {
            "–".to_owned()
        } else {
            interval(100.0 * p.efficiency.value, 100.0 * p.efficiency.half_95, "")
        },
    ]
}

/// Nothing where there is no table.
pub(super) fn section(s: &Story) -> Option<Section> {
    let points = &s.d.losses;
    if points.is_empty() {
        return None;
    }
    let head: Vec<_> = HEAD.iter().enumerate().map(|(k, name)| if k == 0 { words(name) } else { numbers(name) }).collect();
    let body = html! {
        p { "What the refined model loses in each row that turns, at the temperature of the row, with 95 % intervals. " code { "im losses" } " beside it segregates by the standards." }
        (table(&head, &points.iter().map(|p| Row::of(cells(p))).collect::<Vec<_>>()))
    };
    Some(Section { id: "losses", short: "losses", title: "Where the power goes", body })
}
