//! A picture of the parameters with their intervals: each over its refined value, so that all share an axis.

use im_chart::short;
use im_model::ParameterId;
use maud::{Markup, html};

use super::super::page::{figure, legend, text};
use super::super::words::quantity_name;
use crate::diagnosis::{Diagnosis, ParameterChange};
use crate::uncertainty::{HALF_95, MachineQuantity, is_open};

/// Where the axis ends: from nothing to twice the value.
const ENDS: [f64; 2] = [0.0, 2.0];
/// Pixels: names, picture, a line.
const NAMES: f64 = 262.0;
const RIGHT: f64 = 460.0;
const LINE: f64 = 20.0;

fn across(ratio: f64) -> f64 {
    NAMES + 8.0 + (ratio.clamp(ENDS[0], ENDS[1]) - ENDS[0]) / (ENDS[1] - ENDS[0]) * (RIGHT - NAMES - 16.0)
}

/// Nothing where no parameter has an interval.
pub(crate) fn picture(d: &Diagnosis) -> Markup {
    let shown: Vec<(&ParameterChange, f64)> = d
        .parameters
        .iter()
        .filter(|p| p.after != 0.0 && !p.is_of_a_curve())
        .map(|p| (p, HALF_95 * p.std / p.after.abs()))
        .collect();
    if shown.is_empty() {
        return html! {};
    }
    let mut entries = vec![("refined", text("refined, ± 95 %"))];
    entries.extend(shown.iter().any(|(p, _)| is_open(p.after, p.std)).then(|| ("third", text("hardly determined"))));
    entries.extend(shown.iter().any(|(p, _)| given(d, p)).then(|| ("base solid", text("as given"))));
    let caption = "Every parameter over its refined value. Where the value as given lies beyond the axis it stands at its end.";
    html! { (legend(&entries)) (figure(lines(d, &shown), caption)) }
}

/// Whether the motor as given has it: not a parameter of an effect that was added.
fn given(d: &Diagnosis, p: &ParameterChange) -> bool {
    match p.quantity {
        MachineQuantity::Parameter(ParameterId::Effect(e, _)) => d.case.motor.machine.effects().is_on(e),
        _ => p.before != 0.0,
    }
}

fn lines(d: &Diagnosis, shown: &[(&ParameterChange, f64)]) -> Markup {
    let height = shown.len() as f64 * LINE + 24.0;
    html! {
        svg.chart viewBox={ "0 0 " (short(RIGHT)) " " (short(height)) } role="img" aria-label="parameters with their intervals" {
            @for tick in [0.0, 0.5, 1.0, 1.5, 2.0] {
                path.grid d={ "M" (short(across(tick))) " 4L" (short(across(tick))) " " (short(height - 20.0)) } {}
                text.tick x=(short(across(tick))) y=(short(height - 6.0)) text-anchor="middle" { (short(tick)) }
            }
            @for (k, (p, half)) in shown.iter().enumerate() {
                @let y = (k as f64 + 0.5) * LINE + 4.0;
                @let class = if is_open(p.after, p.std) { "third" } else { "refined" };
                @let half = if half.is_finite() { *half } else { f64::INFINITY };
                text x=(short(NAMES)) y=(short(y + 4.0)) text-anchor="end" { (quantity_name(p.quantity).0) }
                path class={ "line solid " (class) } d={ "M" (short(across(1.0 - half))) " " (short(y)) "L" (short(across(1.0 + half))) " " (short(y)) } {}
                circle class=(class) cx=(short(across(1.0))) cy=(short(y)) r="3.2" {}
                @if given(d, p) {
                    path.line.solid.base d={ "M" (short(across(p.before / p.after))) " " (short(y - 6.0)) "v12" } {}
                }
            }
        }
    }
}
