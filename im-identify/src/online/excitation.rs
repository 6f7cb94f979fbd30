//! Persistence of excitation, computed on line.
//!
//! A parameter error θ (relative) shows as y = fᵀθ in each sample, f complex. The information matrix of a window,
//!
//! ```text
//! M = ⟨Re(f̄ fᵀ)/(‖f‖² + f₀²)⟩,
//! ```
//!
//! is (38) of Jadot et al. with the scaling 1/‖B‖² of their gains; ⟨ ⟩ is a first-order mean over the window. Its trace is at most 1. f₀ is
//! the size of f below which it is noise, so that M vanishes at standstill. The smallest eigenvalue of M is zero when some combination of
//! parameters does not show at all; 1/(M⁻¹)ᵢᵢ is what is known of parameter i when the others are unknown too.

use im_model::space_vector::{dot, norm2};
use im_model::{Complex, Scalar};

/// Added to the diagonal before inverting: below it information counts as none.
const NOTHING: f64 = 1e-6;

/// Every how many samples the matrix is looked into: windows are long against it, and it costs more than all the rest.
const EVERY: u8 = 8;

/// How well a window determines N parameters, by relative error; from 0 to 1/N, at best equal for all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excitation<T, const N: usize> {
    /// Smallest eigenvalue of the information matrix.
    pub smallest: T,
    /// Information about each parameter when the others are unknown.
    pub of_each: [T; N],
}

impl<T: Scalar, const N: usize> Excitation<T, N> {
    /// Nothing is known.
    pub const fn none(zero: T) -> Self {
        Self { smallest: zero, of_each: [zero; N] }
    }
}

/// The information matrix and the direction it says least about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExcitationMonitor<T, const N: usize> {
    /// M, lower triangle.
    information: [[T; N]; N],
    weakest: [T; N],
    last: Excitation<T, N>,
    /// Samples since the matrix was last looked into.
    since: u8,
}

impl<T: Scalar, const N: usize> Default for ExcitationMonitor<T, N> {
    fn default() -> Self {
        let zero = T::zero();
        Self { information: [[zero; N]; N], weakest: [T::one(); N], last: Excitation::none(zero), since: 0 }
    }
}

impl<T: Scalar, const N: usize> ExcitationMonitor<T, N> {
    /// What the window says.
    pub fn excitation(&self) -> Excitation<T, N> {
        self.last
    }

    /// The direction in relative parameters that the window says least about, of length 1 (or all ones, before the first sample).
    pub fn weakest(&self) -> [T; N] {
        self.weakest
    }

    /// Row i, column j ≤ i of M.
    pub fn information(&self, i: usize, j: usize) -> T {
        if i < N && j <= i { self.information[i][j] } else { T::zero() }
    }

    /// Adds a sample. `share` is h over the window, from 0 to 1; `floor2` is f₀².
    pub fn add(&mut self, regressor: &[Complex<T>; N], floor2: T, share: T) -> Excitation<T, N> {
        let size = regressor.iter().fold(T::zero(), |s, f| s + norm2(*f));
        let weight = if size + floor2 > T::zero() { T::one() / (size + floor2) } else { T::zero() };
        for i in 0..N {
            for j in 0..=i {
                let m = &mut self.information[i][j];
                *m += (dot(regressor[i], regressor[j]) * weight - *m) * share;
            }
        }
        self.since += 1;
        if self.since >= EVERY {
            (self.since, self.last) = (0, self.evaluate());
        }
        self.last
    }

    /// M + εI = LDLᵀ; one step of inverse iteration on it, from the last direction.
    fn evaluate(&mut self) -> Excitation<T, N> {
        let (zero, one, nothing) = (T::zero(), T::one(), T::from_f64(NOTHING));
        let m = &self.information;
        // k = L⁻¹ and 1/d.
        let (mut l, mut k, mut inverse_d) = ([[zero; N]; N], [[zero; N]; N], [zero; N]);
        for i in 0..N {
            let mut d = m[i][i] + nothing;
            for j in 0..i {
                let mut x = m[i][j];
                for p in 0..j {
                    x -= l[i][p] * k[j][p];
                }
                // k holds l·d for now.
                k[i][j] = x;
                l[i][j] = x * inverse_d[j];
                d -= x * l[i][j];
            }
            // Rounding must not make it negative.
            inverse_d[i] = one / d.max(nothing * T::from_f64(0.5));
        }
        for i in 0..N {
            k[i][i] = one;
            for j in (0..i).rev() {
                let mut x = zero;
                for p in j..i {
                    x -= l[i][p] * k[p][j];
                }
                k[i][j] = x;
            }
        }
        let mut of_each = [zero; N];
        let mut least = 0;
        for i in 0..N {
            let mut x = zero;
            for p in i..N {
                x += k[p][i] * k[p][i] * inverse_d[p];
            }
            of_each[i] = (one / x - nothing).max(zero);
            if of_each[i] < of_each[least] {
                least = i;
            }
        }
        // A direction that has dropped out of the old one must be able to come back.
        let v = &mut self.weakest;
        v[least] += T::from_f64(0.01) * if v[least] < zero { -one } else { one };
        let mut y = [zero; N];
        for i in 0..N {
            for j in 0..=i {
                y[i] += k[i][j] * v[j];
            }
            y[i] *= inverse_d[i];
        }
        let mut size = zero;
        for i in 0..N {
            v[i] = zero;
            for p in i..N {
                v[i] += k[p][i] * y[p];
            }
            size += v[i] * v[i];
        }
        let scale = one / size.sqrt();
        let mut smallest = zero;
        for i in 0..N {
            v[i] *= scale;
            // Directions that drop out must not linger as denormal numbers, which are slow.
            if v[i].abs() < nothing {
                v[i] = zero;
            }
            let mut row = m[i][i] * v[i];
            for j in 0..i {
                row += m[i][j] * v[j] + m[i][j] * v[j];
            }
            smallest += row * v[i];
        }
        Excitation { smallest: smallest.max(zero), of_each }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix4, SymmetricEigen};
    use proptest::prelude::*;

    fn regressors() -> impl Strategy<Value = Vec<[Complex<f64>; 4]>> {
        let z = || (-1.0..1.0f64, -1.0..1.0f64).prop_map(|(re, im)| Complex::new(re, im));
        prop::collection::vec([z(), z(), z(), z()], 2..6)
    }

    proptest! {
        /// Against a library's eigenvalues and inverse.
        #[test]
        fn smallest_eigenvalue_and_conditional_information_are_those_of_the_matrix(f in regressors()) {
            let mut monitor = ExcitationMonitor::<f64, 4>::default();
            for k in 0..4000 {
                monitor.add(&f[k % f.len()], 0.01, 0.002);
            }
            let m = Matrix4::from_fn(|i, j| monitor.information(i.max(j), i.min(j)));
            let truth = SymmetricEigen::new(m).eigenvalues.min().max(0.0);
            let e = monitor.excitation();
            // The matrix still moves a little with each sample, and the direction is nudged by 0.01.
            prop_assert!((e.smallest - truth).abs() < 1e-3 * m.trace() + 0.02 * truth, "{} against {truth}", e.smallest);
            let inverse = (m + Matrix4::identity() * NOTHING).try_inverse().unwrap();
            for (i, of) in e.of_each.into_iter().enumerate() {
                prop_assert!((of + NOTHING - 1.0 / inverse[(i, i)]).abs() < 1e-6);
            }
            prop_assert!(m.trace() <= 1.0 + 1e-9);
        }
    }

    #[test]
    fn one_operating_point_determines_two_of_four_and_nothing_at_all_none() {
        let f = [Complex::new(1.0, 0.0), Complex::new(0.0, 1.0), Complex::new(0.3, 0.2), Complex::new(-0.2, 0.4)];
        let mut monitor = ExcitationMonitor::<f64, 4>::default();
        for _ in 0..5000 {
            monitor.add(&f, 0.0, 0.01);
        }
        assert!(monitor.excitation().smallest < 1e-5, "{:?}", monitor.excitation());
        let mut two = ExcitationMonitor::<f64, 2>::default();
        for _ in 0..5000 {
            two.add(&[f[0], f[1]], 0.0, 0.01);
        }
        assert!((two.excitation().smallest - 0.5).abs() < 1e-3);
        for _ in 0..5000 {
            two.add(&[Complex::new(0.0, 0.0); 2], 0.0, 0.01);
        }
        assert!(two.excitation().smallest < 1e-9 && two.excitation().smallest.is_finite());
    }

    /// Directions that are exactly decoupled: the least known changes hands.
    #[test]
    fn a_direction_that_had_dropped_out_comes_back() {
        let (z, one) = (Complex::new(0.0, 0.0), Complex::new(1.0, 0.0));
        let mut monitor = ExcitationMonitor::<f32, 2>::default();
        for pattern in [[one, z], [z, one], [one, z]] {
            for _ in 0..5000 {
                monitor.add(&pattern, 0.0, 0.01);
            }
            assert!(monitor.excitation().smallest < 1e-3, "{:?}", monitor.excitation());
        }
    }
}
