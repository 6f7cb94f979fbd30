//! Errors over the speed–torque plane.

use serde::Serialize;

use super::{Quantity, Signals, say, stays};

/// Root mean square error over speed and torque.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plane {
    /// Which error.
    pub quantity: Quantity,
    /// Edges of the cells over speed, rad/s.
    pub speed_edges: Vec<f64>,
    /// Edges of the cells over air-gap torque, Nm.
    pub torque_edges: Vec<f64>,
    /// Cells, torque by torque: root mean square error in the quantity's unit; `None` where there are too few rows.
    pub cells: Vec<Vec<Option<f64>>>,
    /// The noise level, in the quantity's unit.
    pub noise: f64,
    /// One sentence.
    pub conclusion: String,
    /// How telling: zero where there is only noise.
    pub strength: f64,
}

const COLUMNS: usize = 12;
const LINES: usize = 9;
/// Rows needed in a cell.
const LEAST: f64 = 20.0;

/// Range without the outermost thousandths: a single spike does not stretch the picture.
pub(super) fn range(mut x: Vec<f64>) -> Option<(f64, f64)> {
    x.retain(|v| v.is_finite());
    if x.len() < 2 {
        return None;
    }
    x.sort_by(f64::total_cmp);
    let at = |p: f64| x[((x.len() - 1) as f64 * p).round() as usize];
    let (lo, hi) = (at(0.002), at(0.998));
    (hi > lo).then_some((lo, hi))
}

pub(super) fn plane(s: &Signals, q: Quantity) -> Option<Plane> {
    let (w0, w1) = range(s.rows().map(|r| r.speed).collect())?;
    let (t0, t1) = range(s.rows().map(|r| r.torque).collect())?;
    if stays(w0, w1) && stays(t0, t1) {
        return None;
    }
    let edges = |lo: f64, hi: f64, n: usize| (0..=n).map(|k| lo + (hi - lo) * k as f64 / n as f64).collect::<Vec<_>>();
    let index = |x: f64, lo: f64, hi: f64, n: usize| {
        (((x - lo) / (hi - lo) * n as f64).floor() as isize).clamp(0, n as isize - 1) as usize
    };
    let mut sums = vec![vec![[0.0; 2]; COLUMNS]; LINES];
    for r in s.rows() {
        if let Some(e) = q.squared(r) {
            let cell = &mut sums[index(r.torque, t0, t1, LINES)][index(r.speed, w0, w1, COLUMNS)];
            cell[0] += 1.0;
            cell[1] += e;
        }
    }
    let cells: Vec<Vec<Option<f64>>> =
        sums.iter().map(|l| l.iter().map(|c| (c[0] >= LEAST).then(|| (c[1] / c[0]).sqrt())).collect()).collect();
    let (speed_edges, torque_edges) = (edges(w0, w1, COLUMNS), edges(t0, t1, LINES));
    let noise = q.noise(s);
    // Cells with few rows are shown, but nothing is said of them: the root mean square of n rows strays by 1/√(2n).
    let firm = || {
        let all = sums.iter().enumerate().flat_map(|(l, row)| row.iter().enumerate().map(move |(c, x)| (x, l, c)));
        all.filter(|(x, ..)| x[0] >= 2.0 * LEAST).map(|(x, l, c)| ((x[1] / x[0]).sqrt(), x[0], l, c))
    };
    let (worst, rows, l, c) = firm().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let least = firm().map(|x| x.0).fold(f64::INFINITY, f64::min);
    let floor = noise * (1.2 + 4.0 / (2.0 * rows).sqrt());
    let (name, unit) = (q.name(), q.unit());
    let flat = worst < 1.3 * least || worst < floor;
    let conclusion = if worst < floor {
        format!("the {name} error is that of the noise ({} {unit}) at every speed and torque", say(noise))
    } else if flat {
        format!("the {name} error is much the same at every speed and torque ({} to {} {unit})", say(least), say(worst))
    } else {
        format!(
            "over speed and torque the {name} error is largest around {} rad/s and {} Nm ({} {unit}, against {} {unit} where it is least)",
            say(0.5 * (speed_edges[c] + speed_edges[c + 1])),
            say(0.5 * (torque_edges[l] + torque_edges[l + 1])),
            say(worst),
            say(least)
        )
    };
    let strength = if flat { 0.0 } else { 0.3 * (worst / least.max(noise)).ln() };
    Some(Plane { quantity: q, speed_edges, torque_edges, cells, noise, conclusion, strength })
}
