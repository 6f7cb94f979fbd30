//! Estimated and recorded speed over time, as a small SVG.

use std::fmt::Write;

use im_model::Recording;
use im_observers::Estimate;

const W: f64 = 720.0;
const H: f64 = 320.0;
const LEFT: f64 = 60.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 44.0;
const RIGHT: f64 = 20.0;
/// At most so many points per line.
const POINTS: usize = 600;

/// The picture; where the estimate is not valid a grey bar runs below it.
pub fn speeds(observer: &str, r: &Recording, estimates: &[Estimate<f64>]) -> String {
    let step = r.len().div_ceil(POINTS);
    let rows = || (0..r.len()).step_by(step);
    let all = || rows().flat_map(|k| [r.omega_m[k], estimates[k].omega_m]);
    let (low, high) = all().fold((0.0f64, 0.0f64), |(l, h), x| (l.min(x), h.max(x)));
    let room = 0.05 * (high - low).max(1e-3);
    let (low, high) = (low - room, high + room);
    let (begin, end) = (r.time_s(0), r.time_s(r.len() - 1));
    let x = |t: f64| LEFT + (t - begin) / (end - begin) * (W - RIGHT - LEFT);
    let y = |v: f64| H - BOTTOM - (v - low) / (high - low) * (H - BOTTOM - TOP);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {W} {H}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"{W}\" height=\"{H}\" fill=\"white\"/>\n"
    );
    for k in 0..=4 {
        let share = f64::from(k) / 4.0;
        let (t, v) = (begin + share * (end - begin), low + share * (high - low));
        let _ = writeln!(svg, r##"<path d="M{LEFT} {0:.1}H{1}" stroke="#ddd"/>"##, y(v), W - RIGHT);
        let _ = writeln!(svg, r#"<text x="{}" y="{:.1}" text-anchor="end">{v:.1}</text>"#, LEFT - 5.0, y(v) + 4.0);
        let _ = writeln!(svg, r#"<text x="{:.1}" y="{}" text-anchor="middle">{t:.2}</text>"#, x(t), H - BOTTOM + 17.0);
    }
    for k in rows().filter(|&k| !estimates[k].status.is_valid()) {
        let width = (W - RIGHT - LEFT) / POINTS as f64 + 0.5;
        let _ =
            writeln!(svg, r##"<rect x="{:.1}" y="{}" width="{width:.1}" height="4" fill="#999"/>"##, x(r.time_s(k)), H - BOTTOM);
    }
    let mut line = |colour: &str, name: &str, place: f64, value: &dyn Fn(usize) -> f64| {
        let path: Vec<String> = rows().map(|k| format!("{:.1},{:.1}", x(r.time_s(k)), y(value(k)))).collect();
        let _ = writeln!(svg, r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="1.3"/>"#, path.join(" "));
        let _ = writeln!(svg, r#"<text x="{place}" y="20" fill="{colour}">{name}</text>"#);
    };
    line("#222222", "recorded speed, rad/s", LEFT, &|k| r.omega_m[k]);
    line("#c0392b", &format!("estimated by {observer}"), LEFT + 140.0, &|k| estimates[k].omega_m);
    let _ = writeln!(svg, r##"<text x="{}" y="20" fill="#999">grey: not valid</text>"##, LEFT + 300.0);
    let _ = writeln!(svg, r#"<text x="{}" y="{}" text-anchor="middle">s</text>"#, 0.5 * W, H - 8.0);
    svg + "</svg>\n"
}
