//! Pictures of a design as SVG text, small and without scripts: pole maps, stability maps, curves over torque.

mod picture;

pub use im_chart::{Series, chart, chart_within, curves};
pub use picture::picture;

use crate::certificate::DesignModel;
use crate::kubota::KubotaDesign;
use crate::kubota_loop::LoopGains;
use crate::linalg;
use std::fmt::Write;

use im_chart::{COLOURS, HEIGHT, MARGIN, WIDTH, axes, stacked};

/// Where the adaptive loop is stable (blue, darker is faster) and unstable (red), over slip and speed, around a region [speeds, slips];
/// certified cells are outlined.
pub fn stability_map(
    plant: DesignModel,
    gains: &LoopGains,
    region: [[f64; 2]; 2],
    flux_vs: f64,
    cells: &[[[f64; 2]; 2]],
) -> String {
    const N: usize = 32;
    let [speed, slip] = region.map(|[low, high]| {
        let around = if low < high { 0.4 * (high - low) } else { 0.1 * low.abs().max(10.0) };
        [low - around, high + around]
    });
    let grid = |[low, high]: [f64; 2]| -> Vec<f64> { (0..N).map(|k| low + (high - low) * (k as f64 + 0.5) / N as f64).collect() };
    let map = gains.map(plant, &grid(speed), &grid(slip), flux_vs);
    let most = map.iter().flatten().fold(1e-9f64, |m, d| m.max(d.abs()));
    let title = "Decay rate of the adaptive loop: blue stable, red unstable; certified cells outlined";
    let mut svg = axes(title, "slip, rad/s", "speed, rad/s", slip, speed);
    let place = |x: [f64; 2], y: [f64; 2]| {
        let u = |x: f64| MARGIN + (x - slip[0]) / (slip[1] - slip[0]) * (WIDTH - 2.0 * MARGIN);
        let v = |y: f64| HEIGHT - MARGIN - (y - speed[0]) / (speed[1] - speed[0]) * (HEIGHT - 2.0 * MARGIN);
        // A line or a point is seen, too.
        let (width, height) = ((u(x[1]) - u(x[0])).max(1.0), (v(y[0]) - v(y[1])).max(1.0));
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
pub fn pole_map(plant: DesignModel, design: &KubotaDesign) -> String {
    let c = plant.constants::<f64>();
    let [low, high] = design.speed_rad_s;
    let speeds = (0..=24).map(|k| low + (high - low) * f64::from(k) / 24.0);
    let points = speeds.flat_map(|w| linalg::eigenvalues(&design.error_matrix(&c, w)));
    let poles = Series::crosses(format!("{low} to {high} rad/s"), points);
    chart("Poles of the estimation error", "real part, 1/s", "imaginary part, rad/s", &[poles])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;
    use crate::kubota::{KubotaRequest, closed_form};
    use crate::kubota_loop::{certify, no_feedback, stabilized};

    #[test]
    fn pictures_are_closed_and_show_both_colours() {
        let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
        let gains = stabilized(plant, 0.2, 0.0, 0.05, 20.0).unwrap();
        let region = [[5.0, 10.0], [-8.0, -2.0]];
        let (design, _) = certify(plant, &gains, region[0], region[1], 0.9, 4).unwrap();
        let cells: Vec<_> = design.cells.iter().map(|cell| [cell.speed_rad_s, cell.slip_rad_s]).collect();
        // Without feedback the same region is partly unstable.
        let map = stability_map(plant, &no_feedback(0.05, 20.0), region, 0.9, &cells);
        assert!(map.ends_with("</svg>\n") && COLOURS[..2].iter().all(|c| map.contains(c)));
        let request = KubotaRequest { speed_rad_s: [-160.0, 160.0], rate_per_s: 3.0, flux_weight: 1e4 };
        let poles = pole_map(plant, &closed_form(plant, &request).unwrap().0);
        assert_eq!(poles.matches(&format!("stroke=\"{}\"", COLOURS[0])).count(), 100, "four poles at 25 speeds");
    }
}
