//! A small writer of SVG charts: axes, lines, bands, bars, cells. Colours come from the page's style sheet by class.

use std::fmt::Write as _;

use super::words::escape;
use crate::format::number;

/// One axis of a chart.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    lo: f64,
    hi: f64,
    label: String,
    log: bool,
}

impl Axis {
    /// Linear, widened where it has no extent.
    pub fn new(lo: f64, hi: f64, label: impl Into<String>) -> Self {
        let (lo, hi) = if lo.is_finite() && hi.is_finite() { (lo.min(hi), lo.max(hi)) } else { (0.0, 1.0) };
        let (lo, hi) = if hi - lo > 1e-12 * hi.abs().max(lo.abs()) && hi > lo {
            (lo, hi)
        } else {
            (lo - 0.5 * lo.abs().max(1e-3), hi + 0.5 * hi.abs().max(1e-3))
        };
        Self { lo, hi, label: label.into(), log: false }
    }

    /// Around values, with a little room; zero included where it is near.
    pub fn around(values: impl IntoIterator<Item = f64>, label: impl Into<String>) -> Self {
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values.into_iter().filter(|v| v.is_finite()) {
            lo = lo.min(v);
            hi = hi.max(v);
        }
        if lo > 0.0 && lo < 0.6 * hi {
            lo = 0.0;
        }
        if hi < 0.0 && hi > 0.6 * lo {
            hi = 0.0;
        }
        let room = 0.06 * (hi - lo);
        let keep = |x: f64, moved: f64| if x == 0.0 { x } else { moved };
        Self::new(keep(lo, lo - room), keep(hi, hi + room), label)
    }

    /// Logarithmic; bounds are taken to be positive.
    pub fn log(lo: f64, hi: f64, label: impl Into<String>) -> Self {
        let (lo, hi) = (lo.max(1e-12), hi.max(1e-11));
        let (lo, hi) = if hi > 1.2 * lo { (lo, hi) } else { (lo / 1.5, hi * 1.5) };
        Self { lo, hi, label: label.into(), log: true }
    }

    fn at(&self, v: f64) -> f64 {
        if self.log {
            (v.max(self.lo * 1e-3) / self.lo).ln() / (self.hi / self.lo).ln()
        } else {
            (v - self.lo) / (self.hi - self.lo)
        }
    }

    /// Ticks with their words.
    fn ticks(&self, wanted: f64) -> Vec<(f64, String)> {
        if self.log {
            let decades = (self.hi / self.lo).log10();
            let steps: &[f64] = if decades < 1.6 { &[1.0, 2.0, 5.0] } else { &[1.0] };
            let every = (decades / 6.0).ceil().max(1.0) as i32;
            let mut out = Vec::new();
            let first = self.lo.log10().floor() as i32;
            for d in (first..=self.hi.log10().ceil() as i32).filter(|d| d.rem_euclid(every) == 0) {
                for s in steps {
                    let v = s * 10f64.powi(d);
                    if v >= self.lo * 0.999 && v <= self.hi * 1.001 {
                        out.push((v, number(v, 2)));
                    }
                }
            }
            return out;
        }
        im_chart::ticks([self.lo, self.hi], wanted)
    }
}

/// A chart under construction.
pub(crate) struct Chart {
    width: f64,
    height: f64,
    left: f64,
    bottom: f64,
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
            left: 48.0,
            bottom: 34.0,
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
        self.width - self.left - 8.0
    }

    fn plot_height(&self) -> f64 {
        self.height - 22.0 - self.bottom
    }

    fn px(&self, x: f64) -> f64 {
        self.x.at(x) * self.plot_width()
    }

    fn py(&self, y: f64) -> f64 {
        // Far outside is far enough: keeps numbers short.
        ((1.0 - self.y.at(y)) * self.plot_height()).clamp(-1e4, 1e4)
    }

    fn path(&self, points: impl Iterator<Item = [f64; 2]>) -> String {
        let mut d = String::new();
        let mut pen = false;
        for [x, y] in points {
            let (x, y) = (self.px(x), self.py(y));
            if !(x.is_finite() && y.is_finite()) {
                pen = false;
                continue;
            }
            let _ = write!(d, "{}{} {}", if pen { "L" } else { "M" }, short(x), short(y));
            pen = true;
        }
        d
    }

    /// A line; where many points share a pixel, the lowest and the highest of them.
    pub fn line(&mut self, points: &[[f64; 2]], class: &str) {
        let d = self.path(im_chart::thinned(points, |x| self.px(x)).into_iter());
        let _ = write!(self.body, r#"<path class="line {class}" d="{d}"/>"#);
    }

    /// Steps between points: a histogram-like line.
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
        let right = at > 0.75 * self.plot_width();
        let (anchor, dx) = if right { ("end", -3.0) } else { ("start", 3.0) };
        // A letter of this size is about six pixels wide.
        let length = 6.0 * word.chars().count() as f64;
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
                l = short(self.left),
                r = short(self.left + w),
                t = short(self.left - 4.0),
                y = short(y),
                b = short(y + 4.0)
            );
        }
        for (v, text) in self.x_ticks.clone().unwrap_or_else(|| self.x.ticks(w / 62.0)) {
            let x = self.left + self.px(v);
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
            short(self.left),
            short(w),
            short(h),
            self.body
        );
        if !self.over.is_empty() {
            let _ = write!(out, r#"<g transform="translate({} 22)">{}</g>"#, short(self.left), self.over);
        }
        out.push_str("</svg>");
        out
    }
}

/// One decimal is a tenth of a pixel.
pub(crate) fn short(x: f64) -> String {
    let mut s = format!("{x:.1}");
    if s.ends_with(".0") {
        s.truncate(s.len() - 2);
    }
    if s == "-0" { "0".into() } else { s }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_of_decades_are_few_and_every_axis_has_some() {
        let words = |a: Axis| a.ticks(5.0).into_iter().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(words(Axis::log(0.9, 600.0, "")), ["1", "10", "100"]);
        // No extent, no numbers: still an axis.
        assert!(!words(Axis::new(2.0, 2.0, "")).is_empty());
        assert!(!words(Axis::around([f64::NAN], "")).is_empty());
    }
}
