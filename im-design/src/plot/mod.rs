//! Pictures of a design as SVG text, small and without scripts: pole maps, stability maps, curves over torque.

mod picture;

pub use picture::picture;

use crate::certificate::Plant;
use crate::kubota::KubotaDesign;
use crate::kubota_loop::LoopGains;
use crate::linalg;
use std::fmt::Write;

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 420.0;
const MARGIN: f64 = 60.0;
const COLOURS: [&str; 5] = ["#1f5fa8", "#c0392b", "#2e8b57", "#8e6bbf", "#c98a1b"];

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

/// A chart of series over linear axes.
pub fn chart(title: &str, x_label: &str, y_label: &str, series: &[Series]) -> String {
    let values = series.iter().flat_map(|s| &s.points).filter(|(x, y)| x.is_finite() && y.is_finite());
    chart_within(title, x_label, y_label, bounds(values.map(|p| p.1)), series)
}

/// The same with the range of y given, beyond which lines are cut.
pub fn chart_within(title: &str, x_label: &str, y_label: &str, [low, high]: [f64; 2], series: &[Series]) -> String {
    let all = || series.iter().flat_map(|s| &s.points).filter(|(x, y)| x.is_finite() && y.is_finite());
    let [left, right] = bounds(all().map(|p| p.0));
    let at = |(x, y): (f64, f64)| {
        let u = MARGIN + (x - left) / (right - left) * (WIDTH - 2.0 * MARGIN);
        (u, HEIGHT - MARGIN - (y.clamp(low, high) - low) / (high - low) * (HEIGHT - 2.0 * MARGIN))
    };
    let mut legend = MARGIN;
    let mut svg = frame(title, x_label, y_label, [left, right], [low, high]);
    for (k, s) in series.iter().enumerate() {
        let colour = COLOURS[k % COLOURS.len()];
        let points = s.points.iter().filter(|(x, y)| x.is_finite() && y.is_finite()).map(|p| at(*p));
        match s.mark {
            Mark::Line => {
                let path: Vec<String> = points.map(|(u, v)| format!("{u:.1},{v:.1}")).collect();
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
        let _ = writeln!(svg, r#"<text x="{legend:.0}" y="{}" fill="{colour}">{}</text>"#, MARGIN - 8.0, escape(&s.name));
        // A letter of this size is about six pixels wide.
        legend += 5.8 * s.name.chars().count() as f64 + 18.0;
    }
    svg.push_str("</svg>\n");
    svg
}

/// Lines of functions over a range.
pub fn curves([low, high]: [f64; 2], of: &[(&str, &dyn Fn(f64) -> f64)]) -> Vec<Series> {
    let x = |k: u32| low + (high - low) * f64::from(k) / 60.0;
    let line = |(name, f): &(&str, &dyn Fn(f64) -> f64)| Series {
        name: (*name).into(),
        mark: Mark::Line,
        points: (0..=60).map(|k| (x(k), f(x(k)))).collect(),
    };
    of.iter().map(line).collect()
}

/// Where the adaptive loop is stable (blue, darker is faster) and unstable (red), over slip and speed, around a region [speeds, slips];
/// certified cells are outlined.
pub fn stability_map(plant: Plant, gains: &LoopGains, region: [[f64; 2]; 2], flux_wb: f64, cells: &[[[f64; 2]; 2]]) -> String {
    const N: usize = 32;
    let [speed, slip] = region.map(|[low, high]| [low - 0.4 * (high - low), high + 0.4 * (high - low)]);
    let grid = |[low, high]: [f64; 2]| -> Vec<f64> { (0..N).map(|k| low + (high - low) * (k as f64 + 0.5) / N as f64).collect() };
    let map = gains.map(plant, &grid(speed), &grid(slip), flux_wb);
    let most = map.iter().flatten().fold(1e-9f64, |m, d| m.max(d.abs()));
    let title = "Decay rate of the adaptive loop: blue stable, red unstable; certified cells outlined";
    let mut svg = frame(title, "slip, rad/s", "speed, rad/s", slip, speed);
    let place = |x: [f64; 2], y: [f64; 2]| {
        let u = |x: f64| MARGIN + (x - slip[0]) / (slip[1] - slip[0]) * (WIDTH - 2.0 * MARGIN);
        let v = |y: f64| HEIGHT - MARGIN - (y - speed[0]) / (speed[1] - speed[0]) * (HEIGHT - 2.0 * MARGIN);
        let (width, height) = (u(x[1]) - u(x[0]), v(y[0]) - v(y[1]));
        format!(r#"x="{:.1}" y="{:.1}" width="{width:.1}" height="{height:.1}""#, u(x[0]), v(y[1]))
    };
    let part = |[low, high]: [f64; 2], k: usize| [k, k + 1].map(|k| low + (high - low) * k as f64 / N as f64);
    // In ten shades, and neighbours of one shade as one, to keep the file small.
    let shade = |decay: f64| {
        let strength = (10.0 * (decay.abs() / most).sqrt()).ceil() as u8;
        (decay > 0.0, strength)
    };
    for (row, decays) in map.iter().enumerate() {
        let mut column = 0;
        while column < N {
            let (stable, strength) = shade(decays[column]);
            let end = (column..N).find(|&k| shade(decays[k]) != (stable, strength)).unwrap_or(N);
            let place = place([part(slip, column)[0], part(slip, end - 1)[1]], part(speed, row));
            let colour = if stable { COLOURS[0] } else { COLOURS[1] };
            let opacity = 0.1 + 0.09 * f64::from(strength);
            let _ = writeln!(svg, r#"<rect {place} fill="{colour}" fill-opacity="{opacity:.2}"/>"#);
            column = end;
        }
    }
    for [speed, slip] in cells {
        let place = place(*slip, *speed);
        let _ = writeln!(svg, r#"<rect {place} fill="none" stroke="black"/>"#);
    }
    svg.push_str("</svg>\n");
    svg
}

/// Poles of the error dynamics of Kubota's observer over its speed range.
pub fn pole_map(plant: Plant, design: &KubotaDesign) -> String {
    let c = plant.constants::<f64>();
    let [low, high] = design.speed_rad_per_s;
    let speeds = (0..=24).map(|k| low + (high - low) * f64::from(k) / 24.0);
    let points = speeds.flat_map(|w| linalg::eigenvalues(&design.error_matrix(&c, w))).collect();
    let poles = Series { name: format!("{low} to {high} rad/s"), mark: Mark::Cross, points };
    chart("Poles of the estimation error", "real part, 1/s", "imaginary part, rad/s", &[poles])
}

/// One picture below another.
fn stacked(upper: &str, lower: &str) -> String {
    let height = 2.0 * HEIGHT;
    let lower = lower.replacen("<svg ", &format!("<svg y=\"{HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" "), 1);
    let upper = upper.replacen("<svg ", &format!("<svg width=\"{WIDTH}\" height=\"{HEIGHT}\" "), 1);
    format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\">\n{upper}{lower}</svg>\n")
}

fn bounds(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)]);
    match high - low {
        span if span > 0.0 && span.is_finite() => [low - 0.03 * span, high + 0.03 * span],
        _ if low.is_finite() => [low - 1.0, low + 1.0],
        _ => [0.0, 1.0],
    }
}

/// The opening tag, axes, ticks and labels.
fn frame(title: &str, x_label: &str, y_label: &str, x: [f64; 2], y: [f64; 2]) -> String {
    let (w, h) = (WIDTH - 2.0 * MARGIN, HEIGHT - 2.0 * MARGIN);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n\
         <rect x=\"{MARGIN}\" y=\"{MARGIN}\" width=\"{w}\" height=\"{h}\" fill=\"none\" stroke=\"#888\"/>\n"
    );
    for (at, text) in ticks(x, 7.0) {
        let u = MARGIN + (at - x[0]) / (x[1] - x[0]) * w;
        let _ = writeln!(svg, r##"<path d="M{u:.1} {MARGIN}v{h}" stroke="#eee"/>"##);
        let _ = writeln!(svg, r#"<text x="{u:.1}" y="{}" text-anchor="middle">{text}</text>"#, HEIGHT - MARGIN + 15.0);
    }
    for (at, text) in ticks(y, 6.0) {
        let v = HEIGHT - MARGIN - (at - y[0]) / (y[1] - y[0]) * h;
        let _ = writeln!(svg, r##"<path d="M{MARGIN} {v:.1}h{w}" stroke="#eee"/>"##);
        let _ = writeln!(svg, r#"<text x="{}" y="{:.1}" text-anchor="end">{text}</text>"#, MARGIN - 5.0, v + 4.0);
    }
    let (middle, bottom, half) = (0.5 * WIDTH, HEIGHT - 20.0, 0.5 * HEIGHT);
    for (x, y, turn, text) in
        [(middle, 30.0, "", title), (middle, bottom, "", x_label), (12.0, half, "rotate(-90 12 210)", y_label)]
    {
        let text = escape(text);
        let _ = writeln!(svg, r#"<text x="{x}" y="{y}" text-anchor="middle" transform="{turn}">{text}</text>"#);
    }
    svg
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
    use crate::Machine;
    use crate::kubota::{KubotaRequest, closed_form};
    use crate::kubota_loop::{certify, mended, no_feedback};

    #[test]
    fn pictures_are_closed_and_show_both_colours() {
        let plant = Plant::Machine(Machine::jadot_table_i());
        let gains = mended(plant, 0.2, 0.0, 0.05, 20.0).unwrap();
        let region = [[5.0, 10.0], [-8.0, -2.0]];
        let (design, _) = certify(plant, &gains, region[0], region[1], 0.9, 4).unwrap();
        let cells: Vec<_> = design.cells.iter().map(|cell| [cell.speed_rad_per_s, cell.slip_rad_per_s]).collect();
        // Without feedback the same region is partly unstable.
        let map = stability_map(plant, &no_feedback(0.05, 20.0), region, 0.9, &cells);
        assert!(map.ends_with("</svg>\n") && COLOURS[..2].iter().all(|c| map.contains(c)));
        let request = KubotaRequest { speed_rad_per_s: [-160.0, 160.0], rate_per_s: 3.0, flux_weight: 1e4 };
        let poles = pole_map(plant, &closed_form(plant, &request).unwrap().0);
        assert_eq!(poles.matches(&format!("stroke=\"{}\"", COLOURS[0])).count(), 100, "four poles at 25 speeds");
    }
}
