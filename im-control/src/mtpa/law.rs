//! Current and slip of least current for a torque, as laws.

use im_model::{Bound, ModelError, Scalar};

use crate::guard;

/// Coefficients of a series at most.
pub const SERIES: usize = 16;

/// The two laws over a range of torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MtpaLaw<T> {
    /// Torques that the laws hold for, Nm. Above, the torque is limited. Below, the current goes with the root of the torque at constant
    /// slip, which is the optimum of an unsaturated machine.
    pub torque_nm: [T; 2],
    /// The laws.
    pub form: LawForm<T>,
}

/// How the laws are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LawForm<T> {
    /// (27): I_s = a₁T + a₂T^b₁ + a₃T^b₂, rms; (29): ω_s = c₀ + c₁T + c₂T² + c₃T³ + c₄T⁴, electrical rad/s.
    Kwon {
        /// a₁, a₂, a₃.
        a: [T; 3],
        /// b₁, b₂.
        b: [T; 2],
        /// c₀ … c₄.
        c: [T; 5],
    },
    /// exp of Chebyshev series in x = (2 ln T − ln T_lo − ln T_hi)/(ln T_hi − ln T_lo), as `im-design` fits them; zeros fill up.
    Series {
        /// Of ln I_s (rms A).
        current: [T; SERIES],
        /// Of ln ω_s (electrical rad/s).
        slip: [T; SERIES],
    },
}

impl<T: Scalar> MtpaLaw<T> {
    /// (30), (31) as printed, from 19 to 215 Nm, where they lie within 3.5 % of the optimum of Table V.
    pub fn kwon_printed() -> Self {
        let c = T::from_f64;
        Self {
            torque_nm: [c(19.0), c(215.0)],
            form: LawForm::Kwon {
                a: [0.109, -17.0, 18.5].map(c),
                b: [0.0177, 0.0799].map(c),
                c: [1.4, -2.4e-3, 176e-6, -933e-9, 1.74e-9].map(c),
            },
        }
    }

    /// From the gain set `mtpa` of `im-design`: the range and the coefficients of the two series.
    ///
    /// # Errors
    /// More than [`SERIES`] coefficients, a range that is none, or a number that is not finite.
    pub fn series(torque_nm: [f64; 2], current: &[f64], slip: &[f64]) -> Result<Self, ModelError> {
        for (name, list) in [("number of current coefficients", current), ("number of slip coefficients", slip)] {
            Bound::Within(1.0, SERIES as f64).check(name, list.len() as f64)?;
        }
        let filled = |list: &[f64]| core::array::from_fn(|k| T::from_f64(list.get(k).copied().unwrap_or(0.0)));
        let form = LawForm::Series { current: filled(current), slip: filled(slip) };
        let law = Self { torque_nm: torque_nm.map(T::from_f64), form };
        law.validate()?;
        Ok(law)
    }

    /// Checks range and coefficients.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        let [low, high] = self.torque_nm.map(T::value);
        guard::SIZE.check("torque_nm[0]", low)?;
        Bound::Within(low * (1.0 + 1e-9), 1e9).check("torque_nm[1]", high)?;
        let coefficient = |x: &T| Bound::Within(-1e9, 1e9).check("coefficient of an MTPA law", x.value());
        match &self.form {
            LawForm::Kwon { a, b, c } => a.iter().chain(b).chain(c).try_for_each(coefficient),
            LawForm::Series { current, slip } => current.iter().chain(slip).try_for_each(coefficient),
        }
    }

    /// Rms current (A) and slip (electrical rad/s) for a torque, both with the sign of a motor: the slip is that of `torque_nm`.
    #[inline]
    pub fn at(&self, torque_nm: T) -> (T, T) {
        let [low, high] = self.torque_nm;
        let size = torque_nm.abs();
        let t = size.max(low).min(high);
        let (current, slip) = match &self.form {
            LawForm::Kwon { a, b, c } => {
                let current = a[0] * t + a[1] * t.powf(b[0]) + a[2] * t.powf(b[1]);
                (current.max(T::zero()), c.iter().rev().fold(T::zero(), |sum, c| sum * t + *c))
            }
            LawForm::Series { current, slip } => {
                let two = T::from_f64(2.0);
                let (ln_low, ln_high) = (low.ln(), high.ln());
                let x = (two * t.ln() - ln_low - ln_high) / (ln_high - ln_low);
                (chebyshev(current, x).exp(), chebyshev(slip, x).exp())
            }
        };
        let less = if size < low { (size / low).sqrt() } else { T::one() };
        (current * less, if torque_nm < T::zero() { -slip } else { slip })
    }
}

/// Clenshaw's sum.
#[inline]
fn chebyshev<T: Scalar>(coefficients: &[T; SERIES], x: T) -> T {
    let (mut b1, mut b2) = (T::zero(), T::zero());
    for c in coefficients[1..].iter().rev() {
        (b1, b2) = (x * b1 + x * b1 - b2 + *c, b1);
    }
    x * b1 - b2 + coefficients[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// (30), (31) term by term.
    #[test]
    fn the_printed_laws_are_as_printed() {
        let law = MtpaLaw::<f64>::kwon_printed();
        for t in [19.0f64, 50.0, 120.0, 215.0] {
            let current = 0.109 * t - 17.0 * t.powf(0.0177) + 18.5 * t.powf(0.0799);
            let slip = 1.4 - 2.4e-3 * t + 176e-6 * t.powi(2) - 933e-9 * t.powi(3) + 1.74e-9 * t.powi(4);
            for sign in [1.0, -1.0] {
                let (i, s) = law.at(sign * t);
                assert!((i - current).abs() < 1e-9 && (s - sign * slip).abs() < 1e-9, "{t}: {i} {s}");
            }
        }
        // Above the range nothing more is asked for.
        assert_eq!(law.at(1e3), law.at(215.0));
    }

    /// Below its range the law is that of an unsaturated machine: current with the root of the torque, slip the same.
    #[test]
    fn below_its_range_the_current_goes_with_the_root_of_the_torque() {
        let law = MtpaLaw::<f64>::kwon_printed();
        let (i, slip) = law.at(19.0);
        for share in [0.0, 0.01, 0.25, 0.81, 1.0] {
            let (less, same) = law.at(-19.0 * share);
            assert!((less - i * share.sqrt()).abs() < 1e-9 && same == if share == 0.0 { slip } else { -slip }, "{share}");
        }
    }

    proptest! {
        /// Σ c_k cos(k arccos x), x from −1 to 1 over the logarithm of the range.
        #[test]
        fn a_series_is_the_sum_of_chebyshev_polynomials(
            c in proptest::collection::vec(-0.5..0.5f64, 1..=SERIES), s in proptest::collection::vec(-0.5..0.5f64, 1..=SERIES),
            x in -1.0..1.0f64, low in 0.1..5.0f64, ratio in 1.5..100.0f64
        ) {
            let law = MtpaLaw::series([low, low * ratio], &c, &s).unwrap();
            let torque = low * ratio.powf(0.5 * (x + 1.0));
            let sum = |c: &[f64]| c.iter().zip(0..).map(|(c, k)| c * (f64::from(k) * x.acos()).cos()).sum::<f64>().exp();
            let (current, slip) = law.at(torque);
            prop_assert!((current / sum(&c) - 1.0).abs() < 1e-9 && (slip / sum(&s) - 1.0).abs() < 1e-9);
        }
    }
}
