//! Signals over time as a small SVG: panels above each other, on one time axis.

use std::fmt::Write;

const WIDTH: f64 = 720.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 16.0;
/// Above a panel, for its legend.
const HEAD: f64 = 26.0;
const FOOT: f64 = 34.0;
/// Columns of a line: in each its lowest and highest value.
const COLUMNS: usize = 480;
const LETTER: f64 = 5.6;

pub const INK: &str = "#222222";
pub const RED: &str = "#c0392b";
pub const BLUE: &str = "#1f5fa8";
pub const GREEN: &str = "#2e8b57";

/// A value per row.
pub struct Line<'a> {
    pub name: String,
    pub colour: &'static str,
    pub value: Box<dyn Fn(usize) -> f64 + 'a>,
    /// Where it is drawn in full; pale elsewhere.
    pub live: Box<dyn Fn(usize) -> bool + 'a>,
}

impl<'a> Line<'a> {
    pub fn new(name: impl Into<String>, colour: &'static str, value: impl Fn(usize) -> f64 + 'a) -> Self {
        Self { name: name.into(), colour, value: Box::new(value), live: Box::new(|_| true) }
    }

    #[must_use]
    pub fn live_where(mut self, live: impl Fn(usize) -> bool + 'a) -> Self {
        self.live = Box::new(live);
        self
    }
}

/// Lines on one axis.
pub struct Panel<'a> {
    /// What is drawn, with its unit.
    pub title: &'static str,
    pub lines: Vec<Line<'a>>,
    /// A level to compare with, and its name.
    pub level: Option<(f64, &'static str)>,
    pub height: f64,
}

/// The picture of `rows` rows; a bar runs below the last panel where `marked` (with its name) holds.
pub fn svg(
    rows: usize,
    time_s: &dyn Fn(usize) -> f64,
    panels: &[Panel<'_>],
    marked: Option<(&str, &dyn Fn(usize) -> bool)>,
) -> String {
    let height = panels.iter().map(|p| p.height + HEAD).sum::<f64>() + FOOT;
    let (begin, end) = (time_s(0), time_s(rows - 1).max(time_s(0) + 1e-9));
    let across = WIDTH - LEFT - RIGHT;
    let x = |t: f64| LEFT + (t - begin) / (end - begin) * across;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    let mut top = HEAD;
    for (n, panel) in panels.iter().enumerate() {
        let bottom = top + panel.height;
        for (t, text) in ticks(begin, end, 7.0) {
            let at = x(t);
            let _ = writeln!(out, r##"<path d="M{at:.1} {top}V{bottom}" stroke="#eee"/>"##);
            if n + 1 == panels.len() {
                let _ = writeln!(out, r#"<text x="{at:.1}" y="{}" text-anchor="middle">{text}</text>"#, bottom + 18.0);
            }
        }
        draw(&mut out, panel, top, rows, &|k| x(time_s(k)));
        top = bottom + HEAD;
    }
    let bottom = top - HEAD;
    if let Some((_, holds)) = marked {
        for (from, to) in stretches(rows, holds) {
            let (a, b) = (x(time_s(from)), x(time_s(to.min(rows - 1))));
            let _ = writeln!(out, r##"<rect x="{a:.1}" y="{bottom}" width="{:.1}" height="4" fill="#999"/>"##, (b - a).max(0.5));
        }
    }
    let note = marked.map_or(String::new(), |(name, _)| format!("grey: {name}"));
    let _ = writeln!(out, r##"<text x="{LEFT}" y="{:.1}" fill="#777">{note}</text>"##, height - 3.0);
    let _ = writeln!(out, r#"<text x="{}" y="{:.1}" text-anchor="end">time, s</text>"#, WIDTH - RIGHT, height - 3.0);
    out + "</svg>\n"
}

fn draw(out: &mut String, panel: &Panel<'_>, top: f64, rows: usize, x: &dyn Fn(usize) -> f64) {
    let columns: Vec<Vec<Point>> = panel.lines.iter().map(|l| thinned(l, rows)).collect();
    let all = columns.iter().flatten().map(|p| p.value).chain(panel.level.map(|l| l.0));
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
    let room = 0.05 * (high - low).max(1e-3 * high.abs()).max(1e-12);
    let (low, high) = (low - room, high + room);
    let bottom = top + panel.height;
    let y = |v: f64| bottom - (v - low) / (high - low) * panel.height;
    for (v, text) in ticks(low, high, panel.height / 30.0) {
        let at = y(v);
        let _ = writeln!(out, r##"<path d="M{LEFT} {at:.1}H{}" stroke="#ddd"/>"##, WIDTH - RIGHT);
        let _ = writeln!(out, r#"<text x="{}" y="{:.1}" text-anchor="end">{text}</text>"#, LEFT - 5.0, at + 4.0);
    }
    let mut place = LEFT;
    let mut legend = |colour: &str, name: &str| {
        let _ = writeln!(out, r#"<text x="{place:.0}" y="{}" fill="{colour}">{}</text>"#, top - 7.0, escaped(name));
        place += LETTER * name.chars().count() as f64 + 16.0;
    };
    legend(INK, panel.title);
    panel.lines.iter().filter(|l| !l.name.is_empty()).for_each(|l| legend(l.colour, &l.name));
    if let Some((v, name)) = panel.level {
        legend("#777", &format!("dashed: {name}"));
        let at = y(v);
        let _ = writeln!(out, r##"<path d="M{LEFT} {at:.1}H{}" stroke="#777" stroke-dasharray="4 4"/>"##, WIDTH - RIGHT);
    }
    for (line, points) in panel.lines.iter().zip(&columns) {
        for part in points.chunk_by(|a, b| a.live == b.live && b.row - a.row <= 2 * rows.div_ceil(COLUMNS)) {
            let path: Vec<String> = part.iter().map(|p| format!("{:.1},{:.1}", x(p.row), y(p.value))).collect();
            let look = if part[0].live { r#"stroke-width="1.3""# } else { r#"stroke-width="1" stroke-opacity="0.3""# };
            let _ = writeln!(out, r#"<polyline points="{}" fill="none" stroke="{}" {look}/>"#, path.join(" "), line.colour);
        }
    }
}

struct Point {
    row: usize,
    value: f64,
    live: bool,
}

/// The lowest and the highest value in each column, in their order; what is not a number is left out.
fn thinned(line: &Line<'_>, rows: usize) -> Vec<Point> {
    let step = rows.div_ceil(COLUMNS);
    let mut points = Vec::new();
    for from in (0..rows).step_by(step) {
        let all = (from..(from + step).min(rows)).map(|row| (row, (line.value)(row))).filter(|p| p.1.is_finite());
        let live = (line.live)(from);
        let point = |(row, value): (usize, f64)| Point { row, value, live };
        let low = all.clone().min_by(|a, b| a.1.total_cmp(&b.1)).map(point);
        let high = all.max_by(|a, b| a.1.total_cmp(&b.1)).map(point);
        let (Some(low), Some(high)) = (low, high) else { continue };
        match low.row.cmp(&high.row) {
            std::cmp::Ordering::Less => points.extend([low, high]),
            std::cmp::Ordering::Equal => points.push(low),
            std::cmp::Ordering::Greater => points.extend([high, low]),
        }
    }
    points
}

/// Where something holds, in columns: first row, and the row after the last.
fn stretches(rows: usize, holds: &dyn Fn(usize) -> bool) -> Vec<(usize, usize)> {
    let step = rows.div_ceil(COLUMNS);
    let mut found: Vec<(usize, usize)> = Vec::new();
    for from in (0..rows).step_by(step).filter(|&from| (from..(from + step).min(rows)).any(holds)) {
        match found.last_mut() {
            Some(last) if last.1 == from => last.1 = from + step,
            _ => found.push((from, from + step)),
        }
    }
    found
}

/// Round numbers between two, about as many as wanted.
fn ticks(low: f64, high: f64, wanted: f64) -> Vec<(f64, String)> {
    let rough = (high - low) / wanted.max(1.0);
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|s| s * power).into_iter().find(|s| *s >= rough).unwrap_or(10.0 * power);
    let decimals = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    let first = (low / step).ceil() as i64;
    // Adding zero leaves no negative zero.
    let at = |k: i64| (k as f64 * step + 0.0, format!("{:.decimals$}", k as f64 * step + 0.0).replace('-', "−"));
    (first..).map(at).take_while(|(v, _)| *v <= high + 1e-9 * step).take(30).collect()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel<'a>(line: Line<'a>) -> Panel<'a> {
        Panel { title: "speed, rad/s", lines: vec![line], level: Some((1.0, "rated")), height: 100.0 }
    }

    #[test]
    fn a_spike_of_one_row_in_a_hundred_thousand_is_drawn() {
        let spike = |k: usize| if k == 70_001 { 7.0 } else { 0.0 };
        let line = Line::new("seen & shown", RED, spike);
        assert!(thinned(&line, 100_000).iter().any(|p| p.value == 7.0));
        let text = svg(100_000, &|k| k as f64 * 1e-4, &[panel(line)], None);
        assert!(text.contains("seen &amp; shown") && text.contains(">6<") && text.len() < 20_000, "{}", text.len());
    }

    #[test]
    fn what_is_not_a_number_leaves_a_gap_and_no_trace() {
        let text = svg(100, &|k| k as f64, &[panel(Line::new("", RED, |k| if k > 50 { f64::NAN } else { 1.0 }))], None);
        assert!(!text.contains("NaN") && !text.contains("inf"));
        let none = svg(100, &|k| k as f64, &[panel(Line::new("", RED, |_| f64::NAN))], Some(("all", &|_| true)));
        assert!(!none.contains("NaN") && !none.contains("polyline") && none.contains("grey: all"));
    }

    #[test]
    fn ticks_are_round() {
        let words = |a, b| ticks(a, b, 5.0).into_iter().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(words(-3.0, 7.0), ["−2", "0", "2", "4", "6"]);
        assert_eq!(words(0.0, 0.5), ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(words(0.0011, 0.0029), ["0.0015", "0.0020", "0.0025"]);
    }
}
