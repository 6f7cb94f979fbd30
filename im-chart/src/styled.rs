//! A chart whose colours come from the style sheet of the page around it, by class: axes, lines, bands, bars, cells.

use std::fmt::Write as _;

use crate::axis::Axis;
use crate::scale::{escape, path, short, thinned};

/// Around the axes, pixels.
const LEFT: f64 = 48.0;
const TOP: f64 = 22.0;
const BOTTOM: f64 = 34.0;

/// A chart under construction.
pub struct Chart {
    width: f64,
    height: f64,
    x: Axis,
    y: Axis,
    title: String,
    body: String,
    over: String,
    x_ticks: Option<Vec<(f64, String)>>,
    /// Row, from, to of words above the picture.
    words: Vec<(usize, f64, f64)>,
}

impl Chart {
    /// 360 by 230 pixels; `title` is read aloud by screen readers.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self {
            width: 360.0,
            height: 230.0,
            x,
            y,
            title: title.into(),
            body: String::new(),
            over: String::new(),
            x_ticks: None,
            words: Vec::new(),
        }
    }

    /// Another size.
    pub fn sized(mut self, width: f64, height: f64) -> Self {
        (self.width, self.height) = (width, height);
        self
    }

    /// Own ticks on the horizontal axis.
    pub fn ticks(mut self, ticks: Vec<(f64, String)>) -> Self {
        self.x_ticks = Some(ticks);
        self
    }

    fn plot_width(&self) -> f64 {
        self.width - LEFT - 8.0
    }

    fn plot_height(&self) -> f64 {
        self.height - TOP - BOTTOM
    }

    fn px(&self, x: f64) -> f64 {
        self.x.at(x) * self.plot_width()
    }

    fn py(&self, y: f64) -> f64 {
        // Far outside is far enough: keeps numbers short.
        ((1.0 - self.y.at(y)) * self.plot_height()).clamp(-1e4, 1e4)
    }

    fn path(&self, points: impl IntoIterator<Item = [f64; 2]>) -> String {
        path(points.into_iter().map(|[x, y]| [self.px(x), self.py(y)]))
    }

    /// A line; where many points share a pixel, the lowest and the highest of them.
    pub fn line(&mut self, points: &[[f64; 2]], class: &str) {
        let d = self.path(thinned(points, |x| self.px(x)));
        let _ = write!(self.body, r#"<path class="line {class}" d="{d}"/>"#);
    }

    /// A dot at every point.
    pub fn dots(&mut self, points: &[[f64; 2]], class: &str) {
        for p in points {
            let (x, y) = (self.px(p[0]), self.py(p[1]));
            if x.is_finite() && y.is_finite() {
                let _ = write!(self.body, r#"<circle class="{class}" cx="{}" cy="{}" r="2.6"/>"#, short(x), short(y));
            }
        }
    }

    /// A band between two lines: x, lower, upper.
    pub fn band(&mut self, points: &[[f64; 3]], class: &str) {
        let upper = self.path(points.iter().map(|p| [p[0], p[2]]));
        let lower = self.path(points.iter().rev().map(|p| [p[0], p[1]])).replacen('M', "L", 1);
        let _ = write!(self.body, r#"<path class="{class}" d="{upper}{lower}Z"/>"#);
    }

    /// A vertical bar of uncertainty at x.
    pub fn whisker(&mut self, x: f64, lo: f64, hi: f64, class: &str) {
        let (x, a, b) = (short(self.px(x)), short(self.py(lo)), short(self.py(hi)));
        let _ = write!(self.body, r#"<path class="line {class}" d="M{x} {a}L{x} {b}"/>"#);
    }

    /// A horizontal line over the whole width.
    pub fn level(&mut self, y: f64, class: &str) {
        let (w, y) = (short(self.plot_width()), short(self.py(y)));
        let _ = write!(self.body, r#"<path class="line {class}" d="M0 {y}L{w} {y}"/>"#);
    }

    /// A vertical line with a word at its top, in the first row where it touches no other.
    pub fn mark(&mut self, x: f64, word: &str, class: &str) {
        let at = self.px(x);
        let h = short(self.plot_height());
        let _ = write!(self.body, r#"<path class="line {class}" d="M{0} 0L{0} {h}"/>"#, short(at));
        // A letter of this size is about six pixels wide.
        let length = 6.0 * word.chars().count() as f64;
        // To the right of its line, where there is room.
        let right = at + length + 3.0 > self.plot_width();
        let (anchor, dx) = if right { ("end", -3.0) } else { ("start", 3.0) };
        let (a, b) = if right { (at - length - 6.0, at) } else { (at, at + length + 6.0) };
        let free = |row: &usize| self.words.iter().all(|w| w.0 != *row || b < w.1 || a > w.2);
        let row = (0..6).find(free).unwrap_or(0);
        self.words.push((row, a, b));
        let _ = write!(
            self.over,
            r#"<text class="mark" x="{}" y="{}" text-anchor="{anchor}">{}</text>"#,
            short(at + dx),
            short(10.0 + 12.0 * row as f64),
            escape(word)
        );
    }

    /// A filled cell with a word on hovering.
    pub fn cell(&mut self, [x0, x1]: [f64; 2], [y0, y1]: [f64; 2], class: &str, word: &str) {
        let (x0, x1) = (self.px(x0).min(self.px(x1)), self.px(x0).max(self.px(x1)));
        let (y0, y1) = (self.py(y0).min(self.py(y1)), self.py(y0).max(self.py(y1)));
        let _ = write!(
            self.body,
            r#"<rect class="{class}" x="{}" y="{}" width="{}" height="{}"><title>{}</title></rect>"#,
            short(x0),
            short(y0),
            short(x1 - x0),
            short(y1 - y0),
            escape(word)
        );
    }

    /// The finished chart.
    pub fn finish(self) -> String {
        let (w, h) = (self.plot_width(), self.plot_height());
        let mut out = format!(
            r#"<svg class="chart" viewBox="0 0 {} {}" role="img" aria-label="{}">"#,
            short(self.width),
            short(self.height),
            escape(&self.title)
        );
        let _ = write!(out, r#"<text class="axis" x="2" y="12">{}</text>"#, escape(&self.y.label));
        let _ = write!(
            out,
            r#"<text class="axis" x="{}" y="{}" text-anchor="end">{}</text>"#,
            short(self.width - 8.0),
            short(self.height - 3.0),
            escape(&self.x.label)
        );
        for (v, text) in self.y.ticks(h / 38.0) {
            let y = 22.0 + self.py(v);
            let _ = write!(
                out,
                r#"<path class="grid" d="M{l} {y}L{r} {y}"/><text class="tick" x="{t}" y="{b}" text-anchor="end">{text}</text>"#,
                l = short(LEFT),
                r = short(LEFT + w),
                t = short(LEFT - 4.0),
                y = short(y),
                // At the foot a number stays clear of the first one of the other axis.
                b = short((y + 4.0).min(22.0 + h))
            );
        }
        for (v, text) in self.x_ticks.clone().unwrap_or_else(|| self.x.ticks(w / 62.0)) {
            let x = LEFT + self.px(v);
            let anchor = if x > self.width - 16.0 { "end" } else { "middle" };
            let at = if anchor == "end" { self.width - 2.0 } else { x };
            let _ = write!(
                out,
                r#"<path class="grid" d="M{x} 22L{x} {b}"/><text class="tick" x="{at}" y="{t}" text-anchor="{anchor}">{text}</text>"#,
                at = short(at),
                x = short(x),
                b = short(22.0 + h),
                t = short(22.0 + h + 13.0)
            );
        }
        let _ = write!(
            out,
            r#"<svg x="{}" y="22" width="{}" height="{}" overflow="hidden">{}</svg>"#,
            short(LEFT),
            short(w),
            short(h),
            self.body
        );
        if !self.over.is_empty() {
            let _ = write!(out, r#"<g transform="translate({} 22)">{}</g>"#, short(LEFT), self.over);
        }
        out.push_str("</svg>");
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_and_a_line_breaks_where_it_has_no_value() {
        let hostile = "</script><b a=\"1\">&";
        let axis = || Axis::new(0.0, 3.0, hostile);
        let mut chart = Chart::new(hostile, axis(), axis());
        chart.line(&[[0.0, 1.0], [1.0, f64::NAN], [2.0, 1.0], [3.0, 2.0]], "measured");
        chart.mark(1.0, hostile, "mark");
        chart.cell([0.0, 1.0], [0.0, 1.0], "h1", hostile);
        let svg = chart.finish();
        assert!(
            !svg.contains("</script>") && !svg.contains("<b ") && svg.contains("&lt;/script&gt;&lt;b a=&quot;1&quot;&gt;&amp;")
        );
        assert_eq!(
            svg.matches('M').count() - svg.matches("class=\"grid\" d=\"M").count(),
            3,
            "two pieces of line and a mark: {svg}"
        );
    }
}
