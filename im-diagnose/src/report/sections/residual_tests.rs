//! What the last model's error still depends on, with its shape.

use im_chart::{Axis, Chart};
use maud::{Markup, html};

use super::super::page::{Section, drawn, figure, list};
use super::super::story::{Story, dependence_words};
use crate::format::{chance, sentence};
use crate::residual_tests::{Dependence, Variable};
use crate::uncertainty::HALF_95;

/// Nothing where nothing is left.
pub(crate) fn section(s: &Story, unexplained: bool) -> Option<Section> {
    let d = s.d;
    if d.dependences.is_empty() {
        return None;
    }
    let last = &d.steps[d.steps.len() - 1];
    let level = last.holdout.as_ref().unwrap_or(&last.train).chi2_per_sample;
    let intro = if unexplained {
        "These are the shapes of what is missing: an effect for the library would have to produce them. Error bars: 95 %."
            .to_owned()
    } else {
        format!(
            "The last model is near the noise of the sensors ({} rms); long recordings show dependences far smaller than the noise of one sample. They are traces of form, not missing causes, unless one matters to you.",
            super::super::words::in_sigma(level)
        )
    };
    let most = if unexplained { 6 } else { 2 };
    let hints = if unexplained { hints(&d.dependences, d.refined.machine.pole_pairs()) } else { Vec::new() };
    Some(Section {
        id: "left",
        short: "what is left",
        title: "What is left",
        body: html! {
            p { (intro) }
            (list(&hints))
            div.grid2 { @for x in d.dependences.iter().take(most) { (chart(x)) } }
        },
    })
}

fn chart(x: &Dependence) -> Markup {
    let part = x.part.label();
    let (label, angle) = match x.variable {
        Variable::RotorAngle(n) => (format!("angle within one of {n} ripples per revolution, °"), true),
        Variable::CurrentAngle(n) => (format!("angle within one of {n} ripples per current period, °"), true),
        v => (v.label(), false),
    };
    let turn = if angle { 180.0 / std::f64::consts::PI } else { 1.0 };
    let points: Vec<[f64; 3]> = x.curve.iter().map(|c| [c[0] * turn, c[1], HALF_95 * c[2]]).collect();
    let ys = points.iter().flat_map(|p| [p[1] - p[2], p[1] + p[2]]).chain([0.0]);
    let mut chart = Chart::new(
        format!("mean error over {label}"),
        Axis::around(points.iter().map(|p| p[0]), label),
        Axis::around(ys, format!("mean error: {part}")),
    );
    chart.level(0.0, "zero");
    for p in points.iter().filter(|p| p[2] > 0.0) {
        chart.whisker(p[0], p[1] - p[2], p[1] + p[2], "refined solid thin");
    }
    let line: Vec<[f64; 2]> = points.iter().map(|p| [p[0], p[1]]).collect();
    chart.line(&line, "refined solid");
    if !angle {
        chart.dots(&line, "refined");
    }
    let by_chance = format!("That it is chance has a probability {}.", chance(x.log_p));
    figure(drawn(chart), format!("{} {by_chance}", sentence(&dependence_words(x))))
}

/// Part of the largest dependence of an error below which another says nothing of its own.
const SHADOW: f64 = 1.0 / 3.0;

/// What such a dependence usually means.
fn hints(left: &[Dependence], pole_pairs: u32) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut add = |t: &str| {
        if !out.iter().any(|x| x == t) {
            out.push(t.to_owned());
        }
    };
    // What is small beside another of the same error is often its shadow.
    let largest = |part| left.iter().filter(|d| d.part == part).map(|d| d.size).fold(0.0, f64::max);
    for d in left.iter().take(4).filter(|d| SHADOW * largest(d.part) <= d.size) {
        match d.variable {
            Variable::RotorAngle(n) if n <= 3 => add(
                "A low order of the rotor angle: unbalance, misalignment, an encoder mounted off its axis, or the load itself.",
            ),
            Variable::RotorAngle(n) => {
                let p = pole_pairs as i32;
                add(&format!(
                    "{n} ripples per revolution: seen from the flux an order of the rotor moves by the pole pairs, so look for {}, {n} or {} of something: rotor bars, stator teeth, gear teeth, fan blades, encoder marks.",
                    n - p,
                    n + p
                ));
            }
            Variable::CurrentAngle(n) if n % 6 == 0 || n == 5 || n == 7 => {
                add("A sixth (fifth, seventh) order of the current's angle: switching of the inverter, or flux harmonics.")
            }
            Variable::CurrentAngle(_) => add("A low order of the current's angle: sensors (offset, gain) or unequal phases."),
            Variable::Flux => add("Flux: the iron of the magnetizing path, in a form that the library's curve does not have."),
            Variable::Current => add("Current: leakage paths, sensors that saturate, or the inverter."),
            Variable::Speed => add("Speed: friction, fan, or a resonance; or a load torque that was not recorded."),
            Variable::Slip => add("Slip: the rotor winding at other frequencies (bars, end rings)."),
            Variable::Time => add("Time: something warms, drifts, or was switched during the recording."),
        }
    }
    out
}
