//! Small SVG charts without scripts, in two dresses: [`chart()`] and [`panels()`] stand alone in documents, with their own colours; a
//! [`Chart`] stands in a page, whose style sheet colours it. SVG is written by hand here: it is text, and a drawing library would
//! bring fonts and rasters along for axes and lines.
//!
//! ```
//! use im_chart::{Panel, Series, panels};
//!
//! let speed = Series::line("speed", (0..100).map(|k| (f64::from(k), f64::from(k).sqrt())));
//! let svg = panels("A start", "time, s", &[Panel::new("speed, rad/s", [speed])]);
//! assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
//! ```

mod axis;
mod panels;
mod scale;
mod series;
mod styled;

pub use axis::Axis;
pub use panels::{Panel, panels, panels_with_marks};
pub use scale::{escape, short, spans};
pub use series::{Mark, Series};
pub use styled::Chart;

use std::fmt::Write;

use scale::bounds;
use series::{Area, Legend};

/// The example of the README is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

/// Width of every chart, pixels.
pub const WIDTH: f64 = 640.0;
/// Height of [`chart`], pixels.
pub const HEIGHT: f64 = 420.0;
/// Around the axes, pixels.
pub const MARGIN: f64 = 60.0;
/// Of the series, in order.
pub const COLOURS: [&str; 5] = ["#1f5fa8", "#c0392b", "#2e8b57", "#8e6bbf", "#c98a1b"];
/// Of what was measured, and of words.
pub const INK: &str = "#222";

/// A chart of series over linear axes.
pub fn chart(title: &str, x_label: &str, y_label: &str, series: &[Series]) -> String {
    chart_within(title, x_label, y_label, bounds(series.iter().flat_map(Series::y)), series)
}

/// The same with the range of y given, beyond which lines are cut.
pub fn chart_within(title: &str, x_label: &str, y_label: &str, range: [f64; 2], series: &[Series]) -> String {
    let x = bounds(series.iter().flat_map(Series::x));
    let area = whole(x, range);
    let mut svg = axes(title, x_label, y_label, x, range);
    area.draw(&mut svg, series, &mut Legend::above(&area));
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
    let area = whole(x, y);
    let mut svg = opening(title, HEIGHT);
    grid(&mut svg, &area, 6.0, true);
    let (middle, bottom) = (0.5 * WIDTH, HEIGHT - 20.0);
    let _ = writeln!(svg, r#"<text x="{middle}" y="{bottom}" text-anchor="middle">{}</text>"#, escape(x_label));
    let (half, label) = (area.top + 0.5 * area.height, escape(y_label));
    let _ = writeln!(svg, r#"<text x="12" y="{half}" text-anchor="middle" transform="rotate(-90 12 {half})">{label}</text>"#);
    svg
}

/// One chart below another.
pub fn stacked(upper: &str, lower: &str) -> String {
    let height = 2.0 * HEIGHT;
    let lower = lower.replacen("<svg ", &format!("<svg y=\"{HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" "), 1);
    let upper = upper.replacen("<svg ", &format!("<svg width=\"{WIDTH}\" height=\"{HEIGHT}\" "), 1);
    format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\">\n{upper}{lower}</svg>\n")
}

/// The one area of a chart.
fn whole(x: [f64; 2], y: [f64; 2]) -> Area {
    Area { top: MARGIN, height: HEIGHT - 2.0 * MARGIN, x: Axis::exact(x), y: Axis::exact(y) }
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

/// The frame of an area with its grid, and words at the ticks.
fn grid(svg: &mut String, area: &Area, y_ticks: f64, x_words: bool) {
    let &Area { top, height, ref x, ref y } = area;
    let width = WIDTH - 2.0 * MARGIN;
    let _ = writeln!(svg, r##"<rect x="{MARGIN}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#888"/>"##);
    for (at, text) in x.ticks(7.0) {
        let u = area.across(at);
        let _ = writeln!(svg, r##"<path d="M{u:.1} {top}v{height}" stroke="#eee"/>"##);
        if x_words {
            let _ = writeln!(svg, r#"<text x="{u:.1}" y="{}" text-anchor="middle">{text}</text>"#, top + height + 15.0);
        }
    }
    for (at, text) in y.ticks(y_ticks) {
        let v = area.down(at);
        let _ = writeln!(svg, r##"<path d="M{MARGIN} {v:.1}h{width}" stroke="#eee"/>"##);
        let _ = writeln!(svg, r#"<text x="{}" y="{:.1}" text-anchor="end">{text}</text>"#, MARGIN - 5.0, v + 4.0);
    }
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
        assert!(svg.contains(&format!(" {}L", short(MARGIN + room))));
    }

    #[test]
    fn nothing_and_what_is_not_a_number_are_drawn_without_harm() {
        let svg = panels("a < b", "x", &[Panel::new("y", [Series::line("s", [(0.0, f64::NAN), (f64::INFINITY, 1.0)])])]);
        assert!(svg.contains("a &lt; b") && !svg.contains("NaN") && !svg.contains("inf") && !svg.contains("<path d=\"M0"));
        assert!(!chart("", "", "", &[]).contains("NaN"));
    }

    #[test]
    fn a_line_breaks_where_it_has_no_value_and_where_it_pales() {
        let points = (0..9).map(|k| (f64::from(k), if k == 2 { f64::NAN } else { 1.0 }));
        let svg = chart("", "", "", &[Series::line("s", points).coloured(INK).pale_in(vec![[5.0, 8.0]])]);
        assert_eq!((svg.matches("fill=\"none\" stroke=\"#222\"").count(), svg.matches("stroke-opacity").count()), (3, 1));
        assert!(svg.matches(&format!("stroke=\"{INK}\"")).count() == 3);
    }
}
