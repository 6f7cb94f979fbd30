//! Tails of χ², and angles between signals and between spans of signals.

use nalgebra::{DMatrix, DVectorView, RealField, convert};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// −log₁₀ P(χ²_k > x), also far beyond where the tail underflows.
pub fn log_p(x: f64, freedom: usize) -> f64 {
    let k = freedom as f64;
    let tail = ChiSquared::new(k).map_or(1.0, |d| d.sf(x));
    if tail > 1e-250 {
        return -tail.log10();
    }
    // Leading term of the tail: (x/2)^{k/2−1} e^{−x/2}/Γ(k/2).
    let half = 0.5 * x;
    (half - (0.5 * k - 1.0) * half.ln() + statrs::function::gamma::ln_gamma(0.5 * k)) / std::f64::consts::LN_10
}

/// The value that χ²_k exceeds with probability `p`.
pub fn threshold(freedom: usize, p: f64) -> f64 {
    ChiSquared::new(freedom as f64).map_or(f64::INFINITY, |d| d.inverse_cdf(1.0 - p))
}

/// An orthonormal basis of columns, by Gram-Schmidt. In single precision it takes half of the memory; sums are in double.
pub struct Basis<S = f64> {
    directions: Vec<Vec<S>>,
}

impl<S> Default for Basis<S> {
    fn default() -> Self {
        Self { directions: Vec::new() }
    }
}

/// A column that lies so far in the span of others, or nearer than ten roundings, holds nothing beside them.
const ROUNDING: f64 = 1e-9;

/// Rows that all directions pass before the next ones: so many stay in the nearest memory.
const BLOCK: usize = 1024;

impl<S: RealField + Copy + Into<f64>> Basis<S> {
    /// Of some columns.
    pub fn of(columns: impl IntoIterator<Item = Vec<f64>>) -> Self {
        let mut me = Self::default();
        columns.into_iter().for_each(|c| drop(me.push(c)));
        me
    }

    /// How many directions there are.
    pub fn rank(&self) -> usize {
        self.directions.len()
    }

    /// Takes one more column, and gives its coordinates; one that lies in the span of the others adds no direction.
    pub fn push(&mut self, mut column: Vec<f64>) -> Vec<f64> {
        let before = dot(&column, &column).sqrt();
        let mut coordinates = vec![0.0; self.rank()];
        // Twice is enough for orthogonality to rounding.
        for _ in 0..2 {
            let along = self.along(0, &column);
            self.take(&along, &mut column);
            coordinates.iter_mut().zip(along).for_each(|(x, along)| *x += along);
        }
        let norm = dot(&column, &column).sqrt();
        if norm > ROUNDING.max(10.0 * S::default_epsilon().into()) * before {
            self.directions.push(column.into_iter().map(|x| convert(x / norm)).collect());
            coordinates.push(norm);
        }
        coordinates
    }

    /// Each direction times a column that is zero but for the rows from `begin` on.
    pub fn along(&self, begin: usize, column: &[f64]) -> Vec<f64> {
        // Sums that do not wait for one another.
        let mut sums = vec![[0.0; 8]; self.rank()];
        for (block, x) in column.chunks(BLOCK).enumerate() {
            let rows = begin + block * BLOCK..begin + block * BLOCK + x.len();
            for (direction, sums) in self.directions.iter().zip(&mut sums) {
                for (q, x) in direction[rows.clone()].chunks(8).zip(x.chunks(8)) {
                    sums.iter_mut().zip(q.iter().zip(x)).for_each(|(sum, (q, x))| *sum += (*q).into() * x);
                }
            }
        }
        sums.iter().map(|s| s.iter().sum()).collect()
    }

    /// Takes each direction times a factor from a column.
    pub fn take(&self, times: &[f64], from: &mut [f64]) {
        for (block, x) in from.chunks_mut(BLOCK).enumerate() {
            let rows = block * BLOCK..block * BLOCK + x.len();
            for (direction, times) in self.directions.iter().zip(times) {
                x.iter_mut().zip(&direction[rows.clone()]).for_each(|(x, q)| *x -= times * (*q).into());
            }
        }
    }

    /// Every so many rows of each direction.
    pub fn in_steps(&self, stride: usize) -> Self {
        Self { directions: self.directions.iter().map(|q| q.iter().step_by(stride).copied().collect()).collect() }
    }

    /// The directions.
    fn into_columns(self) -> Vec<Vec<f64>> {
        self.directions.into_iter().map(|q| q.into_iter().map(Into::into).collect()).collect()
    }
}

/// Σ a b.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    DVectorView::from_slice(a, a.len()).dot(&DVectorView::from_slice(b, b.len()))
}

/// The orthogonal complement of some columns of so many rows.
pub fn complement(columns: impl IntoIterator<Item = Vec<f64>>, rows: usize) -> Vec<Vec<f64>> {
    let mut basis: Basis = Basis::of(columns);
    let spanned = basis.rank();
    (0..rows).for_each(|k| drop(basis.push((0..rows).map(|i| if i == k { 1.0 } else { 0.0 }).collect())));
    basis.into_columns().split_off(spanned)
}

/// Cosine of the angle between two signatures, without sign.
pub fn cosine(a: &[f64], b: &[f64]) -> f64 {
    let both = (dot(a, a) * dot(b, b)).sqrt();
    if a.len() == b.len() && both > 0.0 { (dot(a, b) / both).abs() } else { 0.0 }
}

/// Largest cosine of the principal angles between two spans of columns.
pub fn closest_of(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let [a, b] = [a, b].map(|columns| Basis::<f64>::of(columns.iter().cloned()));
    let along: Vec<f64> = b.into_columns().iter().flat_map(|b| a.along(0, b)).collect();
    let between = DMatrix::from_vec(a.rank(), along.len() / a.rank().max(1), along);
    if between.is_empty() { 0.0 } else { between.singular_values().max() }
}

/// The means of every so many values; of the last ones that are left.
pub fn means(x: &[f64], stride: usize) -> Vec<f64> {
    x.chunks(stride).map(|part| part.iter().sum::<f64>() / part.len() as f64).collect()
}

/// The median; zero of nothing. Sorts in part.
pub fn median(x: &mut [f64]) -> f64 {
    if x.is_empty() {
        return 0.0;
    }
    let middle = x.len() / 2;
    *x.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn effects_are_as_close_as_the_nearest_things_that_they_can_do() {
        let (x, y, z) = (vec![1.0, 0.0, 0.0], vec![0.0, 2.0, 0.0], vec![0.0, 0.0, 3.0]);
        let between = vec![0.0, 1.0, 1.0];
        let near = |a: &[&Vec<f64>], b: &[&Vec<f64>]| {
            let owned = |v: &[&Vec<f64>]| v.iter().map(|v| (*v).clone()).collect::<Vec<_>>();
            closest_of(&owned(a), &owned(b))
        };
        assert!(near(&[&x], &[&y]) < 1e-12 && (near(&[&x, &y], &[&y, &z]) - 1.0).abs() < 1e-12);
        assert!((near(&[&x, &y], &[&between]) - 0.5f64.sqrt()).abs() < 1e-12);
        assert_eq!((near(&[], &[&x]), cosine(&x, &[0.0; 3]), cosine(&y, &[0.0, -1.0, 0.0])), (0.0, 0.0, 1.0));
    }

    proptest! {
        /// Columns are what their coordinates say, and with the complement of some of them nothing is left of any vector.
        #[test]
        fn columns_have_coordinates_and_a_complement(
            columns in prop::collection::vec(prop::collection::vec(-3.0..3.0f64, 6), 1..5),
            twice in any::<bool>(),
        ) {
            let mut columns = columns;
            if twice {
                columns.push(columns[0].iter().map(|x| 2.0 * x).collect());
            }
            let mut basis: Basis = Basis::default();
            let coordinates: Vec<Vec<f64>> = columns.iter().map(|c| basis.push(c.clone())).collect();
            for (c, x) in columns.iter().zip(&coordinates) {
                let mut left = c.clone();
                basis.take(x, &mut left);
                prop_assert!(left.iter().all(|x| x.abs() < 1e-7));
            }
            let rest = complement(columns.clone(), 6);
            prop_assert_eq!(rest.len() + basis.rank(), 6);
            prop_assert!(rest.iter().all(|c| columns.iter().all(|x| dot(c, x).abs() < 1e-7)));
        }
    }
}
