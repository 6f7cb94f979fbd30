//! The recordings as numbers inside the page, so that the reader can zoom; and a still picture for paper.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use im_chart::{Axis, Chart};
use im_identify::offline::ChannelKind;
use im_model::Complex;
use maud::{Markup, html};
use serde_json::{Value, json};

use super::page::{drawn, figure, legend, term, text};
use super::story::{Shown, View};
use super::words::{channel_name, file_name};
use crate::format::number;
use crate::localise::Window;

/// Bytes that the numbers may take.
const BUDGET: usize = 1_450_000;
/// A value: two bytes in base 64.
const BYTES: f64 = 8.0 / 3.0;

/// Names of the models with their classes.
pub(crate) type Models = Vec<(&'static str, &'static str)>;

/// Names and classes of what is shown.
pub(crate) fn models(shown: &[Shown]) -> Models {
    shown.iter().map(|s| (s.name, s.class)).collect()
}

/// A series in 16 bits.
fn packed(values: &[f64]) -> Value {
    let (lo, hi) =
        values.iter().filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    let (lo, hi) = if lo <= hi { (lo, hi) } else { (0.0, 0.0) };
    let offset = 0.5 * (lo + hi);
    let scale = ((hi - lo) / 65_000.0).max(1e-12);
    let bytes: Vec<u8> = values
        .iter()
        .flat_map(|v| {
            let q = if v.is_finite() { (((v - offset) / scale).round() as i64).clamp(-32_767, 32_767) as i16 } else { i16::MIN };
            q.to_le_bytes()
        })
        .collect();
    json!({"q": STANDARD.encode(&bytes), "s": scale, "o": offset})
}

/// The series of a view in a stretch: measured (not a number where it does not count) and models.
fn channel(view: &View, c: usize, from: usize, to: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
    let ch = &view.experiment.channels[c];
    let measured = (from..to).map(|k| if ch.is_valid(k) { ch.values[k] } else { f64::NAN }).collect();
    (measured, view.predictions.iter().map(|p| p[c][from..to].to_vec()).collect())
}

/// What drives the machine, under the signals: a picture with its unit, and its lines with their classes.
struct Applied {
    label: &'static str,
    unit: &'static str,
    lines: Vec<(&'static str, &'static str, Vec<f64>)>,
}

fn applied(view: &View) -> Vec<Applied> {
    let e = &view.experiment;
    let part = |of: fn(&Complex<f64>) -> f64| e.u_s.iter().map(of).collect::<Vec<f64>>();
    let voltage = vec![("α", "measured thin", part(|u| u.re)), ("β", "third thin", part(|u| u.im))];
    let mut out = vec![Applied { label: "applied voltage", unit: "V", lines: voltage }];
    if e.tau_load.iter().any(|t| *t != 0.0) {
        let load = vec![("load", "measured thin", e.tau_load.clone())];
        out.push(Applied { label: "load torque", unit: "Nm", lines: load });
    }
    out
}

/// Every sample of a stretch.
fn full(view: &View, from: usize, to: usize) -> Value {
    let channels: Vec<Value> = (0..view.experiment.channels.len())
        .map(|c| {
            let (m, p) = channel(view, c, from, to);
            let mut one = json!({"m": packed(&m), "p": p.iter().map(|p| packed(p)).collect::<Vec<_>>()});
            if let Some(half) = view.band.get(c) {
                one["h"] = packed(&half[from..to]);
            }
            one
        })
        .collect();
    let step = view.experiment.sample_time_s;
    let drives = drives_as(view, |x| packed(&x[from..to]));
    json!({"from": from as f64 * step, "step": step, "n": to - from, "channels": channels, "drives": drives})
}

fn drives_as(view: &View, pack: impl Fn(&[f64]) -> Value) -> Value {
    applied(view).iter().map(|d| d.lines.iter().map(|l| pack(&l.2)).collect::<Value>()).collect()
}

/// Smallest and largest of every `stride` samples, in their order.
fn extremes(x: &[f64], stride: usize) -> Vec<f64> {
    x.chunks(stride)
        .flat_map(|c| {
            let pick = |better: fn(&f64, &f64) -> bool| {
                c.iter().enumerate().filter(|(_, v)| v.is_finite()).fold(None, |best: Option<(usize, f64)>, (k, v)| match best {
                    Some(b) if !better(v, &b.1) => Some(b),
                    _ => Some((k, *v)),
                })
            };
            match (pick(|a, b| a < b), pick(|a, b| a > b)) {
                (Some(a), Some(b)) if a.0 <= b.0 => [a.1, b.1],
                (Some(a), Some(b)) => [b.1, a.1],
                _ => [f64::NAN; 2],
            }
        })
        .collect()
}

/// A decimated run: the errors too, since extremes of two signals do not subtract.
fn decimated(view: &View, stride: usize) -> Value {
    let n = view.experiment.len();
    let mut rows = 0;
    let channels: Vec<Value> = (0..view.experiment.channels.len())
        .map(|c| {
            let (m, p) = channel(view, c, 0, n);
            let e: Vec<Value> =
                p.iter().map(|p| packed(&extremes(&m.iter().zip(p).map(|(a, b)| a - b).collect::<Vec<_>>(), stride))).collect();
            let p: Vec<Value> = p.iter().map(|p| packed(&extremes(p, stride))).collect();
            let m = extremes(&m, stride);
            rows = m.len();
            let mut one = json!({"m": packed(&m), "p": p, "e": e});
            if let Some(half) = view.band.get(c) {
                one["h"] = packed(&extremes(half, stride));
            }
            one
        })
        .collect();
    let step = view.experiment.sample_time_s * stride as f64 / 2.0;
    let drives = drives_as(view, |x| packed(&extremes(x, stride)));
    json!({"from": 0.0, "step": step, "n": rows, "decimated": true, "channels": channels, "drives": drives})
}

/// The tenth of a second with the largest error of the first model within a window.
fn worst_tenth(view: &View, w: &Window) -> [f64; 2] {
    let t = view.experiment.sample_time_s;
    let (from, to) = ((w.from_s / t).round() as usize, ((w.to_s / t).round() as usize).min(view.experiment.len()));
    let n = ((0.1 / t).round() as usize).clamp(1, (to - from).max(1));
    let e: Vec<f64> = (from..to)
        .map(|k| {
            view.experiment
                .channels
                .iter()
                .zip(&view.predictions[0])
                .filter(|(c, _)| c.is_valid(k))
                .map(|(c, p)| ((c.values[k] - p[k]) / c.sigma).powi(2))
                .sum()
        })
        .collect();
    let mut sum: f64 = e[..n.min(e.len())].iter().sum();
    let (mut at, mut most) = (0, sum);
    for k in n..e.len() {
        sum += e[k] - e[k - n];
        if sum > most {
            (at, most) = (k + 1 - n, sum);
        }
    }
    [(from + at) as f64 * t, (from + at + n) as f64 * t]
}

/// The second (or the whole of a shorter run) with the largest error of the first model.
pub(crate) fn worst(views: &[View]) -> Option<Window> {
    let mut best: Option<Window> = None;
    let (mut rows, mut total) = (0.0, 0.0);
    for (run, v) in views.iter().enumerate() {
        let e = &v.experiment;
        let channels: Vec<_> = e.channels.iter().zip(&v.predictions[0]).collect();
        let squared: Vec<f64> = (0..e.len())
            .map(|k| {
                let used = channels.iter().filter(|(c, _)| c.is_valid(k));
                let (n, sum) = used.fold((0.0, 0.0), |(n, s), (c, p)| (n + 1.0, s + ((c.values[k] - p[k]) / c.sigma).powi(2)));
                if n > 0.0 { sum / n } else { 0.0 }
            })
            .collect();
        if squared.is_empty() {
            continue;
        }
        rows += squared.len() as f64;
        total += squared.iter().sum::<f64>();
        let n = ((1.0 / e.sample_time_s).round() as usize).clamp(1, squared.len());
        let mut sum: f64 = squared[..n].iter().sum();
        let (mut at, mut most) = (0, sum);
        for k in n..squared.len() {
            sum += squared[k] - squared[k - n];
            if sum > most {
                (at, most) = (k + 1 - n, sum);
            }
        }
        let level = (most / n as f64).max(0.0).sqrt();
        if best.as_ref().is_none_or(|b| level > b.level) {
            let t = |k: usize| k as f64 * e.sample_time_s;
            best = Some(Window { run, name: e.name.clone(), from_s: t(at), to_s: t(at + n), level, average: 0.0 });
        }
    }
    best.map(|b| Window { average: (total / f64::max(rows, 1.0)).sqrt(), ..b })
}

/// The JSON that the page's script reads.
pub(crate) fn data(views: &[View], models: &Models, worst: &Window) -> String {
    let names: Vec<String> = views.iter().map(label).collect();
    // Beside the series of each channel: the band, and two voltages and a load.
    let per_row = |v: &View, series: usize| {
        let band = usize::from(!v.band.is_empty());
        (v.experiment.channels.len() * (series + band) + 3) as f64 * BYTES
    };
    let everything: f64 = views.iter().map(|v| v.experiment.len() as f64 * per_row(v, 1 + models.len())).sum();
    let fits = everything <= BUDGET as f64;
    // What decimated runs cost per row over the stride, after the worst stretch has had a quarter of the budget.
    let dense: f64 = views.iter().map(|v| v.experiment.len() as f64 * 2.0 * per_row(v, 1 + 2 * models.len())).sum();
    let stride = (dense / (0.75 * BUDGET as f64)).ceil().max(4.0) as usize;
    let runs: Vec<Value> = views
        .iter()
        .enumerate()
        .map(|(k, v)| {
            let n = v.experiment.len();
            let t = v.experiment.sample_time_s;
            let levels = if fits {
                vec![full(v, 0, n)]
            } else {
                let mut levels = Vec::new();
                if k == worst.run {
                    let rows = (0.25 * BUDGET as f64 / per_row(v, 1 + models.len())) as usize;
                    let from = ((worst.from_s / t).round() as usize).min(n.saturating_sub(1));
                    let to = ((worst.to_s / t).round() as usize).min(n);
                    let (from, to) = if to - from > rows {
                        let [a, b] = worst_tenth(v, worst);
                        let middle = (0.5 * (a + b) / t) as usize;
                        let from = middle.saturating_sub(rows / 2);
                        (from, (from + rows).min(n))
                    } else {
                        (from, to)
                    };
                    levels.push(full(v, from, to));
                }
                levels.push(decimated(v, stride));
                levels
            };
            let channels: Vec<Value> = v
                .experiment
                .channels
                .iter()
                .map(|c| {
                    let (name, unit) = channel_words(&c.name, c.kind);
                    json!({"name": name, "unit": unit, "noise": c.sigma})
                })
                .collect();
            let drives: Value = applied(v)
                .iter()
                .map(|d| {
                    let lines: Value = d.lines.iter().map(|l| json!({"name": l.0, "class": l.1})).collect();
                    json!({"name": d.label, "unit": d.unit, "lines": lines})
                })
                .collect();
            json!({"name": names[k], "sample": t, "end": n as f64 * t, "channels": channels, "drives": drives, "levels": levels})
        })
        .collect();
    let [a, b] = worst_tenth(&views[worst.run], worst);
    json!({
        "models": models.iter().map(|m| json!({"name": m.0, "class": m.1})).collect::<Vec<_>>(),
        "runs": runs,
        "worst": {"run": worst.run, "from": worst.from_s, "to": worst.to_s},
        "tenth": {"from": a, "to": b},
    })
    .to_string()
}

/// What a channel shows, and its unit.
pub(crate) fn channel_words(name: &str, kind: ChannelKind) -> (String, &'static str) {
    let (words, unit) = channel_name(name);
    match (unit, kind) {
        ("", ChannelKind::Current { .. }) => (words, "A"),
        ("", ChannelKind::Speed) => (words, "rad/s"),
        ("", ChannelKind::RmsCurrent) => (words, "A"),
        ("", ChannelKind::ActivePower) => (words, "W"),
        ("", ChannelKind::ReactivePower) => (words, "var"),
        _ => (words, unit),
    }
}

/// The name of a recording, and whether it is held out.
pub(crate) fn label(v: &View) -> String {
    let name = file_name(&v.experiment.name);
    if v.held_out { format!("{name} (held out)") } else { name }
}

/// What the band of prediction holds.
pub(crate) fn band_words(views: &[View]) -> Markup {
    let parameters = if views.iter().any(|v| v.with_parameters) { ", parameters" } else { "" };
    html! { "95 % " (term("band", "band")) ": sensors" (parameters) ", and what the model does not explain" }
}

/// The recordings that are judged with the speed nudged.
pub(crate) fn nudged(views: &[View]) -> String {
    views.iter().filter(|v| v.nudged).map(label).collect::<Vec<_>>().join(", ")
}

/// The zoomable picture with its buttons. What stands in it before the script runs is the worst second, still.
pub(crate) fn body(views: &[View], models: &Models, worst: &Window) -> Markup {
    let mut entries = vec![("measured", text("measured"))];
    let words = |name: &str| match name {
        "base model" => term("base", name),
        "refined model" => term("refined", name),
        _ => text(name),
    };
    entries.extend(models.iter().map(|m| (m.1, words(m.0))));
    entries.push(if views.iter().any(|v| !v.band.is_empty()) {
        ("band", band_words(views))
    } else {
        ("band", html! { (term("noise", "noise band")) " ±2σ" })
    });
    let zoom = [
        ("worst", "worst second"),
        ("tenth", "worst 0.1 s"),
        ("all", "whole run"),
        ("in", "zoom in"),
        ("out", "zoom out"),
        ("left", "◀ earlier"),
        ("right", "later ▶"),
    ];
    html! {
        p {
            @if worst.average.is_finite() && worst.to_s - worst.from_s > 0.99 {
                "The worst second is " (format!("{:.2}", worst.from_s)) " s to " (format!("{:.2}", worst.to_s)) " s of "
                (label(&views[worst.run])) ": the error of the " (models[0].0) " there is " (number(worst.level, 3)) " times the noise, against "
                (number(worst.average, 3)) " times over all recordings. "
            }
            "Drag across a picture to zoom, double-click to zoom out; with the picture in focus the keys ←, →, + and − work too. The values under the pointer stand beside it."
        }
        @if views.iter().any(|v| v.nudged) { p { "With the " (term("nudged_speed", "speed nudged")) " towards the measured one: " (nudged(views)) "." } }
        (legend(&entries))
        div #runs .tools.no-print {
            @for (k, v) in views.iter().enumerate() { button data-run=(k) aria-pressed="false" { (label(v)) } }
        }
        div.tools.no-print { @for (key, words) in zoom { button data-zoom=(key) { (words) } } }
        p { b #span {} }
        div #zoom .zoom tabindex="0" aria-label="Measured and modelled signals over time" {
            (still(&views[worst.run], models, worst))
        }
        output #read .read hidden {}
    }
}

fn still(v: &View, models: &Models, w: &Window) -> Markup {
    let t = v.experiment.sample_time_s;
    let (from, to) = ((w.from_s / t).round() as usize, ((w.to_s / t).round() as usize).min(v.experiment.len()));
    let line = |x: &[f64]| x.iter().enumerate().map(|(k, y)| [(from + k) as f64 * t, *y]).collect::<Vec<_>>();
    let mut charts = Vec::new();
    for (c, ch) in v.experiment.channels.iter().enumerate() {
        let (m, p) = channel(v, c, from, to);
        let (name, unit) = channel_words(&ch.name, ch.kind);
        let all = m.iter().chain(p.iter().flatten()).copied();
        let x = Axis::new(w.from_s, w.to_s, "time, s");
        let mut chart =
            Chart::new(format!("{name} over time"), x, Axis::around(all, format!("{name}, {unit}"))).sized(440.0, 170.0);
        chart.line(&line(&m), "measured");
        for (p, (_, class)) in p.iter().zip(models) {
            chart.line(&line(p), class);
        }
        charts.push(figure(drawn(chart), ""));
    }
    html! { @for chart in &charts { (chart) } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_keep_order_and_skip_gaps() {
        assert_eq!(extremes(&[1.0, 5.0, -2.0, 3.0], 4), [5.0, -2.0]);
        let gap = extremes(&[f64::NAN, f64::NAN], 2);
        assert!(gap.iter().all(|v| v.is_nan()) && gap.len() == 2);
    }
}
