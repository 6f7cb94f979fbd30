//! The load torque where no column holds it.

use im_chart::{Axis, Chart};
use im_model::MotorFile;
use maud::html;

use super::super::load_words::words;
use super::super::page::{Section, drawn, figure};
use crate::loads::{Found, FoundLoad, Loads};

fn picture(f: &FoundLoad) -> Option<Chart> {
    let (points, (low, high)) = (f.found.points(), f.found.range()?);
    let (what, axis) = match f.found {
        Found::Speed(_) => ("speed", "speed, rad/s"),
        _ => ("load torque", "load torque, Nm"),
    };
    let end = points.last().map_or(1.0, |p| p[0]);
    let y = Axis::around([low, high, 0.0], axis);
    let mut chart =
        Chart::new(format!("{what} over time, {}", f.recording), Axis::new(0.0, end, "time, s"), y).sized(440.0, 200.0);
    chart.band(&points.iter().map(|p| [p[0], p[1] - 2.0 * p[2], p[1] + 2.0 * p[2]]).collect::<Vec<_>>(), "fill-refined");
    chart.level(0.0, "zero");
    chart.line(&points.iter().map(|p| [p[0], p[1]]).collect::<Vec<_>>(), "refined solid");
    Some(chart)
}

pub(crate) fn section(loads: &Loads, motor: &MotorFile) -> Option<Section> {
    if loads.is_empty() {
        return None;
    }
    let body = html! {
        @if let Some(note) = loads.note(motor) { p { (note) } }
        div.grid2 { @for f in &loads.found {
            @match picture(f) {
                Some(picture) => (figure(drawn(picture), words(f))),
                None => p { (words(f)) },
            }
        } }
    };
    Some(Section { id: "load", short: "load", title: loads.title(), body })
}
