//! Small SVG charts without scripts: lines and crosses over linear axes, for documents and reports.
//!
//! ```
//! use im_chart::{Panel, Series, panels};
//!
//! let speed = Series::line("speed", (0..100).map(|k| (f64::from(k), f64::from(k).sqrt())));
//! let svg = panels("A start", "time, s", &[Panel::new("speed, rad/s", [speed])]);
//! assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
//! ```

use std::fmt::Write;

/// Width of every chart, pixels.
pub const WIDTH: f64 = 640.0;
/// Height of [`chart`], pixels.
pub const HEIGHT: f64 = 420.0;
/// Around the axes, pixels.
pub const MARGIN: f64 = 60.0;
/// Of the series, in order.
pub const COLOURS: [&str; 5] = ["#1f5fa8", "#c0392b", "#2e8b57", "#8e6bbf", "#c98a1b"];
/// Height of the axes of a panel, pixels.
const PANEL: f64 = 130.0;
/// Between panels, with a legend in it.
const GAP: f64 = 30.0;
/// A line of more points than two per column is drawn by the lowest and the highest of each column.
const COLUMNS: usize = 260;

/// How the points of a series are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Joined by a line.
    Line,
    /// Crosses, as poles are drawn.
    Cross,
}

/// Points with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Line or crosses.
    pub mark: Mark,
    /// x, y.
    pub points: Vec<(f64, f64)>,
}

impl Series {
    /// A line.
    pub fn line(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { name: name.into(), mark: Mark::Line, points: points.into_iter().collect() }
    }

    /// Crosses.
    pub fn crosses(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { name: name.into(), mark: Mark::Cross, points: points.into_iter().collect() }
    }

    fn finite(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite())
    }
}

/// Series over one vertical axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What is drawn, with its unit.
    pub label: String,
    /// What is drawn.
    pub series: Vec<Series>,
}

impl Panel {
    /// Series under a label.
    pub fn new(label: impl Into<String>, series: impl IntoIterator<Item = Series>) -> Self {
        Self { label: label.into(), series: series.into_iter().collect() }
    }
}

/// Where axes stand in a picture, and what they span.
struct Area {
    top: f64,
    height: f64,
    x: [f64; 2],
    y: [f64; 2],
}

/// A chart of series over linear axes.
pub fn chart(title: &str, x_label: &str, y_label: &str, series: &[Series]) -> String {
    let range = bounds(series.iter().flat_map(Series::finite).map(|p| p.1));
    chart_within(title, x_label, y_label, range, series)
}

/// The same with the range of y given, beyond which lines are cut.
pub fn chart_within(title: &str, x_label: &str, y_label: &str, range: [f64; 2], series: &[Series]) -> String {
    let x = bounds(series.iter().flat_map(Series::finite).map(|p| p.0));
    let mut svg = axes(title, x_label, y_label, x, range);
    draw(&mut svg, &Area { top: MARGIN, height: HEIGHT - 2.0 * MARGIN, x, y: range }, series);
    svg.push_str("</svg>\n");
    svg
}

/// Panels above each other over one horizontal axis: signals of different units over time.
pub fn panels(title: &str, x_label: &str, panels: &[Panel]) -> String {
    let x = bounds(panels.iter().flat_map(|p| &p.series).flat_map(Series::finite).map(|p| p.0));
    let height = 40.0 + panels.len() as f64 * (PANEL + GAP) + 36.0;
    let mut svg = opening(title, height);
    for (k, panel) in panels.iter().enumerate() {
        let y = bounds(panel.series.iter().flat_map(Series::finite).map(|p| p.1));
        let area = Area { top: 40.0 + GAP + k as f64 * (PANEL + GAP) - 8.0, height: PANEL, x, y };
        grid(&mut svg, &area, &panel.label, 4.0, k + 1 == panels.len());
        draw(&mut svg, &area, &panel.series);
    }
    let _ = writeln!(svg, r#"<text x="{}" y="{}" text-anchor="middle">{}</text>"#, 0.5 * WIDTH, height - 10.0, escape(x_label));
    svg.push_str("</svg>\n");
    svg
}

/// Lines of functions over a range.
pub fn curves([low, high]: [f64; 2], of: &[(&str, &dyn Fn(f64) -> f64)]) -> Vec<Series> {
    let x = |k: u32| low + (high - low) * f64::from(k) / 60.0;
    of.iter().map(|(name, f)| Series::line(*name, (0..=60).map(|k| (x(k), f(x(k)))))).collect()
}

/// The opening tag, axes, ticks and labels of a chart, to be drawn into and closed by the caller.
pub fn axes(title: &str, x_label: &str, y_label: &str, x: [f64; 2], y: [f64; 2]) -> String {
    let mut svg = opening(title, HEIGHT);
    grid(&mut svg, &Area { top: MARGIN, height: HEIGHT - 2.0 * MARGIN, x, y }, y_label, 6.0, true);
    let (middle, bottom) = (0.5 * WIDTH, HEIGHT - 20.0);
    let _ = writeln!(svg, r#"<text x="{middle}" y="{bottom}" text-anchor="middle">{}</text>"#, escape(x_label));
    svg
}

/// One chart below another.
pub fn stacked(upper: &str, lower: &str) -> String {
    let height = 2.0 * HEIGHT;
    let lower = lower.replacen("<svg ", &format!("<svg y=\"{HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" "), 1);
    let upper = upper.replacen("<svg ", &format!("<svg width=\"{WIDTH}\" height=\"{HEIGHT}\" "), 1);
    format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\">\n{upper}{lower}</svg>\n")
}

fn opening(title: &str, height: f64) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n\
         <text x=\"{}\" y=\"30\" text-anchor=\"middle\">{}</text>\n",
        0.5 * WIDTH,
        escape(title)
    )
}

/// The frame of an area with its grid and the label of its vertical axis.
fn grid(svg: &mut String, area: &Area, label: &str, y_ticks: f64, x_words: bool) {
    let &Area { top, height, x, y } = area;
    let width = WIDTH - 2.0 * MARGIN;
    let bottom = top + height;
    let _ = writeln!(svg, r##"<rect x="{MARGIN}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#888"/>"##);
    for (at, text) in ticks(x, 7.0) {
        let u = MARGIN + (at - x[0]) / (x[1] - x[0]) * width;
        let _ = writeln!(svg, r##"<path d="M{u:.1} {top}v{height}" stroke="#eee"/>"##);
        if x_words {
            let _ = writeln!(svg, r#"<text x="{u:.1}" y="{}" text-anchor="middle">{text}</text>"#, bottom + 15.0);
        }
    }
    for (at, text) in ticks(y, y_ticks) {
        let v = bottom - (at - y[0]) / (y[1] - y[0]) * height;
        let _ = writeln!(svg, r##"<path d="M{MARGIN} {v:.1}h{width}" stroke="#eee"/>"##);
        let _ = writeln!(svg, r#"<text x="{}" y="{:.1}" text-anchor="end">{text}</text>"#, MARGIN - 5.0, v + 4.0);
    }
    let half = top + 0.5 * height;
    let label = escape(label);
    let _ = writeln!(svg, r#"<text x="12" y="{half}" text-anchor="middle" transform="rotate(-90 12 {half})">{label}</text>"#);
}

/// Series and their legend, which stands above the area.
fn draw(svg: &mut String, area: &Area, series: &[Series]) {
    let &Area { top, height, x: [left, right], y: [low, high] } = area;
    let at = |(x, y): (f64, f64)| {
        let u = MARGIN + (x - left) / (right - left) * (WIDTH - 2.0 * MARGIN);
        (u, top + height - (y.clamp(low, high) - low) / (high - low) * height)
    };
    let mut legend = MARGIN;
    for (k, s) in series.iter().enumerate() {
        let colour = COLOURS[k % COLOURS.len()];
        let points: Vec<(f64, f64)> = s.finite().map(at).collect();
        match s.mark {
            Mark::Line => {
                let path: Vec<String> = thinned(points).into_iter().map(|(u, v)| format!("{u:.1},{v:.1}")).collect();
                let path = path.join(" ");
                let _ = writeln!(svg, r#"<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.6"/>"#);
            }
            Mark::Cross => {
                for (u, v) in points {
                    let (a, b, c, d) = (u - 3.0, v - 3.0, u + 3.0, v + 3.0);
                    let path = format!("M{a:.1} {b:.1}L{c:.1} {d:.1}M{a:.1} {d:.1}L{c:.1} {b:.1}");
                    let _ = writeln!(svg, r#"<path d="{path}" stroke="{colour}"/>"#);
                }
            }
        }
        let _ = writeln!(svg, r#"<text x="{legend:.0}" y="{}" fill="{colour}">{}</text>"#, top - 8.0, escape(&s.name));
        // A letter of this size is about six pixels wide.
        legend += 5.8 * s.name.chars().count() as f64 + 18.0;
    }
}

/// Of many points along x, the lowest and the highest of each column, in their order; others are left as they are.
fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let along = points.windows(2).all(|p| p[1].0 >= p[0].0);
    if points.len() <= 4 * COLUMNS || !along {
        return points;
    }
    let column = |p: &(f64, f64)| ((p.0 - MARGIN) / (WIDTH - 2.0 * MARGIN) * COLUMNS as f64) as usize;
    let mut out = Vec::new();
    for part in points.chunk_by(|a, b| column(a) == column(b)) {
        let by = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        if let (Some(low), Some(high)) = (part.iter().min_by(by), part.iter().max_by(by)) {
            out.extend(if low.0 <= high.0 { [*low, *high] } else { [*high, *low] });
        }
    }
    out.dedup();
    out
}

fn bounds(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)]);
    match high - low {
        span if span > 0.0 && span.is_finite() => [low - 0.03 * span, high + 0.03 * span],
        _ if low.is_finite() => [low - 1.0, low + 1.0],
        _ => [0.0, 1.0],
    }
}

/// Round numbers within a range, about as many as wanted.
fn ticks([low, high]: [f64; 2], wanted: f64) -> Vec<(f64, String)> {
    let rough = (high - low) / wanted;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|s| s * power).into_iter().find(|s| *s >= rough).unwrap_or(10.0 * power);
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let word = |x: f64| if decimals > 4 || x.abs() >= 1e5 { format!("{x:.1e}") } else { format!("{x:.decimals$}") };
    // Adding zero leaves no negative zero.
    let at = |k: i64| (k as f64 * step + 0.0, word(k as f64 * step + 0.0).replace('-', "−"));
    ((low / step).ceil() as i64..).map(at).take_while(|(x, _)| *x <= high + 1e-9 * step).take(20).collect()
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_keep_their_peaks() {
        let mut points: Vec<_> = (0..100_000).map(|k| (f64::from(k), (f64::from(k) * 1e-3).sin())).collect();
        points[50_000].1 = 7.0;
        let svg = chart("", "", "", &[Series::line("", points)]);
        assert!(svg.len() < 20_000, "{}", svg.len());
        // The one sample at 7 is the top of the picture, less the room above it.
        let room = (HEIGHT - 2.0 * MARGIN) * 0.03 / 1.06;
        assert!(svg.contains(&format!(",{:.1}", MARGIN + room)));
    }

    #[test]
    fn nothing_and_what_is_not_a_number_are_drawn_without_harm() {
        let svg = panels("a < b", "x", &[Panel::new("y", [Series::line("s", [(0.0, f64::NAN), (f64::INFINITY, 1.0)])])]);
        assert!(svg.contains("a &lt; b") && !svg.contains("NaN") && !svg.contains("inf"));
        assert!(!chart("", "", "", &[]).contains("NaN"));
    }

    #[test]
    fn every_panel_has_its_axis_and_shares_the_time() {
        let line = |y: f64| Series::line("s", [(0.0, 0.0), (1.0, y)]);
        let svg = panels("", "t, s", &[Panel::new("one", [line(1.0)]), Panel::new("two", [line(5.0)])]);
        assert_eq!((svg.matches("<rect x=").count(), svg.matches("t, s").count()), (2, 1));
    }
}
