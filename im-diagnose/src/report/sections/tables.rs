//! Tables of steady states: every reading and what the models make of it, over what was varied.

use im_chart::{Axis, Chart};
use im_identify::offline::Experiment;
use maud::{Markup, html};

use super::super::overlay::{channel_words, label};
use super::super::page::{Section, drawn, figure, legend, text};
use super::super::story::{Story, View};
use crate::format::{number, quantity};

/// What is varied by less than this part of its largest value is not varied.
const VARIED: f64 = 0.1;

/// Nothing without tables.
pub(crate) fn section(s: &Story) -> Option<Section> {
    if s.tables.is_empty() {
        return None;
    }
    let mut entries = vec![("dots measured", text("readings"))];
    entries.extend(s.shown.iter().map(|m| (m.class, text(m.name))));
    let body = html! {
        (legend(&entries))
        @for table in &s.tables {
            h3 { (label(table)) }
            div.grid2 { @for c in 0..table.experiment.channels.len() { (picture(s, table, c)) } }
        }
    };
    Some(Section { id: "tables", short: "tables", title: "Tables, measured and modelled", body })
}

/// What was varied from row to row: voltage, torque or speed, by the first that varies; else the number of the row.
fn over(e: &Experiment) -> (Vec<f64>, &'static str) {
    let voltage = e.u_s.iter().map(|u| 1.5f64.sqrt() * u.norm()).collect::<Vec<f64>>();
    let speed = e.imposed_speed.clone().unwrap_or_default();
    let varies = |x: &Vec<f64>| {
        let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        high - low > VARIED * high.abs().max(low.abs())
    };
    let all = [(voltage, "voltage, line to line rms, V"), (e.tau_load.clone(), "torque, Nm"), (speed, "speed, rad/s")];
    let rows = || (1..=e.len()).map(|k| k as f64).collect();
    all.into_iter().find(|(x, _)| varies(x)).unwrap_or_else(|| (rows(), "row"))
}

fn picture(s: &Story, view: &View, c: usize) -> Markup {
    let channel = &view.experiment.channels[c];
    let (x, what) = over(&view.experiment);
    let mut order: Vec<usize> = (0..x.len()).filter(|&k| channel.is_valid(k)).collect();
    order.sort_by(|&a, &b| x[a].total_cmp(&x[b]));
    let points = |y: &[f64]| order.iter().map(|&k| [x[k], y[k]]).filter(|p| p[1].is_finite()).collect::<Vec<[f64; 2]>>();
    let measured = points(&channel.values);
    let modelled: Vec<Vec<[f64; 2]>> = view.predictions.iter().map(|p| points(&p[c])).collect();
    let (name, unit) = channel_words(&channel.name, channel.kind);
    let values = modelled.iter().flatten().chain(&measured).map(|p| p[1]);
    let mut chart = Chart::new(
        format!("{name} over {what}"),
        Axis::around(x.iter().copied(), what),
        Axis::around(values, format!("{name}, {unit}")),
    );
    for (points, model) in modelled.iter().zip(&s.shown) {
        chart.line(points, model.class);
    }
    chart.dots(&measured, "measured");
    let off = |y: &[[f64; 2]]| {
        let sum: f64 = y.iter().zip(&measured).map(|(a, b)| (a[1] - b[1]).powi(2)).sum();
        (sum / y.len().max(1) as f64).sqrt()
    };
    let said = modelled.last().map_or_else(String::new, |last| {
        format!(
            "The last model is off by {} rms, {} times the instruments' errors.",
            quantity(off(last), unit, 2),
            number(off(last) / channel.sigma, 2)
        )
    });
    figure(drawn(chart), said)
}
