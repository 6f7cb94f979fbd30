//! Measured against modelled, and the difference of the two with the band of prediction, which is thinner than a line beside the signal itself:
//! whether readings lie as far off the last model as they may.

use im_chart::{Axis, Chart};
use im_model::Prediction;
use maud::{Markup, html};

use super::super::overlay::{band_words, channel_words, label};
use super::super::page::{drawn, figure, legend, text};
use super::super::story::View;
use crate::format::{number, sentence};

/// Dots of a picture.
const DOTS: usize = 400;
/// Stretches of the modelled value over which the band is averaged.
const BINS: usize = 24;
/// A band is shown up to this many times the largest difference.
const BAND_SHOWN: f64 = 2.0;

/// Of the recording that no fit has seen, else of the first; nothing where no fit says how sure it is.
pub(crate) fn section(views: &[View], by_training: Option<&Prediction>) -> Markup {
    let Some(view) = views.iter().find(|v| v.held_out).or(views.first()).filter(|v| !v.band.is_empty()) else { return html! {} };
    let channels: Vec<Markup> = (0..view.experiment.channels.len()).filter_map(|c| pictures(view, c)).collect();
    let entries = [("dots measured", text("readings")), ("refined", text("as modelled")), ("band", band_words(views))];
    html! {
        @if !channels.is_empty() {
            h3 { "Measured against modelled: " (label(view)) }
            (legend(&entries))
            @if let Some(said) = said(views, by_training) { p { (said) } }
            @for pair in &channels { div.grid2 { (pair) } }
        }
    }
}

/// How much of the held-out recording lies inside: of the band shown, and of one that was made without it.
fn said(views: &[View], by_training: Option<&Prediction>) -> Option<String> {
    let held_out = views.iter().find(|v| v.held_out)?;
    let (inside, all) = held_out.inside();
    let without = held_out.left().inside(by_training?);
    let percent = |inside: usize, all: usize| number(100.0 * inside as f64 / all as f64, 3);
    Some(format!(
        "{} % of the held-out readings lie in the band. A band made from the training recordings alone holds {} %.",
        percent(inside, all),
        percent(without.iter().map(|w| w.0).sum(), without.iter().map(|w| w.1).sum())
    ))
}

fn pictures(view: &View, c: usize) -> Option<Markup> {
    let (channel, band) = (&view.experiment.channels[c], &view.band[c]);
    let modelled = view.predictions.last().map(|p| &p[c])?;
    let rows = view.compared(c);
    if rows.len() < BINS {
        return None;
    }
    let points: Vec<[f64; 2]> =
        rows.iter().step_by(rows.len().div_ceil(DOTS)).map(|&k| [modelled[k], channel.values[k]]).collect();
    let (lo, hi) = rows.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &k| (a.min(modelled[k]), b.max(modelled[k])));
    let mut widths = [(0.0, 0usize); BINS];
    for &k in &rows {
        let bin = (((modelled[k] - lo) / (hi - lo).max(1e-300)) * BINS as f64) as usize;
        let (sum, count) = &mut widths[bin.min(BINS - 1)];
        *sum += band[k];
        *count += 1;
    }
    let middle = |bin: usize| lo + (hi - lo) * (bin as f64 + 0.5) / BINS as f64;
    let known = widths.iter().enumerate().filter(|(_, w)| w.1 > 0);
    let shade: Vec<[f64; 3]> = known
        .map(|(bin, (sum, count))| {
            let half = sum / *count as f64;
            [middle(bin), -half, half]
        })
        .collect();
    let off: Vec<[f64; 2]> = points.iter().map(|[x, y]| [*x, y - x]).collect();
    // A band far wider than what is off would leave nothing to see of that.
    let most = BAND_SHOWN * off.iter().map(|p| p[1].abs()).fold(0.0, f64::max);
    let shade: Vec<[f64; 3]> = shade.iter().map(|[x, lower, upper]| [*x, lower.max(-most), upper.min(most)]).collect();
    let (name, unit) = channel_words(&channel.name, channel.kind);
    let around = || points.iter().flatten().copied();
    let modelled_axis = || Axis::around(around(), format!("modelled, {unit}"));
    let mut against = Chart::new(
        format!("{name}, measured against modelled"),
        modelled_axis(),
        Axis::around(around(), format!("{name}, measured, {unit}")),
    );
    let band: Vec<[f64; 3]> = shade.iter().map(|[x, lower, upper]| [*x, x + lower, x + upper]).collect();
    against.band(&band, "fill-band");
    against.line(&[[lo, lo], [hi, hi]], "refined solid thin");
    against.dots(&points, "measured");
    let extent = off.iter().map(|p| p[1]).chain(shade.iter().flat_map(|s| [1.2 * s[1], 1.2 * s[2]]));
    let mut difference = Chart::new(
        format!("{name}, measured less modelled, over modelled"),
        modelled_axis(),
        Axis::around(extent, format!("measured − modelled, {unit}")),
    );
    difference.band(&shade, "fill-band");
    difference.line(&[[lo, 0.0], [hi, 0.0]], "refined solid thin");
    difference.dots(&off, "measured");
    let share = number(100.0 * view.inside_of(c) as f64 / rows.len() as f64, 3);
    let said = format!("{} {share} % of the readings lie in the band.", sentence(&name));
    Some(html! { (figure(drawn(against), "")) (figure(drawn(difference), said)) })
}
