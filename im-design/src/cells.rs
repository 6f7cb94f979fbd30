//! Cells that cover a region of speeds and slips: each with a proof of its own, together the whole region.

use crate::exact::Field;

/// Whether cells, as (speeds, slips), cover a region: inside it, apart, and of its whole area together. A region may be a line or a point.
pub(crate) fn covered<F: Field>(cells: &[[[f64; 2]; 2]], region: [[f64; 2]; 2]) -> Result<(), String> {
    let flat = region.map(|[low, high]| low == high);
    let area = |part: [[f64; 2]; 2]| {
        let width = |n: usize| if flat[n] { F::one() } else { F::from_f64(part[n][1]) - F::from_f64(part[n][0]) };
        width(0) * width(1)
    };
    let inside = |[low, high]: [f64; 2], n: usize| region[n][0] <= low && (low < high || flat[n]) && high <= region[n][1];
    let apart = |a: [f64; 2], b: [f64; 2], n: usize| !flat[n] && (a[1] <= b[0] || b[1] <= a[0]);
    let mut covered = F::zero();
    for (k, cell) in cells.iter().enumerate() {
        if !(0..2).all(|n| inside(cell[n], n)) {
            return Err(format!("cell {k} is empty or leaves the region"));
        }
        if cells[..k].iter().any(|other| (0..2).all(|n| !apart(other[n], cell[n], n))) {
            return Err(format!("cell {k} overlaps another"));
        }
        covered = covered + area(*cell);
    }
    // Disjoint cells inside the region with its whole area leave no hole.
    if covered != area(region) {
        return Err("the cells do not cover the region".into());
    }
    Ok(())
}

/// Cells that cover a region of speeds and slips, each proven, halved up to `depth` times where they are not.
///
/// # Errors
/// The first cell that stays unproven.
pub(crate) fn halve<T>(
    speed: [f64; 2],
    slip: [f64; 2],
    depth: u32,
    prove: impl Fn([f64; 2], [f64; 2]) -> Option<T>,
) -> Result<Vec<T>, [[f64; 2]; 2]> {
    let mut cells = Vec::new();
    let mut open = vec![(speed, slip, depth)];
    while let Some((speed, slip, left)) = open.pop() {
        match prove(speed, slip) {
            Some(cell) => cells.push(cell),
            None if left > 0 && (speed[0] < speed[1] || slip[0] < slip[1]) => {
                for w in halves(speed) {
                    open.extend(halves(slip).into_iter().map(|s| (w, s, left - 1)));
                }
            }
            None => return Err([speed, slip]),
        }
    }
    Ok(cells)
}

/// A range in two; a point stays one.
fn halves([low, high]: [f64; 2]) -> Vec<[f64; 2]> {
    let middle = 0.5 * (low + high);
    if low < high { vec![[low, middle], [middle, high]] } else { vec![[low, high]] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_tile_planes_lines_and_points_and_nothing_else() {
        let plane = [[0.0, 2.0], [-1.0, 1.0]];
        let [left, right] = [[[0.0, 1.0], [-1.0, 1.0]], [[1.0, 2.0], [-1.0, 1.0]]];
        assert_eq!(covered::<f64>(&[left, right], plane), Ok(()));
        assert!(covered::<f64>(&[left], plane).unwrap_err().contains("do not cover"));
        assert!(covered::<f64>(&[left, left], plane).unwrap_err().contains("overlaps"));
        assert!(covered::<f64>(&[[[0.0, 3.0], [-1.0, 1.0]]], plane).unwrap_err().contains("leaves"));
        assert!(covered::<f64>(&[left, right, [[1.0, 1.0], [0.0, 1.0]]], plane).unwrap_err().contains("empty"));
        let line = [[1.0, 1.0], [-1.0, 1.0]];
        let [below, above] = [[[1.0, 1.0], [-1.0, 0.0]], [[1.0, 1.0], [0.0, 1.0]]];
        assert_eq!(covered::<f64>(&[below, above], line), Ok(()));
        assert!(covered::<f64>(&[below, below], line).unwrap_err().contains("overlaps"));
        assert!(covered::<f64>(&[below], line).unwrap_err().contains("do not cover"));
        let point = [[1.0, 1.0], [0.5, 0.5]];
        assert_eq!(covered::<f64>(&[point], point), Ok(()));
        assert!(covered::<f64>(&[point, point], point).is_err() && covered::<f64>(&[], point).is_err());
    }
}
