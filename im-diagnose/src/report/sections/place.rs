//! Where it fails: over time, speed and torque, flux, around zero crossings, over frequency, in step with what.

use std::fmt::Write as _;

use super::super::page::{Section, figure, legend, scale, shade, table, term};
use super::super::story::Shown;
use super::super::svg::{Axis, Chart};
use super::super::words::escape;
use crate::format::{number, sentence};
use crate::localise::{Plane, Profile, ProfileOver, Quantity};

/// The section; the first model is the one that fails.
pub(crate) fn section(shown: &[Shown]) -> Section {
    let base = &shown[0];
    let name = base.name;
    let findings = base.place.findings();
    let mut body = if findings.is_empty() {
        format!("<p>The error of the {name} does not depend on anything that was looked at.</p>")
    } else {
        format!("<p class=\"say\">{}</p>", findings.iter().take(3).map(|f| escape(&sentence(f))).collect::<Vec<_>>().join(" "))
    };
    body += "<p>For this section the simulated speed is nudged towards the measured one, so that one error does not hide behind another. Training recordings only.</p>";
    let mut entries: Vec<(&str, String)> = shown.iter().map(|s| (s.class, s.name.to_owned())).collect();
    entries.push(("floor", term("noise", "sensor noise")));
    body += &legend(&entries);
    let mut grid = String::new();
    for q in Quantity::ALL {
        grid += &over_time(shown, q);
    }
    body += &format!("<h3>Over time</h3><div class=\"grid2\">{grid}</div>");

    let mut grid = String::new();
    for over in ProfileOver::ALL {
        for q in Quantity::ALL {
            let wanted = matches!((q, over), (Quantity::Current, _) | (Quantity::Speed, ProfileOver::Speed | ProfileOver::Slip));
            if wanted {
                grid += &profiles(shown, q, over);
            }
        }
    }
    let _ = write!(
        body,
        "<h3>Over {}, current, speed and {}</h3><div class=\"grid2\">{grid}</div>",
        term("flux", "flux"),
        term("slip", "slip frequency")
    );

    let planes: String = base.place.planes.iter().map(plane).collect();
    if !planes.is_empty() {
        let _ = write!(body, "<h3>Over speed and torque ({name})</h3><div class=\"grid2\">{planes}</div>");
    }
    let crossings = crossings(shown);
    let _ = write!(
        body,
        "<h3>Around current zero crossings, and over frequency</h3><div class=\"grid2\">{crossings}{}</div>",
        spectra(shown)
    );
    let _ = write!(body, "<h3>In step with what ({})</h3>{}", term("correlation", "correlations"), correlations(shown));
    Section { id: "where", short: "where it fails", title: "Where it fails".into(), body }
}

fn over_time(shown: &[Shown], q: Quantity) -> String {
    let mut out = String::new();
    for (k, trace) in shown[0].place.time.iter().enumerate().filter(|(_, t)| t.quantity == q) {
        let all = shown.iter().filter_map(|s| s.place.time.get(k));
        let lo = trace.noise.max(1e-12) * 0.5;
        let hi = all.clone().flat_map(|t| &t.points).map(|p| p[1]).fold(2.0 * lo, f64::max);
        let run = std::path::Path::new(&trace.run).file_name().map_or(trace.run.clone(), |n| n.to_string_lossy().into());
        let end = trace.points.last().map_or(1.0, |p| p[0]);
        let y = Axis::log(lo, hi * 1.3, format!("{} error, rms, {} (log)", q.name(), q.unit()));
        let mut chart =
            Chart::new(format!("{} error over time", q.name()), Axis::new(0.0, end, "time, s"), y).sized(360.0, 190.0);
        chart.level(trace.noise, "floor");
        for (t, s) in all.zip(shown) {
            chart.line(&t.points, &format!("{} solid", s.class));
        }
        out += &figure(&chart.finish(), &escape(&run));
    }
    out
}

fn profiles(shown: &[Shown], q: Quantity, over: ProfileOver) -> String {
    let of = |s: &Shown| s.place.profiles.iter().find(|p| p.quantity == q && p.over == over).cloned();
    let Some(first) = of(&shown[0]) else { return String::new() };
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
    figure(&chart.finish(), &escape(&sentence(&first.conclusion)))
}

fn plane(p: &Plane) -> String {
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
    figure(&format!("{}{key}", chart.finish()), &escape(&sentence(&p.conclusion)))
}

fn crossings(shown: &[Shown]) -> String {
    let Some(first) = &shown[0].place.crossings else { return String::new() };
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
    figure(&chart.finish(), &escape(&sentence(&first.conclusion)))
}

fn spectra(shown: &[Shown]) -> String {
    let mut out = String::new();
    for first in &shown[0].place.spectra {
        let q = first.quantity;
        let all: Vec<_> =
            shown.iter().filter_map(|s| s.place.spectra.iter().find(|x| x.quantity == q).map(|x| (x, s.class))).collect();
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
        for l in lines.iter().take(6) {
            chart.mark(l.frequency_hz, &l.name, "mark-line");
        }
        let seen = if q == Quantity::Current { format!(" ({})", term("fluxframe", "seen from the flux")) } else { String::new() };
        let caption = format!(
            "{} From {} s to {} s of a recording, supply {} ± {} Hz{seen}.",
            escape(&sentence(&first.conclusion)),
            number(first.window_s[0], 3),
            number(first.window_s[1], 3),
            number(first.supply_hz, 3),
            number(first.spread_hz, 2)
        );
        out += &figure(&chart.finish(), &caption);
    }
    out
}

fn correlations(shown: &[Shown]) -> String {
    let c = &shown[0].place.correlations;
    let mut head = vec!["error in".to_owned()];
    head.extend(c.signals.iter().map(|s| format!("#{s}")));
    let rows = c
        .errors
        .iter()
        .zip(&c.coefficients)
        .map(|(name, line)| {
            let mut row = vec![escape(name)];
            row.extend(line.iter().map(|v| {
                let text = if v.is_finite() { format!("{v:+.2}").replace('-', "−") } else { "–".into() };
                if v.abs() > 0.3 { format!("<b>{text}</b>") } else { text }
            }));
            (false, row)
        })
        .collect::<Vec<_>>();
    let mut charts = String::new();
    for first in &shown[0].place.memory {
        let end = first.points.last().map_or(1.0, |p| p[0] * 1e3);
        let mut chart = Chart::new(
            format!("autocorrelation of the {} error", first.quantity.name()),
            Axis::new(0.0, end, "later by, ms"),
            Axis::new(-0.5, 1.0, "correlation with itself"),
        )
        .sized(360.0, 190.0);
        chart.band(&[[0.0, -first.chance, first.chance], [end, -first.chance, first.chance]], "fill-noise");
        chart.level(0.0, "zero");
        for s in shown {
            if let Some(m) = s.place.memory.iter().find(|m| m.quantity == first.quantity) {
                chart.line(&m.points.iter().map(|p| [p[0] * 1e3, p[1]]).collect::<Vec<_>>(), s.class);
            }
        }
        charts += &figure(&chart.finish(), &escape(&sentence(&first.conclusion)));
    }
    format!("<p>{}</p>{}<div class=\"grid2\">{charts}</div>", escape(&sentence(&c.conclusion)), table(&head, &rows))
}
