//! A voltage that was sampled: where it was switched between two samples, and its means over the rows.

use im_model::Complex;

use crate::statistics::median;

/// What a switch changes at least: this part of the largest voltage, beyond so many times what is usual from row to row.
const JUMP: f64 = 0.1;
const STANDS_OUT: f64 = 5.0;

/// A step that is foretold from one side alone is off by so many times more.
const ONE_SIDED: f64 = 2.0;

/// A voltage that turns by more than arccos of this from row to row shows no switches.
const FEW_ROWS: f64 = 0.3;

/// A switch that closed or opened between the sample of a row and the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Switch {
    pub row: usize,
    /// What it changed, V.
    pub jump_v: f64,
}

impl Switch {
    /// Standard deviation of the mean voltage of its row: it may have closed at any time in between.
    pub fn sigma_v(self) -> f64 {
        self.jump_v / 12f64.sqrt()
    }
}

/// The largest of some voltages, V.
pub fn size(u: &[Complex<f64>]) -> f64 {
    u.iter().map(|u| u.norm()).fold(0.0, f64::max)
}

/// What a voltage turns by from row to row, rad, on average.
pub fn turn(u: &[Complex<f64>]) -> f64 {
    u.windows(2).map(|w| w[1] * w[0].conj()).sum::<Complex<f64>>().arg()
}

/// The switches in a sampled voltage, in order: steps that those beside it do not foretell, as they do of vectors that turn, either way.
pub fn switches(u: &[Complex<f64>]) -> Vec<Switch> {
    if u.len() < 4 {
        return Vec::new();
    }
    let step = |k: usize| u[k + 1] - u[k];
    let both = 2.0 * turn(u).cos().max(FEW_ROWS);
    let between = |k: usize| (step(k) - (step(k - 1) + step(k + 1)) / both).norm();
    let mut jumps: Vec<f64> = (1..u.len() - 2).map(between).collect();
    let largest = size(u);
    let mut while_on: Vec<f64> = (0..jumps.len()).filter(|n| u[n + 1].norm() > JUMP * largest).map(|n| jumps[n]).collect();
    let usual = median(&mut while_on);
    let least = JUMP * largest + STANDS_OUT * usual;
    // Where one was switched, its neighbours have a part of it: those are foretold from their other side, from two steps and not as well.
    let from_one_side = |k: usize, next: isize| {
        let [near, far] = [1, 2].map(|n| k.checked_add_signed(n * next).filter(|k| k + 1 < u.len()));
        Some((step(k) - step(near?) * both + step(far?)).norm() / ONE_SIDED)
    };
    let mut found = Vec::new();
    let mut order: Vec<usize> = (0..jumps.len()).filter(|n| jumps[*n] > least).collect();
    order.sort_by(|a, b| jumps[*b].total_cmp(&jumps[*a]));
    for n in order {
        if jumps[n] > least {
            found.push(Switch { row: n + 1, jump_v: jumps[n] });
            for (beside, next) in [(n.checked_sub(1), -1), (Some(n + 1), 1)] {
                if let Some(jump) = beside.filter(|b| *b < jumps.len()) {
                    jumps[jump] = jumps[jump].min(from_one_side(jump + 1, next).unwrap_or(0.0));
                }
            }
            jumps[n] = 0.0;
        }
    }
    found.sort_by_key(|s| s.row);
    found
}

/// The mean voltage from each sample to the next, one less than there are samples: of the cubic through four of them, of a parabola beside a switch and
/// at the ends, and half way where it was switched.
pub fn means(u: &[Complex<f64>], switches: &[Switch]) -> Vec<Complex<f64>> {
    let runs_on = |k: usize| k + 1 < u.len() && switches.binary_search_by_key(&k, |s| s.row).is_err();
    let mean = |k: usize| {
        let (a, b) = (u[k], u[k + 1]);
        match (k > 0 && runs_on(k - 1), runs_on(k), runs_on(k + 1)) {
            (true, true, true) => ((a + b) * 13.0 - u[k - 1] - u[k + 2]) / 24.0,
            (true, true, false) => (a * 8.0 + b * 5.0 - u[k - 1]) / 12.0,
            (false, true, true) => (a * 5.0 + b * 8.0 - u[k + 2]) / 12.0,
            _ => (a + b) * 0.5,
        }
    };
    (0..u.len().saturating_sub(1)).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A sine of 327 V with a fifth harmonic, in rows of `angle` rad; only from `on` rows on, a fraction too.
    fn mains(angle: f64, on: f64) -> Vec<Complex<f64>> {
        let at = |x: f64| Complex::from_polar(327.0, angle * x) + Complex::from_polar(6.0, -5.0 * angle * x);
        (0..300).map(f64::from).map(|x| if x < on { Complex::from(0.0) } else { at(x) }).collect()
    }

    proptest! {
        /// Whenever mains are switched on, that is seen in the one row, and its neighbours' means hold as if nothing were.
        #[test]
        fn a_switch_spoils_no_row_but_its_own(angle in 0.01..0.5f64, on in 50.0..250.0f64) {
            let (u, row) = (mains(angle, on), on.ceil() as usize - 1);
            let found = switches(&u);
            prop_assert_eq!(found.iter().map(|s| s.row).collect::<Vec<_>>(), vec![row]);
            prop_assert!((0.7..1.4).contains(&(found[0].jump_v / 327.0)), "{:?}", found);
            let means = means(&u, &found);
            // The mean of each sine, in closed form; a parabola misses (hφ)³/24 of it.
            let mean = |size: f64, h: f64, k: usize| {
                let (x, turned) = (h * angle, Complex::from_polar(size, h * angle * k as f64));
                turned * (Complex::from_polar(1.0, x) - 1.0) / Complex::new(0.0, x)
            };
            for (k, found) in means.iter().enumerate().filter(|x| x.0 != row) {
                let exact = if k < row { Complex::from(0.0) } else { mean(327.0, 1.0, k) + mean(6.0, -5.0, k) };
                let misses = (327.0 * angle.powi(3) + 6.0 * (5.0 * angle).powi(3)) / 24.0;
                prop_assert!((found - exact).norm() <= 1.1 * misses, "{} {}", k, (found - exact).norm());
            }
        }
    }

    #[test]
    fn what_was_not_switched_has_no_switch() {
        for angle in [0.01, 0.1, 0.5] {
            assert_eq!(switches(&mains(angle, 0.0)), []);
        }
        assert_eq!((switches(&[]), means(&[], &[])), (vec![], vec![]));
        let two = [Complex::from(1.0), Complex::from(3.0)];
        assert_eq!((switches(&two), means(&two, &[])), (vec![], vec![Complex::from(2.0)]));
    }
}
