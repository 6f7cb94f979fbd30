//! Series, and how they are drawn within axes.

use std::fmt::Write;

use crate::axis::Axis;
use crate::scale::{escape, path, thinned};
use crate::{COLOURS, MARGIN, WIDTH};

/// How the points of a series are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Joined by a line, which breaks where a point is not a number.
    Line,
    /// The same, dashed.
    Dashes,
    /// Crosses, as poles are drawn.
    Cross,
}

/// Points with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend; none if empty.
    pub name: String,
    /// Line or crosses.
    pub mark: Mark,
    /// x, y.
    pub points: Vec<(f64, f64)>,
    /// Its colour; the next of [`COLOURS`] if none.
    pub colour: Option<&'static str>,
    /// From and to along x: where a line is pale.
    pub pale: Vec<[f64; 2]>,
}

impl Series {
    /// A line.
    pub fn line(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { name: name.into(), mark: Mark::Line, points: points.into_iter().collect(), colour: None, pale: Vec::new() }
    }

    /// Crosses.
    pub fn crosses(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { mark: Mark::Cross, ..Self::line(name, points) }
    }

    /// A dashed line.
    pub fn dashed(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { mark: Mark::Dashes, ..Self::line(name, points) }
    }

    /// In this colour.
    #[must_use]
    pub fn coloured(self, colour: &'static str) -> Self {
        Self { colour: Some(colour), ..self }
    }

    /// Pale within these stretches along x ([`spans`](crate::spans)).
    #[must_use]
    pub fn pale_in(self, pale: Vec<[f64; 2]>) -> Self {
        Self { pale, ..self }
    }

    pub(crate) fn x(&self) -> impl Iterator<Item = f64> + '_ {
        self.finite().map(|p| p[0])
    }

    pub(crate) fn y(&self) -> impl Iterator<Item = f64> + '_ {
        self.finite().map(|p| p[1])
    }

    fn finite(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.points.iter().map(|&p| p.into()).filter(is_finite)
    }

    fn is_pale(&self, x: f64) -> bool {
        let next = self.pale.partition_point(|span| span[1] < x);
        self.pale.get(next).is_some_and(|span| span[0] <= x)
    }
}

fn is_finite(p: &[f64; 2]) -> bool {
    p[0].is_finite() && p[1].is_finite()
}

/// Where axes stand in a picture, pixels, and what they span.
pub(crate) struct Area {
    pub top: f64,
    pub height: f64,
    pub x: Axis,
    pub y: Axis,
}

impl Area {
    /// Columns of two pixels: what a line is thinned to.
    const COLUMNS: f64 = 0.5 * (WIDTH - 2.0 * MARGIN);

    pub fn across(&self, x: f64) -> f64 {
        MARGIN + self.x.at(x) * (WIDTH - 2.0 * MARGIN)
    }

    pub fn down(&self, y: f64) -> f64 {
        self.top + (1.0 - self.y.at(y).clamp(0.0, 1.0)) * self.height
    }

    /// Series, and their legend above the area after what stands there already.
    pub fn draw(&self, svg: &mut String, series: &[Series], legend: &mut Legend) {
        for (k, s) in series.iter().enumerate() {
            let colour = s.colour.unwrap_or(COLOURS[k % COLOURS.len()]);
            match s.mark {
                Mark::Line | Mark::Dashes => self.line(svg, s, colour),
                Mark::Cross => {
                    for [x, y] in s.finite() {
                        let (u, v) = (self.across(x), self.down(y));
                        let (a, b, c, d) = (u - 3.0, v - 3.0, u + 3.0, v + 3.0);
                        let cross = format!("M{a:.1} {b:.1}L{c:.1} {d:.1}M{a:.1} {d:.1}L{c:.1} {b:.1}");
                        let _ = writeln!(svg, r#"<path d="{cross}" stroke="{colour}"/>"#);
                    }
                }
            }
            legend.add(svg, colour, &s.name);
        }
    }

    fn line(&self, svg: &mut String, s: &Series, colour: &str) {
        let column = |x: f64| self.x.at(x) * Self::COLUMNS;
        let points: Vec<[f64; 2]> = s.points.iter().map(|&p| p.into()).collect();
        let along = points.windows(2).all(|p| !is_finite(&p[0]) || !is_finite(&p[1]) || p[1][0] >= p[0][0]);
        let whole = |a: &[f64; 2], b: &[f64; 2]| is_finite(a) && is_finite(b) && s.is_pale(a[0]) == s.is_pale(b[0]);
        for part in points.chunk_by(whole).filter(|part| is_finite(&part[0])) {
            let few = if along && part.len() > 4 * Self::COLUMNS as usize { &thinned(part, column)[..] } else { part };
            let d = path(few.iter().map(|p| [self.across(p[0]), self.down(p[1])]));
            let look = if s.is_pale(part[0][0]) { r#"stroke-opacity="0.3""# } else { r#"stroke-width="1.6""# };
            let dashes = if s.mark == Mark::Dashes { r#" stroke-dasharray="6 3""# } else { "" };
            let _ = writeln!(svg, r#"<path d="{d}" fill="none" stroke="{colour}" {look}{dashes}/>"#);
        }
    }
}

/// Words beside each other above an area.
pub(crate) struct Legend {
    at: f64,
    above: f64,
}

impl Legend {
    pub fn above(area: &Area) -> Self {
        Self { at: MARGIN, above: area.top - 8.0 }
    }

    pub fn add(&mut self, svg: &mut String, colour: &str, words: &str) {
        if words.is_empty() {
            return;
        }
        let _ = writeln!(svg, r#"<text x="{:.0}" y="{}" fill="{colour}">{}</text>"#, self.at, self.above, escape(words));
        // A letter of this size is about six pixels wide.
        self.at += 5.8 * words.chars().count() as f64 + 18.0;
    }
}
