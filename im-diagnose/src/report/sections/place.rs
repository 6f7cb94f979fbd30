//! Where it fails: over time, speed and torque, flux, around zero crossings, over frequency, in step with what.

use im_chart::{Axis, Chart};
use maud::{Markup, html};

use super::super::page::{Row, Section, drawn, figure, legend, numbers, scale, shade, table, term, text, words};
use super::super::story::Shown;
use super::super::words::file_name;
use crate::format::{number, sentence, signed};
use crate::localise::{Crossings, InputCorrelation, Memory, Plane, Profile, ProfileOver, Quantity, Spectrum};

/// Fewest cells of a map.
const LEAST_CELLS: usize = 4;

/// The section; the first model is the one that fails. `nudged`: whether a measured speed helps the simulated one; `held_out`: whether there is a
/// recording that it leaves out.
pub(crate) fn section(shown: &[Shown], nudged: bool, held_out: bool) -> Section {
    let base = &shown[0];
    let name = base.name;
    let findings = base.place.findings();
    let mut entries: Vec<(&str, Markup)> = shown.iter().map(|s| (s.class, text(s.name))).collect();
    entries.push(("floor", term("noise", "sensor noise")));
    let over: Vec<Markup> = ProfileOver::ALL
        .into_iter()
        .flat_map(|over| Quantity::ALL.map(|q| (q, over)))
        .filter(|p| matches!(p, (Quantity::Current, _) | (Quantity::Speed, ProfileOver::Speed | ProfileOver::Slip)))
        .filter_map(|(q, over)| profiles(shown, q, over))
        .collect();
    // Of a few cells no picture tells more than its caption.
    let filled = |p: &&Plane| p.cells.iter().flatten().flatten().count() >= LEAST_CELLS;
    let planes: Vec<&Plane> = base.place.planes.iter().filter(filled).collect();
    let body = html! {
        @if findings.is_empty() {
            p { "The error of the " (name) " does not depend on anything that was looked at." }
        } @else {
            p.say { (findings.iter().take(3).map(|f| sentence(f)).collect::<Vec<_>>().join(" ")) }
        }
        @if nudged {
            p {
                "For this section the simulated speed is nudged towards the measured one, so that one error does not hide behind "
                "another" @if held_out { "; the held-out recording is not in it" } "."
            }
        } @else if held_out {
            p { "The held-out recording is not in this section." }
        }
        (legend(&entries))
        h3 { "Over time" }
        div.grid2 { @for q in Quantity::ALL { (over_time(shown, q)) } }
        @if !over.is_empty() {
            h3 { "Over " (term("flux", "flux")) ", current, speed and " (term("slip", "slip frequency")) }
            div.grid2 { @for chart in &over { (chart) } }
        }
        @if !planes.is_empty() {
            h3 { "Over speed and torque (" (name) ")" }
            div.grid2 { @for p in &planes { (plane(p)) } }
        }
        @if base.place.crossings.is_some() || !base.place.spectra.is_empty() {
            h3 { "Around current zero crossings, and over frequency" }
            div.grid2 {
                @if let Some(first) = &base.place.crossings { (crossings(first, shown)) }
                @for first in &base.place.spectra { (spectrum(first, shown)) }
            }
        }
        h3 { "In step with what (" (term("correlation", "correlations")) ")" }
        (correlations(shown))
        h3 { "Do the errors last, and do they follow the inputs?" }
        p {
            "The error of a model that is right is new in every row and does not follow the inputs: the curves stay within the "
            (term("chanceband", "band of chance")) "."
        }
        div.grid2 {
            @for first in &base.place.memory { (memory(first, shown)) }
            @for first in &base.place.inputs { (input(first, shown)) }
        }
    };
    Section { id: "where", short: "where it fails", title: "Where it fails", body }
}

fn over_time(shown: &[Shown], q: Quantity) -> Markup {
    let mut charts = Vec::new();
    for (k, trace) in shown[0].place.time.iter().enumerate().filter(|(_, t)| t.quantity == q) {
        let all = shown.iter().filter_map(|s| s.place.time.get(k));
        let lo = trace.noise.max(1e-12) * 0.5;
        let hi = all.clone().flat_map(|t| &t.points).map(|p| p[1]).fold(2.0 * lo, f64::max);
        let end = trace.points.last().map_or(1.0, |p| p[0]);
        let y = Axis::log(lo, hi * 1.3, format!("{} error, rms, {} (log)", q.name(), q.unit()));
        let mut chart =
            Chart::new(format!("{} error over time", q.name()), Axis::new(0.0, end, "time, s"), y).sized(360.0, 190.0);
        chart.level(trace.noise, "floor");
        for (t, s) in all.zip(shown) {
            chart.line(&t.points, &format!("{} solid", s.class));
        }
        charts.push(figure(drawn(chart), file_name(&trace.run)));
    }
    html! { @for chart in &charts { (chart) } }
}

fn profiles(shown: &[Shown], q: Quantity, over: ProfileOver) -> Option<Markup> {
    let of = |s: &Shown| s.place.profiles.iter().find(|p| p.quantity == q && p.over == over).cloned();
    let first = of(&shown[0])?;
    let all: Vec<(Profile, &str)> = shown.iter().filter_map(|s| of(s).map(|p| (p, s.class))).collect();
    let xs = all.iter().flat_map(|(p, _)| p.bins.iter().map(|b| b.at));
    let ys = all.iter().flat_map(|(p, _)| p.bins.iter().map(|b| b.rms)).chain([0.0, 1.5 * first.noise]);
    let mut chart = Chart::new(
        format!("{} error over {}", q.name(), over.name()),
        Axis::around(xs, format!("{}, {}", over.name(), over.unit())),
        Axis::around(ys, format!("{} error, rms, {}", q.name(), q.unit())),
    );
    chart.level(first.noise, "floor");
    for (p, class) in &all {
        let points: Vec<[f64; 2]> = p.bins.iter().map(|b| [b.at, b.rms]).collect();
        chart.line(&points, class);
        chart.dots(&points, class);
    }
    Some(figure(drawn(chart), sentence(&first.conclusion)))
}

fn plane(p: &Plane) -> Markup {
    let found = || p.cells.iter().flatten().flatten();
    let most = found().copied().fold(0.0, f64::max);
    let least = found().copied().fold(f64::INFINITY, f64::min).min(most);
    let (lo, hi) = (least.max(0.3 * p.noise).max(1e-12), most.max(1e-12) * 1.0001);
    let (s, t) = (&p.speed_edges, &p.torque_edges);
    let unit = p.quantity.unit();
    let mut chart = Chart::new(
        format!("{} error over speed and torque", p.quantity.name()),
        Axis::new(s[0], s[s.len() - 1], "speed, rad/s"),
        Axis::new(t[0], t[t.len() - 1], "air-gap torque, Nm"),
    );
    for (l, row) in p.cells.iter().enumerate() {
        for (c, cell) in row.iter().enumerate() {
            if let Some(v) = cell {
                let word = format!(
                    "{} to {} rad/s, {} to {} Nm: {} {unit}",
                    number(s[c], 3),
                    number(s[c + 1], 3),
                    number(t[l], 3),
                    number(t[l + 1], 3),
                    number(*v, 3)
                );
                let level = shade((v / lo).ln() / (hi / lo).max(1.0001).ln());
                chart.cell([s[c], s[c + 1]], [t[l], t[l + 1]], &format!("h{level}"), &word);
            }
        }
    }
    let key = scale(&format!("{} {unit}", number(lo, 2)), &format!("{} {unit} (rms, log)", number(hi, 2)));
    figure(html! { (drawn(chart)) (key) }, sentence(&p.conclusion))
}

fn crossings(first: &Crossings, shown: &[Shown]) -> Markup {
    let all = shown.iter().filter_map(|s| s.place.crossings.as_ref().map(|c| (c, s.class)));
    let ys = all.clone().flat_map(|(c, _)| c.bins.iter().map(|b| b[2])).chain([0.0, 1.5 * first.noise]);
    let mut chart = Chart::new(
        "error around current zero crossings",
        Axis::new(-90.0, 90.0, "angle from the zero crossing of a phase current, °"),
        Axis::around(ys, "error of that phase current, rms, A"),
    )
    .ticks([-90, -45, 0, 45, 90].map(|d| (f64::from(d), d.to_string().replace('-', "−"))).to_vec());
    chart.level(first.noise, "floor");
    for (c, class) in all {
        chart.line(&c.bins.iter().map(|b| [b[0], b[2]]).collect::<Vec<_>>(), class);
    }
    figure(drawn(chart), html! { (sentence(&first.conclusion)) " Dashed: the " (term("noise", "sensor noise")) "." })
}

fn spectrum(first: &Spectrum, shown: &[Shown]) -> Markup {
    let q = first.quantity;
    let of = |s: &'_ Shown| s.place.spectra.iter().find(|x| x.quantity == q).cloned().map(|x| (x, s.class));
    let all: Vec<_> = shown.iter().filter_map(of).collect();
    let ys = || all.iter().flat_map(|(x, _)| x.points.iter().map(|p| p[1]));
    let most = ys().fold(0.0, f64::max);
    let mut sorted: Vec<f64> = ys().collect();
    sorted.sort_by(f64::total_cmp);
    let least = sorted.get(sorted.len() / 50).copied().unwrap_or(1e-6).max(most * 1e-6);
    let (start, end) = (first.points.first().map_or(1.0, |p| p[0]), first.points.last().map_or(1.0, |p| p[0]));
    let mut chart = Chart::new(
        format!("spectrum of the {} error", q.name()),
        Axis::log(start, end, "frequency, Hz (log)"),
        Axis::log(least, most * 2.5, format!("amplitude, {} (log)", q.unit())),
    );
    for (x, class) in &all {
        chart.line(&x.points, &format!("{class} thin solid"));
    }
    let mut lines = first.lines.clone();
    lines.sort_by(|a, b| b.prominence.total_cmp(&a.prominence));
    // From left to right, so that a name below another is that of a line further on.
    lines.truncate(6);
    lines.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    for l in &lines {
        chart.mark(l.frequency_hz, &mark(&l.name), "mark-line");
    }
    let [from, to] = first.window_s.map(|t| number(t, 3));
    let supply = format!("{} ± {} Hz", number(first.supply_hz, 3), number(first.spread_hz, 2));
    let caption = html! {
        (sentence(&first.conclusion)) " From " (from) " s to " (to) " s of " (file_name(&first.run)) ", supply " (supply)
        @if q == Quantity::Current { " (" (term("fluxframe", "seen from the flux")) ")" } "."
        @if !lines.is_empty() { " Marks: f supply, n rotor, s slip." }
    };
    figure(drawn(chart), caption)
}

/// The name of a line as short as a picture wants it: "6f" for six times the supply.
fn mark(name: &str) -> String {
    let (times, of) = name.split_once(" × ").unwrap_or(("", name));
    let letter = match of {
        "supply" => "f",
        "rotor" => "n",
        "slip" => "s",
        other => other,
    };
    format!("{times}{letter}")
}

fn correlations(shown: &[Shown]) -> Markup {
    let c = &shown[0].place.correlations;
    let head: Vec<_> = [words("error in")].into_iter().chain(c.signals.iter().map(numbers)).collect();
    let coefficient = |v: &f64| {
        let text = match *v {
            v if !v.is_finite() => "–".into(),
            v if v.abs() < 0.005 => "0.00".into(),
            v => signed(v, 2),
        };
        html! { @if v.abs() > 0.3 { b { (text) } } @else { (text) } }
    };
    let row = |(name, line): (&&str, &Vec<f64>)| Row::new([text(name)].into_iter().chain(line.iter().map(coefficient)));
    let rows: Vec<Row> = c.errors.iter().zip(&c.coefficients).map(row).collect();
    html! {
        p { (sentence(&c.conclusion)) }
        (table(&head, &rows))
    }
}

fn memory(first: &Memory, shown: &[Shown]) -> Markup {
    let end = first.points.last().map_or(1.0, |p| p[0] * 1e3);
    let mut chart = Chart::new(
        format!("autocorrelation of the {} error", first.quantity.name()),
        Axis::new(0.0, end, "later by, ms"),
        Axis::new(-1.0, 1.0, "correlation with itself"),
    )
    .sized(360.0, 190.0);
    chart.band(&[[0.0, -first.chance, first.chance], [end, -first.chance, first.chance]], "fill-noise");
    chart.level(0.0, "zero");
    for s in shown {
        if let Some(m) = s.place.memory.iter().find(|m| m.quantity == first.quantity) {
            chart.line(&m.points.iter().map(|p| [p[0] * 1e3, p[1]]).collect::<Vec<_>>(), s.class);
        }
    }
    let said = shown.iter().filter_map(|s| {
        let own = s.place.memory.iter().find(|m| m.quantity == first.quantity)?;
        Some((s.name, own.conclusion.as_str()))
    });
    figure(drawn(chart), within(said, "", first.chance))
}

/// What is said of each model, and how wide the band is, and of which model.
fn within<'a>(said: impl Iterator<Item = (&'a str, &'a str)>, of_which: &str, chance: f64) -> String {
    let said: Vec<(&str, &str)> = said.collect();
    let of = |(name, conclusion): &(&str, &str)| match said.len() {
        1 => sentence(conclusion),
        _ => format!("{}: {conclusion}.", sentence(name).trim_end_matches('.')),
    };
    let all: Vec<String> = said.iter().map(of).collect();
    format!("{} The band{of_which}: ±{}, where 95 of 100 lie by chance.", all.join(" "), number(chance, 3))
}

fn input<'a>(first: &InputCorrelation, shown: &'a [Shown]) -> Markup {
    let of = |s: &'a Shown| s.place.inputs.iter().find(|x| (x.error, x.input) == (first.error, first.input));
    let all: Vec<(&InputCorrelation, &Shown)> = shown.iter().filter_map(|s| Some((of(s)?, s))).collect();
    let bare = |s: &str| s.split(',').next().unwrap_or(s).to_owned();
    let title = format!("error in {} with {}", bare(first.error), bare(first.input));
    let end = first.points.last().map_or(1.0, |p| p[0] * 1e3);
    let most = all.iter().flat_map(|(x, _)| &x.points).map(|p| p[1].abs()).fold(0.2, f64::max).min(1.0);
    let x = Axis::new(-end, end, "error later than the input by, ms");
    let mut chart = Chart::new(&title, x, Axis::new(-1.05 * most, 1.05 * most, &title)).sized(360.0, 190.0);
    // That of the last model: the error that is left has to lie within it.
    let chance = all.last().map_or(first.chance, |(x, _)| x.chance);
    chart.band(&[[-end, -chance, chance], [end, -chance, chance]], "fill-noise");
    chart.level(0.0, "zero");
    for (x, s) in &all {
        chart.line(&x.points.iter().map(|p| [p[0] * 1e3, p[1]]).collect::<Vec<_>>(), s.class);
    }
    let of_which = match all.as_slice() {
        [_, .., (_, last)] => format!(" of the {}", last.name),
        _ => String::new(),
    };
    figure(drawn(chart), within(all.iter().map(|(x, s)| (s.name, x.conclusion.as_str())), &of_which, chance))
}
