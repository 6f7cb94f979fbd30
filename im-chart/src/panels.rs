//! Panels above each other over one horizontal axis: signals of different units over time.

use std::fmt::Write;

use crate::axis::Axis;
use crate::scale::{bounds, escape};
use crate::series::{Area, Legend, Series};
use crate::{INK, MARGIN, WIDTH, grid, opening};

/// Above the first panel, with the title in it, pixels.
const HEAD: f64 = 40.0;
/// Above a panel, with its legend in it.
const GAP: f64 = 30.0;
/// Below the last panel.
const FOOT: f64 = 36.0;

/// Series over one vertical axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What is drawn, with its unit.
    pub label: String,
    /// What is drawn.
    pub series: Vec<Series>,
    /// A level to compare with, and its name.
    pub level: Option<(f64, String)>,
    /// Height of the axes, pixels.
    pub height: f64,
}

impl Panel {
    /// Series under a label.
    pub fn new(label: impl Into<String>, series: impl IntoIterator<Item = Series>) -> Self {
        Self { label: label.into(), series: series.into_iter().collect(), level: None, height: 130.0 }
    }

    /// With a dashed level to compare with.
    #[must_use]
    pub fn with_level(self, level: f64, name: impl Into<String>) -> Self {
        Self { level: Some((level, name.into())), ..self }
    }

    /// Of this height, pixels.
    #[must_use]
    pub fn tall(self, height: f64) -> Self {
        Self { height, ..self }
    }
}

/// Panels above each other over one horizontal axis.
pub fn panels(title: &str, x_label: &str, panels: &[Panel]) -> String {
    panels_with_marks(title, x_label, panels, "", &[])
}

/// The same with a grey bar below, along the stretches of x ([`spans`](crate::spans)) where something holds, and its name.
pub fn panels_with_marks(title: &str, x_label: &str, panels: &[Panel], mark: &str, marked: &[[f64; 2]]) -> String {
    let x = Axis::exact(bounds(panels.iter().flat_map(|p| &p.series).flat_map(Series::x)));
    let height = HEAD + panels.iter().map(|p| GAP + p.height).sum::<f64>() + FOOT;
    let mut svg = opening(title, height);
    let mut bottom = HEAD - 8.0;
    for (k, panel) in panels.iter().enumerate() {
        let level = panel.level.as_ref().map(|l| l.0);
        let y = Axis::exact(bounds(panel.series.iter().flat_map(Series::y).chain(level)));
        let area = Area { top: bottom + GAP, height: panel.height, x: x.clone(), y };
        bottom = area.top + area.height;
        grid(&mut svg, &area, panel.height / 32.0, k + 1 == panels.len());
        let mut legend = Legend::above(&area);
        legend.add(&mut svg, INK, &panel.label);
        area.draw(&mut svg, &panel.series, &mut legend);
        if let Some((level, name)) = &panel.level {
            legend.add(&mut svg, "#777", &format!("dashed: {name}"));
            let (y, across) = (area.down(*level), WIDTH - 2.0 * MARGIN);
            let _ = writeln!(svg, r##"<path d="M{MARGIN} {y:.1}h{across}" stroke="#777" stroke-dasharray="4 4"/>"##);
        }
        for [from, to] in marked.iter().filter(|_| k + 1 == panels.len()) {
            let (a, b) = (area.across(*from), area.across(*to));
            let _ = writeln!(svg, r##"<rect x="{a:.1}" y="{bottom}" width="{:.1}" height="4" fill="#999"/>"##, (b - a).max(0.5));
        }
    }
    let at = height - 10.0;
    if !mark.is_empty() {
        let _ = writeln!(svg, r##"<text x="{MARGIN}" y="{at}" fill="#777">grey: {}</text>"##, escape(mark));
    }
    let _ = writeln!(svg, r#"<text x="{}" y="{at}" text-anchor="middle">{}</text>"#, 0.5 * WIDTH, escape(x_label));
    svg.push_str("</svg>\n");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(y: f64) -> Series {
        Series::line("s", [(0.0, 0.0), (1.0, y)])
    }

    #[test]
    fn every_panel_has_its_axis_and_shares_the_time() {
        let svg = panels("", "t, s", &[Panel::new("one", [line(1.0)]), Panel::new("two", [line(5.0)])]);
        assert_eq!((svg.matches("<rect x=").count(), svg.matches("t, s").count()), (2, 1));
    }

    #[test]
    fn a_level_far_away_stands_within_the_axes() {
        let svg = panels("", "", &[Panel::new("one", [line(1.0)]).with_level(9.0, "rated")]);
        assert!(svg.contains("dashed: rated") && svg.contains(">5<"));
    }

    #[test]
    fn what_holds_somewhere_is_marked_below_the_last_panel() {
        let both = [Panel::new("one", [line(1.0)]), Panel::new("two", [line(1.0)])];
        let svg = panels_with_marks("", "", &both, "lost & found", &[[0.2, 0.4], [0.9, 0.9]]);
        assert_eq!(svg.matches("fill=\"#999\"").count(), 2);
        assert!(svg.contains("grey: lost &amp; found"));
    }
}
