//! A line chart as a small SVG without scripts.

use std::fmt::Write;

const W: f64 = 720.0;
const H: f64 = 320.0;
const LEFT: f64 = 60.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 44.0;
const COLOURS: [&str; 6] = ["#222222", "#1f5fa8", "#c0392b", "#2e8b57", "#8e6bbf", "#c98a1b"];

/// A named line.
pub struct Line {
    pub name: &'static str,
    pub points: Vec<(f64, f64)>,
}

/// Lines over linear axes; `y` is the range shown, beyond which lines are cut.
pub fn chart(title: &str, x_label: &str, y_label: &str, y: [f64; 2], lines: &[Line]) -> String {
    let xs = || lines.iter().flat_map(|l| &l.points).map(|p| p.0);
    let (x0, x1) = (xs().fold(f64::INFINITY, f64::min), xs().fold(f64::NEG_INFINITY, f64::max));
    let right = W - 130.0;
    let at = |(u, v): (f64, f64)| {
        (
            LEFT + (u - x0) / (x1 - x0) * (right - LEFT),
            H - BOTTOM - (v.clamp(y[0], y[1]) - y[0]) / (y[1] - y[0]) * (H - BOTTOM - TOP),
        )
    };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {W} {H}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"{W}\" height=\"{H}\" fill=\"white\"/>\n<text x=\"{LEFT}\" y=\"20\" font-size=\"13\">{title}</text>\n"
    );
    for k in 0..=4 {
        let share = f64::from(k) / 4.0;
        let (u, v) = (x0 + share * (x1 - x0), y[0] + share * (y[1] - y[0]));
        let (px, py) = (at((u, y[0])).0, at((x0, v)).1);
        let _ = writeln!(svg, r##"<path d="M{LEFT} {py:.1}H{right}" stroke="#ddd"/>"##);
        let _ = writeln!(svg, r#"<text x="{}" y="{:.1}" text-anchor="end">{v:.3}</text>"#, LEFT - 5.0, py + 4.0);
        let _ = writeln!(svg, r#"<text x="{px:.1}" y="{}" text-anchor="middle">{u:.2}</text>"#, H - BOTTOM + 15.0);
    }
    let _ = writeln!(svg, r#"<text x="{}" y="{}" text-anchor="middle">{x_label}</text>"#, 0.5 * (LEFT + right), H - 8.0);
    let _ =
        writeln!(svg, r#"<text x="14" y="{0}" text-anchor="middle" transform="rotate(-90 14 {0})">{y_label}</text>"#, 0.5 * H);
    for (k, line) in lines.iter().enumerate() {
        let colour = COLOURS[k % COLOURS.len()];
        let path: Vec<String> =
            line.points.iter().filter(|p| p.1.is_finite()).map(|p| at(*p)).map(|(u, v)| format!("{u:.1},{v:.1}")).collect();
        let _ = writeln!(svg, r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="1.3"/>"#, path.join(" "));
        let _ = writeln!(
            svg,
            r#"<text x="{}" y="{:.1}" fill="{colour}">{}</text>"#,
            right + 8.0,
            TOP + 10.0 + 16.0 * k as f64,
            line.name
        );
    }
    svg + "</svg>\n"
}
